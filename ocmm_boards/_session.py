"""Stored corners and record of a board calibration."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import msgspec
import numpy as np

from ocmm_boards._board import Board
from ocmm_boards._corners import BoardViews
from ocmm_boards._solution import BoardCalibration
from ocmm_core.build import build_version
from ocmm_core.calibration.guided import (
    CalibrationContext,
    CalibrationOutcome,
    build_outcome,
    hash_of,
)
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import CalibrationStore, rig_from_record
from ocmm_core.camera import Rig
from ocmm_core.documents import write_new

SCHEMA = "ocmm.board-views/1"


def keep_views(
    folder: Path, board: Board, views: BoardViews, rig: Rig, who: str, now: datetime
) -> Path:
    """Write all corners before anything is computed; return the new file."""
    path = folder / now.strftime("boards-%Y%m%dT%H%M%S%f.json")
    folder.mkdir(parents=True, exist_ok=True)
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
    write_new(path, msgspec.json.encode(content))
    return path


def evaluated(
    rig: Rig, store: CalibrationStore, board: Board, views: BoardViews, found: BoardCalibration,
    now: datetime, *, who: str, temperature: Temperature | None, valid_days: int,
) -> CalibrationOutcome:  # fmt: skip
    """Return the record and its comparison with the calibration in force."""
    running = store.active()
    how = CalibrationContext(
        method="boards", made=now, valid_days=valid_days, who=who, software=build_version(),
        temperature_c=None if temperature is None else temperature.celsius,
        sensor_temperatures_c=(), data_sha256=hash_of(views.uv),
        artefacts=(board.artefact.use,) if board.traceable else (),
        previous=store.active_hash or "",
    )  # fmt: skip
    return build_outcome(
        rig, found.found, how, None if running is None else rig_from_record(running)
    )
