"""What many values say: trend and run rules, Cpk by month, R&R over stations."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np

from ocmm_core.archive.questions._answers import ArchiveAnswer
from ocmm_core.archive.questions._asked import (
    MOST_VALUES,
    Asked,
    at_station,
    cut,
    needs,
    nothing_of,
    number_of,
    simulated_note,
    wall,
)
from ocmm_core.archive.stores import Archive, Cell, Row
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.archive import PartValue, Trend
from ocmm_core.inspection.evaluation import NO_REAL_PART, SIMULATED
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.studies import gauge_study
from ocmm_core.tolerances.decisions import Verdict, capability, control_chart


def trend(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return the trend of a characteristic over stations: control chart, run rules, Cpk.

    Raises
    ------
    InputError
        No part or characteristic is named, or none is known by that name.
    """
    needs(asked, "part", "characteristic")
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
        raise nothing_of(archive, asked)
    rows = [dict(zip(table.columns, row, strict=True)) for row in reversed(table.rows)]
    limits = {(row["low"], row["high"], row["unit"]) for row in rows}
    notes = list(cut(table.rows, asked.most))
    newest = rows[-1]
    if len(limits) > 1:
        keep = (newest["low"], newest["high"], newest["unit"])
        other = [row for row in rows if (row["low"], row["high"], row["unit"]) != keep]
        rows = [row for row in rows if (row["low"], row["high"], row["unit"]) == keep]
        notes.append(
            "1 job had other limits and is left out."
            if len(other) == 1
            else f"{len(other)} jobs had other limits and are left out."
        )
    made = _trend(asked.characteristic, rows)
    if made.why_not:
        notes.append(made.why_not)
    if made.caution:
        notes.append(made.caution)
    if made.capability is not None:
        notes.append(made.capability.words)
    notes += simulated_note(rows)
    shown = tuple(
        (
            wall(row["created_utc"]), row["station"], row["serial"], row["operator"],
            row["value"], row["uncertainty"], row["verdict"], row["why_not"],
        )
        for row in reversed(rows)
    )  # fmt: skip
    return ArchiveAnswer(
        f"{asked.part}: {asked.characteristic}{at_station(asked.station)}",
        ("Time", "Station", "Serial", "Operator", "Value", "U", "Verdict", "Not counted because"),
        shown,
        tuple(notes),
        (made,),
    )


def cpk_by_month(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return Cp and Cpk of the characteristics of a part, month by month, with their intervals.

    Raises
    ------
    InputError
        No part is named, or nothing is known of it.
    """
    needs(asked, "part")
    table = archive.ask(
        "SELECT characteristic, created_utc, value, uncertainty, low, high, unit, simulated"
        " FROM archived_result WHERE part = :part AND counted = 1"
        " AND (:name = '' OR characteristic = :name) AND (:station = '' OR station = :station)"
        " ORDER BY characteristic, created_utc LIMIT :most",
        {
            "part": asked.part, "name": asked.characteristic, "station": asked.station,
            "most": MOST_VALUES,
        },
    )  # fmt: skip
    if not table.rows:
        raise nothing_of(archive, asked)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    notes = simulated_note(rows)
    real = [row for row in rows if not row["simulated"]] or rows
    groups: dict[tuple[str, str, Cell, Cell, Cell], list[tuple[float, float]]] = defaultdict(list)
    for row in real:
        month = wall(row["created_utc"])[:7]
        key = (str(row["characteristic"]), month, row["low"], row["high"], row["unit"])
        groups[key].append((number_of(row["value"]), number_of(row["uncertainty"])))
    shown: list[Row] = []
    for (name, month, low, high, unit), values in groups.items():
        found = np.array(values)
        try:
            able = capability(
                found[:, 0], -math.inf if low is None else number_of(low),
                math.inf if high is None else number_of(high),
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
        f"{asked.part}: capability by month{at_station(asked.station)}",
        ("Characteristic", "Month", "Jobs", "Mean", "Sigma", "Cp", "Cpk", "Cpk low", "Cpk high",
         "Unit", "No index because"),
        tuple(shown),
        (*notes, *cut(table.rows, MOST_VALUES)),
    )  # fmt: skip


def rr(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return the gauge R&R over stations: parts by serial number, each measured at every station.

    Stations take the place of operators. Of each part as many measurements count at each station as
    the fewest have, the first ones; parts that some station did not measure are left out.

    Raises
    ------
    InputError
        There are fewer than two parts, stations or trials.
    """
    needs(asked, "part", "characteristic")
    table = archive.ask(
        "SELECT serial, station, value, low, high, simulated FROM archived_result"
        " WHERE part = :part AND characteristic = :name AND counted = 1 AND state = 'finished'"
        " ORDER BY created_utc, job_id LIMIT :most",
        {"part": asked.part, "name": asked.characteristic, "most": MOST_VALUES},
    )
    if not table.rows:
        raise nothing_of(archive, asked)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    notes = simulated_note(rows)
    real = [row for row in rows if not row["simulated"]] or rows
    cells: dict[tuple[str, str], list[float]] = defaultdict(list)
    for row in real:
        cells[str(row["serial"]), str(row["station"])].append(number_of(row["value"]))
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
        tolerance=number_of(high) - number_of(low) if both else None,
        one_sided=None
        if both
        else next((number_of(x) for x in (high, low) if x is not None), None),
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


def _trend(name: str, rows: list[dict[str, Cell]]) -> Trend:
    real = any(not row["simulated"] for row in rows)
    items, left_out, counted = [], [], []
    for row in rows:
        why = str(row["why_not"])
        if row["simulated"] and real:
            why = f"{SIMULATED}. {NO_REAL_PART}"
        label = f"{row['station']!s} {row['serial']!s}"
        value = None if why else number_of(row["value"])
        uncertainty = None if why else number_of(row["uncertainty"])
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
    low = -math.inf if rows[-1]["low"] is None else number_of(rows[-1]["low"])
    high = math.inf if rows[-1]["high"] is None else number_of(rows[-1]["high"])
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
