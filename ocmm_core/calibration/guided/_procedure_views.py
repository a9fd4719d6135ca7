"""Snapshots of the three procedures: what `view` of each returns."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.calibration.guided._outcome import CalibrationOutcome, VerificationOutcome
from ocmm_core.calibration.guided._procedure import ProcedureView
from ocmm_core.calibration.records import Corner
from ocmm_core.geometry import Float


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell of the volume.

    Attributes
    ----------
    name
        Where it is, in words ("near top left").
    low_world, high_world
        (3,), mm.
    poses, wanted
        Of the probe in it.
    """

    name: str
    low_world: Float
    high_world: Float
    poses: int
    wanted: int


@dataclass(frozen=True, slots=True)
class Tilt:
    """One way of holding the probe.

    Attributes
    ----------
    name
        In words ("leaning left").
    poses, wanted
        Held so.
    """

    name: str
    poses: int
    wanted: int


@dataclass(frozen=True, slots=True)
class VolumeCoverage:
    """What of the volume was shown.

    Attributes
    ----------
    cells, tilts
        With what is still missing.
    fraction
        Of what is wanted, 0 to 1.
    """

    cells: tuple[Cell, ...]
    tilts: tuple[Tilt, ...]
    fraction: float

    @property
    def missing(self) -> tuple[str, ...]:
        """Return the names of cells and tilts that lack poses, the emptiest first."""
        places = [(one.poses / one.wanted, one.name) for one in self.cells]
        ways = [(one.poses / one.wanted, one.name) for one in self.tilts]
        return tuple(name for share, name in sorted(places + ways) if share < 1.0)


@dataclass(frozen=True, slots=True)
class KnownPoint:
    """One reference point of the list.

    Attributes
    ----------
    name
        As in the list.
    position_world
        (3,), mm.
    views
        Cameras that saw it; None until it was taken.
    """

    name: str
    position_world: Float
    views: int | None


@dataclass(frozen=True, slots=True)
class KnownPointsView:
    """Snapshot of the calibration from known points.

    Attributes
    ----------
    base
        What all procedures show.
    points
        All of the list, in its order.
    next_point
        Index of the point that is taken next; None after the last one.
    outcome
        Of `compute`; None before it, and after another point was taken.
    """

    base: ProcedureView
    points: tuple[KnownPoint, ...]
    next_point: int | None
    outcome: CalibrationOutcome | None


@dataclass(frozen=True, slots=True)
class RelocationView:
    """Snapshot of the relocation.

    Attributes
    ----------
    base
        What all procedures show.
    poses
        Of the waved probe that were taken.
    coverage
        Of the volume.
    length_sigma_mm
        Predicted standard uncertainty of a length of ``length_mm`` anywhere in the volume, from
        what was collected so far (`predict`); None before the first prediction.
    length_mm, length_limit_mm
        Which length, and from where on it is good enough.
    bar_placements, bars_wanted
        Taken so far, and wanted.
    world_points, world_wanted
        Control points taken so far by name, and the names that are wanted.
    visits
        Of the seats that are visited first and last, so far.
    seats_world
        (3,), mm, each: seats that were visited, by the cameras as they were before.
    next_seat
        Index of the seat that is visited next, now or at the end; None after the last one.
    outcome
        Of `compute`; None before it, and after another observation was taken.
    """

    base: ProcedureView
    poses: int
    coverage: VolumeCoverage
    length_sigma_mm: float | None
    length_mm: float
    length_limit_mm: float
    bar_placements: int
    bars_wanted: int
    world_points: tuple[str, ...]
    world_wanted: tuple[str, ...]
    visits: int
    seats_world: tuple[Float, ...]
    next_seat: int | None
    outcome: CalibrationOutcome | None


@dataclass(frozen=True, slots=True)
class LinePlan:
    """One measuring line of the verification.

    Attributes
    ----------
    name
        In words ("space diagonal 1").
    ends_world
        (2, 3), mm: where the first and the last nest of the bar should be.
    taken
        Nests that were taken, of `wanted`.
    wanted
        Nests of the bar.
    hint
        What speaks against the placement as it was taken; empty where nothing does.
    shares
        Where the nests are along the bar, from 0 to 1.
    """

    name: str
    ends_world: Float
    taken: int
    wanted: int
    hint: str = ""
    shares: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class VerificationView:
    """Snapshot of the verification.

    Attributes
    ----------
    base
        What all procedures show.
    lines
        The seven lines, or more where the corners need them.
    current_line
        Index of the line that is being taken; None after the last one.
    spheres
        Points taken on each sphere; empty where none was chosen.
    sphere_points
        Wanted on each.
    outcome
        Of `compute`; the verdict, or None before it.
    places
        One for each sphere: which third of the volume, or empty.
    seats_world
        (3,), mm, each: seats that were visited.
    next_seat
        Index of the seat that is visited next, now or at the end; None after the last one.
    corners
        Of the volume, as test lengths ended there so far.
    notes
        What of the guideline's advice could not be followed, and why.
    """

    base: ProcedureView
    lines: tuple[LinePlan, ...]
    current_line: int | None
    spheres: tuple[int, ...]
    sphere_points: int
    outcome: VerificationOutcome | None
    places: tuple[str, ...]
    seats_world: tuple[Float, ...]
    next_seat: int | None
    corners: tuple[Corner, ...]
    notes: tuple[str, ...]
