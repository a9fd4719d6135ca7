"""Table of averaged spots, for relocation, verification and tips.

::

    # ocmm shots
    # sigma: 0.0105
    shot;kind;place;serial;led;u;v
    1;pose;;20330001;1;312.4471;1766.0312

One row for each spot; rows of a shot need not be adjacent. ``kind`` is ``pose`` (the waved probe),
``bar`` (its two LEDs), ``seat`` (the ball in the control point ``place``; without a place, in an
end of the bar), ``repeat`` (in the next of the two seats that a relocation visits first and again
at its end), ``nest`` (in the next nest of the current line), ``sphere`` (on its next point) or
``cone`` (in the next attitude). ``led`` counts from 1 in the order of the probe document. ``sigma``
is the standard deviation of a spot, px per axis. Separators and decimal signs: `ocmm_core.tables`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_core.geometry import Pixels
from ocmm_core.tables import TableAccount, TableOptions, TextRow, TextTable, read_pixels

ShotKind = Literal["pose", "bar", "seat", "repeat", "nest", "sphere", "cone"]

_COLUMNS = ("shot", "kind", "place", "serial", "led", "u", "v")


@dataclass(frozen=True, slots=True)
class Shot:
    """Simultaneous averaged spots."""

    kind: ShotKind
    place: str
    uv: Pixels
    """(C, L, 2), px, by LED; (C, 2, 2) for the bar; NaN if unseen."""
    sigma_px: float
    """Standard deviation of a spot, px per axis."""


@dataclass(frozen=True, slots=True)
class ShotTable:
    """Recorded shots in the order of their first rows, and the account of the reader."""

    shots: tuple[Shot, ...]
    account: TableAccount


def load_shots(
    path: Path | str, rig: Rig, n_leds: int, options: TableOptions | None = None
) -> ShotTable:
    """Return the shots of the table at ``path``.

    InputError: not such a table, or a row has an unknown kind, camera or LED, repeats a spot, or
    contradicts an earlier row of its shot.
    """
    found = read_pixels(path, _COLUMNS, options)
    table = found.table
    rows_of = {str(camera.serial): index for index, camera in enumerate(rig.cameras)}
    shots: dict[str, Shot] = {}
    for row in table.rows:
        kind = next((one for one in get_args(ShotKind) if one == row.cells["kind"]), None)
        if kind is None:
            raise _wrong(
                table, row.line, f"{row.cells['kind']!r} is not a kind of shot",
                f"Write {', '.join(get_args(ShotKind))}.",
            )  # fmt: skip
        count = 2 if kind == "bar" else n_leds
        shot = shots.get(row.cells["shot"])
        if shot is None:
            uv = np.full((len(rig.cameras), count, 2), np.nan)
            shot = shots[row.cells["shot"]] = Shot(kind, row.cells["place"], uv, found.sigma_px)
        if (shot.kind, shot.place) != (kind, row.cells["place"]):
            raise _wrong(
                table, row.line, f"shot {row.cells['shot']!r} has another kind or place above",
                "Number every shot uniquely.",
            )  # fmt: skip
        camera = rows_of.get(row.cells["serial"])
        if camera is None:
            raise _wrong(
                table, row.line, f"rig '{rig.name}' has no camera {row.cells['serial']!r}",
                "Select the rig the shots were taken with.",
            )  # fmt: skip
        led = _led(table, row, count)
        if np.isfinite(shot.uv[camera, led, 0]):
            raise _wrong(table, row.line, "this spot occurs already", "Keep one of the rows.")
        shot.uv[camera, led] = found.uv(row)
    return ShotTable(tuple(shots.values()), found.account)


def _led(table: TextTable, row: TextRow, count: int) -> int:
    text = row.cells["led"]
    if not text.isdecimal() or not 1 <= int(text) <= count:
        raise _wrong(table, row.line, f"there is no LED {text!r}", f"Write 1 to {count}.")
    return int(text) - 1


def _wrong(table: TextTable, line: int, what: str, remedy: str) -> InputError:
    return InputError("shots.row", f"{table.path}, line {line}: {what}.", remedy)
