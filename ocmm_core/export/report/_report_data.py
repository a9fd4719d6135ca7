"""Everything that a report can say about a job, frozen: what every exporter gets."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ocmm_core.alignment import nominal_frame
from ocmm_core.build import build_version
from ocmm_core.errors import OcmmError
from ocmm_core.export.report._names import check_file_stem, last_moment
from ocmm_core.export.template import Paper, plain_paper
from ocmm_core.features.shapes import Fit, NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.inspection.causes import Explanation, explanations
from ocmm_core.inspection.evaluation import FeatureView, JobView, job_states, surface_covariances
from ocmm_core.inspection.finished import ReopenedJob
from ocmm_core.inspection.plan import Plan, release_in_job
from ocmm_core.measuring import Climate, MeasuredPoint
from ocmm_core.named_file import FileIdentity
from ocmm_core.seals import NO_RELEASE, ReleaseState
from ocmm_core.storage import JobHead, JobSeal
from ocmm_core.tolerances.decisions import CharacteristicResult, PartVerdict, rule_id, rule_words
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic


@dataclass(frozen=True, slots=True)
class Element:
    """A nominal or actual element as reported; None for what its shape lacks."""

    point: Float
    """(3,), mm: centre or point on the element."""
    direction: Float | None
    across: Float | None = None
    """`direction`, `across`: (3,), unit: normal or axis, and the direction of the length."""
    diameter: float | None = None
    """mm: of a cone square to its axis at ``point``; of the centre line of a torus."""
    length: float | None = None
    width: float | None = None
    """`length`, `width`: mm: of slot, rectangle and ellipse, over all; the width of a torus is that
    of its tube. Of other shapes the nominal length along the axis, if in the plan."""
    angle_deg: float | None = None
    """Full apex angle of a cone."""


def element_of_nominal(nominal: NominalFeature, frame: RigidTransform) -> Element:
    """Return a nominal in another frame, without properties that the shape lacks."""
    shape = nominal.shape
    across = unit(np.array(nominal.across)) if shape.spec.has_across else None
    return Element(
        point=frame.apply(np.array(nominal.point, dtype=np.float64)),
        # A sphere has no direction, regardless of the plan's default.
        direction=(
            frame.rotation @ unit(np.array(nominal.direction))
            if shape.spec.planned_direction
            else None
        ),
        across=None if across is None else frame.rotation @ across,
        diameter=nominal.diameter or None,
        length=nominal.length or None,
        width=nominal.width or None,
        angle_deg=nominal.angle_deg or None,
    )


def element_of_fit(fit: Fit, frame: RigidTransform) -> Element:
    """Return a fit (world frame) in another frame, with full sizes instead of half ones."""
    sizes = {size.field: size.whole(fit.geometry) or None for size in fit.shape.spec.sizes}
    return Element(
        point=frame.apply(fit.point),
        direction=frame.rotation @ fit.direction if fit.direction.any() else None,
        across=frame.rotation @ fit.across if fit.across.any() else None,
        diameter=sizes.get("diameter"),
        length=sizes.get("length"),
        width=sizes.get("width"),
        angle_deg=sizes.get("angle_deg"),
    )


_SHORT = 12
"""Digits of a hash in tables; the note has the whole hash."""

_HASH = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True, slots=True)
class Instrument:
    """State of the cameras, probe or reference body."""

    label: str
    """State, name and shortened hash: pure ASCII without commas, for tables."""
    note: str = ""
    """As stored in the job file, with complete hashes; may be empty."""


@dataclass(frozen=True, slots=True)
class ReportedFeature:
    seen: FeatureView
    """Shape, points as reported, fit in the world frame, verdict, note."""
    nominal: NominalFeature | None
    """None for a construction without a nominal."""
    nominal_element: Element | None
    """In the part frame; None without ``nominal``, or if the datums do not define that frame."""
    actual_element: Element | None
    """As measured, in the frame of the report; None without a fit."""

    @property
    def name(self) -> str:
        return self.seen.name

    @property
    def shape(self) -> Shape:
        return self.seen.shape


@dataclass(frozen=True, slots=True)
class ReportedResult:
    """A result with the characteristic of the plan."""

    result: CharacteristicResult
    asked: Characteristic | None
    """None if the plan does not contain it."""

    @property
    def unit(self) -> Literal["mm", "deg"]:
        return self.result.unit if self.asked is None else spec_of(self.asked.kind).unit

    @property
    def one_sided(self) -> bool:
        """Return whether only the upper limit counts."""
        return self.asked is not None and spec_of(self.asked.kind).one_sided

    @property
    def datums(self) -> tuple[str, ...]:
        return () if self.asked is None else tuple(self.asked.datums)

    @property
    def association(self) -> str:
        """Return how the elements were associated with their points."""
        asked = "" if self.asked is None else self.asked.association
        return self.result.association or asked


@dataclass(frozen=True, slots=True)
class ReportData:
    """One job, ready to be reported; lengths in mm, angles in degrees."""

    view: JobView
    """Features, results, points held back and reasons for unproven verdicts."""
    head: JobHead
    plan: Plan
    T_part_from_world: RigidTransform | None
    """Alignment; without it (None) measured values are in the world frame."""
    features: tuple[ReportedFeature, ...]
    """In the order of the plan, then constructions."""
    calibration: Instrument
    probe: Instrument
    reference: Instrument
    """`calibration`, `probe`, `reference`: states, hashes; no label without a reference body."""
    climate: Climate
    observations: tuple[MeasuredPoint, ...] = ()
    """Points as stored, without compensation; may be empty."""
    annulled: tuple[int, ...] = ()
    """Numbers of the undone points."""
    taken_utc: dict[int, str] = field(default_factory=dict)
    """ISO 8601 text by number of the point."""
    notes: tuple[str, ...] = ()
    """Sentences about suspect parts of the file."""
    taken_back: tuple[tuple[MeasuredPoint, str], ...] = ()
    """Undone points as stored, with reasons; may be empty."""
    explanations: tuple[Explanation, ...] = ()
    """Reasons and remedies for NOT CONFORM and NOT PROVEN results, in the order of the plan."""
    written_by: str = field(default_factory=build_version)
    """Version of the reporting program; ``head`` has that of the measuring program."""
    seal: JobSeal | None = None
    """Number of signed steps, and signer; None if unknown."""
    release: ReleaseState = NO_RELEASE
    """Release of the plan, copied into the job at its start."""
    identity: FileIdentity | None = None
    """The job file that was read; None while a job is measured."""
    paper: Paper = field(default_factory=plain_paper)
    """Letterhead, and facts that are not in the job file; set with ``dataclasses.replace``."""
    covariances: Mapping[int, Float] = field(default_factory=dict)
    """(3, 3), mm^2, world: of compensated surface points by number; none of a specimen."""

    @property
    def job(self) -> str:
        return self.view.job

    @property
    def results(self) -> tuple[CharacteristicResult, ...]:
        return self.view.characteristics

    @property
    def reported(self) -> tuple[ReportedResult, ...]:
        asked = {item.name: item for item in self.plan.characteristics}
        return tuple(ReportedResult(result, asked.get(result.name)) for result in self.results)

    def explanation(self, characteristic: str) -> Explanation | None:
        """Return why a result is not CONFORM; None if it is."""
        named = (item for item in self.explanations if item.characteristic == characteristic)
        return next(named, None)

    @property
    def frame(self) -> RigidTransform:
        """Return the motion from the world to the frame in which the report gives everything."""
        return self.T_part_from_world or RigidTransform.identity()

    @property
    def system(self) -> Literal["Part", "World"]:
        return "World" if self.T_part_from_world is None else "Part"

    @property
    def part(self) -> PartVerdict:
        return self.view.part_verdict

    @property
    def last_taken_utc(self) -> str:
        """Return the UTC of the last point, empty without points; StorageError if invalid."""
        if not self.taken_utc:
            return ""
        latest = max(self.taken_utc.values(), key=lambda text: last_moment(text, ()))
        # A time in UTC keeps its digits.
        return latest if latest.endswith("+00:00") else last_moment(latest, ()).isoformat()

    @property
    def states(self) -> tuple[str, ...]:
        """Return the states to show on every page, sheet and file.

        SIMULATED, CAMERAS UNPROVEN, INCOMPLETE and PARTIAL PLAN (`job_states`), PLAN NOT RELEASED
        if a release does not fit the plan, and IN DOUBT if the file is suspect, else UNCALIBRATED.
        """
        void = self.release.release is not None and not self.release.released
        states = (*job_states(self.view), *(("PLAN NOT RELEASED",) if void else ()))
        if self.notes:
            return (*states, "IN DOUBT")
        # Reasons of the room are not reasons of the calibration.
        uncalibrated = self.view.unproven not in ("", self.view.room_doubt)
        return (*states, *(("UNCALIBRATED",) if uncalibrated else ()))

    @property
    def state_words(self) -> str:
        """Return the states in one line; may be empty."""
        return ", ".join(self.states)

    @property
    def stem(self) -> str:
        """Return the stem of file names: job name and states; StorageError if invalid for files."""
        name = check_file_stem(self.job)
        return "_".join((name, *(state.replace(" ", "_") for state in self.states)))

    @property
    def rule_words(self) -> str:
        return rule_words(rule_id(self.plan.rule))


def reported_features(
    view: JobView, plan: Plan, T_part_from_world: RigidTransform | None
) -> tuple[ReportedFeature, ...]:
    """Return features and constructions with their elements in the frame of the report."""
    frame = T_part_from_world or RigidTransform.identity()
    T_part_from_nominal = _part_from_nominal(plan)
    nominals = {nominal.name: nominal for nominal in plan.features}
    features = []
    for seen in (*view.features, *view.constructed):
        nominal = nominals.get(seen.name)
        features.append(
            ReportedFeature(
                seen=seen,
                nominal=nominal,
                nominal_element=(
                    None
                    if nominal is None or T_part_from_nominal is None
                    else element_of_nominal(nominal, T_part_from_nominal)
                ),
                actual_element=None if seen.fit is None else element_of_fit(seen.fit, frame),
            )
        )
    return tuple(features)


def _part_from_nominal(plan: Plan) -> RigidTransform | None:
    """Return the motion from the frame of the nominals (drawing, model) to the part, or None."""
    bound = plan.bound_alignment
    if bound is None:
        return RigidTransform.identity()
    try:
        return nominal_frame(bound)
    except OcmmError:
        return None


def report_of_job(job: ReopenedJob) -> ReportData:
    last = {event.kind: event.text for event in job.events}
    calibration = last.get("calibration", "NONE")
    probe = last.get("probe", f"NONE {job.body.name}:")
    measured = job.points, job.sensitivities, job.rig, job.body, job.options
    body = job.options.reference
    reference = (
        Instrument("") if body is None else Instrument(body.label, f"{body.name} {body.identity}")
    )
    return ReportData(
        job.view, job.head, job.plan, job.T_part_from_world,
        reported_features(job.view, job.plan, job.T_part_from_world),
        calibration=_instrument(calibration, uncalibrated="uncalibrated" in last),
        probe=_instrument(probe, uncalibrated="uncalibrated" in last), reference=reference,
        climate=job.climate, observations=job.points, annulled=job.annulled,
        taken_utc=job.taken_utc, notes=job.doubts, taken_back=job.taken_back, seal=job.seal,
        release=release_in_job(job.head, job.events), identity=job.identity,
        explanations=explanations(job.plan, job.view, *measured),
        covariances=surface_covariances(job.plan, *measured),
    )  # fmt: skip


def _instrument(note: str, *, uncalibrated: bool) -> Instrument:
    """Return cameras or probe from the text that the job file keeps of them."""
    short = _HASH.sub(lambda found: found.group()[:_SHORT], note, count=1)
    # Further hashes of dependent records are in the note.
    short = re.sub(r" (calibration|qualification) [0-9a-f]{64}", "", short)
    short = re.sub(r"due (\d{4}-\d\d-\d\d)T\S*", r"due \1", short)
    word, _, rest = short.partition(" ")
    word = "UNCALIBRATED" if uncalibrated else word
    rest = rest.replace(", tip ", "/").replace(":", "", 1).replace(",", " ")
    plain = "".join(sign if sign.isascii() and sign.isprintable() else "?" for sign in rest)
    return Instrument(f"{word} {plain}".strip(), note)
