"""Statistics: trend and run rules, Cpk by month, R&R over stations."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.evaluation import SIMULATED_LINE
from ocmm_core.inspection.finished import PartValue, Trend
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.tolerances.decisions import Verdict, capability, control_chart
from ocmm_shop.archive.questions import _judge
from ocmm_shop.archive.stores import Archive, Cell, Row
from ocmm_shop.studies import gauge_study


def trend(archive: Archive, asked: _judge.Query) -> _judge.ArchiveAnswer:
    """Return the trend over stations: chart, run rules, Cpk; InputError: unknown characteristic."""
    _judge.needs(asked, "part", "characteristic")
    values = _values(archive, asked, asked.most)
    groups = _by_limits(values.entries)
    trends = [_trend(asked.characteristic, group) for group in groups.values()]
    notes = [*values.notes]
    if len(groups) > 1:
        notes.insert(0, f"Limits were changed: {len(groups)} trends, one for each pair of limits.")
    for (_, low, high, unit), made in zip(groups, trends, strict=True):
        words = f"{_limits(low, high, unit)}: " if len(groups) > 1 else ""
        able = "" if made.capability is None else made.capability.summary
        notes += [f"{words}{text}" for text in (made.why_not, made.caution, able) if text]
    shown = tuple(
        (
            _judge.wall(one["created_utc"]), one["station"], one["serial"], one["operator"],
            one["value"], one["uncertainty"], one["low"], one["high"], one["verdict"],
            one["why_not"],
        )
        for one in values.entries
    )  # fmt: skip
    return _judge.ArchiveAnswer(
        f"{asked.part}: {asked.characteristic}{_judge.at_station(asked.station)}",
        ("Time", "Station", "Serial", "Operator", "Value", "U", "Low", "High", "Verdict",
         "Not counted because"),
        shown,
        tuple(notes),
        tuple(trends),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Values:
    """Values of one kind, real or simulated, newest first, with remarks."""

    entries: list[_judge.Entry]
    notes: list[str]

    @property
    def counted(self) -> list[_judge.Entry]:
        return [one for one in self.entries if one["counted"]]


def _values(archive: Archive, asked: _judge.Query, most: int, *, repeated: bool = False) -> _Values:
    """Return values of a part, ``most`` of those that count; `repeated`: not only the last."""
    judge = _judge.Judge(archive)
    named: dict[str, Cell] = {"part": asked.part, "name": asked.characteristic}
    for simulated in (0, 1):
        seen: set[tuple[Cell, ...]] = set()

        def count(entry: _judge.Entry, seen: set[tuple[Cell, ...]] = seen) -> bool:
            if asked.station and entry["station"] != asked.station:
                entry["counted"] = None
                return False
            if entry["counted"] and entry["state"] != "finished":
                entry |= {"counted": 0, "why_not": "Not finished."}
            key = (*_limits_of(entry), _judge.part_of(entry))
            if entry["counted"] and key in seen and not repeated:
                entry |= {"counted": 0, "why_not": "Measured again later."}
            if entry["counted"]:
                seen.add(key)
            return bool(entry["counted"])

        entries = judge.rows(
            f"SELECT {_judge.JUDGED}, characteristic, created_utc, state, serial, operator, value,"  # noqa: S608
            " uncertainty, verdict, low, high, unit, kind, counted, why_not, simulated"
            " FROM archived_line_result WHERE part = :part AND simulated = :simulated"
            " AND (:name = '' OR characteristic = :name) ORDER BY created_utc DESC, job_id DESC",
            named | {"simulated": simulated}, most, count,
        )  # fmt: skip
        found = [one for one in entries if one["counted"] is not None]
        if found:
            return _Values(found, _notes(archive, named, found, most, simulated=bool(simulated)))
    raise _judge.nothing_of(archive, asked)


def _notes(
    archive: Archive,
    named: dict[str, Cell],
    found: list[_judge.Entry],
    most: int,
    *,
    simulated: bool,
) -> list[str]:
    notes = list(_judge.cut([one for one in found if one["counted"]], most))
    again = sum(one["why_not"] == "Measured again later." for one in found)
    left = sum(not one["counted"] for one in found) - again
    notes += [f"Measured again, counted once: {again}."] if again else []
    notes += [f"Not counted, with their reason: {left}."] if left else []
    if any(one["counted"] and not one["serial"] for one in found):
        notes.append("Jobs without a serial number count as a part each.")
    if simulated:
        return [SIMULATED_LINE, *notes]
    others = archive.query(
        "SELECT count(DISTINCT job_uuid) FROM archived_result WHERE part = :part"
        " AND simulated = 1 AND (:name = '' OR characteristic = :name)", named,
    ).rows[0][0]  # fmt: skip
    if others:
        notes.append(f"Simulated jobs, not counted beside real ones: {others!s}.")
    return notes


def _limits_of(entry: _judge.Entry) -> tuple[Cell, ...]:
    return entry["characteristic"], entry["low"], entry["high"], entry["unit"]


def _by_limits(entries: list[_judge.Entry]) -> dict[tuple[Cell, ...], list[_judge.Entry]]:
    """Return entries by characteristic and limits, those with the most counted parts first."""
    groups: dict[tuple[Cell, ...], list[_judge.Entry]] = defaultdict(list)
    for one in entries:
        groups[_limits_of(one)].append(one)
    parts = {key: sum(bool(one["counted"]) for one in group) for key, group in groups.items()}
    return {key: groups[key] for key in sorted(groups, key=lambda key: -parts[key])}


def _limits(low: Cell, high: Cell, unit: Cell) -> str:
    if low is None or high is None:
        one = high if low is None else low
        return "No limit" if one is None else f"Limit {_judge.number_of(one):.4f} {unit!s}"
    return f"Limits {_judge.number_of(low):.4f} to {_judge.number_of(high):.4f} {unit!s}"


def cpk_by_month(archive: Archive, asked: _judge.Query) -> _judge.ArchiveAnswer:
    """Return Cp and Cpk with intervals of a part by month; InputError if the part is unknown."""
    _judge.needs(asked, "part")
    found = _values(archive, asked, _judge.MOST_VALUES)
    groups: dict[tuple[str, str, Cell, Cell, Cell], list[tuple[float, float]]] = defaultdict(list)
    for one in sorted(found.counted, key=lambda one: (one["characteristic"], one["created_utc"])):
        month = _judge.wall(one["created_utc"])[:7]
        key = (str(one["characteristic"]), month, one["low"], one["high"], one["unit"])
        groups[key].append((_judge.number_of(one["value"]), _judge.number_of(one["uncertainty"])))
    shown: list[Row] = []
    for (name, month, low, high, unit), values in groups.items():
        pairs = np.array(values)
        try:
            able = capability(
                pairs[:, 0], -math.inf if low is None else _judge.number_of(low),
                math.inf if high is None else _judge.number_of(high),
                float(np.median(pairs[:, 1])) / COVERAGE_FACTOR,
            )  # fmt: skip
            shown.append(
                (name, month, able.count, able.mean, able.sigma_within, able.cp, able.cpk,
                 able.cpk_low, able.cpk_high, low, high, unit, "")
            )  # fmt: skip
        except OcmmError as error:
            why = error.what
            shown.append(
                (
                    name,
                    month,
                    len(values),
                    float(pairs[:, 0].mean()),
                    *(None,) * 5,
                    low,
                    high,
                    unit,
                    why,
                )
            )
    return _judge.ArchiveAnswer(
        f"{asked.part}: capability by month{_judge.at_station(asked.station)}",
        ("Characteristic", "Month", "Parts", "Mean", "Sigma", "Cp", "Cpk", "Cpk low", "Cpk high",
         "Low", "High", "Unit", "No index because"),
        tuple(shown),
        tuple(found.notes),
    )  # fmt: skip


def rr(archive: Archive, asked: _judge.Query) -> _judge.ArchiveAnswer:
    """Return the gauge R&R over stations: parts by serial number, each measured at every station.

    Stations replace operators. The same number of first measurements counts for each part and
    station; parts not measured by all stations are left out. InputError: there are fewer than two
    parts, stations or trials.
    """
    _judge.needs(asked, "part", "characteristic")
    found = _values(archive, asked, _judge.MOST_VALUES, repeated=True)
    groups = _by_limits(found.counted)
    if not groups:
        raise _judge.nothing_of(archive, asked)
    (_, low, high, unit), chosen = next(iter(groups.items()))
    notes = [*found.notes]
    if left := len(found.counted) - len(chosen):
        notes.append(f"{_limits(low, high, unit)}; values with other limits, left out: {left}.")
    cells: dict[tuple[str, str], list[float]] = defaultdict(list)
    for one in reversed(chosen):
        cells[str(one["serial"]), str(one["station"])].append(_judge.number_of(one["value"]))
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
    both = low is not None and high is not None
    study = gauge_study(
        values,
        tolerance=_judge.number_of(high) - _judge.number_of(low) if both else None,
        one_sided=None
        if both
        else next((_judge.number_of(x) for x in (high, low) if x is not None), None),
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
    return _judge.ArchiveAnswer(
        f"{asked.part}: {asked.characteristic}, R&R over {len(stations)} stations, "
        f"{len(whole)} parts, {trials} trials",
        ("Source", "Sigma", "Value"),
        tuple(shown),
        tuple(notes),
        study=study,
    )


def _trend(name: str, entries: list[_judge.Entry]) -> Trend:
    """Return the trend of values under the same limits; input is newest first."""
    items, left_out, counted = [], [], []
    for one in reversed(entries):
        label = f"{one['station']!s} {one['serial']!s}"
        value = _judge.number_of(one["value"]) if one["counted"] else None
        uncertainty = _judge.number_of(one["uncertainty"]) if one["counted"] else None
        if value is None or uncertainty is None:
            left_out.append(f"{label}: {one['why_not']!s}")
        else:
            counted.append((value, uncertainty))
        items.append(
            PartValue(
                label, str(one["serial"]), str(one["created_utc"]), value, uncertainty,
                Verdict(one["verdict"]),
            )
        )  # fmt: skip
    newest = entries[0]
    low = -math.inf if newest["low"] is None else _judge.number_of(newest["low"])
    high = math.inf if newest["high"] is None else _judge.number_of(newest["high"])
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
        name, str(newest["kind"]), low, high, tuple(items), tuple(left_out), chart, able, why_not
    )
