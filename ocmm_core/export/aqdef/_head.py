"""Header of the values: part, catalogues, characteristics with all their limits."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial

from ocmm_core.errors import StorageError
from ocmm_core.export.aqdef._keys import fitted, foreign_signs, told_whole
from ocmm_core.export.aqdef._reader import KeyedLine
from ocmm_core.export.report import Number, ReportData, ReportedResult, Units, check_name

_LIMIT, _NATURAL = 1, 2
_QUANTITIES = {"straightness": 100, "position": 109}
_UNDEFINED = 0
"""``K2009``, measured quantity: only values shown in a public source of Q-DAS. Any other kind gets
the published "undefined", and its quantity in words in ``K2900``."""

_HASH_DIGITS = 12


def head_lines(jobs: Sequence[ReportData], units: Units) -> Iterator[KeyedLine]:
    for key, index, text in (
        *_part_lines(jobs),
        *_catalogue_lines(jobs),
        *_characteristic_lines(jobs[0], units),
    ):
        if text:
            yield KeyedLine(key, index, fitted(key, text))


def _part_lines(jobs: Sequence[ReportData]) -> Iterator[tuple[str, int, str]]:
    data = alike(jobs)[0]
    given, machine = data.paper.given, data.paper.template.machine
    texts = {
        "K1001": data.plan.part,
        "K1041": given.drawing,
        "K1042": given.revision,
        "K1053": given.order or data.view.header.order,
        "K1081": given.machine,
        "K1201": machine.serial or machine.inventory,
        "K1341": check_name("plan", data.plan.name),
    }
    whole = told_whole(texts)
    people = operators(jobs)
    foreign = foreign_signs((*texts.values(), *people, given.customer, machine.name))
    yield "K0100", 0, str(len(data.reported))
    yield from ((key, 0, text) for key, text in texts.items())
    yield "K1002", 0, data.plan.part
    yield "K1062", 0, given.customer
    yield "K1082", 0, given.machine
    yield "K1202", 0, machine.name
    # A text of the whole file is written only if all its values share it.
    yield "K1222", 0, people[0] if len(people) == 1 else ""
    yield "K1230", 0, given.place or data.paper.template.place
    yield "K1342", 0, data.head.plan_identity[:_HASH_DIGITS]
    told = (
        *states(jobs),
        *_part_words(jobs),
        data.rule_words,
        data.calibration.label,
        *((whole,) if whole else ()),
        *(("? stands for characters outside Windows-1252",) if foreign else ()),
    )
    yield "K1900", 0, "; ".join(told)


def _catalogue_lines(jobs: Sequence[ReportData]) -> Iterator[tuple[str, int, str]]:
    for index, name in enumerate(operators(jobs), start=1):
        yield "K4092", index, name
    for index, name in enumerate(machines(jobs), start=1):
        yield "K4062", index, name
    for index, name in enumerate(gauges(jobs), start=1):
        yield "K4072", index, name
        yield "K4073", index, name


def _characteristic_lines(data: ReportData, units: Units) -> Iterator[tuple[str, int, str]]:
    gauge = data.probe.label
    for index, reported in enumerate(data.reported, start=1):
        result, tell = reported.result, partial(_limit, reported, units)
        digits = units.angle_decimals if reported.unit == "deg" else units.length_decimals
        yield "K2001", index, str(index)
        yield "K2002", index, check_name("characteristic", result.name)
        yield "K2004", index, "0"
        yield "K2009", index, str(_QUANTITIES.get(result.kind, _UNDEFINED))
        yield "K2022", index, str(digits)
        yield "K2101", index, tell(result.nominal)
        yield "K2110", index, tell(result.nominal + result.lower)
        yield "K2111", index, tell(result.nominal + result.upper)
        if not reported.one_sided:
            yield "K2112", index, tell(result.lower)
            yield "K2113", index, tell(result.upper)
        yield "K2120", index, str(_NATURAL if reported.one_sided else _LIMIT)
        yield "K2121", index, str(_LIMIT)
        yield "K2142", index, reported.unit if reported.unit == "deg" else units.lengths
        yield "K2401", index, gauge
        yield "K2402", index, gauge
        yield "K2900", index, _quantity_words(reported)


def _quantity_words(reported: ReportedResult) -> str:
    """Return the measurand and its features, and individual limits if they differ."""
    result = reported.result
    words = f"{result.kind} of {', '.join(result.features)}"
    if reported.datums:
        words += f" to {' | '.join(reported.datums)}"
    modifier = "" if reported.asked is None else reported.asked.modifier
    return (
        f"{words}; {modifier}: the limit of each part is larger by its bonus" if modifier else words
    )


def operators(jobs: Sequence[ReportData]) -> tuple[str, ...]:
    return _each(data.head.operator for data in jobs)


def machines(jobs: Sequence[ReportData]) -> tuple[str, ...]:
    return _each(data.paper.given.machine for data in jobs)


def gauges(jobs: Sequence[ReportData]) -> tuple[str, ...]:
    return _each(data.probe.label for data in jobs)


def _each(texts: Iterable[str]) -> tuple[str, ...]:
    """Return distinct non-empty texts in order."""
    return tuple(dict.fromkeys(text for text in texts if text.strip()))


def entry(catalogue: Sequence[str], text: str) -> str:
    """Return the number of an entry of a catalogue; empty if missing."""
    return str(catalogue.index(text) + 1) if text in catalogue else ""


def _part_words(jobs: Sequence[ReportData]) -> tuple[str, ...]:
    """Return the verdict on the part, or the counts for several parts."""
    words = [data.part.headline for data in jobs]
    if len(words) == 1:
        return (words[0],)
    return tuple(f"{words.count(word)} of {len(words)} {word}" for word in dict.fromkeys(words))


def alike(jobs: Sequence[ReportData]) -> Sequence[ReportData]:
    """Return jobs with the same characteristics; StorageError otherwise."""
    first = jobs[0]
    for data in jobs[1:]:
        if data.plan.characteristics != first.plan.characteristics or [
            item.name for item in data.results
        ] != [item.name for item in first.results]:
            raise StorageError(
                "export.other_plan",
                f"{data.job} was measured with another plan than {first.job}: their values "
                "cannot share one statistics file.",
                "Report jobs of one plan together.",
            )
        if data.view.simulated != first.view.simulated:
            real, computed = sorted((first, data), key=lambda job: job.view.simulated)
            raise StorageError(
                "export.simulated",
                f"{computed.job} is SIMULATED and {real.job} is not: their values cannot share "
                "one statistics file.",
                "Report simulated jobs separately.",
            )
    return jobs


def states(jobs: Sequence[ReportData]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(state for data in jobs for state in data.states))


def _limit(reported: ReportedResult, units: Units, value: float) -> str:
    return number(reported, units, value).text()


def number(reported: ReportedResult, units: Units, value: float) -> Number:
    name = reported.result.name
    if reported.unit == "deg":
        return units.finite(name, value, units.angle_decimals)
    return units.finite(name, units.scaled(value), units.length_decimals)
