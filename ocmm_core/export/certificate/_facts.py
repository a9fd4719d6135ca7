"""Facts of a certificate, and the clauses of ISO/IEC 17025 that require them."""

from __future__ import annotations

from collections.abc import Iterator

from ocmm_core.export.certificate._content import STATUS_WORDS, Certificate, CertificateRun
from ocmm_core.export.report import NOT_STATED, PaperFact, one_line
from ocmm_core.export.template import PaperLengths, surroundings
from ocmm_core.surroundings import HUMIDITY, PRESSURE
from ocmm_core.wording import Speech

_ENGLISH, _MM = Speech(), PaperLengths()

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
"""Omitted: h (calibrated on site), k and p as for reports, and opinions (7.8.4.1 f)."""


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


def open_certificate_clauses(paper: Certificate) -> tuple[str, ...]:
    """Return the clauses without a statement, in order."""
    said = {fact.clause for fact in certificate_facts(paper) if fact.stated}
    return tuple(clause for clause in CERTIFICATE_CLAUSES if clause not in said)


def certificate_title(paper: Certificate, speech: Speech = _ENGLISH) -> str:
    """Return the translated title; a laboratory's own title stays."""
    whole = speech.say(paper.title)
    if whole != paper.title:
        return whole
    return ": ".join(map(speech.say, paper.title.split(": ")))


def rule_said(rule: str, speech: Speech) -> str:
    """Return the guideline and decision rule of a judgement, translated."""
    head, mark, name = rule.rpartition(", rule ")
    if not mark:
        return speech.say(rule)
    return f"{speech.say(head)}, {speech.say('decision rule')}: {speech.say(name)}"


def air_said(run: CertificateRun, speech: Speech = _ENGLISH) -> str:
    """Return temperature, humidity and pressure of a run; empty if not noted."""
    warm = () if run.temperature_c is None else (f"{run.temperature_c:.1f} °C",)
    return ", ".join((*map(speech.number, warm), *map(speech.say, run.air.words)))


def conformity_words(paper: Certificate, speech: Speech = _ENGLISH) -> str:
    """Return the statement of conformity, with its rule."""
    last = paper.final
    if last is None:
        if not paper.not_after:
            return ""
        return f"{speech.say('No statement')}: {speech.say(paper.not_after)}"
    words = speech.say(last.words)
    words = words[:1].upper() + words[1:]
    rule = rule_said(last.rule, speech)
    return f"{words}, {speech.say('by its rule')}: {rule}. {speech.say(_each_error(last))}"


def _each_error(run: CertificateRun) -> str:
    if any(line.stated is not None for line in run.lines):
        return "Each error: by the same rule."
    return "Each error: ISO 14253-1, proven beyond U (k = 2)."


def _facts(
    paper: Certificate, speech: Speech, lengths: PaperLengths
) -> Iterator[tuple[str, str, str]]:
    say = speech.say
    house, given = paper.paper.template.laboratory, paper.paper.given
    machine = paper.paper.template.machine
    yield "7.8.2.1 a", "Title", certificate_title(paper, speech)
    yield "7.8.2.1 b", "Laboratory", ", ".join((house.name, *house.address)) if house.name else ""
    if paper.accreditation:
        yield "", "Accreditation", paper.accreditation
    yield "7.8.2.1 d", "Number", paper.number
    if paper.paper.words:
        yield "", "Template", paper.paper.words
    yield "7.8.2.1 e", "Customer", given.customer or house.name
    yield "7.8.2.1 c", "Place", given.place or paper.paper.template.place
    yield "7.8.2.1 g", "Item", ", ".join((say(paper.item), *_identified(paper, speech)))
    yield "", "Machine", ", ".join(part for part in (machine.name, machine.serial) if part)
    yield "7.8.2.1 f", "Method", "; ".join(map(say, (paper.method, *paper.norms)))
    begin, end = paper.begin_utc[:10], paper.end_utc[:10]
    yield "7.8.2.1 i", "Tested", begin if begin == end else say(f"{begin} to {end}")
    yield "7.8.2.1 j", "Issued", say("dated beside the signature")
    yield "7.8.4.1 b", "Environment", _environment(paper, speech)
    yield "7.8.4.1 c", "Traceability", " ".join(map(say, _traceability(paper)))
    yield "7.8.4.1 d", "Condition", _condition(paper, speech)
    yield "7.8.4.1 a", "Uncertainty", say("U, expanded, k = 2 (about 95 %), with every result.")
    yield "7.8.4.1 e", "Conformity", conformity_words(paper, speech)
    yield "7.8.2.1 m", "Units, volume", f"{say(_units(lengths))} {say(paper.volume)}"
    notes = [*paper.states, *given.deviations, *(note for run in paper.runs for note in run.notes)]
    # A deviation of both runs is stated once.
    notes = list(map(say, dict.fromkeys(notes)))
    none = say("None noted in the record, none stated.")
    yield "7.8.2.1 n", "Deviations", " ".join(notes) or none
    yield "", "Software", f"OCMM {paper.software}"
    yield "7.8.2.1 o", "Signed by", "; ".join(map(say, paper.paper.template.signatures))
    yield "7.8.2.1 l", "Statement", say(RELATES_ONLY)
    if not paper.accreditation:
        yield "", "Statement", say(IN_HOUSE)


def _units(lengths: PaperLengths) -> str:
    if lengths.unit == "inch":
        return "Lengths of tables and plots in inch (1 in = 25.4 mm), in sentences in mm."
    return "Lengths in mm."


def _identified(paper: Certificate, speech: Speech) -> Iterator[str]:
    for name, value in paper.identifications:
        yield f"{speech.say(name)} {value}"


def _environment(paper: Certificate, speech: Speech) -> str:
    told = [
        f"{speech.say(name)}: {speech.number(f'{celsius:.1f} °C')}"
        for name, celsius in paper.climate
    ]
    told += [
        f"{speech.say(STATUS_WORDS[run.status])}: {air}"
        for run in paper.runs
        if (air := air_said(run, speech))
    ]
    # Data of a record come first; those of the requester fill gaps only.
    airs = [run.air for run in paper.runs]
    known = {HUMIDITY.field for air in airs if air.humidity_percent is not None}
    known |= {PRESSURE.field for air in airs if air.pressure_hpa is not None}
    told += [
        speech.say(sentence).removesuffix(".")
        for sentence in surroundings(paper.paper.given, known)
    ]
    return "; ".join(told)


def _traceability(paper: Certificate) -> Iterator[str]:
    for use in paper.artefacts:
        due = f", due {use.due_utc[:10]}" if use.due_utc else ""
        yield f"{use.name} no. {use.serial}: certificate {use.certificate or NOT_STATED}{due}."


def _condition(paper: Certificate, speech: Speech) -> str:
    """Return both states in words, also if not determined."""
    say = speech.say
    if not paper.runs and not (paper.not_found or paper.not_after):
        return ""
    states = [run.status for run in paper.runs]
    if states == ["beforeAdjustment"] and not paper.not_after:
        return say("As found; nothing was adjusted.")
    if len(states) == 2 and not paper.not_after:
        return say("As found and after adjustment, both below.")

    def told(status: str, why: str) -> str:
        return say("below") if status in states else f"{say('not determined')} ({say(why)})"

    found = told("beforeAdjustment", paper.not_found or "no test as found was made")
    after = told("afterAdjustment", paper.not_after)
    return f"{say('As found')}: {found}. {say('After adjustment')}: {after}."
