"""Queries use an index: their time does not depend on the number of jobs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest

from ocmm_shop.archive.questions import Query, parts, today, trend, used
from ocmm_shop.archive.stores import Archive
from ocmm_shop.archive.stores._interface import Cell, Table
from ocmm_shop.archive.stores._sqlite import SqliteArchive
from tests.shop.archive.conftest import Place
from tests.shop.archive.made_jobs import START, made_delivery

JOBS = 40


class Explained:
    """An archive of which every question is explained before it is answered."""

    def __init__(self, archive: Archive) -> None:
        self._archive = archive
        self.place = archive.place
        self.steps: list[str] = []
        self.how = (
            "EXPLAIN QUERY PLAN" if isinstance(archive, SqliteArchive) else "EXPLAIN (COSTS OFF)"
        )

    def query(self, sql: str, values: Mapping[str, Cell] | None = None) -> Table:
        with self._archive._transaction():  # noqa: SLF001 - as one who tunes a server
            if not isinstance(self._archive, SqliteArchive):
                # With forty jobs reading all is quickest; with many it is not.
                self._archive._run("SET LOCAL enable_seqscan = off")  # noqa: SLF001
            table = self._archive._run(f"{self.how} {sql}", values)  # noqa: SLF001
        self.steps += [str(row[-1]).strip() for row in table.rows]
        return self._archive.query(sql, values)


@pytest.mark.parametrize("question", ["today", "trend", "used", "used short", "parts"])
def test_a_question_reads_no_table_from_end_to_end(place: Place, question: str) -> None:
    asked = Query(part="FLANGE", characteristic="D1", first=START.astimezone().date())
    with place.open() as archive:
        archive.put_all([made_delivery(seed) for seed in range(JOBS)])
        explained = Explained(archive)
        if question == "today":
            assert today(explained, asked).rows  # type: ignore[arg-type]
        elif question == "trend":
            assert trend(explained, asked).rows  # type: ignore[arg-type]
        elif question == "parts":
            assert parts(explained)  # type: ignore[arg-type]
        else:
            (known,) = archive.query(
                "SELECT DISTINCT identity FROM archived_use WHERE used_kind = 'calibration'"
            ).rows
            what = str(known[0])[: 12 if question == "used short" else 64]
            asked = replace(asked, kind="calibration", what=what)
            assert len(used(explained, asked).rows) == JOBS  # type: ignore[arg-type]
    text = "\n".join(explained.steps)
    assert "index" in text.lower()
    # The steps of `archive_characteristic` are its own rows, not a table's; a key (k) is a row for
    # each station.
    whole = [
        step
        for step in explained.steps
        if step.lstrip("-> ").startswith(("Seq Scan", "SCAN"))
        and step.split()[-1] not in ("p", "c", "k")
    ]
    assert whole == [], text


def test_a_shortened_hash_finds_every_one_that_begins_so(place: Place) -> None:
    from msgspec import structs

    with place.open() as archive:
        for number in range(5):
            made = made_delivery(number)
            identity = f"abcdef{number}" + "0" * 57
            uses = tuple(
                structs.replace(use, identity=identity) if use.kind == "calibration" else use
                for use in made.record.uses
            )
            record = structs.replace(made.record, uses=uses)
            archive.put(structs.replace(made, record=record))
        assert len(used(archive, Query(kind="calibration", what="abcdef")).rows) == 5
        assert len(used(archive, Query(kind="calibration", what="abcdef3")).rows) == 1
        few = used(archive, Query(kind="calibration", what="abcdef", most=2))
        assert len(few.rows) == 2
        assert few.rows[0][0] >= few.rows[1][0]  # type: ignore[operator]
        assert few.notes == ("Only the first 2 are shown.",)
        # By its name all have it.
        assert len(used(archive, Query(kind="calibration", what="hall3")).rows) == 5
