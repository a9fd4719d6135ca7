"""Values for statistical process control in the Q-DAS ASCII transfer format (AQDEF, ``.dfq``).

Keyed lines with CR LF; one line of values for each part, characteristics apart by char 15, fields
by char 20; dates as ``dd.MM.yyyy/HH:mm:ss``, UTC. Keys and their meanings are those of public
readers of the format (docs/exports.md says which are assumed). Several jobs of one plan go into
one file as several values. A value that must not count in statistics carries attribute 255, and
one that is missing stays empty with 256: no number stands in for it.

The format has limits and values, and its readers judge by them alone. So the verdicts of the job
stand beside them as text (``K0009``): of each part, and of what is not CONFORM.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial

from ocmm_core.errors import StorageError
from ocmm_core.export.report._delimited import same_number
from ocmm_core.export.report._exporter import Exporter
from ocmm_core.export.report._names import check_file_stem, check_name, clean_text
from ocmm_core.export.report._profile import Profile
from ocmm_core.export.report._report_data import ReportData, ReportedResult
from ocmm_core.export.report._tables import Cell, Number, Table, Units
from ocmm_core.inspection.evaluation import held_below
from ocmm_core.tolerances.decisions import Verdict

_FIELD, _CHARACTERISTIC = "\x14", "\x0f"
_NEWLINE = "\r\n"
_ENCODING = "cp1252"
_VALID, _DOUBTFUL, _MISSING = 0, 255, 256
_LIMIT, _NATURAL = 1, 2
_REMARK = "K0009"
_LONGEST_REMARK = 250

_FIELDS = (
    "K0001", "K0002", "K0004", "K0005", "K0006", "K0007", "K0008", "K0010", "K0011", "K0012",
)  # fmt: skip
"""Order of the fields of a value: value, attribute, time, events, batch, nest, operator, machine,
process, gauge."""


@dataclass(frozen=True, slots=True)
class KeyedLine:
    """A keyed line: ``K2101/3 20.0000``; index zero stands for the whole part."""

    key: str
    index: int
    text: str


@dataclass(frozen=True, slots=True)
class TransferFile:
    """What a file holds.

    Attributes
    ----------
    lines
        All keyed lines in their order.
    values
        For each part the fields of every characteristic by their keys.
    """

    lines: tuple[KeyedLine, ...]
    values: tuple[tuple[dict[str, str], ...], ...]

    def text(self, key: str, index: int = 0) -> str | None:
        """Return the first text of a key; None where there is none."""
        for line in self.lines:
            if (line.key, line.index) == (key, index):
                return line.text
        return None


def read_transfer(content: bytes) -> TransferFile:
    """Return what a file holds.

    Raises
    ------
    StorageError
        A line is neither keyed nor one of values.
    """
    lines: list[KeyedLine] = []
    values: list[tuple[dict[str, str], ...]] = []
    for number, line in enumerate(content.decode(_ENCODING).split(_NEWLINE), start=1):
        if not line:
            continue
        head, _, text = line.partition(" ")
        key, _, index = head.partition("/")
        if _FIELD in line:
            parts = [part.split(_FIELD) for part in line.split(_CHARACTERISTIC)]
            values.append(tuple(dict(zip(_FIELDS, part, strict=False)) for part in parts))
        elif key[:1] == "K" and key[1:].isdigit() and (index or "0").isdigit():
            lines.append(KeyedLine(key, int(index or "0"), text))
        else:
            raise StorageError(
                "aqdef.line", f"Line {number} of the transfer file is {line!r}.", "Write it again."
            )
    return TransferFile(tuple(lines), tuple(values))


def _contents(jobs: Sequence[ReportData], profile: Profile) -> dict[str, bytes]:
    lines = [_keyed(line.key, line.index, line.text) for line in _head_lines(jobs, profile.units)]
    for data in jobs:
        fields = [_fields(data, reported, profile.units) for reported in data.reported]
        lines.append(_CHARACTERISTIC.join(_FIELD.join(row) for row in fields))
        # The serial number of the part whose values stand above, for all characteristics.
        lines.append(f"K0014/0 {_text(data.head.serial)}")
        lines += [f"{_REMARK}/{line.index} {line.text}" for line in _remarks(data)]
    text = "".join(line + _NEWLINE for line in lines)
    return {_name(jobs): text.encode(_ENCODING, "replace")}


def _differences(
    jobs: Sequence[ReportData], profile: Profile, files: Mapping[str, bytes]
) -> list[str]:
    name, units = _name(jobs), profile.units
    try:
        found = read_transfer(files[name])
    except (StorageError, UnicodeDecodeError) as error:
        return [f"{name}: {error}"]
    different = [
        f"{name}: {line.key}/{line.index} is not {line.text!r}."
        for line in _head_lines(jobs, units)
        if found.text(line.key, line.index) != line.text
    ]
    serials = [line.text for line in found.lines if line.key == "K0014"]
    if serials != [_text(data.head.serial) for data in jobs] or len(found.values) != len(jobs):
        different.append(f"{name}: it does not hold the values of {len(jobs)} part(s).")
    remarks = [line for line in found.lines if line.key == _REMARK]
    if remarks != [line for data in jobs for line in _remarks(data)]:
        different.append(f"{name}: it does not hold the verdicts of {len(jobs)} part(s).")
    for data, values in zip(jobs, found.values, strict=False):
        if len(values) != len(data.reported):
            different.append(f"{name}: values of {data.job} are missing.")
        for reported, fields in zip(data.reported, values, strict=False):
            if not _is_told(data, reported, fields, units):
                different.append(f"{name}: {data.job}, {reported.result.name}: another value.")
    return different


def _preview(jobs: Sequence[ReportData], profile: Profile) -> tuple[Table, ...]:
    units = profile.units
    rows: list[tuple[Cell, ...]] = []
    for index, reported in enumerate(jobs[0].reported):
        asked = reported.result
        told = [_told(data, data.reported[index], units) for data in _alike(jobs)]
        values: list[Cell] = [value if value is not None else "" for value, _ in told]
        rows.append((index + 1, asked.name, reported.unit, *values))
    columns = ("No.", "Characteristic", "Unit", *(data.job for data in jobs))
    remarks = tuple((data.job, line.text) for data in jobs for line in _remarks(data))
    return (
        Table("Verdicts", ("Job", "Remark"), remarks),
        Table("Q-DAS values", columns, tuple(rows)),
    )


def _name(jobs: Sequence[ReportData]) -> str:
    if len(jobs) == 1:
        return f"{jobs[0].stem}.dfq"
    plan = check_file_stem(jobs[0].plan.name)
    states = "".join(f"_{state.replace(' ', '_')}" for state in _states(jobs))
    return f"{plan}_{len(jobs)}_parts{states}.dfq"


def _states(jobs: Sequence[ReportData]) -> tuple[str, ...]:
    """Return the states of all jobs together."""
    return tuple(dict.fromkeys(state for data in jobs for state in data.states))


def _remarks(data: ReportData) -> Iterator[KeyedLine]:
    """Yield the verdict on the part, and that on each characteristic that is not CONFORM."""
    yield KeyedLine(_REMARK, 0, _remark("; ".join((*data.states, *data.part.lines))))
    for index, reported in enumerate(data.reported, start=1):
        if reported.result.verdict is not Verdict.CONFORM:
            yield KeyedLine(_REMARK, index, reported.result.verdict.value)


def _remark(text: str) -> str:
    """Return a remark that fits; where it had to be cut, it says so."""
    return text if len(text) <= _LONGEST_REMARK else f"{text[: _LONGEST_REMARK - 4]} ..."


def _alike(jobs: Sequence[ReportData]) -> Sequence[ReportData]:
    """Return jobs that can be values of the same characteristics; StorageError otherwise."""
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


def _head_lines(jobs: Sequence[ReportData], units: Units) -> Iterator[KeyedLine]:
    data = _alike(jobs)[0]
    yield KeyedLine("K0100", 0, str(len(data.reported)))
    yield KeyedLine("K1001", 0, _text(data.plan.part))
    yield KeyedLine("K1002", 0, _text(data.plan.part))
    if data.view.header.order:
        yield KeyedLine("K1053", 0, _text(data.view.header.order))
    yield KeyedLine("K1086", 0, check_name("plan", data.plan.name))
    told = (*_states(jobs), *_part_words(jobs), data.rule_words, data.calibration.label)
    yield KeyedLine("K1900", 0, _text("; ".join(told)))
    for index, reported in enumerate(data.reported, start=1):
        result, tell = reported.result, partial(_limit, reported, units)
        name = check_name("characteristic", result.name)
        digits = units.angle_decimals if reported.unit == "deg" else units.length_decimals
        yield KeyedLine("K2001", index, str(index))
        yield KeyedLine("K2002", index, name)
        yield KeyedLine("K2004", index, "0")
        yield KeyedLine("K2022", index, str(digits))
        yield KeyedLine("K2101", index, tell(result.nominal))
        yield KeyedLine("K2110", index, tell(result.nominal + result.lower))
        yield KeyedLine("K2111", index, tell(result.nominal + result.upper))
        yield KeyedLine("K2120", index, str(_NATURAL if reported.one_sided else _LIMIT))
        yield KeyedLine("K2121", index, str(_LIMIT))
        yield KeyedLine("K2142", index, reported.unit if reported.unit == "deg" else units.lengths)


def _part_words(jobs: Sequence[ReportData]) -> tuple[str, ...]:
    """Return the verdict on the part, or how many parts have which."""
    words = [data.part.word.value for data in jobs]
    if len(words) == 1:
        return (words[0],)
    return tuple(f"{words.count(word)} of {len(words)} {word}" for word in dict.fromkeys(words))


def _limit(reported: ReportedResult, units: Units, value: float) -> str:
    return _number(reported, units, value).text()


def _number(reported: ReportedResult, units: Units, value: float) -> Number:
    """Return a number in the unit of a characteristic."""
    name = reported.result.name
    if reported.unit == "deg":
        return units.finite(name, value, units.angle_decimals)
    return units.finite(name, units.scaled(value), units.length_decimals)


def _told(data: ReportData, reported: ReportedResult, units: Units) -> tuple[Number | None, int]:
    """Return value and attribute of a result."""
    result = reported.result
    if result.stated is None:
        return None, _MISSING
    held = bool(held_below(result, data.plan, data.view))
    # NOT PROVEN alone is no reason: without the values near a limit a process looks better than it
    # is. What no real part has must not count among those of real ones.
    doubtful = held or bool(data.view.unproven) or data.view.simulated
    number = _number(reported, units, result.stated[0])
    return number, _DOUBTFUL if doubtful else _VALID


def _fields(data: ReportData, reported: ReportedResult, units: Units) -> list[str]:
    value, attribute = _told(data, reported, units)
    return [
        "" if value is None else value.text(),
        str(attribute),
        _time(data, reported),
        "", _text(data.view.header.batch), "",
        _text(data.head.operator),
        "", "",
        _text(data.probe.label),
    ]  # fmt: skip


def _is_told(
    data: ReportData, reported: ReportedResult, fields: Mapping[str, str], units: Units
) -> bool:
    value, attribute = _told(data, reported, units)
    told = fields.get("K0001", "")
    same = told == "" if value is None else same_number(value, told)
    return same and (fields.get("K0002"), fields.get("K0004"), fields.get("K0008")) == (
        str(attribute),
        _time(data, reported),
        _text(data.head.operator),
    )


def _time(data: ReportData, reported: ReportedResult) -> str:
    """Return when the last point of a result was taken, or when the job began."""
    numbers = [
        point.number
        for feature in data.features
        if feature.name in reported.result.features
        for point in feature.seen.points
    ]
    taken = [data.taken_utc[number] for number in numbers if number in data.taken_utc]
    moment = max(taken, default=data.head.created_utc)
    return datetime.fromisoformat(moment).astimezone(UTC).strftime("%d.%m.%Y/%H:%M:%S")


def _keyed(key: str, index: int, text: str) -> str:
    return f"{key}/{index} {text}" if index else f"{key} {text}"


def _text(text: str) -> str:
    """Return free text as a field can hold it."""
    return clean_text(text).encode(_ENCODING, "replace").decode(_ENCODING)


AQDEF = Exporter(
    name="dfq",
    title="Q-DAS (AQDEF)",
    purpose="Q-DAS and other programs for statistics; one or several parts",
    suffixes=(".dfq",),
    profile="unit and digits",
    contents=_contents,
    differences=_differences,
    preview=_preview,
    batch=True,
)
