"""Frozen snapshots of a running inspection, for any screen or script to look at."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ocmm_core.acquisition.worker import AcquisitionStatus
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring.point import MeasuredPoint, Refusal
from ocmm_core.tolerances.result import CharacteristicResult, Verdict


class StatusWord(Enum):
    """The one word that the inspector sees."""

    READY = "READY"
    MEASURING = "MEASURING"
    NOT_READY = "NOT READY"
    INACCURATE = "INACCURATE"
    LOST = "LOST"


@dataclass(frozen=True, slots=True)
class ReferenceView:
    """The reference body to which everything is given.

    Attributes
    ----------
    name, n_leds
        Its name and how many LEDs it has.
    seen
        How many of them two cameras see now.
    moved_mm, turned_rad
        How far it and the part were carried against the cameras since the job began; None while
        that is not known.
    leds_world
        (R, 3), mm, world of the job; None before its place is known.
    """

    name: str
    n_leds: int
    seen: int
    moved_mm: float | None
    turned_rad: float | None
    leds_world: Float | None


@dataclass(frozen=True, slots=True)
class LiveView:
    """The latest state of the machine; pulled 30 to 60 times a second.

    Attributes
    ----------
    status, reason
        The word and, unless READY, the sentence behind it.
    tip_world
        (3,), mm; None unless the number can be trusted.
    tip_uncertainty
        mm, k = 2, of one averaged point at this place; None together with ``tip_world``.
    rotation_world_from_probe, origin_world
        (3, 3) and (3,); None together with ``tip_world``.
    spots
        (C, 8, 2), px: spot of every slot, NaN where the slot sees nothing.
    slot_leds
        (C, 8) int64: LED number that the slot follows, -1 where unknown.
    frame_counter
        Exposure number of the latest frame, -1 before the first.
    time_s
        Bus time of the latest frame, s.
    frames_per_second
        Frames tracked a second, over the last second of bus time.
    acquisition
        Counters of the acquisition.
    slot_references
        (C, 8) int64: LED of the reference body that the slot follows, -1 for none; None without a
        reference body.
    reference
        The reference body; None without one.
    """

    status: StatusWord
    reason: str
    tip_world: Float | None
    tip_uncertainty: float | None
    rotation_world_from_probe: Float | None
    origin_world: Float | None
    spots: Float
    slot_leds: Int
    frame_counter: int
    time_s: float
    frames_per_second: float
    acquisition: AcquisitionStatus
    slot_references: Int | None = None
    reference: ReferenceView | None = None


class FeatureState(Enum):
    """Where a feature of the plan stands."""

    PENDING = "pending"
    ACTIVE = "active"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class FeatureView:
    """One feature of the plan as it stands.

    Attributes
    ----------
    name, shape, needed
        From the plan.
    state
        Where it stands.
    points
        Accepted points, oldest first.
    fit
        Compensated fit in the world frame (`features.shapes.Fit`; diameters without the ball);
        None while there are too few points.
    verdict
        Worst verdict of the characteristics that rest on it; None where there is none yet.
    note
        Why there is no fit, or why its points prove nothing; else empty.
    """

    name: str
    shape: Shape
    needed: int
    state: FeatureState
    points: tuple[MeasuredPoint, ...]
    fit: Fit | None
    verdict: Verdict | None
    note: str


@dataclass(frozen=True, slots=True)
class JobView:
    """The whole job as it stands; a new one after every change.

    Attributes
    ----------
    job, part, operator
        Names.
    features
        In the order of the plan.
    active
        Name of the feature that takes the next point; empty when all are done.
    characteristics
        In the order of the plan.
    refusal
        Why the last touch gave no point; None after an accepted one.
    complete
        Every feature is done.
    unproven
        Why no verdict of this job can be CONFORM or NOT CONFORM; empty where they can.
    held
        Numbers of the points that are held back: what rests on them is NOT PROVEN.
    temperature
        What is known of the temperatures of probe and part, and what is compensated, in words.
    at_20_c
        Values are those of the part at 20 °C.
    """

    job: str
    part: str
    operator: str
    features: tuple[FeatureView, ...]
    active: str
    characteristics: tuple[CharacteristicResult, ...]
    refusal: Refusal | None
    complete: bool
    unproven: str = ""
    held: tuple[int, ...] = ()
    temperature: str = ""
    at_20_c: bool = False
