"""Queries on both stores: the answers, exclusions, and exports."""

from __future__ import annotations

import csv
import io
from datetime import date, datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_shop.archive.questions import (
    QUESTIONS,
    Query,
    cpk_by_month,
    export_answer,
    parts,
    passed,
    rr,
    today,
    trend,
    used,
)
from ocmm_shop.archive.records import Delivery
from ocmm_shop.archive.stores import Archive
from ocmm_shop.studies import gauge_study
from tests.shop.archive.conftest import Place
from tests.shop.archive.made_jobs import START, made_delivery, made_record, made_sender

DAY = START.astimezone().date()


def fill(archive: Archive, count: int = 60) -> None:
    archive.put_all([made_delivery(seed) for seed in range(count)])


def test_a_days_list_has_the_jobs_of_that_day_newest_first(place: Place) -> None:
    with place.open() as archive:
        # One job a minute would stay within the day; seven minutes apart 60 take seven hours.
        fill(archive)
        answer = today(archive, Query(first=DAY))
        assert len(answer.rows) == 60
        assert answer.rows[0][0] > answer.rows[-1][0]  # type: ignore[operator]
        assert today(archive, Query(first=DAY + timedelta(days=1))).rows == ()
        assert today(archive, Query(first=DAY, station="Station 9")).rows == ()
        few = today(archive, Query(first=DAY, most=5))
        assert len(few.rows) == 5
        assert few.notes == ("Finished real parts: 5.", "Only the first 5 are shown.")


def test_a_day_is_that_of_the_clock_on_the_wall(place: Place) -> None:
    with place.open() as archive:
        midnight = datetime(2026, 5, 4).astimezone()
        for number, minutes in enumerate((-1, 0, 24 * 60 - 1, 24 * 60)):
            utc = (midnight + timedelta(minutes=minutes)).astimezone(START.tzinfo)
            archive.put(made_delivery(number, changed_utc=utc.isoformat(timespec="milliseconds")))
        rows = today(archive, Query(first=date(2026, 5, 4))).rows
        assert [row[3] for row in rows] == ["00002", "00001"]


def test_a_trend_has_chart_run_rules_and_cpk_over_stations(place: Place) -> None:
    other = made_sender("Station 2", 2)
    with place.open() as archive:
        fill(archive, 20)
        archive.put_all([made_delivery(seed, other) for seed in range(20, 40)])
        answer = trend(archive, Query(part="FLANGE", characteristic="D1"))
        assert {row[1] for row in answer.rows} == {"Station 1", "Station 2"}
        (chart,) = answer.trends
        assert chart.chart is not None
        assert chart.capability is not None
        values = [made_record(seed).results[1].value for seed in range(40)]
        np.testing.assert_allclose(chart.values, np.array(values))
        assert (chart.low, chart.high) == (20.9, 21.1)
        only = trend(archive, Query(part="FLANGE", characteristic="D1", station="Station 2"))
        assert len(only.rows) == 20


def test_what_is_in_doubt_is_in_the_list_and_not_in_the_chart(place: Place) -> None:
    with place.open() as archive:
        fill(archive, 10)
        archive.put(made_delivery(10, fault="Altered after it was archived: step 3."))
        archive.put(made_delivery(11, simulated=True))
        answer = trend(archive, Query(part="FLANGE", characteristic="D1"))
        (chart,) = answer.trends
        assert len(answer.rows) == 11
        assert len(chart.values) == 10
        altered = next(row for row in answer.rows if str(row[-1]).startswith("Altered"))
        assert altered[-2] == "NOT PROVEN"
        assert [row[6] for row in today(archive, Query(first=DAY)).rows].count("NOT PROVEN") == 1
        assert "Simulated jobs, not counted beside real ones: 1." in answer.notes
        assert any("Altered" in one for one in chart.left_out)
        assert passed(archive, Query()).notes == ("Jobs in doubt, not counted: 1.",)


def test_a_trend_is_split_where_limits_were_changed(place: Place) -> None:
    with place.open() as archive:
        fill(archive, 10)
        made = made_delivery(50)
        changed = tuple(msgspec.structs.replace(row, high=25.0) for row in made.record.results)
        record = msgspec.structs.replace(made.record, results=changed)
        archive.put(msgspec.structs.replace(made, record=record))
        answer = trend(archive, Query(part="FLANGE", characteristic="D1"))
        assert answer.notes[0] == "Limits were changed: 2 trends, one for each pair of limits."
        assert len(answer.rows) == 11
        assert [(one.low, one.high, len(one.values)) for one in answer.trends] == [
            (20.9, 21.1, 10), (20.9, 25.0, 1),
        ]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "what", "count"),
    [
        ("artefact", "B-17", 12),
        ("artefact", "B-1", 0),
        ("tip", "T1", 12),
        ("calibration", "", 12),
        ("calibration", "short", 12),
    ],
)
def test_where_something_was_used(place: Place, kind: str, what: str, count: int) -> None:
    calibration = made_record(1).job.calibration
    what = {"": calibration, "short": calibration[:12]}.get(what, what)
    with place.open() as archive:
        fill(archive, 12)
        assert len(used(archive, Query(kind=kind, what=what)).rows) == count


def test_who_passed_what(place: Place) -> None:
    with place.open() as archive:
        fill(archive, 9)
        archive.put(made_delivery(9, verdict="PART DOES NOT CONFORM"))
        answer = passed(archive, Query())
        assert [row[:7] for row in answer.rows] == [
            ("Anna", "FLANGE", "Station 1", 4, 3, 1, 0),
            ("Ben", "FLANGE", "Station 1", 3, 3, 0, 0),
            ("Cleo", "FLANGE", "Station 1", 3, 3, 0, 0),
        ]
        assert len(passed(archive, Query(operator="Ben")).rows) == 1


def test_cpk_by_month_is_that_of_the_batch_page(place: Place) -> None:
    with place.open() as archive:
        fill(archive, 40)
        answer = cpk_by_month(archive, Query(part="FLANGE", characteristic="D1"))
        (row,) = answer.rows
        assert row[:3] == ("D1", DAY.isoformat()[:7], 40)
        able = trend(archive, Query(part="FLANGE", characteristic="D1")).trends[0].capability
        assert able is not None
        assert row[5:9] == (able.cp, able.cpk, able.cpk_low, able.cpk_high)


def test_rr_over_stations_is_the_study_of_the_same_values(place: Place) -> None:
    rng = np.random.default_rng(3)
    values = 20.0 + rng.normal(0.0, 0.05, (5, 1, 1)) + rng.normal(0.0, 0.004, (5, 3, 2))
    with place.open() as archive:
        number = 0
        for part in range(5):
            for station in range(3):
                for trial in range(2):
                    number += 1
                    sender = made_sender(f"Station {station}", station + 1)
                    archive.put(study_job(number, sender, part, values[part, station, trial]))
        # A part that only one station measured.
        archive.put(study_job(99, made_sender("Station 0", 1), 9, 20.0))
        answer = rr(archive, Query(part="FLANGE", characteristic="D0"))
        expected = gauge_study(values, tolerance=20.1 - 19.9)
        assert answer.study is not None
        assert answer.study.grr == pytest.approx(expected.grr)
        assert answer.study.av == pytest.approx(expected.av)
        assert answer.notes == ("Parts not measured twice at every station, left out: 1.",)


def study_job(number: int, sender: object, part: int, value: float) -> Delivery:
    made = made_delivery(number, sender, serial=f"P{part}")  # type: ignore[arg-type]
    first = msgspec.structs.replace(made.record.results[0], value=float(value))
    record = msgspec.structs.replace(made.record, results=(first, *made.record.results[1:]))
    return msgspec.structs.replace(made, record=record)


def test_what_is_not_there_is_said_with_what_there_is(place: Place) -> None:
    with place.open() as archive:
        fill(archive, 3)
        assert parts(archive)[0] == ("FLANGE", "D0")
        with pytest.raises(InputError, match=r"No archived part is called 'X'\. There are: FLANGE"):
            trend(archive, Query(part="X", characteristic="D1"))
        with pytest.raises(InputError, match="Its characteristics: D0, D1, D2"):
            trend(archive, Query(part="FLANGE", characteristic="D9"))
        with pytest.raises(InputError, match="needs at least two parts"):
            rr(archive, Query(part="FLANGE", characteristic="D0"))
        with pytest.raises(InputError, match="is before"):
            today(archive, Query(first=DAY, last=DAY - timedelta(days=1)))


def test_injection_in_every_field_of_a_question_has_no_effect(place: Place) -> None:
    nasty = (
        "'; DROP TABLE job; --", '" OR 1=1', "x' UNION SELECT content FROM file --", "%s", ":part",
        "\\'; DELETE FROM result;", "%(part)s",
    )  # fmt: skip
    with place.open() as archive:
        fill(archive, 3)
        for text in nasty:
            asked = Query(
                station=text, part=text, characteristic=text, operator=text, what=text, first=DAY
            )
            for question in QUESTIONS:
                try:
                    assert question.answer(archive, asked).rows == ()
                except InputError:
                    continue
        assert archive.query("SELECT count(*) FROM job").rows == ((3,),)
        assert archive.query("SELECT count(*) FROM result").rows == ((9,),)


def test_a_table_is_exported_with_full_digits_and_without_formulas(
    place: Place, tmp_path: Path
) -> None:
    with place.open() as archive:
        archive.put(made_delivery(1, operator="=HYPERLINK(1)", serial="+1"))
        archive.put(made_delivery(2))
        answer = trend(archive, Query(part="FLANGE", characteristic="D1"))
    export_answer(answer, tmp_path / "t.csv")
    rows = list(csv.reader(io.StringIO((tmp_path / "t.csv").read_text("utf-8"))))
    assert rows[0] == list(answer.columns)
    assert rows[2][2:4] == ["'+1", "'=HYPERLINK(1)"]
    assert float(rows[2][4]) == made_record(1).results[1].value
    with pytest.raises(InputError, match=r"neither \.csv nor \.parquet"):
        export_answer(answer, tmp_path / "t.xls")
