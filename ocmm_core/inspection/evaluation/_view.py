"""Frozen snapshots of a running inspection, for screens and scripts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import Enum
from typing import TYPE_CHECKING, Literal

import numpy as np

from ocmm_core.acquisition.frames import AcquisitionStatus
from ocmm_core.features.shapes import MOST_POINTS, Fit, NominalFeature, Shape
from ocmm_core.geometry import Float, Int, RigidTransform
from ocmm_core.measuring import MeasuredPoint, PathProgress, Refusal
from ocmm_core.names import normal_name
from ocmm_core.part_model import PlacedPart
from ocmm_core.tolerances import decisions

if TYPE_CHECKING:
    # It loads what computes, which the Start page does without.
    from ocmm_core.features.measured import CommandingPoints

Probing = Literal["plan", "any"]
"""Order of probing: of the plan, or any."""


class StatusWord(Enum):
    """Status word shown to the inspector."""

    READY = "READY"
    MEASURING = "MEASURING"
    NOT_READY = "NOT READY"
    INACCURATE = "INACCURATE"
    LOST = "LOST"
    FAILED = "FAILED"


@dataclass(frozen=True, slots=True)
class ReferenceView:
    """Reference body of all coordinates."""

    name: str
    n_leds: int
    seen: int
    """LEDs now seen by two cameras."""
    moved_mm: float | None
    turned_rad: float | None
    """`moved_mm`, `turned_rad`: Of body and part against the cameras since start, or None."""
    leds_world: Float | None
    """(R, 3), mm, world of the job; None before its pose is known."""


@dataclass(frozen=True, slots=True)
class LiveView:
    """The latest state of the machine; polled 30 to 60 times a second."""

    status: StatusWord
    reason: str
    """`status`, `reason`: The word and, unless READY, its reason."""
    tip_world: Float | None
    """(3,), mm; None unless the number can be trusted."""
    tip_uncertainty: float | None
    """mm, k = 2, of one averaged point at this place; None together with ``tip_world``."""
    rotation_world_from_probe: Float | None
    origin_world: Float | None
    """`rotation_world_from_probe`, `origin_world`: (3, 3), (3,); None with ``tip_world``."""
    spots: Float
    """(C, S, 2), px: spot of every slot, NaN without spot."""
    slot_leds: Int
    """(C, S) int64: LED number of the slot, -1 if unknown."""
    frame_counter: int
    """Exposure number of the latest frame, -1 before the first."""
    time_s: float
    """Bus time of the latest frame, s."""
    frames_per_second: float
    """Over the last second of bus time."""
    acquisition: AcquisitionStatus
    slot_references: Int | None = None
    """(C, S) int64: reference LED of the slot, -1 for none; None without such a body."""
    reference: ReferenceView | None = None
    faults: tuple[str, ...] = ()
    """Failures outside the measurement, a sentence each; they remain until restart."""
    path: PathProgress | None = None
    """Of continuous probing, while the button is held."""


class FeatureState(Enum):
    PENDING = "pending"
    ACTIVE = "active"
    DONE = "done"
    SKIPPED = "skipped"


@dataclass(frozen=True, slots=True)
class DeletedPoint:
    """A deleted point that can be restored."""

    point: MeasuredPoint
    reason: str


@dataclass(frozen=True, slots=True)
class Coverage:
    """Distribution of the points over a feature."""

    fraction: float
    """0 to 1: share of the sectors, cells or stretches that have a point."""
    cells: tuple[bool, ...]
    """Per sector (counter-clockwise about the fit's direction), cell, stretch: has a point."""
    words: str
    """"5 of 8 sectors"."""
    warning: str = ""
    """Remedy for a bad distribution; else empty."""
    start: float = 0.0
    """Start of the first sector, rad counter-clockwise from the first axis of `perpendicular_pair`
    of the direction; 0 without sectors."""


@dataclass(frozen=True, slots=True)
class Target:
    """Place of the next point."""

    feature: str
    surface_world: Float
    normal_world: Float
    """`surface_world`, `normal_world`: (3,), mm, and (3,), unit, from the material towards the
    probe; zero for a line, whose plan does not name its face."""
    ball_world: Float
    """(3,), mm: centre of the ball in contact."""
    approximate: bool = False
    """The pose of the part is only roughly known: guidance, never a result."""
    words: str = ""
    """Instruction of another program that asks for the point; empty for targets of the plan."""

    def distance(self, tip_world: Float) -> float:
        """Return the distance of the ball, (3,) mm, from its target, mm."""
        return float(np.linalg.norm(tip_world - self.ball_world))


@dataclass(frozen=True, slots=True, eq=False)
class PlannedFeature:
    """Planned geometry of the active feature, shown until it is measured."""

    nominal: NominalFeature
    T_world_from_nominal: RigidTransform
    """Known or assumed pose of the nominals."""
    supposed: bool
    """Pose unknown: the part is shown upright in the middle of the volume."""
    targets: tuple[Target, ...] = ()
    """In the assumed pose: neither ring nor tone guides to them, no touch is checked."""


@dataclass(frozen=True, slots=True)
class FeatureView:
    """State of a feature of the plan."""

    name: str
    shape: Shape
    needed: int
    """`name`, `shape`, `needed`: From the plan; ``needed`` points."""
    state: FeatureState
    points: tuple[MeasuredPoint, ...]
    """Points that count, oldest first."""
    fit: Fit | None
    """Compensated, world (`features.shapes.Fit`; without the ball); None: too few points."""
    note: str
    """Why there is no fit, or why its points prove nothing; else empty."""
    outliers: tuple[int, ...] = ()
    """Numbers of points contradicted by the others: flagged, and counting until deleted."""
    commanding: CommandingPoints | None = None
    """Points without which the others agree far better; until deleted, nothing is proven."""
    deleted: tuple[DeletedPoint, ...] = ()
    coverage: Coverage | None = None
    targets: tuple[Target, ...] = ()
    """The best next one first; empty if the pose of the part or the size is unknown."""
    text: str = ""
    picture: str = ""
    """`text`, `picture`: Instruction of the plan, and its picture file next to the plan."""
    compensation: str = "approach"
    """Detection of the side of the material: one of `measuring.compensation.METHODS`."""
    spacing: float = 0.0
    scan: str = ""
    """Of continuous probing, mm: distance of the points along a path; 0 for single touches."""

    @property
    def taken(self) -> int:
        return len(self.points)

    @property
    def open_ended(self) -> bool:
        """Return whether it takes single points until the job is closed."""
        return self.shape is Shape.POINT and self.needed == MOST_POINTS

    @property
    def count_text(self) -> str:
        """Return how many points were taken, and of how many: ``3 / 8``."""
        return str(self.taken) if self.open_ended else f"{self.taken} / {self.needed}"

    @property
    def spread_warning(self) -> str:
        """Return the warning about the spread of the points.

        While points are missing the next target guides the spread.
        """
        if self.coverage is None or self.taken < self.needed - 1:
            return ""
        return self.coverage.warning

    @property
    def last_touch(self) -> int:
        """Return the number of its last point, deleted or not; zero if it never had one."""
        last = self.points[-1].number if self.points else 0
        return max(last, *(item.point.number for item in self.deleted), 0)

    @property
    def skipped(self) -> bool:
        return self.state is FeatureState.SKIPPED

    @property
    def provisional(self) -> bool:
        """Return whether it is incomplete, so that it decides nothing."""
        return self.state is not FeatureState.DONE


@dataclass(frozen=True, slots=True)
class JobHeader:
    """Identification of a job, entered before the first point."""

    operator: str
    part: str
    serial: str
    order: str = ""
    batch: str = ""

    def __post_init__(self) -> None:
        """Normalise the names, so that equal names are one part or batch."""
        for one in fields(self):
            object.__setattr__(self, one.name, normal_name(getattr(self, one.name)))


@dataclass(frozen=True, slots=True)
class JobView:
    """State of the whole job; a new object after every change."""

    job: str
    part: str
    operator: str
    features: tuple[FeatureView, ...]
    """In the order of the plan."""
    active: str
    """Feature that takes the next point; empty when all are done."""
    characteristics: tuple[decisions.CharacteristicResult, ...]
    """In the order of the plan."""
    refusal: Refusal | None
    """Why the last touch gave no point; None after an accepted one."""
    complete: bool
    """Every feature is done or skipped."""
    requirements: decisions.RequirementCount | None
    """Requirements of its sources in the plan; None for a plan made by hand."""
    unproven: str = ""
    """Why no verdict of this job can be CONFORM or NOT CONFORM; empty if they can."""
    held: tuple[int, ...] = ()
    """Numbers of held points: dependent results are NOT PROVEN."""
    temperature: str = ""
    """Temperatures of probe and part, and their compensation, in words."""
    at_20_c: bool = False
    """Values are those of the part at 20 °C."""
    header: JobHeader = field(default_factory=lambda: JobHeader("", "", ""))
    probing: Probing = "plan"
    """``"plan"``: in the order of the plan; ``"any"``: the touched feature is recognised."""
    paused: bool = False
    """Touches are refused until the job is resumed."""
    target: Target | None = None
    """Place of the next point; None if unknown."""
    constructed: tuple[FeatureView, ...] = ()
    """Constructed features, in the order of the plan."""
    undo: str = ""
    redo: str = ""
    """`undo`, `redo`: Steps that these would undo and redo, in words; empty if none."""
    looked_at: str = ""
    """Feature under review; empty if none. It changes nothing else here."""
    simulated: bool = False
    """Partly from a virtual rig: every screen, page and file states it."""
    camera_doubts: tuple[str, ...] = ()
    """Unproven properties of its cameras, in sentences; every page and file states them."""
    noise: tuple[str, ...] = ()
    """Cameras whose spots scatter more than stated, in sentences; U is widened accordingly."""
    placed_part: PlacedPart | None = None
    """The nominal part by the CAD model of the plan; None without one."""
    planned: PlannedFeature | None = None
    """Nominals of the active feature while it has no fit."""
    room_doubt: str = ""
    """Why the ambient conditions invalidate the job by its plan; empty if they do not. Also in
    ``unproven``, unless a weightier reason is."""
    room: tuple[tuple[str, str], ...] = ()
    """Ambient readings: fields and sentences, as `environment_words`."""
    part_verdict: decisions.PartVerdict = field(init=False)
    """The verdict on the part. Like `verdict_of`, derived from ``features`` and ``characteristics``
    at construction, so that they agree."""
    _summaries: Mapping[str, decisions.VerdictSummary] = field(
        init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        resting: dict[str, list[decisions.CharacteristicResult]] = {}
        for result in self.characteristics:
            for name in dict.fromkeys(result.features):
                resting.setdefault(name, []).append(result)
        summaries = {name: decisions.summarise(results, name) for name, results in resting.items()}
        missing = [item.name for item in self.features if item.state is not FeatureState.DONE]
        part = decisions.judge_part(self.characteristics, missing, self.requirements)
        object.__setattr__(self, "_summaries", summaries)
        object.__setattr__(self, "part_verdict", part)

    def verdict_of(self, feature: str) -> decisions.VerdictSummary:
        return self._summaries.get(feature, decisions.NO_VERDICT)

    def deciding(self, feature: str) -> decisions.CharacteristicResult | None:
        return self.result(self.verdict_of(feature).deciding)

    def result(self, name: str) -> decisions.CharacteristicResult | None:
        return next((item for item in self.characteristics if item.name == name), None)

    @property
    def shown(self) -> FeatureView | None:
        """Return the feature that screens show: the one under review, else the active one.

        One just done stays until the next one has its first point, and one whose only point was
        deleted stays, so that it can be restored. At the end it is the one that decides over the
        part, unless CONFORM. None if no feature was touched and none is active.
        """
        named = {item.name: item for item in self.features}
        if self.looked_at in named:
            return named[self.looked_at]
        deciding = self.result(self.part_verdict.summary.deciding) if self.complete else None
        if deciding is not None and deciding.verdict is not decisions.Verdict.CONFORM:
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
        """Return whether screens show the verdict on the part: all done, no review."""
        return self.complete and not self.looked_at

    def feature(self, name: str) -> FeatureView:
        """Return a feature by name; KeyError if unknown."""
        for feature in self.features:
            if feature.name == name:
                return feature
        raise KeyError(name)
