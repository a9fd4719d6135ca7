"""Statistics count distinct finished parts of one limit and one kind; text of rows is cleaned."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_shop.archive.checks import verify_archive
from ocmm_shop.archive.questions import Query, cpk_by_month, passed, today, trend
from ocmm_shop.archive.records import Delivery, shown_text
from ocmm_shop.archive.stores import Archive
from tests.shop.archive.conftest import Place, by_hand
from tests.shop.archive.made_jobs import START, made_delivery, made_sender

D1 = Query(part="FLANGE", characteristic="D1")
DAY = START.astimezone().date()


def limited(delivery: Delivery, high: float) -> Delivery:
    rows = tuple(msgspec.structs.replace(row, high=high) for row in delivery.record.results)
    record = msgspec.structs.replace(delivery.record, results=rows)
    return msgspec.structs.replace(delivery, record=record)


def fill(archive: Archive) -> None:
    """Measure six parts: two of them again, three jobs are given up, and some are simulated."""
    for seed in range(6):
        archive.put(made_delivery(seed))
    for seed, part in ((6, 0), (7, 1), (8, 1)):
        archive.put(made_delivery(seed, serial=f"{part:05d}"))
    for seed in range(10, 13):
        archive.put(made_delivery(seed, state="paused", verdict="NOT COMPLETE", complete=False))
    for seed in range(20, 28):
        archive.put(made_delivery(seed, simulated=True))


def test_a_capability_counts_parts_and_not_jobs(place: Place) -> None:
    with place.open() as archive:
        fill(archive)
        (row,) = cpk_by_month(archive, D1).rows
        assert row[2] == 6
        answer = trend(archive, D1)
        (made,) = answer.trends
        assert made.capability is not None
        assert made.capability.count == 6
        assert "Measured again, counted once: 3." in answer.notes
        assert "Simulated jobs, not counted beside real ones: 8." in answer.notes
        assert {str(one[-1]) for one in answer.rows} == {
            "", "Measured again later.", "Not finished.",
        }  # fmt: skip
        # The last result of a part is its result.
        assert [one[4] for one in answer.rows if one[2] == "00001" and not one[-1]] == [
            made_delivery(8).record.results[1].value
        ]
        assert sum(int(str(one[3])) for one in passed(archive, Query()).rows) == 6
        assert today(archive, Query(first=DAY)).notes[0] == "Finished real parts: 6."
        by_sql = "SELECT parts, simulated FROM archive_month WHERE characteristic = 'D1' ORDER BY 2"
        assert archive.query(by_sql).rows == ((6, 0), (8, 1))


def test_the_newest_row_rules_neither_limits_nor_kind(place: Place) -> None:
    with place.open() as archive:
        fill(archive)
        archive.put(limited(made_delivery(30), 29.0))
        archive.put(made_delivery(31, simulated=True))
        answer = trend(archive, D1)
        assert [(one.high, len(one.values)) for one in answer.trends] == [(21.1, 6), (29.0, 1)]
        months = cpk_by_month(archive, D1).rows
        assert {(row[2], row[10]) for row in months} == {(1, 29.0), (6, 21.1)}


def test_the_filter_comes_before_the_limit_of_rows(place: Place) -> None:
    with place.open() as archive:
        for seed in range(5):
            archive.put(made_delivery(seed))
        for seed in range(5, 40):
            archive.put(made_delivery(seed, made_sender("Station 2", 2), simulated=seed % 2 == 0))
        for seed in range(40, 60):
            archive.put(made_delivery(seed, state="open", verdict="NOT COMPLETE", complete=False))
        asked = Query(part="FLANGE", characteristic="D1", station="Station 1", most=5, first=DAY)
        (made,) = trend(archive, asked).trends
        assert len(made.values) == 5
        assert len(today(archive, asked).rows) == 5
        (row,) = passed(archive, Query(station="Station 1", operator="Ben", most=1)).rows
        assert row[3] == 2


def test_only_simulated_jobs_are_said_to_be_simulated(place: Place) -> None:
    with place.open() as archive:
        for seed in range(6):
            archive.put(made_delivery(seed, simulated=True))
        for question in (trend, cpk_by_month):
            assert question(archive, D1).notes[0].startswith("SIMULATED")


HOSTILE = "\x1b[2J\x1b]0;owned\x07\u202eevil\u200b\x9b1m"


OF_PART = ("--part", "FLANGE", "--characteristic", "D1")
COMMANDS = {
    "today": ("--from", DAY.isoformat()), "trend": OF_PART, "passed": (), "used": ("tip", "T1"),
}  # fmt: skip


@pytest.mark.parametrize("question", sorted(COMMANDS))
def test_text_of_a_row_reaches_no_terminal_and_no_file(
    place: Place, tmp_path: Path, question: str
) -> None:
    with place.open() as archive:
        for seed in range(6):
            archive.put(made_delivery(seed))
        # As written with a tool of the store.
        sql = "UPDATE job SET {0} = :c" if place.store == "sqlite" else "UPDATE job SET {0} = "
        for column, text in (("serial", HOSTILE), ("operator", f"=HYPERLINK({HOSTILE})")):
            quoted = "'" + text.replace("'", "''") + "'"
            by_hand(archive, sql.format(column).replace(":c", "") + quoted)
        file = tmp_path / "t.csv"
        words = [question, *COMMANDS[question], "--archive", place.address, "--export", str(file)]
        done = CliRunner().invoke(app, ["archive", *words], env={"COLUMNS": "300"})
        assert done.exit_code == 0, done.output
        written = file.read_text("utf-8")
        assert "evil" in written
        for where in (done.output, written):
            lines = where.replace("\r", "").split("\n")
            assert [line for line in lines if not line.isprintable()] == []
        for row in csv.reader(io.StringIO(written)):
            assert not any(cell.startswith(("=", "+", "@")) for cell in row)
        for _, why in verify_archive(archive).faults:
            assert why.isprintable()


def test_text_is_cut_and_cleaned_by_one_function() -> None:
    assert shown_text("a\tb\nc\x1b") == "a\ufffdb\ufffdc\ufffd"
    assert shown_text("\u2028\u202e\ud800x", "?") == "???x"
    assert len(shown_text("x" * 10_000)) == 3000
    assert shown_text("Größe 5 µm ≤ √2") == "Größe 5 µm ≤ √2"
