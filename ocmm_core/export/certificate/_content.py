"""Data of a certificate of the machine, its facts, and the clauses of ISO/IEC 17025 for them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Literal, TypeVar

from ocmm_core.acceptance import RoomAir
from ocmm_core.ambient import HUMIDITY, PRESSURE
from ocmm_core.calibration.records import PRACTICE, ArtefactUse, is_practice
from ocmm_core.export.report import NOT_STATED, PaperFact, one_line
from ocmm_core.export.template import Paper, PaperLengths, ambient_conditions
from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS
from ocmm_core.wording import Speech

T = TypeVar("T")
Status = Literal["beforeAdjustment", "afterAdjustment"]

STATUS_WORDS: dict[Status, str] = {
    "beforeAdjustment": "as found",
    "afterAdjustment": "after adjustment",
}

PRACTICE_WORDS = "PRACTICE: made with a virtual hand on the virtual rig; valid for nothing."
SIMULATED_WORDS = "SIMULATED: the virtual rig was tested, no real machine."

K = 2.0
"""Coverage factor of every expanded uncertainty in the records."""


class Conformity(StrEnum):
    """Conformity of an error by ISO 14253-1, in the words of a DCC."""

    CONFORM = "pass"
    LEANING_IN = "conditionalPass"
    LEANING_OUT = "conditionalFail"
    NOT_CONFORM = "fail"

    @property
    def summary(self) -> str:
        return {
            Conformity.CONFORM: "CONFORM",
            Conformity.LEANING_IN: "NOT PROVEN, leaning in",
            Conformity.LEANING_OUT: "NOT PROVEN, leaning out",
            Conformity.NOT_CONFORM: "NOT CONFORM",
        }[self]


@dataclass(frozen=True, slots=True)
class CertificateLine:
    """One error against its limit; mm."""

    name: str
    """Quantity and place."""
    measured: float
    reference: float
    """`measured`, `reference`: Indicated and certified."""
    expanded: float
    """U (k = 2) of the error."""
    limit: float
    """Permissible error (MPE)."""
    stated: Conformity | None = None
    """By the rule of a procedure; None for that of ISO 14253-1."""

    @property
    def error(self) -> float:
        return self.measured - self.reference

    @property
    def conformity(self) -> Conformity:
        """Return the conformity of the error: proven only with U inside or outside."""
        if self.stated is not None:
            return self.stated
        size = abs(self.error)
        if size + self.expanded <= self.limit:
            return Conformity.CONFORM
        if size - self.expanded > self.limit:
            return Conformity.NOT_CONFORM
        return Conformity.LEANING_IN if size <= self.limit else Conformity.LEANING_OUT


@dataclass(frozen=True, slots=True)
class CertificateRun:
    """One run of a test: as found, or after an adjustment."""

    status: Status
    made_utc: str
    made_by: str
    """`made_utc`, `made_by`: End, ISO 8601, and operator."""
    temperature_c: float | None
    """Ambient; None if not measured."""
    rule: str
    lines: tuple[CertificateLine, ...]
    """All that count, also failed ones."""
    passed: bool
    record: str
    data_sha256: str
    """`record`, `data_sha256`: Hashes of the record and of its observations."""
    notes: tuple[str, ...] = ()
    stated: Conformity | Literal["", "noPass"] = ""
    """Verdict in the words of a procedure, if more specific than ``passed``; may be empty."""
    air: RoomAir = field(default_factory=RoomAir)
    """Ambient humidity and pressure; empty if not read."""

    @property
    def word(self) -> str:
        """Return the verdict in the words of a DCC."""
        return str(self.stated) or ("pass" if self.passed else "fail")

    @property
    def summary(self) -> str:
        if self.stated == "noPass":
            return "VOID: it shows nothing"
        if isinstance(self.stated, Conformity):
            return self.stated.summary
        return "passed" if self.passed else "NOT passed"


@dataclass(frozen=True, slots=True)
class CertificateValue:
    r"""A value stated without a limit; ``expanded`` (k = 2) if known.

    ``unit`` is in the words of D-SI, such as ``\milli\metre``; ``\one`` for a plain number.
    """

    name: str
    value: float
    unit: str
    expanded: float | None = None


@dataclass(frozen=True, slots=True)
class Certificate:
    """Certificate of the machine; `values`, `values_before`: others, and before adjustment."""

    title: str
    """In-house: record or test report; "calibration certificate" requires an ``accreditation``."""
    number: str
    """From the hash of its record."""
    item: str
    identifications: tuple[tuple[str, str], ...]
    """`item`, `identifications`: names and values of serial numbers and hashes."""
    method: str
    norms: tuple[str, ...]
    """`method`, `norms`: In words, and by guideline."""
    software: str
    runs: tuple[CertificateRun, ...]
    """As found first. One if nothing was adjusted."""
    values: tuple[CertificateValue, ...]
    artefacts: tuple[ArtefactUse, ...]
    """Basis of traceability."""
    volume: str
    begin_utc: str
    end_utc: str
    """`begin_utc`, `end_utc`: Of the test, ISO 8601."""
    previous: str
    """Hash of the previous record; empty for the first one."""
    paper: Paper
    """Laboratory, customer, place."""
    accreditation: str = ""
    """As named in the procedure; may be empty."""
    simulated: bool = False
    camera_doubts: tuple[str, ...] = ()
    """Unproven properties of cameras, in sentences; the certificate states CAMERAS UNPROVEN."""
    values_before: tuple[CertificateValue, ...] = ()
    climate: tuple[tuple[str, float], ...] = ()
    """Further temperatures by object, degrees Celsius."""
    not_found: str = ""
    not_after: str = ""
    """`not_found`, `not_after`: why the state before or after adjustment is unknown, or ""."""

    @property
    def states(self) -> tuple[str, ...]:
        """Return the limitations of the certificate, a sentence each."""
        practised = self.title.startswith(PRACTICE)
        unproven = (f"{UNPROVEN_CAMERAS}: {' '.join(self.camera_doubts)}",)
        return (
            *((PRACTICE_WORDS if practised else SIMULATED_WORDS,) if self.simulated else ()),
            *(unproven if self.camera_doubts else ()),
        )

    @property
    def final(self) -> CertificateRun | None:
        """Return the run of the item's current state; None if there is none."""
        return self.runs[-1] if self.runs and not self.not_after else None

    @property
    def passed(self) -> bool:
        """Return the verdict on the item's current state."""
        return self.final is not None and self.final.passed


def marked(paper: Certificate, *made_by: str) -> Certificate:
    """Return a certificate with PRACTICE in its title if one of its records was practice."""
    if not any(map(is_practice, made_by)):
        return paper
    return replace(paper, title=f"{PRACTICE}: {paper.title}", simulated=True)


def once(items: Sequence[T]) -> tuple[T, ...]:
    """Return distinct artefacts or sentences in order."""
    return tuple(dict.fromkeys(items))


_ENGLISH, _MM = Speech(), PaperLengths()

RELATES_ONLY = "The results relate only to the items named, as they were at the time of the test."
IN_HOUSE = (
    "Record of the user's own test. It is no certificate of an accredited laboratory, and names "
    "no accreditation."
)


def certificate_facts(
    paper: Certificate, speech: Speech = _ENGLISH, lengths: PaperLengths = _MM
) -> tuple[PaperFact, ...]:
    """Return the head of a certificate in order; `NOT_STATED` if unknown.

    Sentences are translated one by one. `speech`: language of values; names are not translated.
    """
    return tuple(
        PaperFact("laboratory", clause, name, one_line(value) or NOT_STATED)
        for clause, name, value in _facts(paper, speech, lengths)
    )


def certificate_title(paper: Certificate, speech: Speech = _ENGLISH) -> str:
    """Return the translated title; a laboratory's own title stays."""
    whole = speech.text(paper.title)
    if whole != paper.title:
        return whole
    return ": ".join(map(speech.text, paper.title.split(": ")))


def rule_said(rule: str, speech: Speech) -> str:
    """Return the guideline and decision rule of a judgement, translated."""
    head, mark, name = rule.rpartition(", rule ")
    if not mark:
        return speech.text(rule)
    return f"{speech.text(head)}, {speech.text('decision rule')}: {speech.text(name)}"


def air_said(run: CertificateRun, speech: Speech = _ENGLISH) -> str:
    """Return temperature, humidity and pressure of a run; empty if not noted."""
    warm = () if run.temperature_c is None else (f"{run.temperature_c:.1f} °C",)
    return ", ".join((*map(speech.number, warm), *map(speech.text, run.air.lines)))


def conformity_words(paper: Certificate, speech: Speech = _ENGLISH) -> str:
    """Return the statement of conformity, with its rule."""
    last = paper.final
    if last is None:
        if not paper.not_after:
            return ""
        return f"{speech.text('No statement')}: {speech.text(paper.not_after)}"
    words = speech.text(last.summary)
    words = words[:1].upper() + words[1:]
    rule = rule_said(last.rule, speech)
    return f"{words}, {speech.text('by its rule')}: {rule}. {speech.text(_each_error(last))}"


def _each_error(run: CertificateRun) -> str:
    if any(line.stated is not None for line in run.lines):
        return "Each error: by the same rule."
    return "Each error: ISO 14253-1, proven beyond U (k = 2)."


def _facts(
    paper: Certificate, speech: Speech, lengths: PaperLengths
) -> Iterator[tuple[str, str, str]]:
    tr = speech.text
    house, given = paper.paper.template.laboratory, paper.paper.given
    machine = paper.paper.template.machine
    yield "7.8.2.1 a", "Title", certificate_title(paper, speech)
    yield "7.8.2.1 b", "Laboratory", ", ".join((house.name, *house.address)) if house.name else ""
    if paper.accreditation:
        yield "", "Accreditation", paper.accreditation
    yield "7.8.2.1 d", "Number", paper.number
    if paper.paper.label:
        yield "", "Template", paper.paper.label
    yield "7.8.2.1 e", "Customer", given.customer or house.name
    yield "7.8.2.1 c", "Place", given.place or paper.paper.template.place
    yield "7.8.2.1 g", "Item", ", ".join((tr(paper.item), *_identified(paper, speech)))
    yield "", "Machine", ", ".join(part for part in (machine.name, machine.serial) if part)
    yield "7.8.2.1 f", "Method", "; ".join(map(tr, (paper.method, *paper.norms)))
    begin, end = paper.begin_utc[:10], paper.end_utc[:10]
    yield "7.8.2.1 i", "Tested", begin if begin == end else tr(f"{begin} to {end}")
    yield "7.8.2.1 j", "Issued", tr("dated beside the signature")
    yield "7.8.4.1 b", "Environment", _environment(paper, speech)
    yield "7.8.4.1 c", "Traceability", " ".join(map(tr, _traceability(paper)))
    yield "7.8.4.1 d", "Condition", _condition(paper, speech)
    yield "7.8.4.1 a", "Uncertainty", tr("U, expanded, k = 2 (about 95 %), with every result.")
    yield "7.8.4.1 e", "Conformity", conformity_words(paper, speech)
    yield "7.8.2.1 m", "Units, volume", f"{tr(_units(lengths))} {tr(paper.volume)}"
    notes = [*paper.states, *given.deviations, *(note for run in paper.runs for note in run.notes)]
    # A deviation of both runs is stated once.
    notes = list(map(tr, dict.fromkeys(notes)))
    none = tr("None noted in the record, none stated.")
    yield "7.8.2.1 n", "Deviations", " ".join(notes) or none
    yield "", "Software", f"OCMM {paper.software}"
    yield "7.8.2.1 o", "Signed by", "; ".join(map(tr, paper.paper.template.signatures))
    yield "7.8.2.1 l", "Statement", tr(RELATES_ONLY)
    if not paper.accreditation:
        yield "", "Statement", tr(IN_HOUSE)


def _units(lengths: PaperLengths) -> str:
    if lengths.unit == "inch":
        return "Lengths of tables and plots in inch (1 in = 25.4 mm), in sentences in mm."
    return "Lengths in mm."


def _identified(paper: Certificate, speech: Speech) -> Iterator[str]:
    for name, value in paper.identifications:
        yield f"{speech.text(name)} {value}"


def _environment(paper: Certificate, speech: Speech) -> str:
    states = [
        f"{speech.text(name)}: {speech.number(f'{celsius:.1f} °C')}"
        for name, celsius in paper.climate
    ]
    states += [
        f"{speech.text(STATUS_WORDS[run.status])}: {air}"
        for run in paper.runs
        if (air := air_said(run, speech))
    ]
    # Data of a record come first; those of the requester fill gaps only.
    airs = [run.air for run in paper.runs]
    known = {HUMIDITY.field for air in airs if air.humidity_percent is not None}
    known |= {PRESSURE.field for air in airs if air.pressure_hpa is not None}
    states += [
        speech.text(sentence).removesuffix(".")
        for sentence in ambient_conditions(paper.paper.given, known)
    ]
    return "; ".join(states)


def _traceability(paper: Certificate) -> Iterator[str]:
    for use in paper.artefacts:
        due = f", due {use.due_utc[:10]}" if use.due_utc else ""
        yield f"{use.name} no. {use.serial}: certificate {use.certificate or NOT_STATED}{due}."


def _condition(paper: Certificate, speech: Speech) -> str:
    """Return both states in words, also if not determined."""
    tr = speech.text
    if not paper.runs and not (paper.not_found or paper.not_after):
        return ""
    states = [run.status for run in paper.runs]
    if states == ["beforeAdjustment"] and not paper.not_after:
        return tr("As found; nothing was adjusted.")
    if len(states) == 2 and not paper.not_after:
        return tr("As found and after adjustment, both below.")

    def state_text(status: str, why: str) -> str:
        return tr("below") if status in states else f"{tr('not determined')} ({tr(why)})"

    found = state_text("beforeAdjustment", paper.not_found or "no test as found was made")
    after = state_text("afterAdjustment", paper.not_after)
    return f"{tr('As found')}: {found}. {tr('After adjustment')}: {after}."
