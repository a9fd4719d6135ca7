"""Snapshots of the procedures, returned by `view` of each."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.calibration.guided._outcome import CalibrationOutcome, VerificationOutcome
from ocmm_core.calibration.guided._procedure import ProcedureView
from ocmm_core.calibration.records import Corner
from ocmm_core.geometry import Float


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
