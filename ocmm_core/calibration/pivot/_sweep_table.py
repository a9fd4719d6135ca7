"""Table of two recorded sweeps of a probe, for its pivot calibration.

::

    # ocmm sweeps
    # sigma: 0.0146
    sweep;frame;serial;led;u;v
    1;1;20330001;1;312.4471;1766.0312

One row for each spot. ``sweep`` is 1 for the calibrating sweep and 2 for the independent one, with
the cone in another place or the probe leaning to another side. ``frame`` numbers the poses of a
sweep in the order of time; rows may be in any order. ``led`` counts from 1 in the order of the
probe document. ``sigma`` is the standard deviation of a spot, px per axis. Separators and decimal
signs: `ocmm_core.tables`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core.calibration.pivot._data import PivotSweep
from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.tables import TableAccount, TableOptions, TextRow, TextTable, read_pixels

_COLUMNS = ("sweep", "frame", "serial", "led", "u", "v")
_SWEEPS = 2


@dataclass(frozen=True, slots=True)
class SweepTable:
    """Recorded sweeps, the calibrating one first, and the account of the reader."""

    sweeps: tuple[PivotSweep, ...]
    account: TableAccount


def load_sweeps(
    path: Path | str, rig: Rig, n_leds: int, options: TableOptions | None = None
) -> SweepTable:
    """Return both sweeps of a table; InputError if one is missing, for unknown or double rows."""
    read = read_pixels(path, _COLUMNS, options)
    table = read.table
    cameras = {str(camera.serial): index for index, camera in enumerate(rig.cameras)}
    frames: tuple[dict[int, Float], ...] = tuple({} for _ in range(_SWEEPS))
    for row in table.rows:
        sweep = _count(table, row, "sweep", _SWEEPS)
        led = _count(table, row, "led", n_leds)
        number = _count(table, row, "frame", None)
        camera = cameras.get(row.cells["serial"])
        if camera is None:
            raise _wrong(
                table, row.line, f"rig '{rig.name}' has no camera {row.cells['serial']!r}",
                "Select the rig the sweeps were taken with.",
            )  # fmt: skip
        uv = frames[sweep].setdefault(number, np.full((len(rig.cameras), n_leds, 2), np.nan))
        if np.isfinite(uv[camera, led, 0]):
            raise _wrong(table, row.line, "this spot occurs already", "Keep one of the rows.")
        uv[camera, led] = read.uv(row)
    for number, own in enumerate(frames, start=1):
        if not own:
            raise InputError(
                "sweeps.missing",
                f"{table.path}: there is no sweep {number}.",
                "Give both sweeps: the one that calibrates, and an independent one.",
            )
    sweeps = tuple(
        PivotSweep.even(np.array([own[number] for number in sorted(own)]), read.sigma_px)
        for own in frames
    )
    return SweepTable(sweeps, read.account)


def _count(table: TextTable, row: TextRow, column: str, most: int | None) -> int:
    text = row.cells[column]
    if not text.isdecimal() or int(text) < 1 or (most is not None and int(text) > most):
        wanted = "a number from 1" if most is None else f"1 to {most}"
        raise _wrong(table, row.line, f"there is no {column} {text!r}", f"Write {wanted}.")
    return int(text) - 1


def _wrong(table: TextTable, line: int, what: str, remedy: str) -> InputError:
    return InputError("sweeps.row", f"{table.path}, line {line}: {what}.", remedy)
