"""Required statements of a test report (ISO/IEC 17025:2017, 7.8.2 and 7.8.3).

Each names its clause; unknown facts are `NOT_STATED`, none is guessed or omitted.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import msgspec

from ocmm_core.export.report._names import one_line
from ocmm_core.export.report._report_data import ReportData
from ocmm_core.export.template import RELATES_ONLY, WHOLE_ONLY, PaperLengths, ambient_conditions
from ocmm_core.inspection.evaluation import SIMULATED_LINE
from ocmm_core.tolerances.decisions import U_WORDS

_MM = PaperLengths()

NOT_STATED = "not stated"

Group = Literal["laboratory", "customer", "item", "measurement", "instrument", "statements"]

_HEAD_DIGITS = 16
_NUMBER_DIGITS = 8


@dataclass(frozen=True, slots=True)
class PaperFact:
    """One line of the head of a report."""

    group: Group
    clause: str
    """Clause of ISO/IEC 17025 that requires it; may be empty."""
    name: str
    value: str
    """`name`, `value`: Printed texts; ``value`` is `NOT_STATED` if unknown."""

    @property
    def stated(self) -> bool:
        return self.value != NOT_STATED


def report_number(data: ReportData) -> str:
    """Return the unique number of the report.

    Given by the user, or made from job, identity and end of its chain: equal for reports of the
    same state of a job, different for others.
    """
    given = one_line(data.paper.given.number)
    if given:
        return given
    steps = "" if data.seal is None else f"-{data.seal.steps}"
    return f"{data.job}-{data.head.job_uuid[:_NUMBER_DIGITS]}{steps}"


def paper_facts(data: ReportData, lengths: PaperLengths = _MM) -> tuple[PaperFact, ...]:
    """Return the head of a report in printed order, with lengths in a unit."""
    return tuple(
        PaperFact(group, clause, name, one_line(value) or NOT_STATED)
        for group, clause, name, value in _facts(data, lengths)
    )


def _facts(data: ReportData, lengths: PaperLengths) -> Iterator[tuple[Group, str, str, str]]:
    paper, given, head = data.paper.template, data.paper.given, data.head
    house = paper.laboratory
    yield "laboratory", "7.8.2.1 a", "Title", paper.title
    yield "laboratory", "7.8.2.1 b", "Laboratory", _joined(house.name, *house.address)
    yield "laboratory", "", "Contact", house.contact
    if house.accreditation:
        yield "laboratory", "", "Accreditation", house.accreditation
    yield "laboratory", "7.8.2.1 d", "Report number", report_number(data)
    yield "laboratory", "7.8.2.1 j", "Issued", "dated beside the authorising signature"
    if data.paper.label:
        yield "laboratory", "", "Template", data.paper.label
    yield "customer", "7.8.2.1 e", "Customer", _joined(given.customer, given.customer_address)
    yield "customer", "", "Order", given.order or data.view.header.order
    yield "item", "7.8.2.1 g", "Part", head.part
    yield "item", "7.8.2.1 g", "Serial number", head.serial
    yield "item", "", "Batch", data.view.header.batch
    yield "item", "", "Drawing", given.drawing
    yield "item", "", "Revision", given.revision
    yield "item", "7.8.2.1 h", "Received, condition", given.received
    yield "measurement", "7.8.2.1 f", "Method", _method(data)
    yield "measurement", "", "Plan release", data.release.summary
    yield "measurement", "7.8.2.1 c", "Place", given.place or paper.place
    yield "measurement", "7.8.2.1 i", "Begin (UTC)", _moment(head.created_utc)
    yield "measurement", "7.8.2.1 i", "End (UTC)", _moment(data.last_taken_utc)
    yield "measurement", "", "Operator", head.operator
    yield "measurement", "7.8.3.1 a", "Environment", environment(data)
    yield "measurement", "7.8.2.1 n", "Deviations from the plan", " ".join(plan_deviations(data))
    yield "measurement", "7.8.2.1 m", "Units, frame", frame_words(data, lengths)
    yield "measurement", "7.8.3.1 c", "Uncertainty", f"{U_WORDS}."
    yield "measurement", "7.8.3.1 b", "Decision rule", data.rule_words
    yield "instrument", "", "Machine", _machine(data)
    yield "instrument", "", "Cameras", _cameras(data)
    yield "instrument", "", "Calibration", data.calibration.label
    yield "instrument", "", "Probe and tip", data.probe.label
    if data.reference.label:
        yield "instrument", "", "Reference body", data.reference.label
    yield "instrument", "", "Certificates", " ".join(_certificates(data))
    yield "instrument", "", "Head of the job", _head(data)
    yield "statements", "7.8.2.1 l", "Statement", RELATES_ONLY
    yield "statements", "", "Statement", WHOLE_ONLY
    yield (
        "statements", "7.8.2.2", "Statement",
        "Customer, order, drawing, part, batch and serial number are as they were given to the "
        "laboratory.",
    )  # fmt: skip
    for text in (*paper.statements, *given.remarks):
        yield "statements", "", "Statement", text
    yield "statements", "7.8.2.1 o", "Signed by", "; ".join(paper.signatures)


def statements(data: ReportData) -> tuple[str, ...]:
    """Return the sentences above the signatures."""
    return tuple(fact.value for fact in paper_facts(data) if fact.name == "Statement")


def environment(data: ReportData) -> str:
    """Return the ambient readings, then temperatures of the results with compensations."""
    climate, room = data.climate, _room(data)
    told = [
        f"{name} {now.celsius:.2f} °C, u = {now.sigma_k:.2f} K ({now.origin})."
        for name, now in (("Probe", climate.probe.now), ("Part", climate.part.now))
        if now is not None
    ]
    if not told:
        return " ".join(room)
    kept = "Results at 20 °C." if data.view.at_20_c else "Results as warm as the part was."
    return " ".join((*room, *told, kept))


def _room(data: ReportData) -> tuple[str, ...]:
    """Return the ambient readings of the job; those given with the report fill gaps only."""
    kept = {field for field, _ in data.view.room}
    return (*(told for _, told in data.view.room), *ambient_conditions(data.paper.given, kept))


def plan_deviations(data: ReportData) -> tuple[str, ...]:
    """Return the deviations of a job from its plan, in sentences; "none" is also a statement."""
    told = [*data.paper.given.deviations]
    if data.view.simulated:
        told.append(SIMULATED_LINE)
    told += (*data.view.camera_doubts, *data.view.noise)
    skipped = [item.name for item in data.features if item.seen.skipped]
    for names, words in (
        (skipped, "Skipped"),
        (data.part.missing, "Not measured"),
        ([str(number) for number in data.annulled], "Points taken back"),
        ([str(number) for number in data.view.held], "Points held back"),
    ):
        if names:
            told.append(f"{words}: {', '.join(names)}.")
    if data.view.unproven:
        told.append(data.view.unproven)
    if data.part.is_partial:
        told.append(f"{data.part.requirement_words}.")
    told += data.notes
    return tuple(told) or ("None shown by the job, none stated.",)


def frame_words(data: ReportData, lengths: PaperLengths = _MM) -> str:
    """Return the units, and the frame of all coordinates of the report."""
    datums = data.plan.alignment
    if data.system == "World":
        frame = "World frame of the cameras: the part is not aligned"
    elif datums is None:
        frame = "Part frame"
    else:
        frame = f"Part frame by the alignment of the plan ({data.plan.name})"
    return f"{lengths.sentence} {frame}. Nominals in the part frame."


def _method(data: ReportData) -> str:
    return (
        f"Optical coordinate measurement with a hand-held touch probe; plan {data.plan.name}, "
        f"SHA-256 {data.head.plan_identity[:_HEAD_DIGITS]}; OCMM {data.head.software_version}"
    )


def _machine(data: ReportData) -> str:
    machine = data.paper.template.machine
    serial = machine.serial and f"no. {machine.serial}"
    inventory = machine.inventory and f"inventory {machine.inventory}"
    return _joined(machine.name, serial, inventory)


class _Camera(msgspec.Struct):
    """A camera, of a rig document or a record."""

    name: str = ""
    serial: int | str = ""


class _Certificate(msgspec.Struct):
    name: str = ""
    serial: str = ""
    certificate: str = ""
    due_utc: str = ""


class _Instruments(msgspec.Struct):
    """Items with serial numbers in a rig document or a record; the rest is ignored."""

    cameras: list[_Camera] = msgspec.field(default_factory=list)
    artefacts: list[_Certificate] = msgspec.field(default_factory=list)
    valid_until_utc: str = ""


def _instruments(text: str) -> _Instruments:
    try:
        found = msgspec.json.decode(text) if text.startswith("{") else tomllib.loads(text)
        return msgspec.convert(found, _Instruments)
    except (ValueError, msgspec.MsgspecError, RecursionError):
        # A report does not judge the documents of a job; `reopen_job` does.
        return _Instruments()


def _cameras(data: ReportData) -> str:
    found = _instruments(data.head.rig_text).cameras
    return ", ".join(f"{camera.name} {camera.serial}" for camera in found if camera.serial)


def _certificates(data: ReportData) -> Iterator[str]:
    for text, what in ((data.head.rig_text, "cameras"), (data.head.probe_text, "probe")):
        found = _instruments(text)
        for use in found.artefacts:
            due = f", due {use.due_utc[:10]}" if use.due_utc else ""
            number = f" no. {use.serial}" if use.serial else ""
            yield f"{use.name}{number}: {use.certificate or NOT_STATED}{due} ({what})."
        if found.valid_until_utc:
            yield f"Calibration of the {what} valid until {found.valid_until_utc[:10]}."


def _head(data: ReportData) -> str:
    seal = data.seal
    return "" if seal is None else f"step {seal.steps}, {seal.head[:_HEAD_DIGITS]}"


def _moment(utc: str) -> str:
    return utc[:19].replace("T", " ")


def _joined(*parts: str) -> str:
    return ", ".join(part for part in parts if part)
