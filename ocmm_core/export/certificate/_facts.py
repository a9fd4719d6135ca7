"""The facts of a paper about the machine, and the list of ISO/IEC 17025 that they are held to."""

from __future__ import annotations

from collections.abc import Iterator

from ocmm_core.export.certificate._content import STATUS_WORDS, Certificate, CertificateRun
from ocmm_core.export.report import NOT_STATED, PaperFact, one_line, surroundings

RELATES_ONLY = "The results relate only to the items named, as they were at the time of the test."
IN_HOUSE = (
    "Record of the user's own test. It is no certificate of an accredited laboratory, and names "
    "no accreditation."
)

CERTIFICATE_CLAUSES = (
    "7.8.2.1 a", "7.8.2.1 b", "7.8.2.1 c", "7.8.2.1 d", "7.8.2.1 e", "7.8.2.1 f", "7.8.2.1 g",
    "7.8.2.1 i", "7.8.2.1 j", "7.8.2.1 l", "7.8.2.1 m", "7.8.2.1 n", "7.8.2.1 o", "7.8.4.1 a",
    "7.8.4.1 b", "7.8.4.1 c", "7.8.4.1 d", "7.8.4.1 e",
)  # fmt: skip
"""What a calibration certificate is asked for. Left out: h (nothing is received: the machine is
calibrated where it stands), k and p as for reports, and opinions (7.8.4.1 f)."""


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
    last = paper.final
    if last is None:
        return f"No statement: {paper.not_after}" if paper.not_after else ""
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
    notes = [*paper.states, *given.deviations, *(note for run in paper.runs for note in run.notes)]
    # What both runs could not follow is one deviation.
    notes = list(dict.fromkeys(notes))
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
    told = [f"{name}: {celsius:.1f} °C" for name, celsius in paper.climate]
    for run in paper.runs:
        warm = () if run.temperature_c is None else (f"{run.temperature_c:.1f} °C",)
        if warm or run.air.words:
            told.append(f"{STATUS_WORDS[run.status]}: {', '.join((*warm, *run.air.words))}")
    told += [sentence.removesuffix(".") for sentence in surroundings(paper.paper.given)]
    return "; ".join(told)


def _traceability(paper: Certificate) -> Iterator[str]:
    for use in paper.artefacts:
        due = f", due {use.due_utc[:10]}" if use.due_utc else ""
        yield f"{use.name} no. {use.serial}: certificate {use.certificate or NOT_STATED}{due}."


def _condition(paper: Certificate) -> str:
    """Return both states in words; that one was not determined is a statement, too."""
    if not paper.runs and not (paper.not_found or paper.not_after):
        return ""
    states = [run.status for run in paper.runs]
    if states == ["beforeAdjustment"] and not paper.not_after:
        return "As found; nothing was adjusted."
    if len(states) == 2 and not paper.not_after:
        return "As found and after adjustment, both below."
    found = "below" if "beforeAdjustment" in states else f"not determined ({_why(paper)})"
    after = "below" if "afterAdjustment" in states else f"not determined ({paper.not_after})"
    return f"As found: {found}. After adjustment: {after}."


def _why(paper: Certificate) -> str:
    return paper.not_found or "no test as found was made"
