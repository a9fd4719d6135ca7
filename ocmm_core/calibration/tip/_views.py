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
    """What is between now and the next observation.

    Attributes
    ----------
    phase
        See `Phase`.
    seconds_left
        Until it is ready, if the probe keeps resting; zero in other phases.
    fraction
        Of that time that has passed, 0 to 1.
    """

    phase: Phase
    seconds_left: float
    fraction: float


@dataclass(frozen=True, slots=True)
class SpherePlace:
    """One wanted place on the sphere.

    Attributes
    ----------
    name
        In words ("22 degrees below the pole, right").
    direction_world
        (3,): unit vector from the centre of the sphere.
    point
        Index of the point that was taken there; None while it is missing.
    """

    name: str
    direction_world: Float
    point: int | None


@dataclass(frozen=True, slots=True)
class SphereProgress:
    """The points on the sphere so far.

    Attributes
    ----------
    places
        The wanted layout.
    next_place
        Index of the place to be touched next; None where all were.
    also_world
        (3,): where one more point would help most once the layout is complete and the diameter is
        not known well enough; None where nothing more is wanted, or not yet.
    tips_world
        (n, 3), mm: ball centres.
    directions_world
        (n, 3): unit vectors from the centre of the sphere, as far as it is known.
    slots
        (n,): index of the place of each point, -1 where it is at none.
    residuals_mm
        (n,): from the sphere that fits best, positive outside; NaN before four points.
    sigmas_mm
        (n,): predicted standard deviations of one point along its normal.
    doubtful
        Indices of points that do not fit beyond chance. They stay in unless somebody takes them
        back (`drop` takes back the last one, `take_back` any).
    diameter_mm
        Of the ball, so far; NaN before the points determine it.
    diameter_sigma_mm
        Its predicted standard uncertainty with the points so far, in a check that of its difference
        from the qualified one; infinite before they determine it.
    diameter_sigma_end_mm
        The same when the rest of the layout is taken as well; NaN before the first point.
    diameter_sigma_limit_mm
        From where on it is good enough.
    centre_sigma_mm
        (3,): predicted standard uncertainties of the sphere's centre; infinite before they are.
    form_mm
        Largest less smallest radius so far; NaN before four points.
    """

    places: tuple[SpherePlace, ...]
    next_place: int | None
    also_world: Float | None
    tips_world: Points3
    directions_world: Points3
    slots: Int
    residuals_mm: Float
    sigmas_mm: Float
    doubtful: tuple[int, ...]
    diameter_mm: float
    diameter_sigma_mm: float
    diameter_sigma_end_mm: float
    diameter_sigma_limit_mm: float
    centre_sigma_mm: Float
    form_mm: float

    @property
    def missing(self) -> tuple[int, ...]:
        """Return the indices of the places that were not touched yet."""
        return tuple(i for i, place in enumerate(self.places) if place.point is None)


@dataclass(frozen=True, slots=True)
class ConeAttitude:
    """One wanted way of holding the probe while its ball is in the cone.

    Attributes
    ----------
    name
        In words ("leaning left").
    handle_world
        (3,): unit vector from the ball to the handle.
    point
        Index of the observation that was taken so; None while it is missing.
    """

    name: str
    handle_world: Float
    point: int | None


@dataclass(frozen=True, slots=True)
class ConeProgress:
    """The ball in the cone so far.

    Attributes
    ----------
    attitudes
        Wanted.
    next_attitude
        Index of the one to be held next; None where all were.
    tips_world
        (n, 3), mm: ball centres by the calibration in force.
    handles_world
        (n, 3): unit vectors from the ball to the handle.
    off_world
        (n, 3), mm: tips less their mean.
    spread_2s_mm, largest_mm
        Two standard deviations, and largest distance from the mean; NaN before two.
    half_range_mm
        (3,): half of largest less smallest per world axis; NaN before two.
    spread_limit_mm, largest_limit_mm
        What the stated uncertainties allow (once in a thousand more); NaN before two.
    length_error_mm, length_sigma_mm
        True less calibrated distance of the ball from the handle, and its standard uncertainty;
        NaN and infinite before the attitudes determine it.
    """

    attitudes: tuple[ConeAttitude, ...]
    next_attitude: int | None
    tips_world: Points3
    handles_world: Points3
    off_world: Points3
    spread_2s_mm: float
    largest_mm: float
    half_range_mm: Float
    spread_limit_mm: float
    largest_limit_mm: float
    length_error_mm: float
    length_sigma_mm: float


@dataclass(frozen=True, slots=True)
class TouchView:
    """What qualification and check have in common.

    Attributes
    ----------
    base
        What all procedures show.
    probe, tip
        Names.
    sphere_name, sphere_diameter_mm, sphere_expanded_mm
        The sphere: name, certified diameter at the temperature of the session, and its expanded
        uncertainty (k = 2).
    nominal_mm
        Diameter that the ball should have.
    sphere, cone
        What was taken.
    countdown
        To the next observation.
    """

    base: ProcedureView
    probe: str
    tip: str
    sphere_name: str
    sphere_diameter_mm: float
    sphere_expanded_mm: float
    nominal_mm: float
    sphere: SphereProgress
    cone: ConeProgress
    countdown: Countdown


@dataclass(frozen=True, slots=True)
class TipOutcome:
    """A qualification that waits for being stored.

    Attributes
    ----------
    record
        What would be stored, with all checks and the verdict.
    largest
        Index of the check that is nearest to its limit, or farthest beyond.
    warnings
        What makes it weaker.
    previous
        The qualification before; None for the first one.
    residuals_mm, directions_world
        (n,) and (n, 3): radius residuals of all points, and where they are.
    cone_off_world
        (m, 3), mm: tips of all attitudes in the cone, less their mean.
    """

    record: TipRecord
    largest: int
    warnings: tuple[Finding, ...]
    previous: TipRecord | None
    residuals_mm: Float
    directions_world: Points3
    cone_off_world: Points3


class CheckVerdict(StrEnum):
    """What a quick check says."""

    PASSED = "passed"
    FAILED = "failed"
    INCONCLUSIVE = "inconclusive"


@dataclass(frozen=True, slots=True)
class TipCheckOutcome:
    """A quick check that waits for being stored; an inconclusive one is no outcome.

    Attributes
    ----------
    record
        What would be stored.
    largest
        Index of the check that is nearest to its limit, or farthest beyond.
    findings
        Which check failed and what to do; empty where it passed.
    warnings
        What makes it weaker.
    """

    record: TipCheckRecord
    largest: int
    findings: tuple[Finding, ...]
    warnings: tuple[Finding, ...]


@dataclass(frozen=True, slots=True)
class TipView(TouchView):
    """Snapshot of the qualification.

    Attributes
    ----------
    outcome
        Of `compute`; None before it, and after another point was taken.
    """

    outcome: TipOutcome | None


@dataclass(frozen=True, slots=True)
class TipCheckView(TouchView):
    """Snapshot of the quick check.

    Attributes
    ----------
    so_far
        What the check says with what was taken so far.
    advice
        Why it is inconclusive or failed and what to do, one or two sentences; else empty.
    outcome
        Of `compute`; None before it, and after another point was taken.
    """

    so_far: CheckVerdict
    advice: str
    outcome: TipCheckOutcome | None
