"""All that a paper about the machine says, and the list of ISO/IEC 17025 that it is held to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from ocmm_core.calibration.records import ArtefactUse
from ocmm_core.export.report import NOT_STATED, Paper, PaperFact, one_line

Status = Literal["beforeAdjustment", "afterAdjustment"]

STATUS_WORDS: dict[Status, str] = {
    "beforeAdjustment": "as found",
    "afterAdjustment": "after adjustment",
}

K = 2.0
"""Coverage factor of every expanded uncertainty in the records."""

RELATES_ONLY = "The results relate only to the items named, as they were at the time of the test."
IN_HOUSE = (
    "Record of the user's own test. It is no certificate of an accredited laboratory, and names "
    "no accreditation."
)

SIMULATED_WORDS = "SIMULATED: the virtual rig was tested, no real machine."

CERTIFICATE_CLAUSES = (
    "7.8.2.1 a", "7.8.2.1 b", "7.8.2.1 c", "7.8.2.1 d", "7.8.2.1 e", "7.8.2.1 f", "7.8.2.1 g",
    "7.8.2.1 i", "7.8.2.1 j", "7.8.2.1 l", "7.8.2.1 m", "7.8.2.1 n", "7.8.2.1 o", "7.8.4.1 a",
    "7.8.4.1 b", "7.8.4.1 c", "7.8.4.1 d", "7.8.4.1 e",
)  # fmt: skip
"""What a calibration certificate is asked for. Left out: h (nothing is received: the machine is
calibrated where it stands), k and p as for reports, and opinions (7.8.4.1 f)."""


class Conformity(StrEnum):
    """How an error stands to its limit by ISO 14253-1, in the words of a DCC."""

    CONFORM = "pass"
    LEANING_IN = "conditionalPass"
    LEANING_OUT = "conditionalFail"
    NOT_CONFORM = "fail"

    @property
    def words(self) -> str:
        """Return it in the words of the product."""
        return {
            Conformity.CONFORM: "CONFORM",
            Conformity.LEANING_IN: "NOT PROVEN, leaning in",
            Conformity.LEANING_OUT: "NOT PROVEN, leaning out",
            Conformity.NOT_CONFORM: "NOT CONFORM",
        }[self]


@dataclass(frozen=True, slots=True)
class CertificateLine:
    """One error against its limit; mm.

    Attributes
    ----------
    name
        What was measured where.
    measured, reference
        Indicated and certified.
    expanded
        U (k = 2) of the error.
    limit
        Permissible error (MPE).
    stated
        By the rule of a procedure; None for that of ISO 14253-1.
    """

    name: str
    measured: float
    reference: float
    expanded: float
    limit: float
    stated: Conformity | None = None

    @property
    def error(self) -> float:
        """Return measured less certified."""
        return self.measured - self.reference

    @property
    def conformity(self) -> Conformity:
        """Return how the error stands to the limit: proven only with U inside or outside."""
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
    """One run of a test: as found, or after something was adjusted.

    Attributes
    ----------
    status
        Which of the two.
    made_utc, made_by
        When it ended, ISO 8601 text, and who did it.
    temperature_c
        Of the surroundings; None where nobody measured it.
    rule
        How it was judged, in words.
    lines
        All that count, also those that failed.
    passed
        The verdict of the record, by its rule.
    record, data_sha256
        Hashes of the record and of the observations behind it.
    notes
        What else must be known.
    stated
        The verdict in the words of a procedure, where it says more than ``passed``; may be empty.
    """

    status: Status
    made_utc: str
    made_by: str
    temperature_c: float | None
    rule: str
    lines: tuple[CertificateLine, ...]
    passed: bool
    record: str
    data_sha256: str
    notes: tuple[str, ...] = ()
    stated: Conformity | Literal["", "noPass"] = ""

    @property
    def word(self) -> str:
        """Return the verdict in the words of a DCC."""
        return str(self.stated) or ("pass" if self.passed else "fail")

    @property
    def words(self) -> str:
        """Return the verdict for people."""
        if self.stated == "noPass":
            return "VOID: it shows nothing"
        if isinstance(self.stated, Conformity):
            return self.stated.words
        return "passed" if self.passed else "NOT passed"


@dataclass(frozen=True, slots=True)
class CertificateValue:
    r"""A value that is stated without a limit; ``expanded`` (k = 2) where it is known.

    ``unit`` is in the words of D-SI, such as ``\milli\metre``; ``\one`` for a bare number.
    """

    name: str
    value: float
    unit: str
    expanded: float | None = None


@dataclass(frozen=True, slots=True)
class Certificate:
    """A paper about the machine.

    Attributes
    ----------
    title
        In-house papers are called records or test reports; "calibration certificate" stands only
        where ``accreditation`` names one.
    number
        Of the paper, from the hash of its record.
    accreditation
        As the procedure names it; empty for none.
    item, identifications
        What was tested, with names and values of its serial numbers and hashes.
    method, norms
        In words, and by which guideline.
    software
        Version that made the record.
    runs
        As found first. Where nothing was adjusted, one.
    values
        Everything else that was found.
    artefacts
        What traceability rests on.
    volume
        Where it holds, in words.
    begin_utc, end_utc
        Of the test, ISO 8601 text.
    previous
        Hash of the record before; empty for the first one.
    paper
        Laboratory, customer, place.
    simulated
        No real machine was tested.
    """

    title: str
    number: str
    item: str
    identifications: tuple[tuple[str, str], ...]
    method: str
    norms: tuple[str, ...]
    software: str
    runs: tuple[CertificateRun, ...]
    values: tuple[CertificateValue, ...]
    artefacts: tuple[ArtefactUse, ...]
    volume: str
    begin_utc: str
    end_utc: str
    previous: str
    paper: Paper
    accreditation: str = ""
    simulated: bool = False

    @property
    def passed(self) -> bool:
        """Return the verdict of the last run."""
        return bool(self.runs) and self.runs[-1].passed


def certificate_facts(paper: Certificate) -> tuple[PaperFact, ...]:
    """Return the head of a paper in its order; `NOT_STATED` where nobody knows."""
    return tuple(
        PaperFact("laboratory", clause, name, one_line(value) or NOT_STATED)
        for clause, name, value in _facts(paper)
    )


def open_certificate_clauses(paper: Certificate) -> tuple[str, ...]:
    """Return the clauses of which a paper states nothing, in their order."""
    said = {fact.clause for fact in certificate_facts(paper) if fact.stated}
    return tuple(clause for clause in CERTIFICATE_CLAUSES if clause not in said)


def conformity_words(paper: Certificate) -> str:
    """Return the statement of conformity, with its rule."""
    if not paper.runs:
        return ""
    last = paper.runs[-1]
    words = last.words[:1].upper() + last.words[1:]
    return f"{words}, by its rule: {last.rule}. {_each_error(last)}"


def _each_error(run: CertificateRun) -> str:
    if any(line.stated is not None for line in run.lines):
        return "Each error: by the same rule."
    return "Each error: ISO 14253-1, proven beyond U (k = 2)."


def _facts(paper: Certificate) -> Iterator[tuple[str, str, str]]:
    house, given = paper.paper.template.laboratory, paper.paper.given
    machine = paper.paper.template.machine
    yield "7.8.2.1 a", "Title", paper.title
    yield "7.8.2.1 b", "Laboratory", ", ".join((house.name, *house.address)) if house.name else ""
    if paper.accreditation:
        yield "", "Accreditation", paper.accreditation
    yield "7.8.2.1 d", "Number", paper.number
    yield "7.8.2.1 e", "Customer", given.customer or house.name
    yield "7.8.2.1 c", "Place", given.place or paper.paper.template.place
    yield "7.8.2.1 g", "Item", ", ".join((paper.item, *_identified(paper)))
    yield "", "Machine", ", ".join(part for part in (machine.name, machine.serial) if part)
    yield "7.8.2.1 f", "Method", "; ".join((paper.method, *paper.norms))
    begin, end = paper.begin_utc[:10], paper.end_utc[:10]
    yield "7.8.2.1 i", "Tested", begin if begin == end else f"{begin} to {end}"
    yield "7.8.2.1 j", "Issued", "dated beside the signature"
    yield "7.8.4.1 b", "Environment", _environment(paper)
    yield "7.8.4.1 c", "Traceability", " ".join(_traceability(paper))
    yield "7.8.4.1 d", "Condition", _condition(paper)
    yield "7.8.4.1 a", "Uncertainty", "U, expanded, k = 2 (about 95 %), with every result."
    yield "7.8.4.1 e", "Conformity", conformity_words(paper)
    yield "7.8.2.1 m", "Units, volume", f"Lengths in mm. {paper.volume}"
    simulated = [SIMULATED_WORDS] if paper.simulated else []
    notes = [*simulated, *given.deviations, *(note for run in paper.runs for note in run.notes)]
    yield "7.8.2.1 n", "Deviations", " ".join(notes) or "None noted in the record, none stated."
    yield "", "Software", f"OCMM {paper.software}"
    yield "7.8.2.1 o", "Signed by", "; ".join(paper.paper.template.signatures)
    yield "7.8.2.1 l", "Statement", RELATES_ONLY
    if not paper.accreditation:
        yield "", "Statement", IN_HOUSE


def _identified(paper: Certificate) -> Iterator[str]:
    for name, value in paper.identifications:
        yield f"{name} {value}"


def _environment(paper: Certificate) -> str:
    told = [
        f"{STATUS_WORDS[run.status]}: {run.temperature_c:.1f} °C"
        for run in paper.runs
        if run.temperature_c is not None
    ]
    return "; ".join(told)


def _traceability(paper: Certificate) -> Iterator[str]:
    for use in paper.artefacts:
        due = f", due {use.due_utc[:10]}" if use.due_utc else ""
        yield f"{use.name} no. {use.serial}: certificate {use.certificate or NOT_STATED}{due}."


def _condition(paper: Certificate) -> str:
    if not paper.runs:
        return ""
    if len(paper.runs) == 1 and paper.runs[0].status == "beforeAdjustment":
        return "As found; nothing was adjusted."
    if len(paper.runs) == 1:
        return "After adjustment; no test as found was made."
    return "As found and after adjustment, both below."
