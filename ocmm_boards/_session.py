"""A calibration by views of a board: corners kept first, then the record, ready to be accepted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np

from ocmm_boards._board import Board, load_board
from ocmm_boards._corners import BoardViews
from ocmm_boards._detection import views_in
from ocmm_boards._solution import BoardCalibration, calibrate_with_board
from ocmm_core.build import build_version
from ocmm_core.calibration import guided
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import CalibrationStore, rig_from_record, store_folder
from ocmm_core.camera import Rig
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
    kept: Callable[[Path], None] = lambda path: None,
) -> BoardSession:  # fmt: skip
    """Keep the corners next to the records, then calibrate and compare; nothing is accepted.

    ``kept`` gets the file of the corners before anything is computed. Errors as
    `calibrate_with_board`.
    """
    path = _keep(store.folder / "sessions", board, views, rig, who, now)
    kept(path)
    found = calibrate_with_board(rig, board, views, force=force)
    running = store.active()
    how = guided.CalibrationContext(
        method="boards", made=now, valid_days=valid_days, who=who, software=build_version(),
        temperature_c=None if temperature is None else temperature.celsius,
        sensor_temperatures_c=(), data_sha256=guided.hash_of(views.uv),
        artefacts=(board.artefact.use,) if board.traceable else (),
        previous=store.active_hash or "",
    )  # fmt: skip
    outcome = guided.build_outcome(
        rig, found.found, how, None if running is None else rig_from_record(running)
    )
    return BoardSession(path, found, outcome)


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


def _keep(folder: Path, board: Board, views: BoardViews, rig: Rig, who: str, now: datetime) -> Path:
    """Write all corners before anything is computed; return the new file."""
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
    }
    write_together({path: msgspec.json.encode(content)})
    return path
