"""Values for statistical process control in the Q-DAS ASCII transfer format (AQDEF, ``.dfq``).

Keyed lines with CR LF; one line of values for each part, characteristics separated by char 15,
fields by char 20; dates as ``dd.MM.yyyy/HH:mm:ss``, UTC. `_head` has the keys with type and length,
docs/quality/exports.md the assumptions. Operators, machines and gauges are in catalogues (``K4092/1
NAME``), and a value has the number of the entry (``K0008``). Several jobs of one plan go into one
file as several values. A value excluded from statistics has attribute 255, and a missing one is
empty with 256. The format has limits and values, by which alone its readers judge. So the verdicts
of the job are added as text (``K0009``): of each part, and of characteristics that are not CONFORM.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ocmm_core.errors import StorageError
from ocmm_core.export import report
from ocmm_core.export.aqdef import _head as head
from ocmm_core.export.aqdef._head import number
from ocmm_core.inspection.evaluation import held_below
from ocmm_core.names import file_stem
from ocmm_core.tolerances.decisions import Verdict

_VALID, _DOUBTFUL, _MISSING = 0, 255, 256
_REMARK = "K0009"


def _contents(jobs: Sequence[report.ReportData], profile: report.Profile) -> dict[str, bytes]:
    lines = [
        f"{line.key}/{line.index} {line.text}" if line.index else f"{line.key} {line.text}"
        for line in head.head_lines(jobs, profile.units)
    ]
    for data in jobs:
        fields = [_fields(jobs, data, reported, profile.units) for reported in data.reported]
        lines.append(head.CHARACTERISTIC.join(head.FIELD.join(row) for row in fields))
        # Serial number of the part whose values are above, for all characteristics.
        lines.append(f"K0014/0 {head.fitted('K0014', data.head.serial)}")
        lines += [f"{_REMARK}/{line.index} {line.text}" for line in _remarks(data)]
    text = "".join(line + head.NEWLINE for line in lines)
    return {_name(jobs): text.encode(head.ENCODING)}


def _differences(
    jobs: Sequence[report.ReportData], profile: report.Profile, files: Mapping[str, bytes]
) -> list[str]:
    name, units = _name(jobs), profile.units
    try:
        found = head.read_transfer(files[name])
    except (StorageError, UnicodeDecodeError) as error:
        return [f"{name}: {error}"]
    texts = found.texts()
    different = [
        f"{name}: {line.key}/{line.index} is not {line.text!r}."
        for line in head.head_lines(jobs, units)
        if texts.get((line.key, line.index)) != line.text
    ]
    serials = [line.text for line in found.lines if line.key == "K0014"]
    wanted = [head.fitted("K0014", data.head.serial) for data in jobs]
    if serials != wanted or len(found.values) != len(jobs):
        different.append(f"{name}: it does not hold the values of {len(jobs)} part(s).")
    remarks = [line for line in found.lines if line.key == _REMARK]
    if remarks != [line for data in jobs for line in _remarks(data)]:
        different.append(f"{name}: it does not hold the verdicts of {len(jobs)} part(s).")
    for data, values in zip(jobs, found.values, strict=False):
        if len(values) != len(data.reported):
            different.append(f"{name}: values of {data.job} are missing.")
        for reported, fields in zip(data.reported, values, strict=False):
            if not _is_told(jobs, data, reported, fields, units):
                different.append(f"{name}: {data.job}, {reported.result.name}: another value.")
    return different


def _preview(
    jobs: Sequence[report.ReportData], profile: report.Profile
) -> tuple[report.ReportTable, ...]:
    units = profile.units
    rows: list[tuple[report.Cell, ...]] = []
    for index, reported in enumerate(jobs[0].reported):
        asked = reported.result
        told = [
            _value_with_attribute(data, data.reported[index], units) for data in head.alike(jobs)
        ]
        values: list[report.Cell] = [value if value is not None else "" for value, _ in told]
        rows.append((index + 1, asked.name, reported.unit, *values))
    columns = ("No.", "Characteristic", "Unit", *(data.job for data in jobs))
    remarks = tuple((data.job, line.text) for data in jobs for line in _remarks(data))
    return (
        report.ReportTable("Verdicts", ("Job", "Remark"), remarks),
        report.ReportTable("Q-DAS values", columns, tuple(rows)),
    )


def _name(jobs: Sequence[report.ReportData]) -> str:
    if len(jobs) == 1:
        return f"{jobs[0].stem}.dfq"
    plan = file_stem(jobs[0].plan.name)
    told = "".join(f"_{state.replace(' ', '_')}" for state in head.states(jobs))
    return f"{plan}_{len(jobs)}_parts{told}.dfq"


def _remarks(data: report.ReportData) -> Iterator[head.KeyedLine]:
    """Yield the verdict on the part, and those on characteristics that are not CONFORM."""
    texts = {"K0006": data.view.header.batch, "K0014": data.head.serial}
    whole = head.told_whole(texts)
    told = "; ".join((*data.states, *data.part.lines, *((whole,) if whole else ())))
    yield head.KeyedLine(_REMARK, 0, head.fitted(_REMARK, told))
    for index, reported in enumerate(data.reported, start=1):
        if reported.result.verdict is not Verdict.CONFORM:
            yield head.KeyedLine(_REMARK, index, reported.result.verdict.value)


def _value_with_attribute(
    data: report.ReportData, reported: report.ReportedResult, units: report.Units
) -> tuple[report.Number | None, int]:
    """Return value and attribute of a result."""
    result = reported.result
    if result.stated is None:
        return None, _MISSING
    held = bool(held_below(result, data.plan, data.view))
    # NOT PROVEN alone is no reason: without values near a limit a process looks better than it is.
    # Simulated values must not count among real ones.
    doubtful = held or bool(data.view.unproven) or data.view.simulated
    value = number(reported, units, result.stated[0])
    return value, _DOUBTFUL if doubtful else _VALID


def _fields(
    jobs: Sequence[report.ReportData],
    data: report.ReportData,
    reported: report.ReportedResult,
    units: report.Units,
) -> list[str]:
    value, attribute = _value_with_attribute(data, reported, units)
    batch = data.view.header.batch
    return [
        "" if value is None else head.fitted("K0001", value.text()),
        str(attribute),
        _time(data, reported),
        # In a line of values a batch starts with '#', as in the programs of Q-DAS.
        "", f"#{head.fitted('K0006', batch)}" if batch else "", "",
        *_entries(jobs, data),
    ]  # fmt: skip


def _entries(jobs: Sequence[report.ReportData], data: report.ReportData) -> tuple[str, ...]:
    """Return the catalogue numbers of operator, machine, process and gauge of a job."""
    return (
        head.entry(head.operators(jobs), data.head.operator),
        head.entry(head.machines(jobs), data.paper.given.machine),
        "",
        head.entry(head.gauges(jobs), data.probe.label),
    )


def _is_told(
    jobs: Sequence[report.ReportData], data: report.ReportData, reported: report.ReportedResult,
    fields: Mapping[str, str], units: report.Units,
) -> bool:  # fmt: skip
    value, attribute = _value_with_attribute(data, reported, units)
    told = fields.get("K0001", "")
    same = told == "" if value is None else report.same_number(value, told)
    keys = ("K0008", "K0010", "K0011", "K0012")
    return (
        same
        and (fields.get("K0002"), fields.get("K0004")) == (str(attribute), _time(data, reported))
        and tuple(fields.get(key) for key in keys) == _entries(jobs, data)
    )


def _time(data: report.ReportData, reported: report.ReportedResult) -> str:
    """Return the time of the last point of a result, or the start of the job."""
    numbers = [
        point.number
        for feature in data.features
        if feature.name in reported.result.features
        for point in feature.seen.points
    ]
    taken = [data.taken_utc[number] for number in numbers if number in data.taken_utc]
    return report.last_moment(data.head.created_utc, taken).strftime("%d.%m.%Y/%H:%M:%S")


AQDEF: report.Exporter = report.Exporter(
    name="dfq",
    title="Q-DAS (AQDEF)",
    purpose="Q-DAS and other programs for statistics; one or several parts",
    suffixes=(".dfq",),
    profile="unit and digits",
    contents=_contents, differences=_differences, preview=_preview, batch=True,
)  # fmt: skip
