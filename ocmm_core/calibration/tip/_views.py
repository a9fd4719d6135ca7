"""Snapshots of tip qualification and quick tip check, returned by `view`."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from ocmm_core.calibration.guided import ProcedureView
from ocmm_core.calibration.records import Finding, TipCheckRecord, TipRecord
from ocmm_core.geometry import Float, Int, Points3


class Phase(StrEnum):
    """Progress of recording one observation."""

    SEARCHING = "searching"
    """The probe is not seen well enough, or is in the wrong place."""

    RESTING = "resting"
    """Must rest longer; see `Countdown.seconds_left`."""

    READY = "ready"
    """`record` stores it now."""

    TAKEN = "taken"
    """This place is recorded: move on."""


@dataclass(frozen=True, slots=True)
class Countdown:
    """Time to the next observation."""

    phase: Phase
    seconds_left: float
    """Until it is ready, if the probe keeps resting; zero in other phases."""
    fraction: float
    """Elapsed fraction of that time, 0 to 1."""


@dataclass(frozen=True, slots=True)
class SpherePlace:
    """One wanted place on the sphere."""

    name: str
    """Place in words ("22 degrees below the pole, right")."""
    direction_world: Float
    """(3,): unit vector from the centre of the sphere."""
    point: int | None
    """Index of the point recorded there, or None."""


@dataclass(frozen=True, slots=True)
class SphereProgress:
    """Points on the sphere."""

    places: tuple[SpherePlace, ...]
    next_place: int | None
    """Index of the next place; None after the last."""
    also_world: Float | None
    """(3,): most useful direction of one more point if the complete layout leaves the diameter too
    uncertain; otherwise None."""
    tips_world: Points3
    """(n, 3), mm: ball centres."""
    directions_world: Points3
    """(n, 3): unit vectors from the centre of the sphere as currently determined."""
    slots: Int
    """(n,): index of the place of each point, -1 if none."""
    residuals_mm: Float
    """(n,): from the best-fit sphere, positive outside; NaN before four points."""
    doubtful: tuple[int, ...]
    """Indices of significantly inconsistent points. They are used unless the user removes them
    (`drop`: the last one, `take_back`: any)."""
    diameter_mm: float
    """Ball; NaN until determined by the points."""
    diameter_sigma_mm: float
    """Its predicted standard uncertainty with the present points; in a check, that of its
    difference from the qualified one; infinite until determined."""
    diameter_sigma_end_mm: float
    """The same for the complete layout; NaN before the first point."""
    diameter_sigma_limit_mm: float
    form_mm: float
    """Largest less smallest radius; NaN before four points."""

    @property
    def missing(self) -> tuple[int, ...]:
        """Return the indices of the untouched places."""
        return tuple(i for i, place in enumerate(self.places) if place.point is None)


@dataclass(frozen=True, slots=True)
class ConeAttitude:
    """One wanted attitude of the probe with its ball in the cone."""

    name: str
    """Attitude in words ("leaning left")."""
    handle_world: Float
    """(3,): unit vector from the ball to the handle."""
    point: int | None
    """Index of its observation, or None."""


@dataclass(frozen=True, slots=True)
class ConeProgress:
    """Attitudes in the cone."""

    attitudes: tuple[ConeAttitude, ...]
    next_attitude: int | None
    """Index of the next attitude; None after the last."""
    tips_world: Points3
    """(n, 3), mm: ball centres by the calibration in force."""
    handles_world: Points3
    """(n, 3): unit vectors from the ball to the handle."""
    off_world: Points3
    """(n, 3), mm: tips less their mean."""
    spread_2s_mm: float
    largest_mm: float
    """`spread_2s_mm`, `largest_mm`: Two standard deviations, and largest from mean; else NaN."""
    half_range_mm: Float
    """(3,): half of largest less smallest per world axis; NaN before two."""
    spread_limit_mm: float
    largest_limit_mm: float
    """`spread_limit_mm`, `largest_limit_mm`: Allowed by the stated uncertainties (exceeded once in
    a thousand); NaN before two."""


@dataclass(frozen=True, slots=True)
class TouchView:
    """Common part of the snapshots of qualification and check."""

    base: ProcedureView
    probe: str
    tip: str
    sphere_name: str
    sphere_diameter_mm: float
    sphere_expanded_mm: float
    """`sphere_name`, `sphere_diameter_mm`, `sphere_expanded_mm`: The sphere: name, certified
    diameter at the temperature of the session, and its expanded uncertainty (k = 2)."""
    nominal_mm: float
    sphere: SphereProgress
    cone: ConeProgress
    countdown: Countdown


@dataclass(frozen=True, slots=True)
class TipOutcome:
    """A qualification awaiting storage."""

    record: TipRecord
    """To be stored, with all checks and the verdict."""
    largest: int
    """Index of the check closest to, or farthest beyond, its limit."""
    warnings: tuple[Finding, ...]
    """Findings that weaken it."""
    previous: TipRecord | None
    """The previous qualification; None for the first one."""
    residuals_mm: Float
    directions_world: Points3
    """`residuals_mm`, `directions_world`: (n,) and (n, 3): radius residuals and directions of all
    points."""
    cone_off_world: Points3
    """(m, 3), mm: tips of all attitudes in the cone, less their mean."""


class CheckVerdict(StrEnum):
    """Result of a quick check."""

    PASSED = "passed"
    FAILED = "failed"
    INCONCLUSIVE = "inconclusive"


@dataclass(frozen=True, slots=True)
class TipCheckOutcome:
    """A conclusive quick check awaiting storage."""

    record: TipCheckRecord
    largest: int
    """Index of the check closest to, or farthest beyond, its limit."""
    findings: tuple[Finding, ...]
    """Failed checks with remedies; empty if passed."""
    warnings: tuple[Finding, ...]
    """Findings that weaken it."""
    due_utc: str
    """Expiry of the tip: the earlier one of its calibration and qualification, ISO 8601."""


@dataclass(frozen=True, slots=True)
class TipView(TouchView):
    """Snapshot of the qualification."""

    outcome: TipOutcome | None
    """Result of `compute`; None before it, and after another point."""


@dataclass(frozen=True, slots=True)
class TipCheckView(TouchView):
    """Snapshot of the quick check."""

    so_far: CheckVerdict
    outcome: TipCheckOutcome | None
    """Result of `compute`; None before it, and after another point."""
