"""Snapshots of the three procedures: what `view` of each returns."""

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
    """Where it is, in words ("near top left")."""
    low_world: Float
    high_world: Float
    """`low_world`, `high_world`: (3,), mm."""
    poses: int
    wanted: int
    """`poses`, `wanted`: Of the probe in it."""


@dataclass(frozen=True, slots=True)
class Tilt:
    """One way of holding the probe."""

    name: str
    """In words ("leaning left")."""
    poses: int
    wanted: int
    """`poses`, `wanted`: Held so."""


@dataclass(frozen=True, slots=True)
class VolumeCoverage:
    """What of the volume was shown."""

    cells: tuple[Cell, ...]
    tilts: tuple[Tilt, ...]
    """`cells`, `tilts`: With what is still missing."""
    fraction: float
    """Of what is wanted, 0 to 1."""

    @property
    def missing(self) -> tuple[str, ...]:
        """Return the names of cells and tilts that lack poses, the emptiest first."""
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
    """Cameras that saw it; None until it was taken."""


@dataclass(frozen=True, slots=True)
class KnownPointsView:
    """Snapshot of the calibration from known points."""

    base: ProcedureView
    """What all procedures show."""
    points: tuple[KnownPoint, ...]
    """All of the list, in its order."""
    next_point: int | None
    """Index of the point that is taken next; None after the last one."""
    outcome: CalibrationOutcome | None
    """Of `compute`; None before it, and after another point was taken."""


@dataclass(frozen=True, slots=True)
class RelocationView:
    """Snapshot of the relocation."""

    base: ProcedureView
    """What all procedures show."""
    poses: int
    coverage: VolumeCoverage
    length_sigma_mm: float | None
    """Predicted standard uncertainty of a length of ``length_mm`` anywhere in the volume, from what
    was collected so far (`predict`); None before the first prediction."""
    length_mm: float
    length_limit_mm: float
    """`length_mm`, `length_limit_mm`: Which length, and from where on it is good enough."""
    bar_placements: int
    bars_wanted: int
    """`bar_placements`, `bars_wanted`: Taken so far, and wanted."""
    world_points: tuple[str, ...]
    world_wanted: tuple[str, ...]
    """`world_points`, `world_wanted`: Control points taken so far by name, and the names that are
    wanted."""
    visits: int
    """Of the seats that are visited first and last, so far."""
    seats_world: tuple[Float, ...]
    """(3,), mm, each: seats that were visited, by the cameras as they were before."""
    next_seat: int | None
    """Index of the seat that is visited next, now or at the end; None after the last one."""
    outcome: CalibrationOutcome | None
    """Of `compute`; None before it, and after another observation was taken."""


@dataclass(frozen=True, slots=True)
class LinePlan:
    """One measuring line of the verification."""

    name: str
    """In words ("space diagonal 1")."""
    ends_world: Float
    """(2, 3), mm: where the first and the last nest of the bar should be."""
    taken: int
    """Nests that were taken, of `wanted`."""
    wanted: int
    """Nests of the bar."""
    hint: str = ""
    """What speaks against the placement as it was taken; empty where nothing does."""
    shares: tuple[float, ...] = ()
    """Where the nests are along the bar, from 0 to 1."""


@dataclass(frozen=True, slots=True)
class VerificationView:
    """Snapshot of the verification."""

    base: ProcedureView
    """What all procedures show."""
    lines: tuple[LinePlan, ...]
    """The seven lines, or more where the corners need them."""
    current_line: int | None
    """Index of the line that is being taken; None after the last one."""
    spheres: tuple[int, ...]
    """Points taken on each sphere; empty where none was chosen."""
    sphere_points: int
    """Wanted on each."""
    outcome: VerificationOutcome | None
    """Of `compute`; the verdict, or None before it."""
    places: tuple[str, ...]
    """One for each sphere: which third of the volume, or empty."""
    seats_world: tuple[Float, ...]
    """(3,), mm, each: seats that were visited."""
    next_seat: int | None
    """Index of the seat that is visited next, now or at the end; None after the last one."""
    corners: tuple[Corner, ...]
    """Of the volume, as test lengths ended there so far."""
    notes: tuple[str, ...]
    """What of the guideline's advice could not be followed, and why."""
