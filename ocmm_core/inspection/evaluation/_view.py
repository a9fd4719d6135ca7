"""Frozen snapshots of a running inspection, for any screen or script to look at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import Literal

import numpy as np

from ocmm_core.acquisition.frames import AcquisitionStatus
from ocmm_core.features.measured import CommandingPoints
from ocmm_core.features.shapes import Fit, NominalFeature, Shape
from ocmm_core.geometry import Float, Int, RigidTransform
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.names import normal_name
from ocmm_core.part_model import PlacedPart
from ocmm_core.tolerances.decisions import (
    NO_VERDICT,
    CharacteristicResult,
    PartVerdict,
    RequirementCount,
    Verdict,
    VerdictSummary,
    judge_part,
    summarise,
)

Probing = Literal["plan", "any"]
"""Whether features are probed in the order of the plan, or in any."""


class StatusWord(Enum):
    """The one word that the inspector sees."""

    READY = "READY"
    MEASURING = "MEASURING"
    NOT_READY = "NOT READY"
    INACCURATE = "INACCURATE"
    LOST = "LOST"
    FAILED = "FAILED"


@dataclass(frozen=True, slots=True)
class ReferenceView:
    """The reference body to which everything is given."""

    name: str
    n_leds: int
    """`name`, `n_leds`: Its name and how many LEDs it has."""
    seen: int
    """How many of them two cameras see now."""
    moved_mm: float | None
    turned_rad: float | None
    """`moved_mm`, `turned_rad`: How far it and the part were carried against the cameras since the
    job began; None while that is not known."""
    leds_world: Float | None
    """(R, 3), mm, world of the job; None before its place is known."""


@dataclass(frozen=True, slots=True)
class LiveView:
    """The latest state of the machine; pulled 30 to 60 times a second."""

    status: StatusWord
    reason: str
    """`status`, `reason`: The word and, unless READY, the sentence behind it."""
    tip_world: Float | None
    """(3,), mm; None unless the number can be trusted."""
    tip_uncertainty: float | None
    """mm, k = 2, of one averaged point at this place; None together with ``tip_world``."""
    rotation_world_from_probe: Float | None
    origin_world: Float | None
    """`rotation_world_from_probe`, `origin_world`: (3, 3) and (3,); None together with
    ``tip_world``."""
    spots: Float
    """(C, S, 2), px: spot of every slot, NaN where the slot sees nothing."""
    slot_leds: Int
    """(C, S) int64: LED number that the slot follows, -1 where unknown."""
    frame_counter: int
    """Exposure number of the latest frame, -1 before the first."""
    time_s: float
    """Bus time of the latest frame, s."""
    frames_per_second: float
    """Frames tracked a second, over the last second of bus time."""
    acquisition: AcquisitionStatus
    """Counters of the acquisition."""
    slot_references: Int | None = None
    """(C, S) int64: LED of the reference body that the slot follows, -1 for none; None without a
    reference body."""
    reference: ReferenceView | None = None
    """The reference body; None without one."""
    faults: tuple[str, ...] = ()
    """What has failed beside the measuring, a sentence each; they stay until a new start."""


class FeatureState(Enum):
    """Where a feature of the plan stands."""

    PENDING = "pending"
    ACTIVE = "active"
    DONE = "done"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class DeletedPoint:
    """A point that was taken out of a feature and can be put back."""

    point: MeasuredPoint
    reason: str


@dataclass(frozen=True, slots=True)
class Coverage:
    """How well the points of a feature are spread over it."""

    fraction: float
    """0 to 1: part of the sectors, cells or stretches that have a point."""
    cells: tuple[bool, ...]
    """Of each sector (counter-clockwise about the direction of the fit), cell or stretch, whether
    it has a point."""
    words: str
    """Fraction in words: "5 of 8 sectors"."""
    warning: str = ""
    """What to do where the points are badly spread; else empty."""
    start: float = 0.0
    """Where the first sector begins, rad counter-clockwise from the first axis that
    `perpendicular_pair` gives for the direction; 0 for what has no sectors."""


@dataclass(frozen=True, slots=True)
class Target:
    """Where the next point is wanted."""

    feature: str
    """Name of the feature."""
    surface_world: Float
    normal_world: Float
    """`surface_world`, `normal_world`: (3,), mm, and (3,), unit, from the material towards the
    probe; zero for a line, whose plan does not say which face it lies in."""
    ball_world: Float
    """(3,), mm: where the centre of the ball is when it touches there."""
    approximate: bool = False
    """The place of the part is only roughly known: guidance, never a result."""

    def distance(self, tip_world: Float) -> float:
        """Return how far the ball, (3,) mm, still is from its place, mm."""
        return float(np.linalg.norm(tip_world - self.ball_world))


@dataclass(frozen=True, slots=True, eq=False)
class PlannedFeature:
    """Planned geometry of the active feature, shown until it is measured."""

    nominal: NominalFeature
    T_world_from_nominal: RigidTransform
    """Where the nominals of the plan are, or may be."""
    supposed: bool
    """Nobody knows where the part is: it is shown upright in the middle of the volume."""
    targets: tuple[Target, ...] = ()
    """Where to touch it, if it is supposed there. Neither ring nor tone leads to such places, and
    no touch is held against them."""


@dataclass(frozen=True, slots=True)
class FeatureView:
    """One feature of the plan as it stands."""

    name: str
    shape: Shape
    needed: int
    """`name`, `shape`, `needed`: From the plan; ``needed`` points."""
    state: FeatureState
    """Where it stands."""
    points: tuple[MeasuredPoint, ...]
    """Points that count, oldest first."""
    fit: Fit | None
    """Compensated fit in the world frame (`features.shapes.Fit`; diameters without the ball); None
    while there are too few points."""
    note: str
    """Why there is no fit, or why its points prove nothing; else empty."""
    outliers: tuple[int, ...] = ()
    """Numbers of points that lie far from the element that the others show: flagged, and counting
    until somebody deletes them."""
    commanding: CommandingPoints | None = None
    """Points without which the others agree far better: nothing that rests on the feature is proven
    until they are deleted."""
    deleted: tuple[DeletedPoint, ...] = ()
    """Points that were taken out and can be put back, oldest first."""
    coverage: Coverage | None = None
    """How well the points are spread; None without any."""
    targets: tuple[Target, ...] = ()
    """Where points are still wanted, the best next one first; empty where it is not known where the
    part stands, or how large the feature is."""
    text: str = ""
    picture: str = ""
    """`text`, `picture`: From the plan: what to do, and the file beside the plan that shows it."""
    compensation: str = "approach"
    """How the side of the material is found: one of `measuring.compensation.METHODS`."""

    @property
    def taken(self) -> int:
        """Return how many points it has."""
        return len(self.points)

    @property
    def last_touch(self) -> int:
        """Return the number of its last point, deleted or not; zero where it never had one."""
        last = self.points[-1].number if self.points else 0
        return max(last, *(item.point.number for item in self.deleted), 0)

    @property
    def skipped(self) -> bool:
        """Return whether it was skipped."""
        return self.state is FeatureState.SKIPPED

    @property
    def provisional(self) -> bool:
        """Return whether it is still being probed, so that nothing is decided by it."""
        return self.state is not FeatureState.DONE


@dataclass(frozen=True, slots=True)
class JobHeader:
    """Whom and what a job is about: asked for before the first point."""

    operator: str
    part: str
    serial: str
    order: str = ""
    batch: str = ""

    def __post_init__(self) -> None:
        """Bring the names into their normal form, so that equal names are one part or batch."""
        for one in fields(self):
            object.__setattr__(self, one.name, normal_name(getattr(self, one.name)))


@dataclass(frozen=True, slots=True)
class JobView:
    """The whole job as it stands; a new one after every change."""

    job: str
    part: str
    operator: str
    """`job`, `part`, `operator`: Names."""
    features: tuple[FeatureView, ...]
    """In the order of the plan."""
    active: str
    """Name of the feature that takes the next point; empty when all are done."""
    characteristics: tuple[CharacteristicResult, ...]
    """In the order of the plan."""
    refusal: Refusal | None
    """Why the last touch gave no point; None after an accepted one."""
    complete: bool
    """Every feature is done or skipped."""
    requirements: RequirementCount | None
    """How many requirements of its sources the plan contains; None for a plan made by hand."""
    unproven: str = ""
    """Why no verdict of this job can be CONFORM or NOT CONFORM; empty where they can."""
    held: tuple[int, ...] = ()
    """Numbers of the points that are held back: what rests on them is NOT PROVEN."""
    temperature: str = ""
    """What is known of the temperatures of probe and part, and what is compensated, in words."""
    at_20_c: bool = False
    """Values are those of the part at 20 °C."""
    header: JobHeader = field(default_factory=lambda: JobHeader("", "", ""))
    """Operator, part, serial, order and batch."""
    probing: Probing = "plan"
    """``"plan"``: in the order of the plan; ``"any"``: the feature that is touched is found."""
    paused: bool = False
    """Touches are refused until it goes on."""
    target: Target | None = None
    """Where the next point is wanted; None where that is not known."""
    constructed: tuple[FeatureView, ...] = ()
    """Features made from others, in the order of the plan."""
    undo: str = ""
    redo: str = ""
    """`undo`, `redo`: What these would take back and do again, in words; empty where there is
    nothing."""
    looked_at: str = ""
    """Name of the feature that somebody looks back at; empty where nobody does. It changes nothing
    else here."""
    simulated: bool = False
    """Some of it came from a virtual rig: every screen, page and file says so."""
    camera_doubts: tuple[str, ...] = ()
    """What its cameras could not prove, in sentences; every page and file says so."""
    placed_part: PlacedPart | None = None
    """The nominal part by the CAD model of the plan; None where the plan names none."""
    planned: PlannedFeature | None = None
    """The active feature by its nominals, as long as it has no fit; None where it has one."""
    room_doubt: str = ""
    """Why the room lets the job prove nothing by its plan; empty where it does. It stands in
    ``unproven``, too, where nothing weightier does."""
    room: tuple[tuple[str, str], ...] = ()
    """What was read off in the room: fields and sentences, as `environment_words`."""
    part_verdict: PartVerdict = field(init=False)
    """The verdict on the part. This and what `verdict_of` returns are made of ``features`` and
    ``characteristics`` whenever a view is made, so that they cannot say anything else."""
    _summaries: Mapping[str, VerdictSummary] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Join the verdicts."""
        resting: dict[str, list[CharacteristicResult]] = {}
        for result in self.characteristics:
            for name in dict.fromkeys(result.features):
                resting.setdefault(name, []).append(result)
        summaries = {name: summarise(results, name) for name, results in resting.items()}
        missing = [item.name for item in self.features if item.state is not FeatureState.DONE]
        part = judge_part(self.characteristics, missing, self.requirements)
        object.__setattr__(self, "_summaries", summaries)
        object.__setattr__(self, "part_verdict", part)

    def verdict_of(self, feature: str) -> VerdictSummary:
        """Return the verdict on a feature: that of all characteristics that are about it."""
        return self._summaries.get(feature, NO_VERDICT)

    def deciding(self, feature: str) -> CharacteristicResult | None:
        """Return the characteristic that decides over a feature; None where it has none."""
        return self.result(self.verdict_of(feature).deciding)

    def result(self, name: str) -> CharacteristicResult | None:
        """Return the result of a characteristic; None where there is none of that name."""
        return next((item for item in self.characteristics if item.name == name), None)

    @property
    def shown(self) -> FeatureView | None:
        """Return the feature that screens show.

        That is the one that somebody looks back at, else the active one; but a feature that is just
        done stays in sight until the next one has its first point, or nobody would ever see its
        result, and one whose only point was deleted stays too, so that the point can be put back.
        Once all is done it is the one that decides over the part, where that is not CONFORM. None
        where no feature was touched and none is active.
        """
        named = {item.name: item for item in self.features}
        if self.looked_at in named:
            return named[self.looked_at]
        deciding = self.result(self.part_verdict.summary.deciding) if self.complete else None
        if deciding is not None and deciding.verdict is not Verdict.CONFORM:
            about = next((name for name in deciding.features if name in named), "")
            if about:
                return named[about]
        active = named.get(self.active)
        touched = [item for item in self.features if item.last_touch]
        if (active is not None and active.last_touch) or not touched:
            return active
        return max(touched, key=lambda item: item.last_touch)

    @property
    def shows_part(self) -> bool:
        """Return whether screens show the verdict on the part: all is done, nobody looks back."""
        return self.complete and not self.looked_at

    def feature(self, name: str) -> FeatureView:
        """Return the feature called ``name``; KeyError if there is none."""
        for feature in self.features:
            if feature.name == name:
                return feature
        raise KeyError(name)
