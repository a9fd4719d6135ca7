"""Tip of a tracked tool from poses that another program recorded.

The tool turns about its tip, which rests in one place (Z. Yaniv, Int. J. CARS 10 (2015) 1). Frames
of one recording share slow errors, so that only several recordings show the error of the tip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import scipy
from scipy.spatial.transform import Rotation

from ocmm_core.calibration.pivot import PosePivot, pivot_of_poses
from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tables import NamedColumns, TableAccount, TableOptions, TextTable, read_table

_PLACE = (("x", "tx", "px", "pos_x"), ("y", "ty", "py", "pos_y"), ("z", "tz", "pz", "pos_z"))
_TURN = (("qx",), ("qy",), ("qz",), ("qw", "q0", "qs"))
_NAMES = tuple(name for names in (*_PLACE, *_TURN) for name in names)
_COLUMNS = "x,y,z,qx,qy,qz,qw"
_UNIT_LENGTH = 1e-3
_OTHER = 0.2
"""Ratio of residuals by which another meaning of the columns is the right one."""
_LEAST = 3


@dataclass(frozen=True, slots=True)
class PoseFile:
    rotations: Float
    """(n, 3, 3): world from tool."""
    origins_world: Points3
    """(n, 3), mm."""
    account: TableAccount
    unseen: int
    """Rows without a pose."""


@dataclass(frozen=True, slots=True)
class ToolPivot:
    """Tip from recordings, each about another place."""

    pivots: tuple[PosePivot, ...]
    tip: Float
    """(3,), mm, frame of the tool: mean of the recordings."""
    expanded: Float | None
    """(3,), mm: U (95 %) of each coordinate from the scatter of the recordings, without their
    common errors; None for fewer than three."""

    def to_json(self, files: Sequence[PoseFile]) -> str:
        """Return a JSON object, ``ocmm.pivot/1``, of the tip and its recordings in ``files``."""
        recordings = [
            {
                "file": str(one.account.path), "poses": len(found.used), "unseen": one.unseen,
                "left_out": int(np.count_nonzero(~found.used)), "rms": found.rms,
                "tip": found.tip.tolist(), "place": found.centre.tolist(),
            }
            for one, found in zip(files, self.pivots, strict=True)
        ]  # fmt: skip
        expanded = None if self.expanded is None else self.expanded.tolist()
        whole = {
            "schema": "ocmm.pivot/1", "unit": "mm", "tip": self.tip.tolist(), "U": expanded,
            "recordings": recordings,
        }  # fmt: skip
        return msgspec.json.format(msgspec.json.encode(whole), indent=2).decode()


def read_poses(path: Path, options: TableOptions | None = None) -> PoseFile:
    """Return the poses of a table: position and unit quaternion of the tool in each row.

    Rows without numbers, as trackers write for a hidden tool, are counted. InputError if a column
    is missing, the unit is unclear, or a quaternion has not the length 1.
    """
    options = options or TableOptions()
    table = read_table(path, NamedColumns((), _NAMES, optional=_NAMES), options)
    place, turn = ([_column(table, names) for names in group] for group in (_PLACE, _TURN))
    columns = [*place, *turn]
    rows = [row for row in table.rows if any(row.cells[name] for name in columns)]
    numbers = np.array([[table.number(row, name) for name in columns] for row in rows])
    numbers = numbers.reshape(-1, len(columns))
    lengths = np.linalg.norm(numbers[:, 3:], axis=1)
    wrong = np.flatnonzero(np.abs(lengths - 1.0) > _UNIT_LENGTH)
    if len(wrong):
        raise InputError(
            "poses.quaternion",
            f"{path}, line {rows[int(wrong[0])].line}: the quaternion has the length "
            f"{lengths[wrong[0]]:.4g}, not 1.",
            f"Check which columns hold the quaternion, and state them: {_COLUMNS}.",
        )
    unit = table.unit(place, options)
    turns = Rotation.from_quat(numbers[:, 3:]).as_matrix() if len(rows) else np.zeros((0, 3, 3))
    unseen = len(table.rows) - len(rows)
    return PoseFile(turns, unit.in_mm(numbers[:, :3]), table.account(unit), unseen)


def _column(table: TextTable, names: Sequence[str]) -> str:
    found = [name for name in names if name in table.columns]
    if len(found) != 1:
        raise InputError(
            "poses.columns",
            f"{table.path}: the heading has {len(found)} columns for '{names[0]}', not one.",
            f"State the columns, '-' for one that is not read: {_COLUMNS}.",
        )
    return found[0]


def pivot_of_files(files: Sequence[PoseFile], seed: int = 1) -> ToolPivot:
    """Return the tip of a tool from recordings; `seed`: of the search for wrong poses.

    CalibrationError: the poses do not determine the tip, or agree far better if the quaternions
    have another order, or are inverse.
    """
    pivots = tuple(_pivot(one, seed) for one in files)
    tips = np.array([one.tip for one in pivots])
    expanded = None
    if len(tips) >= _LEAST:
        factor = scipy.special.stdtrit(len(tips) - 1, scipy.special.ndtr(2.0))
        expanded = factor * np.std(tips, axis=0, ddof=1) / np.sqrt(len(tips))
    return ToolPivot(pivots, tips.mean(axis=0), expanded)


def _pivot(file: PoseFile, seed: int) -> PosePivot:
    found = pivot_of_poses(file.rotations, file.origins_world, seed)
    quaternions = Rotation.from_matrix(file.rotations).as_quat()
    others = {
        words: Rotation.from_quat(np.roll(quaternions, shift, axis=1))
        for words, shift in (("with qw first", -1), ("with qw last", 1), ("inverse", 0))
    }
    others["inverse"] = others["inverse"].inv()
    for words, turns in others.items():
        try:
            other = pivot_of_poses(turns.as_matrix(), file.origins_world, seed)
        except CalibrationError:
            continue
        if other.rms < _OTHER * found.rms:
            raise CalibrationError(
                "poses.meaning",
                f"{file.account.path}: the poses agree to {other.rms:.3f} mm if the quaternions "
                f"are {words}, but to {found.rms:.3f} mm as stated.",
                "State the columns as the program that wrote them means them, or export the pose "
                "of the tool in the tracker.",
            )
    return found
