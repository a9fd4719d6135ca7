"""Snapshots of tip qualification and quick tip check: what `view` of both returns."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from ocmm_core.calibration.guided import ProcedureView
from ocmm_core.calibration.records import Finding, TipCheckRecord, TipRecord
from ocmm_core.geometry import Float, Int, Points3


class Phase(StrEnum):
    """How far the taking of one observation is."""

    SEARCHING = "searching"
    """The probe is not seen well enough, or it is not where it should be."""

    RESTING = "resting"
    """It must rest a little longer; see `Countdown.seconds_left`."""

    READY = "ready"
    """`take` takes it now."""

    TAKEN = "taken"
    """This place was taken: move on."""


@dataclass(frozen=True, slots=True)
class Countdown:
    """What is between now and the next observation."""

    phase: Phase
    seconds_left: float
    """Until it is ready, if the probe keeps resting; zero in other phases."""
    fraction: float
    """Of that time that has passed, 0 to 1."""


@dataclass(frozen=True, slots=True)
class SpherePlace:
    """One wanted place on the sphere."""

    name: str
    """In words ("22 degrees below the pole, right")."""
    direction_world: Float
    """(3,): unit vector from the centre of the sphere."""
    point: int | None
    """Index of the point that was taken there; None while it is missing."""


@dataclass(frozen=True, slots=True)
class SphereProgress:
    """The points on the sphere so far."""

    places: tuple[SpherePlace, ...]
    next_place: int | None
    """Index of the place to be touched next; None where all were."""
    also_world: Float | None
    """(3,): where one more point would help most once the layout is complete and the diameter is
    not known well enough; None where nothing more is wanted, or not yet."""
    tips_world: Points3
    """(n, 3), mm: ball centres."""
    directions_world: Points3
    """(n, 3): unit vectors from the centre of the sphere, as far as it is known."""
    slots: Int
    """(n,): index of the place of each point, -1 where it is at none."""
    residuals_mm: Float
    """(n,): from the sphere that fits best, positive outside; NaN before four points."""
    sigmas_mm: Float
    """(n,): predicted standard deviations of one point along its normal."""
    doubtful: tuple[int, ...]
    """Indices of points that do not fit beyond chance. They stay in unless somebody takes them back
    (`drop` takes back the last one, `take_back` any)."""
    diameter_mm: float
    """Of the ball, so far; NaN before the points determine it."""
    diameter_sigma_mm: float
    """Its predicted standard uncertainty with the points so far, in a check that of its difference
    from the qualified one; infinite before they determine it."""
    diameter_sigma_end_mm: float
    """The same when the rest of the layout is taken as well; NaN before the first point."""
    diameter_sigma_limit_mm: float
    centre_sigma_mm: Float
    """(3,): predicted standard uncertainties of the sphere's centre; infinite before they are."""
    form_mm: float
    """Largest less smallest radius so far; NaN before four points."""

    @property
    def missing(self) -> tuple[int, ...]:
        """Return the indices of the places that were not touched yet."""
        return tuple(i for i, place in enumerate(self.places) if place.point is None)


@dataclass(frozen=True, slots=True)
class ConeAttitude:
    """One wanted way of holding the probe while its ball is in the cone."""

    name: str
    """In words ("leaning left")."""
    handle_world: Float
    """(3,): unit vector from the ball to the handle."""
    point: int | None
    """Index of the observation that was taken so; None while it is missing."""


@dataclass(frozen=True, slots=True)
class ConeProgress:
    """The ball in the cone so far."""

    attitudes: tuple[ConeAttitude, ...]
    """Wanted."""
    next_attitude: int | None
    """Index of the one to be held next; None where all were."""
    tips_world: Points3
    """(n, 3), mm: ball centres by the calibration in force."""
    handles_world: Points3
    """(n, 3): unit vectors from the ball to the handle."""
    off_world: Points3
    """(n, 3), mm: tips less their mean."""
    spread_2s_mm: float
    largest_mm: float
    """`spread_2s_mm`, `largest_mm`: Two standard deviations, and largest distance from the mean;
    NaN before two."""
    half_range_mm: Float
    """(3,): half of largest less smallest per world axis; NaN before two."""
    spread_limit_mm: float
    largest_limit_mm: float
    """`spread_limit_mm`, `largest_limit_mm`: What the stated uncertainties allow (once in a
    thousand more); NaN before two."""
    length_error_mm: float
    length_sigma_mm: float
    """`length_error_mm`, `length_sigma_mm`: True less calibrated distance of the ball from the
    handle, and its standard uncertainty; NaN and infinite before the attitudes determine it."""


@dataclass(frozen=True, slots=True)
class TouchView:
    """What qualification and check have in common."""

    base: ProcedureView
    """What all procedures show."""
    probe: str
    tip: str
    """`probe`, `tip`: Names."""
    sphere_name: str
    sphere_diameter_mm: float
    sphere_expanded_mm: float
    """`sphere_name`, `sphere_diameter_mm`, `sphere_expanded_mm`: The sphere: name, certified
    diameter at the temperature of the session, and its expanded uncertainty (k = 2)."""
    nominal_mm: float
    """Diameter that the ball should have."""
    sphere: SphereProgress
    cone: ConeProgress
    """`sphere`, `cone`: What was taken."""
    countdown: Countdown


@dataclass(frozen=True, slots=True)
class TipOutcome:
    """A qualification that waits for being stored."""

    record: TipRecord
    """What would be stored, with all checks and the verdict."""
    largest: int
    """Index of the check that is nearest to its limit, or farthest beyond."""
    warnings: tuple[Finding, ...]
    """What makes it weaker."""
    previous: TipRecord | None
    """The qualification before; None for the first one."""
    residuals_mm: Float
    directions_world: Points3
    """`residuals_mm`, `directions_world`: (n,) and (n, 3): radius residuals of all points, and
    where they are."""
    cone_off_world: Points3
    """(m, 3), mm: tips of all attitudes in the cone, less their mean."""


class CheckVerdict(StrEnum):
    """What a quick check says."""

    PASSED = "passed"
    FAILED = "failed"
    INCONCLUSIVE = "inconclusive"


@dataclass(frozen=True, slots=True)
class TipCheckOutcome:
    """A quick check that waits for being stored; an inconclusive one is no outcome."""

    record: TipCheckRecord
    """What would be stored."""
    largest: int
    """Index of the check that is nearest to its limit, or farthest beyond."""
    findings: tuple[Finding, ...]
    """Which check failed and what to do; empty where it passed."""
    warnings: tuple[Finding, ...]
    """What makes it weaker."""


@dataclass(frozen=True, slots=True)
class TipView(TouchView):
    """Snapshot of the qualification."""

    outcome: TipOutcome | None
    """Of `compute`; None before it, and after another point was taken."""


@dataclass(frozen=True, slots=True)
class TipCheckView(TouchView):
    """Snapshot of the quick check."""

    so_far: CheckVerdict
    """What the check says with what was taken so far."""
    advice: str
    """Why it is inconclusive or failed and what to do, one or two sentences; else empty."""
    outcome: TipCheckOutcome | None
    """Of `compute`; None before it, and after another point was taken."""
