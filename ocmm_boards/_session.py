"""A calibration by views of a board: corners kept first, then the record, ready to be accepted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np

from ocmm_boards._board import Board, load_board
from ocmm_boards._corners import MOST_BYTES, BoardViews
from ocmm_boards._detection import views_in
from ocmm_boards._joint import RecordedSpots
from ocmm_boards._recordings import Recordings
from ocmm_boards._solution import BoardCalibration, calibrate_with_board
from ocmm_core.build import build_version
from ocmm_core.calibration import guided
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import CalibrationStore, rig_from_record, store_folder
from ocmm_core.camera import Rig
from ocmm_core.documents import read_text
from ocmm_core.errors import InputError
from ocmm_core.export import write_together

SCHEMA = "ocmm.board-views/1"


@dataclass(frozen=True, slots=True)
class BoardSession:
    """A calibration by views, ready to be accepted."""

    kept: Path
    """File of its corners."""
    found: BoardCalibration
    outcome: guided.CalibrationOutcome

    def accept(self, store: CalibrationStore, who: str, now: datetime, reason: str = "") -> None:
        """Put the calibration in force; errors as `CalibrationStore.accept`."""
        store.accept(self.outcome.record, who, reason or "calibrated with a board", now, self.kept)


def run_session(
    rig: Rig, store: CalibrationStore, board: Board, views: BoardViews, now: datetime, *,
    who: str, temperature: Temperature | None = None, valid_days: int = 365, force: bool = False,
    kept: Callable[[Path], None] = lambda path: None, recordings: Recordings | None = None,
) -> BoardSession:  # fmt: skip
    """Keep the corners next to the records, then calibrate and compare; nothing is accepted.

    ``kept`` gets the file of the corners before anything is computed with them, ``recordings`` are
    part of the same bundle. Errors as `calibrate_with_board` and `Recordings.spots`.
    """
    recorded = None
    if recordings is not None:
        # The board alone locates the cameras well enough to label spots.
        alone = calibrate_with_board(rig, board, views, force=force)
        recorded = recordings.spots(replace(rig, cameras=alone.found.cameras), temperature)
    path = _keep(store.folder / "sessions", board, views, recorded, rig, who, now)
    kept(path)
    found = calibrate_with_board(rig, board, views, force=force, recorded=recorded)
    running = store.active()
    observed = None if recorded is None else recorded.observed
    more = () if observed is None else (observed.frames.uv, *(b.uv for b in observed.shown_bars))
    bars = () if recorded is None else recorded.artefacts
    how = guided.CalibrationContext(
        method="boards", made=now, valid_days=valid_days, who=who, software=build_version(),
        temperature_c=None if temperature is None else temperature.celsius,
        sensor_temperatures_c=(), data_sha256=guided.hash_of(views.uv, *more),
        artefacts=(*((board.artefact.use,) if board.traceable else ()), *bars),
        previous=store.active_hash or "",
    )  # fmt: skip
    outcome = guided.build_outcome(
        rig, found.found, how, None if running is None else rig_from_record(running)
    )
    return BoardSession(path, found, outcome)


def kept_views(path: Path, rig: Rig, board: Board) -> BoardViews:
    """Return the corners of an earlier session, of any board of these numbers.

    InputError: not such a file, of other cameras, or of a board with other corners.
    """
    shape = (len(rig.cameras), len(board.corners))
    try:
        kept = msgspec.json.decode(read_text(path, MOST_BYTES), type=_KeptViews)
        count = len(kept.views)
        uv = np.array(kept.corners_px, dtype=np.float64).reshape(count, *shape, 2)
        levels = np.array(kept.levels, dtype=np.int64).reshape(count, *shape)
    except (msgspec.DecodeError, ValueError) as error:
        raise _not_kept(path) from error
    if kept.serials != [camera.serial for camera in rig.cameras]:
        raise _not_kept(path)
    uv[(uv < 0.0).all(axis=-1)] = np.nan
    return BoardViews(tuple(kept.views), uv, levels)


def _not_kept(path: Path) -> InputError:
    return InputError(
        "boards.kept",
        f"{path}: it does not contain corners of this board in this rig.",
        "Give a file boards-....json of the folder of sessions with its rig and its board, or a "
        "folder of pictures.",
    )


class _KeptViews(msgspec.Struct):
    views: list[str]
    serials: list[int]
    corners_px: list[list[list[list[float]]]]
    levels: list[list[list[int]]]


def run_folder(
    rig: Rig, calibrations: Path, board: Path, folder: Path, who: str,
    tell: Callable[[str, float], None] = lambda step, share: None,
) -> BoardSession:  # fmt: skip
    """Return the session of the views in a folder, see `views_in`; errors as `run_session`."""
    known = load_board(board)
    views = views_in(
        folder, rig, known, lambda done, of: tell("Searching corners", 0.8 * done / of)
    )
    tell("Calibrating", 0.8)
    store = CalibrationStore(store_folder(calibrations, rig.name))
    return run_session(rig, store, known, views, datetime.now(UTC), who=who)


def _keep(
    folder: Path, board: Board, views: BoardViews, recorded: RecordedSpots | None, rig: Rig,
    who: str, now: datetime,
) -> Path:  # fmt: skip
    """Write all corners and spots before anything is computed; return the new file."""
    path = folder / now.strftime("boards-%Y%m%dT%H%M%S%f.json")
    seen = np.where(np.isfinite(views.uv), views.uv, -1.0)
    content = {
        "schema": SCHEMA,
        "rig": rig.name,
        "rig_identity": rig.identity,
        "who": who,
        "utc": now.isoformat(),
        "board": msgspec.to_builtins(board.document),
        "views": list(views.names),
        "serials": [camera.serial for camera in rig.cameras],
        "corners_px": seen.tolist(),
        "levels": views.levels.tolist(),
        "left_out": list(views.left_out),
        "probe": None if recorded is None else recorded.body.identity,
        "recorded": None if recorded is None else recorded.observed,
    }
    # Spots that were not seen are null.
    write_together({path: msgspec.json.encode(content, enc_hook=np.ndarray.tolist)})
    return path
