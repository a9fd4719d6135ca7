"""The questions that people ask of an archive; each is one call, for window, terminal and scripts.

What counts is said by the views (`_views`): no job in doubt, no value without proof. Simulated jobs
never count beside real ones.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta

import numpy as np

from ocmm_core.archive._answers import ArchiveAnswer
from ocmm_core.archive._rows import USES
from ocmm_core.archive._store import Archive, Cell, Row
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.archive import PartValue, Trend
from ocmm_core.inspection.evaluation import NO_REAL_PART, SIMULATED, SIMULATED_LINE
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.studies import gauge_study
from ocmm_core.tolerances.decisions import Verdict, capability, control_chart

MOST_SHOWN = 500
"""Jobs of a trend, the newest ones: more are no chart that anybody reads."""
_MOST_VALUES = 200_000


@dataclass(frozen=True, slots=True)
class Asked:
    """What a question is about; a question takes what it needs.

    Attributes
    ----------
    station, part, characteristic, operator
        Names; empty for all.
    kind, what
        Of `used`: calibration, tip, artefact ...; its hash (or how it begins), serial or name.
    first, last
        Days by the clock on the wall, both included; None for no limit (`today`: today).
    most
        Rows of a list, or jobs of a trend.
    """

    station: str = ""
    part: str = ""
    characteristic: str = ""
    operator: str = ""
    kind: str = "calibration"
    what: str = ""
    first: date | None = None
    last: date | None = None
    most: int = MOST_SHOWN


def today(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return what was measured on a day, newest first."""
    first = asked.first or datetime.now().astimezone().date()
    last = asked.last or first
    low, high = _span(first, last)
    table = archive.ask(
        "SELECT changed_utc, station, part, serial, operator, state, verdict, points, simulated,"
        " fault, held FROM archived_job WHERE changed_utc >= :low AND changed_utc < :high"
        " AND (:station = '' OR station = :station) ORDER BY changed_utc DESC LIMIT :most",
        {"low": low, "high": high, "station": asked.station, "most": asked.most},
    )
    rows = tuple(
        (_wall(row[0]), *row[1:8], _remark(bool(row[8]), str(row[9]), bool(row[10])))
        for row in table.rows
    )
    days = first.isoformat() if first == last else f"{first.isoformat()} to {last.isoformat()}"
    return ArchiveAnswer(
        f"Measured on {days}{_at(asked.station)}",
        ("Time", "Station", "Part", "Serial", "Operator", "State", "Verdict", "Points", "Remark"),
        rows,
        _cut(rows, asked.most),
    )


def trend(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return the trend of a characteristic over stations: control chart, run rules, Cpk.

    Raises
    ------
    InputError
        No part or characteristic is named, or none is known by that name.
    """
    _needs(asked, "part", "characteristic")
    table = archive.ask(
        "SELECT created_utc, station, serial, operator, value, uncertainty, verdict, low, high,"
        " unit, kind, counted, why_not, simulated, job_uuid FROM archived_result"
        " WHERE part = :part AND characteristic = :name AND (:station = '' OR station = :station)"
        " ORDER BY created_utc DESC LIMIT :most",
        {
            "part": asked.part, "name": asked.characteristic, "station": asked.station,
            "most": asked.most,
        },
    )  # fmt: skip
    if not table.rows:
        raise _nothing(archive, asked)
    rows = [dict(zip(table.columns, row, strict=True)) for row in reversed(table.rows)]
    limits = {(row["low"], row["high"], row["unit"]) for row in rows}
    notes = list(_cut(table.rows, asked.most))
    newest = rows[-1]
    if len(limits) > 1:
        keep = (newest["low"], newest["high"], newest["unit"])
        other = [row for row in rows if (row["low"], row["high"], row["unit"]) != keep]
        rows = [row for row in rows if (row["low"], row["high"], row["unit"]) == keep]
        notes.append(f"{len(other)} jobs had other limits and are left out.")
    made = _trend(asked.characteristic, rows)
    if made.why_not:
        notes.append(made.why_not)
    if made.caution:
        notes.append(made.caution)
    if made.capability is not None:
        notes.append(made.capability.words)
    notes += _simulated_note(rows)
    shown = tuple(
        (
            _wall(row["created_utc"]), row["station"], row["serial"], row["operator"],
            row["value"], row["uncertainty"], row["verdict"], row["why_not"],
        )
        for row in reversed(rows)
    )  # fmt: skip
    return ArchiveAnswer(
        f"{asked.part}: {asked.characteristic}{_at(asked.station)}",
        ("Time", "Station", "Serial", "Operator", "Value", "U", "Verdict", "Not counted because"),
        shown,
        tuple(notes),
        (made,),
    )


def used(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return the jobs that were measured with something, newest first.

    Raises
    ------
    InputError
        The kind is none, or nothing is named.
    """
    if asked.kind not in USES:
        raise InputError(
            "archive.used", f"{asked.kind!r} is nothing that is used.", f"One of {', '.join(USES)}."
        )
    _needs(asked, "what")
    # Two searches, each by its index; a hash may be shortened as screens show it.
    table = archive.ask(
        "SELECT changed_utc, station, part, serial, operator, verdict, identity, name, simulated,"
        " fault, held, job_uuid FROM archived_use WHERE used_kind = :kind AND"
        " (identity = :what OR (identity > :what AND identity < :beyond))"
        " UNION SELECT changed_utc, station, part, serial, operator, verdict, identity, name,"
        " simulated, fault, held, job_uuid FROM archived_use"
        " WHERE used_kind = :kind AND name = :what ORDER BY changed_utc DESC LIMIT :most",
        {
            "kind": asked.kind, "what": asked.what, "most": asked.most,
            # Only hashes are shortened: a serial number B-1 is not B-17.
            "beyond": f"{asked.what}g" if _is_short_hash(asked.what) else asked.what,
        },
    )  # fmt: skip
    rows = tuple(
        (
            _wall(row[0]), *row[1:6], row[7], str(row[6])[:12],
            _remark(bool(row[8]), str(row[9]), bool(row[10])),
        )
        for row in table.rows
    )  # fmt: skip
    return ArchiveAnswer(
        f"Measured with {asked.kind} {asked.what[:40]}",
        ("Time", "Station", "Part", "Serial", "Operator", "Verdict", "Name", "Identity", "Remark"),
        rows,
        _cut(rows, asked.most),
    )


def cpk_by_month(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return Cp and Cpk of the characteristics of a part, month by month, with their intervals.

    Raises
    ------
    InputError
        No part is named, or nothing is known of it.
    """
    _needs(asked, "part")
    table = archive.ask(
        "SELECT characteristic, created_utc, value, uncertainty, low, high, unit, simulated"
        " FROM archived_result WHERE part = :part AND counted = 1"
        " AND (:name = '' OR characteristic = :name) AND (:station = '' OR station = :station)"
        " ORDER BY characteristic, created_utc LIMIT :most",
        {
            "part": asked.part, "name": asked.characteristic, "station": asked.station,
            "most": _MOST_VALUES,
        },
    )  # fmt: skip
    if not table.rows:
        raise _nothing(archive, asked)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    notes = _simulated_note(rows)
    real = [row for row in rows if not row["simulated"]] or rows
    groups: dict[tuple[str, str, Cell, Cell, Cell], list[tuple[float, float]]] = defaultdict(list)
    for row in real:
        month = _wall(row["created_utc"])[:7]
        key = (str(row["characteristic"]), month, row["low"], row["high"], row["unit"])
        groups[key].append((_number(row["value"]), _number(row["uncertainty"])))
    shown: list[Row] = []
    for (name, month, low, high, unit), values in groups.items():
        found = np.array(values)
        try:
            able = capability(
                found[:, 0], -math.inf if low is None else _number(low),
                math.inf if high is None else _number(high),
                float(np.median(found[:, 1])) / COVERAGE_FACTOR,
            )  # fmt: skip
            shown.append(
                (name, month, able.count, able.mean, able.sigma_within, able.cp, able.cpk,
                 able.cpk_low, able.cpk_high, unit, "")
            )  # fmt: skip
        except OcmmError as error:
            why = error.what
            shown.append(
                (name, month, len(values), float(found[:, 0].mean()), *(None,) * 5, unit, why)
            )
    return ArchiveAnswer(
        f"{asked.part}: capability by month{_at(asked.station)}",
        ("Characteristic", "Month", "Jobs", "Mean", "Sigma", "Cp", "Cpk", "Cpk low", "Cpk high",
         "Unit", "No index because"),
        tuple(shown),
        (*notes, *_cut(table.rows, _MOST_VALUES)),
    )  # fmt: skip


def passed(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return who passed what: finished real jobs by operator, part and verdict."""
    low, high = _span(asked.first or date(1970, 1, 1), asked.last or date(9000, 1, 1))
    table = archive.ask(
        "SELECT operator, part, station, count(*),"
        " sum(CASE WHEN verdict = 'PART CONFORMS' THEN 1 ELSE 0 END),"
        " sum(CASE WHEN verdict = 'PART DOES NOT CONFORM' THEN 1 ELSE 0 END),"
        " sum(CASE WHEN verdict NOT IN ('PART CONFORMS', 'PART DOES NOT CONFORM')"
        " THEN 1 ELSE 0 END), max(changed_utc) FROM archived_job"
        " WHERE state = 'finished' AND simulated = 0 AND fault = '' AND held = 0"
        " AND changed_utc >= :low AND changed_utc < :high"
        " AND (:operator = '' OR operator = :operator) AND (:part = '' OR part = :part)"
        " AND (:station = '' OR station = :station)"
        " GROUP BY operator, part, station ORDER BY operator, part, station LIMIT :most",
        {
            "low": low, "high": high, "operator": asked.operator, "part": asked.part,
            "station": asked.station, "most": asked.most,
        },
    )  # fmt: skip
    rows = tuple(
        (*row[:3], *(int(str(cell)) for cell in row[3:7]), _wall(row[7])) for row in table.rows
    )
    left = archive.ask(
        "SELECT count(*) FROM archived_job WHERE (fault <> '' OR held = 1)"
        " AND changed_utc >= :low AND changed_utc < :high",
        {"low": low, "high": high},
    ).rows[0][0]
    notes = (f"Jobs in doubt, not counted: {int(str(left))}.",) if left else ()
    return ArchiveAnswer(
        "Who passed what",
        ("Operator", "Part", "Station", "Jobs", "Conform", "Do not conform", "Neither", "Last"),
        rows,
        (*notes, *_cut(rows, asked.most)),
    )


def rr(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return the gauge R&R over stations: parts by serial number, each measured at every station.

    Stations take the place of operators. Of each part as many measurements count at each station as
    the fewest have, the first ones; parts that some station did not measure are left out.

    Raises
    ------
    InputError
        There are fewer than two parts, stations or trials.
    """
    _needs(asked, "part", "characteristic")
    table = archive.ask(
        "SELECT serial, station, value, low, high, simulated FROM archived_result"
        " WHERE part = :part AND characteristic = :name AND counted = 1 AND state = 'finished'"
        " ORDER BY created_utc, job_id LIMIT :most",
        {"part": asked.part, "name": asked.characteristic, "most": _MOST_VALUES},
    )
    if not table.rows:
        raise _nothing(archive, asked)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    notes = _simulated_note(rows)
    real = [row for row in rows if not row["simulated"]] or rows
    cells: dict[tuple[str, str], list[float]] = defaultdict(list)
    for row in real:
        cells[str(row["serial"]), str(row["station"])].append(_number(row["value"]))
    stations = sorted({station for _, station in cells})
    serials = sorted({serial for serial, _ in cells})
    whole = [one for one in serials if all(len(cells.get((one, at), ())) >= 2 for at in stations)]
    if len(whole) < 2 or len(stations) < 2:
        raise InputError(
            "archive.rr",
            f"{asked.part}, {asked.characteristic}: {len(whole)} parts were measured twice or more "
            f"at each of {len(stations)} stations.",
            "A study needs at least two parts, each measured twice at two stations.",
        )
    trials = min(len(cells[one, at]) for one in whole for at in stations)
    values = np.array([[cells[one, at][:trials] for at in stations] for one in whole])
    low, high = real[-1]["low"], real[-1]["high"]
    both = low is not None and high is not None
    study = gauge_study(
        values,
        tolerance=_number(high) - _number(low) if both else None,
        one_sided=None if both else next((_number(x) for x in (high, low) if x is not None), None),
    )
    left = len(serials) - len(whole)
    if left:
        notes.append(f"Parts not measured twice at every station, left out: {left}.")
    means = values.mean(axis=(0, 2))
    shown: list[Row] = [
        ("Repeatability (EV)", study.ev, None),
        ("Reproducibility over stations (AV)", study.av, None),
        ("Gauge R&R", study.grr, None),
        *((f"Mean at {at}", None, float(mean)) for at, mean in zip(stations, means, strict=True)),
    ]
    return ArchiveAnswer(
        f"{asked.part}: {asked.characteristic}, R&R over {len(stations)} stations, "
        f"{len(whole)} parts, {trials} trials",
        ("Source", "Sigma", "Value"),
        tuple(shown),
        tuple(notes),
        study=study,
    )


def parts(archive: Archive) -> tuple[tuple[str, str], ...]:
    """Return the parts and characteristics that there are values of, sorted."""
    table = archive.ask("SELECT DISTINCT part, characteristic FROM result ORDER BY 1, 2")
    return tuple((str(part), str(name)) for part, name in table.rows)


Ask = Callable[[Archive, Asked], ArchiveAnswer]


@dataclass(frozen=True, slots=True)
class Question:
    """One question.

    Attributes
    ----------
    name, title
        For scripts, and for people.
    takes, needs
        Fields of `Asked` that it uses, and those of them that must be given.
    ask
        Answers it.
    """

    name: str
    title: str
    takes: tuple[str, ...]
    needs: tuple[str, ...]
    ask: Ask


QUESTIONS = (
    Question("today", "What was measured", ("first", "last", "station", "most"), (), today),
    Question(
        "trend", "Trend", ("part", "characteristic", "station", "most"),
        ("part", "characteristic"), trend,
    ),
    Question("used", "What used this", ("kind", "what", "most"), ("what",), used),
    Question("cpk", "Cpk by month", ("part", "characteristic", "station"), ("part",), cpk_by_month),
    Question(
        "passed", "Who passed what", ("operator", "part", "station", "first", "last"), (), passed
    ),
    Question(
        "rr", "R&R over stations", ("part", "characteristic"), ("part", "characteristic"), rr
    ),
)  # fmt: skip
"""All questions, in the order in which they are offered."""


def _trend(name: str, rows: list[dict[str, Cell]]) -> Trend:
    real = any(not row["simulated"] for row in rows)
    items, left_out, counted = [], [], []
    for row in rows:
        why = str(row["why_not"])
        if row["simulated"] and real:
            why = f"{SIMULATED}. {NO_REAL_PART}"
        label = f"{row['station']!s} {row['serial']!s}"
        value = None if why else _number(row["value"])
        uncertainty = None if why else _number(row["uncertainty"])
        if why:
            left_out.append(f"{label}: {why}")
        elif value is not None and uncertainty is not None:
            counted.append((value, uncertainty))
        items.append(
            PartValue(
                label, str(row["serial"]), str(row["created_utc"]), value, uncertainty,
                Verdict(row["verdict"]),
            )
        )  # fmt: skip
    low = -math.inf if rows[-1]["low"] is None else _number(rows[-1]["low"])
    high = math.inf if rows[-1]["high"] is None else _number(rows[-1]["high"])
    chart, able, why_not = None, None, ""
    try:
        values = np.array([value for value, _ in counted])
        chart = control_chart(values)
        able = capability(
            values, low, high, float(np.median([u for _, u in counted])) / COVERAGE_FACTOR
        )
    except OcmmError as error:
        why_not = f"{error.what} {error.remedy}"
    return Trend(
        name, str(rows[-1]["kind"]), low, high, tuple(items), tuple(left_out), chart, able, why_not
    )


def _nothing(archive: Archive, asked: Asked) -> InputError:
    known = parts(archive)
    names = sorted({part for part, _ in known})
    if asked.part not in names:
        some = ", ".join(names[:10]) or "none yet"
        return InputError(
            "archive.part", f"No archived part is called {asked.part!r}.", f"There are: {some}."
        )
    own = ", ".join(name for part, name in known if part == asked.part)[:500]
    return InputError(
        "archive.characteristic",
        f"Part {asked.part} has no counted value of {asked.characteristic or 'anything'!r}"
        f"{_at(asked.station)}.",
        f"Its characteristics: {own}.",
    )


def _needs(asked: Asked, *fields: str) -> None:
    labels: Mapping[str, str] = {"what": "what was used"}
    for field in fields:
        if not getattr(asked, field):
            raise InputError(
                "archive.question", f"Which {labels.get(field, field)}?", "Give its name."
            )


def _span(first: date, last: date) -> tuple[str, str]:
    """Return the ends of days on the wall in UTC, as the archive sorts times."""
    if last < first:
        raise InputError(
            "archive.days", f"{last} is before {first}.", "Give the earlier day first."
        )
    low = datetime(first.year, first.month, first.day).astimezone(UTC)
    end = last + timedelta(days=1)
    high = datetime(end.year, end.month, end.day).astimezone(UTC)
    return low.isoformat(timespec="milliseconds"), high.isoformat(timespec="milliseconds")


def _wall(utc: Cell) -> str:
    return datetime.fromisoformat(str(utc)).astimezone().strftime("%Y-%m-%d %H:%M")


def _remark(simulated: bool, fault: str, held: bool) -> str:
    words = [SIMULATED] if simulated else []
    words += [fault] if fault else []
    words += ["Held back: see the marks."] if held else []
    return " ".join(words)


def _simulated_note(rows: list[dict[str, Cell]]) -> list[str]:
    computed = [row for row in rows if row["simulated"]]
    if not computed:
        return []
    if len(computed) == len(rows):
        return [SIMULATED_LINE]
    return [f"Simulated jobs, not counted beside real ones: {len(computed)}."]


def _cut(rows: tuple[Row, ...], most: int) -> tuple[str, ...]:
    return (f"Only the first {most} are shown.",) if len(rows) >= most else ()


def _at(station: str) -> str:
    return f" at {station}" if station else ""


def _number(cell: Cell) -> float:
    assert isinstance(cell, int | float)  # noqa: S101 - by the type of the column
    return float(cell)


def _is_short_hash(text: str) -> bool:
    return 6 <= len(text) <= 64 and all(c in "0123456789abcdef" for c in text)
