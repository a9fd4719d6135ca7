"""Snapshots of the procedures, returned by `view` of each, and their results.

Coverage of a volume by a waved probe: cells and attitudes that still lack poses.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.guided._procedure import ProcedureView
from ocmm_core.calibration.records import CameraRecord, Corner, Finding, VerificationRecord
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int, Pixels, Points3
from ocmm_core.tracking import ProbeBody


@dataclass(frozen=True, slots=True)
class CameraResiduals:
    """Residuals of one camera's spots: arrows on its picture."""

    name: str
    uv: Pixels
    residuals_px: Pixels
    """`uv`, `residuals_px`: (n, 2), px: position, and observed minus predicted."""
    used: NDArray[np.bool_]
    """(n,): False for outliers."""


@dataclass(frozen=True, slots=True)
class CameraChange:
    """Change of one camera from the running calibration, after alignment of the frames."""

    name: str
    shift_mm: float
    turn_rad: float
    """`shift_mm`, `turn_rad`: Distance of the centres, and angle between the attitudes, after the
    best common rigid motion of all cameras, which absorbs a motion of the whole frame."""
    focal_mm: float
    u0_px: float
    v0_px: float
    """`focal_mm`, `u0_px`, `v0_px`: After less before."""


@dataclass(frozen=True, slots=True)
class CalibrationComparison:
    """Comparison of the new calibration with the one in force."""

    moved_mm: float
    turned_rad: float
    """`moved_mm`, `turned_rad`: The common motion of all cameras."""
    cameras: tuple[CameraChange, ...]
    """Remainder of each camera."""
    nodes_world: Points3
    differences_world: Points3
    """`nodes_world`, `differences_world`: (n, 3), mm: points of the volume located by the old
    calibration, and new minus old location after removal of the common motion."""
    length_sigma_before_mm: float
    length_sigma_after_mm: float
    """`length_sigma_before_mm`, `length_sigma_after_mm`: Predicted, of a length in the volume."""


@dataclass(frozen=True, slots=True)
class CalibrationOutcome:
    """A calibration awaiting acceptance."""

    record: CameraRecord
    rig: Rig
    residuals: tuple[CameraResiduals, ...]
    errors_at_world: Points3
    errors_world: Points3
    """`errors_at_world`, `errors_world`: (n, 3), mm: points not used for the calibration, and
    located minus reference (known points), or the misfits of the bar and control points at their
    places."""
    warnings: tuple[Finding, ...]
    """Findings that did not refuse it."""
    comparison: CalibrationComparison | None
    """With the calibration in force, or None."""


@dataclass(frozen=True, slots=True)
class TrackerView:
    """Snapshot of the calibration of a tracker."""

    base: ProcedureView
    tips_world: Points3
    """(n, 3), mm: ball at the recorded places."""
    outcome: CalibrationOutcome | None
    """Result of `compute`, or None."""


@dataclass(frozen=True, slots=True)
class VerificationOutcome:
    """A verdict awaiting storage."""

    record: VerificationRecord
    """To be stored, with all checks."""
    largest: int
    """Index of the check closest to, or farthest beyond, its limit."""
    failed: tuple[int, ...]
    """Indices of the nonconforming checks."""
    warnings: tuple[Finding, ...]
    """Findings that weaken the verdict."""
    due_utc: str
    """Expiry of the verified calibration, ISO 8601; empty without one."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell of the volume."""

    name: str
    """Place in words ("near top left")."""
    low_world: Float
    high_world: Float
    """`low_world`, `high_world`: (3,), mm."""
    poses: int
    wanted: int
    """`poses`, `wanted`: Poses of the probe in it."""


@dataclass(frozen=True, slots=True)
class Tilt:
    """One attitude class of the probe."""

    name: str
    """In words ("leaning left")."""
    poses: int
    wanted: int


@dataclass(frozen=True, slots=True)
class VolumeCoverage:
    """Coverage of the volume."""

    cells: tuple[Cell, ...]
    tilts: tuple[Tilt, ...]
    fraction: float
    """Fraction of the wanted poses, 0 to 1."""

    @property
    def missing(self) -> tuple[str, ...]:
        """Return the names of incomplete cells and tilts, the emptiest first."""
        places = [(one.poses / one.wanted, one.name) for one in self.cells]
        ways = [(one.poses / one.wanted, one.name) for one in self.tilts]
        return tuple(name for share, name in sorted(places + ways) if share < 1.0)


@dataclass(frozen=True, slots=True)
class KnownPoint:
    """One reference point of the list."""

    name: str
    position_world: Float
    """(3,), mm."""
    views: int | None
    """Cameras that saw it; None until recorded."""


@dataclass(frozen=True, slots=True)
class KnownPointsView:
    """Snapshot of the calibration from known points."""

    base: ProcedureView
    points: tuple[KnownPoint, ...]
    """In order of the list."""
    next_point: int | None
    """Index of the point to record next; None after the last one."""
    outcome: CalibrationOutcome | None
    """Result of `compute`; None before it, and after another point."""


@dataclass(frozen=True, slots=True)
class RelocationView:
    """Snapshot of the relocation."""

    base: ProcedureView
    poses: int
    coverage: VolumeCoverage
    length_sigma_mm: float | None
    """Predicted standard uncertainty of ``length_mm`` in the volume (`predict`), or None."""
    length_mm: float
    length_limit_mm: float
    """`length_mm`, `length_limit_mm`: Test length, and its sufficient uncertainty."""
    bar_placements: int
    bars_wanted: int
    world_points: tuple[str, ...]
    world_wanted: tuple[str, ...]
    visits: int
    """Visits of the seats that are visited first and last."""
    seats_world: tuple[Float, ...]
    """(3,), mm, each: visited seats, by the previous camera calibration."""
    next_seat: int | None
    """Index of the seat to visit next, now or at the end; None after the last one."""
    outcome: CalibrationOutcome | None
    """Result of `compute`; None before it, and after another observation."""


@dataclass(frozen=True, slots=True)
class LinePlan:
    """One measuring line of the verification."""

    name: str
    """In words ("space diagonal 1")."""
    ends_world: Float
    """(2, 3), mm: nominal places of the first and the last nest of the bar."""
    taken: int
    """Recorded nests of `wanted`."""
    wanted: int
    hint: str = ""
    """Objection to the recorded placement, or empty."""
    shares: tuple[float, ...] = ()
    """Positions of the nests along the bar, from 0 to 1."""


@dataclass(frozen=True, slots=True)
class VerificationView:
    """Snapshot of the verification."""

    base: ProcedureView
    lines: tuple[LinePlan, ...]
    """Seven lines, or more if the corners need them."""
    current_line: int | None
    """Index of the current line; None after the last one."""
    spheres: tuple[int, ...]
    """Points recorded on each sphere; empty without spheres."""
    sphere_points: int
    """Wanted on each."""
    outcome: VerificationOutcome | None
    """Result of `compute`, or None."""
    places: tuple[str, ...]
    """Third of the volume of each sphere, or empty."""
    seats_world: tuple[Float, ...]
    """(3,), mm, each: visited seats."""
    next_seat: int | None
    """Index of the seat to visit next, now or at the end; None after the last one."""
    corners: tuple[Corner, ...]
    """Of the volume, with the test lengths that ended there."""
    notes: tuple[str, ...]
    """Guideline advice that could not be followed, and why."""


CELL_MM = 120.0
POSES_PER_CELL = 8
POSES_PER_TILT = 30
LEANING = np.radians(12.0)
"""Angle from which a probe counts as leaning."""

_WORDS = (("left", "centre", "right"), ("near", "middle", "far"), ("low", "mid-height", "high"))
_TILTS = ("upright", "leaning left", "leaning right", "leaning forward", "leaning back")


def coverage(
    rig: Rig, body: ProbeBody, rotations_world_from_probe: Float, tips_world: Points3
) -> VolumeCoverage:
    """Return how poses (n, 3, 3), (n, 3), mm, fill the volume; cameras may have moved."""
    low, high = rig.volume_world
    views = viewer_axes(rig)
    counts = [max(1, min(4, round(float(size) / CELL_MM))) for size in high - low]
    step = (high - low) / counts
    place = np.floor((tips_world - low) / step).astype(np.int64)
    # Poses of a moved frame may lie outside: count them in the cell at the border.
    place = np.clip(place, 0, np.array(counts) - 1)
    cells = []
    for index in np.ndindex(*counts):
        begin = low + np.array(index) * step
        poses = int(np.count_nonzero((place == np.array(index)).all(axis=1)))
        name = _name(index, counts, views)
        cells.append(Cell(name, begin, begin + step, poses, POSES_PER_CELL))
    held = _tilts(body, rotations_world_from_probe, views)
    tilts = [
        Tilt(name, int(np.count_nonzero(held == number)), POSES_PER_TILT)
        for number, name in enumerate(_TILTS)
    ]
    done = sum(min(cell.poses, cell.wanted) for cell in cells)
    done += sum(min(tilt.poses, tilt.wanted) for tilt in tilts)
    wanted = len(cells) * POSES_PER_CELL + len(tilts) * POSES_PER_TILT
    return VolumeCoverage(tuple(cells), tuple(tilts), done / wanted)


def viewer_axes(rig: Rig) -> Float:
    """Return right, away and up as seen along the cameras' view, (3, 3) rows."""
    axes = np.mean([camera.T_camera_from_world.rotation for camera in rig.cameras], axis=0)
    return np.stack([axes[0], axes[2], -axes[1]])


def _name(index: tuple[int, ...], counts: list[int], views: Float) -> str:
    """Return the place of a cell in words; axes with one cell are not named."""
    words = []
    free = [0, 1, 2]
    for view in (1, 2, 0):
        axis = max(free, key=lambda one: abs(views[view, one]))
        free.remove(axis)
        if counts[axis] == 1:
            continue
        number = index[axis] if views[view, axis] > 0.0 else counts[axis] - 1 - index[axis]
        ends = {0: _WORDS[view][0], counts[axis] - 1: _WORDS[view][2]}
        inner = _WORDS[view][1] if counts[axis] == 3 else f"{_WORDS[view][1]} {number}"
        words.append(ends.get(number, inner))
    return " ".join(words)


def _tilts(body: ProbeBody, rotations: Float, views: Float) -> Int:
    """Return the attitude class of each pose, (n,): index into the names of tilts."""
    handle = body.leds_probe.mean(axis=0) - body.tip_probe
    axis = rotations @ (handle / np.linalg.norm(handle))
    right, away, up = views
    across, along = np.arctan2(axis @ right, axis @ up), np.arctan2(axis @ away, axis @ up)
    sideways = np.abs(across) >= np.abs(along)
    held = np.where(sideways, np.where(across < 0.0, 1, 2), np.where(along > 0.0, 3, 4))
    upright = np.maximum(np.abs(across), np.abs(along)) < LEANING
    return np.where(upright, 0, held).astype(np.int64)
