"""Header of the values: part, catalogues, characteristics with all their limits.

Keys have types and lengths by the published table of supported K-fields (Hexagon, Q-DAS
configurator): ``AN`` is text with a maximum length, ``I`` an integer and ``F`` a number with a
maximum number of characters, ``D`` a date. Nothing is truncated silently:

* an identifying text (part, order, drawing, batch, serial number, plan) that is too long ends in
  ``~`` and four hexadecimal digits of the SHA-256 of the whole text, so that two long ones stay
  distinct; the whole text is in a remark;
* any other text ends with `` ...``;
* a number that does not fit is refused.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

from ocmm_core.errors import StorageError
from ocmm_core.export.report import Number, ReportData, ReportedResult, Units, check_name, one_line

FIELD, CHARACTERISTIC = "\x14", "\x0f"
NEWLINE = "\r\n"
ENCODING = "cp1252"

FIELDS = (
    "K0001", "K0002", "K0004", "K0005", "K0006", "K0007", "K0008", "K0010", "K0011", "K0012",
)  # fmt: skip
"""value, attribute, time, events, batch, nest, operator, machine, process, gauge."""


@dataclass(frozen=True, slots=True)
class KeyedLine:
    """A keyed line: ``K2101/3 20.0000``; index zero is the whole part."""

    key: str
    index: int
    text: str


@dataclass(frozen=True, slots=True)
class TransferFile:
    lines: tuple[KeyedLine, ...]
    values: tuple[tuple[dict[str, str], ...], ...]
    """For each part the fields of every characteristic by key."""

    def text(self, key: str, index: int = 0) -> str | None:
        """Return the first text of a key; None if missing."""
        return self.texts().get((key, index))

    def texts(self) -> dict[tuple[str, int], str]:
        """Return the first text of every key and index, for many lookups."""
        # Reversed, so that the first one remains.
        return {(line.key, line.index): line.text for line in reversed(self.lines)}


def read_transfer(content: bytes) -> TransferFile:
    """Return the contents of a file; StorageError if a line is neither keyed nor one of values."""
    lines: list[KeyedLine] = []
    values: list[tuple[dict[str, str], ...]] = []
    for number, line in enumerate(content.decode(ENCODING).split(NEWLINE), start=1):
        if not line:
            continue
        head, _, text = line.partition(" ")
        key, _, index = head.partition("/")
        if FIELD in line:
            parts = [part.split(FIELD) for part in line.split(CHARACTERISTIC)]
            values.append(tuple(dict(zip(FIELDS, part, strict=False)) for part in parts))
        elif key[:1] == "K" and key[1:].isdigit() and (index or "0").isdigit():
            lines.append(KeyedLine(key, int(index or "0"), text))
        else:
            raise StorageError(
                "aqdef.line", f"Line {number} of the transfer file is {line!r}.", "Write it again."
            )
    return TransferFile(tuple(lines), tuple(values))


Type = Literal["AN", "I", "F", "D"]
_CUT, _TAIL, _DIGITS = " ...", "~", 4


@dataclass(frozen=True, slots=True)
class Key:
    type: Type
    length: int
    """`type`, `length`: As in the published table."""
    title: str
    """Meaning, for messages and remarks."""
    tells_apart: bool = False
    """Identifying: longer texts must stay distinct."""


KEYS: Mapping[str, Key] = {
    "K0001": Key("F", 22, "value"),
    "K0002": Key("I", 5, "attribute"),
    "K0004": Key("D", 19, "time"),
    "K0006": Key("AN", 14, "batch", tells_apart=True),
    "K0008": Key("I", 10, "operator, by catalogue"),
    "K0009": Key("AN", 255, "remark"),
    "K0010": Key("I", 10, "machine, by catalogue"),
    "K0012": Key("I", 10, "gauge, by catalogue"),
    "K0014": Key("AN", 40, "serial number", tells_apart=True),
    "K0053": Key("AN", 20, "order of the value", tells_apart=True),
    "K0100": Key("I", 5, "number of characteristics"),
    "K1001": Key("AN", 30, "part number", tells_apart=True),
    "K1002": Key("AN", 80, "part"),
    "K1041": Key("AN", 30, "drawing", tells_apart=True),
    "K1042": Key("AN", 20, "revision of the drawing", tells_apart=True),
    "K1053": Key("AN", 40, "order", tells_apart=True),
    "K1062": Key("AN", 40, "customer"),
    "K1081": Key("AN", 24, "machine", tells_apart=True),
    "K1082": Key("AN", 40, "machine in words"),
    "K1201": Key("AN", 24, "test facility", tells_apart=True),
    "K1202": Key("AN", 40, "test facility in words"),
    "K1222": Key("AN", 40, "operator"),
    "K1230": Key("AN", 40, "place"),
    "K1341": Key("AN", 20, "plan", tells_apart=True),
    "K1342": Key("AN", 40, "index of the plan"),
    "K1900": Key("AN", 255, "remark"),
    "K2001": Key("AN", 20, "characteristic number"),
    "K2002": Key("AN", 80, "characteristic", tells_apart=True),
    "K2004": Key("I", 5, "type of the characteristic"),
    "K2009": Key("I", 5, "measured quantity"),
    "K2022": Key("I", 5, "decimals"),
    "K2101": Key("F", 22, "nominal"),
    "K2110": Key("F", 22, "lower limit"),
    "K2111": Key("F", 22, "upper limit"),
    "K2112": Key("F", 22, "lower allowance"),
    "K2113": Key("F", 22, "upper allowance"),
    "K2120": Key("I", 3, "kind of the lower limit"),
    "K2121": Key("I", 3, "kind of the upper limit"),
    "K2142": Key("AN", 20, "unit"),
    "K2401": Key("AN", 40, "gauge", tells_apart=True),
    "K2402": Key("AN", 80, "gauge in words"),
    "K2900": Key("AN", 255, "remark"),
    "K4062": Key("AN", 40, "machine, entry of the catalogue", tells_apart=True),
    "K4072": Key("AN", 40, "gauge, entry of the catalogue", tells_apart=True),
    "K4073": Key("AN", 80, "gauge in words, entry of the catalogue"),
    "K4092": Key("AN", 50, "operator, entry of the catalogue", tells_apart=True),
}


def fitted(key: str, text: str) -> str:
    """Return a text fitted to a key by the rules above; StorageError if a number does not fit."""
    asked = KEYS[key]
    if asked.type != "AN":
        number = text.lstrip("-") if asked.type == "I" else text
        if len(number) > asked.length or (asked.type == "I" and not number.isdigit()):
            raise StorageError(
                "aqdef.number",
                f"{text} does not fit the Q-DAS field {key} ({asked.title}), which takes "
                f"{asked.length} characters.",
                "Use a profile with fewer digits, or leave out the Q-DAS file.",
            )
        return text
    plain = _written(text)
    lost = asked.tells_apart and plain != one_line(text)
    if len(plain) <= asked.length and not lost:
        return plain
    if asked.tells_apart:
        tail = _TAIL + hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]
        return plain[: asked.length - len(tail)] + tail
    return plain[: asked.length - len(_CUT)] + _CUT


def told_whole(texts: Mapping[str, str]) -> str:
    """Return the complete texts of those that did not fit, for a remark; empty if all did."""
    return "; ".join(
        f"{KEYS[key].title} in full: {_written(text)}"
        for key, text in texts.items()
        if fitted(key, text) != _written(text)
    )


def foreign_signs(texts: Iterable[str]) -> bool:
    """Return whether a text has characters outside the encoding of the file."""
    return any(one_line(text) != _written(text) for text in texts)


def _written(text: str) -> str:
    """Return a text with ``?`` for characters outside the encoding."""
    return one_line(text).encode(ENCODING, "replace").decode(ENCODING)


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
