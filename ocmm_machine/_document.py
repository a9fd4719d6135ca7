"""Document of a machine's corrections: which characteristic acts on which offset, and limits.

Facts of finished jobs are for corrections, with reasons why they prove nothing. The register has
every change of an offset, signed, chained and undoable. Each line states all values before and
after it, so that files of corrections have absolute values: loading one twice changes nothing more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta

from ocmm_core.calibration.records import CalibrationStatus
from ocmm_core.documents import Document, load_document
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.report import report_of_job
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import PARTIAL_PLAN, SIMULATED
from ocmm_core.inspection.finished import ReopenedJob, parts_of_batch, reopen_job, why_not_counted
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_core.tolerances.kinds import spec_of

SCHEMA = "ocmm.corrections/1"
SignedAxis = Literal["+X", "-X", "+Y", "-Y", "+Z", "-Z"]
Machine = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9_ -]{0,58}[A-Za-z0-9]$")]
Name = Annotated[str, Meta(pattern=r"^[!-~]([ -~]{0,58}[!-~])?$")]
Positive = Annotated[float, Meta(gt=0.0)]
Value = Annotated[float, Meta(gt=-1e5, lt=1e5)]
Share = Annotated[float, Meta(gt=0.0, le=1.0)]
Count = Annotated[int, Meta(ge=1, le=9999)]
_SIZE = ("radius", "turn-x")
_ACTS_ON = {"position": ("work", "length", "turn-z"), "outer": _SIZE, "inner": _SIZE}


def vector_of(axis: SignedAxis) -> Float:
    """Return the unit vector (3,) of a signed axis."""
    vector: Float = np.zeros(3)
    vector["XYZ".index(axis[1])] = 1.0 if axis[0] == "+" else -1.0
    return vector


class MachineFrame(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Axes of the machine, as directions of the part frame of the plan."""

    x: SignedAxis
    y: SignedAxis
    z: SignedAxis
    handedness: Literal["right", "left"]
    """Handedness of the machine's axes; stated again, so that one wrong sign is found."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """mm: zero of the work offset in the part frame; the centre of its rotation."""

    @property
    def R_machine_from_part(self) -> Float:
        """Return the axes as rows, (3, 3); a reflection if the machine is left-handed."""
        return np.array([vector_of(self.x), vector_of(self.y), vector_of(self.z)])


class ControlOffset(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One value in the control; mm, of a rotation degrees."""

    name: Name
    kind: Literal["work", "length", "radius", "turn-x", "turn-z"]
    number: Count
    """Number of the work offset (1 is G54) or tool."""
    axis: Literal["", "x", "y", "z", "c"] = ""
    """Axis of a work offset; ``"c"`` is its rotation from X towards Y of the machine."""
    register: Literal["wear", "geometry"] = "wear"
    """Register of a tool."""
    counts: Literal["radius", "diameter"] = "radius"
    """How the control counts ``radius`` or ``turn-x``; a machine parameter."""
    present: Value
    """In the control before the first correction."""
    dead_band: Positive
    step: Positive
    """`dead_band`, `step`: No smaller change is made, and no larger one at a time."""
    lowest: Value
    highest: Value
    """`lowest`, `highest`: Limits of the value in the control."""
    share: Share = 0.7
    """Share of the found change that is made."""

    @property
    def unit(self) -> Literal["mm", "deg"]:
        return "deg" if self.axis == "c" else "mm"


class Drive(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A characteristic, and all offsets that act on it."""

    characteristic: str
    offsets: Annotated[tuple[str, ...], Meta(min_length=1)]
    acts: Literal["position", "outer", "inner"]
    """A place or a distance; the size of a boss or shaft, of a bore or slot."""
    direction: Literal[SignedAxis, ""] = ""
    """In the part frame: the cut moves this way if the value of a position grows."""
    feature: str = ""
    """The cut feature; empty: the first one of the characteristic."""
    weight: Annotated[float, Meta(ge=0.0, le=1e6)] = 1.0
    """On the least squares, in addition to 1 / U²; 0 shows the effect only."""


class CorrectionDocument(Document, frozen=True, kw_only=True):
    """Offsets of a machine and the characteristics of one plan that correct them."""

    machine: Machine
    """Also the name of its register."""
    plan: str
    frame: MachineFrame
    offset: Annotated[tuple[ControlOffset, ...], Meta(min_length=1)]
    drive: Annotated[tuple[Drive, ...], Meta(min_length=1)]
    method: Literal["last", "mean", "trend"] = "last"
    """The last part; the mean of the last ``parts``; or their line, extended to the next part."""
    parts: Annotated[int, Meta(ge=1, le=1000)] = 1
    """Required number of parts since the last change."""
    dead_parts: Annotated[int, Meta(ge=0, le=1000)] = 0
    """Parts after a change that do not count: cut before the control had it."""
    resolution: Annotated[float, Meta(ge=1e-5, le=0.01)] = 0.001
    """Smallest step of the control; changes are rounded towards zero to it."""

    @property
    def named(self) -> dict[str, ControlOffset]:
        return {one.name: one for one in self.offset}


def load_corrections(path: Path | str) -> CorrectionDocument:
    """Return the document at ``path``; InputError if it contradicts itself."""
    document = load_document(path, CorrectionDocument, SCHEMA)
    for field, remedy in _faults(document):
        raise InputError("correction.field", f"{path}: field '{field}' is not usable.", remedy)
    return document


def _faults(document: CorrectionDocument) -> Iterator[tuple[str, str]]:
    """Yield the contradictory fields, each with its remedy."""
    if document.parts < {"last": 1, "mean": 2, "trend": 3}[document.method]:
        yield "parts", "Give at least 1 part for the last one, 2 for a mean, 3 for a trend."
    turned = float(np.linalg.det(document.frame.R_machine_from_part))
    if abs(turned) < 0.5:
        yield "frame", "Give three different axes of the part."
    if (turned > 0.0) != (document.frame.handedness == "right"):
        yield "frame.handedness", "The axes have the other one: check the sign of each axis."
    places = {(one.kind, one.axis, one.number, one.register) for one in document.offset}
    if not len(document.named) == len(document.offset) == len(places):
        yield "offset", "Name each offset once, and each value of the control."
    for one in document.offset:
        steps = one.present / document.resolution
        if (one.kind == "work") != bool(one.axis):
            yield f"{one.name}.axis", "Give it for work offsets only."
        if one.step <= one.dead_band:
            yield f"{one.name}.step", "Give more than the dead band."
        if not one.lowest <= one.present <= one.highest or abs(steps - round(steps)) > 1e-4:
            yield f"{one.name}.present", "Give steps of the resolution, from lowest to highest."
    if len({one.characteristic for one in document.drive}) < len(document.drive):
        yield "drive", "Name each characteristic once."
    for drive in document.drive:
        kinds = {
            document.named[name].kind if name in document.named else "" for name in drive.offsets
        }
        if not kinds <= set(_ACTS_ON[drive.acts]):
            yield f"{drive.characteristic}.offsets", "Name offsets of this document that act on it."
        if (drive.acts == "position") != bool(drive.direction):
            yield f"{drive.characteristic}.direction", "Give it for positions only."


_USABLE = (CalibrationStatus.VALID, CalibrationStatus.DUE)


@dataclass(frozen=True, slots=True)
class MeasuredValue:
    """A characteristic of a finished job."""

    result: CharacteristicResult
    axis: str
    """Axis of the part frame, from the plan; empty if none."""
    why: str = ""
    """Reason why its value does not count, as other results show."""

    @property
    def refusal(self) -> str:
        """Return why no correction rests on it, as a sentence; empty if one may."""
        result = self.result
        if self.why:
            return self.why
        if result.verdict not in (Verdict.CONFORM, Verdict.NOT_CONFORM):
            return f"The verdict on {result.name} is {result.verdict.value}."
        if result.stated is None or not np.isfinite(result.stated).all() or result.stated[2] <= 0.0:
            return f"{result.name} has no value with an uncertainty."
        if spec_of(result.kind).one_sided:
            return f"{result.name} is the width of a zone, which has no sign."
        return ""


@dataclass(frozen=True, slots=True)
class PartFacts:
    """A finished job."""

    job: str
    uuid: str
    serial: str
    plan: str
    created: datetime
    simulated: bool
    faults: tuple[str, ...]
    """Why it proves nothing, in sentences; empty for a whole, signed, calibrated job."""
    values: Mapping[str, MeasuredValue]
    """By name of the characteristic."""
    places: Mapping[str, Float]
    """Nominal points (3,) of the features, mm, part frame."""
    aligned: bool
    """Whether the part frame was measured."""


def facts_of(job: ReopenedJob) -> PartFacts:
    data = report_of_job(job)
    words = {one.label.partition(" ")[0] for one in (data.calibration, data.probe)}
    unusable = () if data.view.simulated else sorted(words - set(_USABLE))
    states = [one for one in data.states if one not in (PARTIAL_PLAN, SIMULATED)]
    asked = {one.name: one for one in data.plan.characteristics}
    faults = (
        *job.doubts,
        *(f"The job is {state}." for state in states),
        *(f"Its cameras or its probe were {word}." for word in unusable),
        *(() if data.view.complete else ("The job is not finished.",)),
    )
    return PartFacts(
        job=data.job, uuid=data.head.job_uuid, serial=data.head.serial, plan=data.plan.name,
        created=datetime.fromisoformat(data.head.created_utc), simulated=data.view.simulated,
        faults=faults,
        values={
            one.name: MeasuredValue(
                one, asked[one.name].axis if one.name in asked else "", why_not_counted(job, one)
            )
            for one in data.results
        },
        places={
            one.name: one.nominal_element.point
            for one in data.features
            if one.nominal_element is not None
        },
        aligned=data.T_part_from_world is not None,
    )  # fmt: skip


def read_parts(
    path: Path, since: datetime | None, probes: Path | None = None, calibrations: Path | None = None
) -> tuple[tuple[PartFacts, ...], tuple[str, ...]]:
    """Return a job after the earlier ones of its batch and plan, and sentences on unread ones.

    Jobs are read-only and recomputed; errors of the job itself as of `reopen_job`. ``since``: only
    later jobs are read; None reads the job alone.
    """
    last = reopen_job(path, probes, calibrations=calibrations)
    own, batch = facts_of(last), last.view.header.batch
    parts: list[PartFacts] = []
    unread: list[str] = []
    for one in parts_of_batch(path.parent, batch) if batch and since is not None else ():
        created, same = datetime.fromisoformat(one.created_utc), last.head.plan_identity
        if not (since or created) <= created < own.created or one.plan_identity != same:
            continue
        try:
            parts.append(facts_of(reopen_job(one.path, probes, calibrations=calibrations)))
        except OcmmError as error:
            unread.append(error.what)
    return (*parts, own), tuple(unread)


class CorrectionLine(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One change of a machine's offsets."""

    utc: str
    who: str
    software: str
    what: Literal["corrected", "undone", "stated"]
    """By a job; back to the values before; or read by a person from the control."""
    document: str
    """SHA-256 of the document of corrections."""
    before: dict[str, float]
    after: dict[str, float]
    """`before`, `after`: values of all offsets of the document, mm or degrees."""
    expanded: dict[str, float] = {}
    """U of the changes."""
    job: str = ""
    serial: str = ""
    jobs: tuple[str, ...] = ()
    serials: tuple[str, ...] = ()
    """`job`, `serial`: the source. `jobs`, `serials`: all parts used, by UUID and number."""
    characteristics: tuple[str, ...] = ()
    undoes: int = 0
    """Number of the line that is undone, from 1 on."""
    reason: str = ""

    @property
    def changed(self) -> list[str]:
        """Return the names of the changed offsets."""
        return [one for one, value in self.after.items() if value != self.before.get(one)]


def values_in_force(
    document: CorrectionDocument, lines: Sequence[CorrectionLine]
) -> dict[str, float]:
    """Return the values of all offsets after these lines."""
    values = {one.name: one.present for one in document.offset}
    for line in lines:
        values |= {name: value for name, value in line.after.items() if name in values}
    return values


def count_since(
    document: CorrectionDocument, parts: Sequence[PartFacts], lines: Sequence[CorrectionLine]
) -> Iterator[PartFacts]:
    """Yield the parts that were cut with the values in force now, oldest first."""
    times = [datetime.fromisoformat(line.utc) for line in lines]
    now = values_in_force(document, lines)
    seen: dict[int, int] = {}
    for part in parts:
        before = sum(time <= part.created for time in times)
        seen[before] = seen.get(before, 0) + 1
        dead = document.dead_parts if before else 0
        if seen[before] > dead and values_in_force(document, lines[:before]) == now:
            yield part
