"""Lists of jobs: what was measured, with what, and who passed what."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import date, datetime

from ocmm_core.archive.questions._answers import ArchiveAnswer
from ocmm_core.archive.questions._asked import (
    Asked,
    at_station,
    cut,
    needs,
    remark,
    span,
    wall,
)
from ocmm_core.archive.records import USES
from ocmm_core.archive.stores import Archive, Cell, Row
from ocmm_core.errors import InputError
from ocmm_core.tolerances.decisions import PartWord

_MOST_HASHES = 20
"""Identities that one shortened hash may stand for."""


def today(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return what was measured on a day, newest first."""
    first = asked.first or datetime.now().astimezone().date()
    last = asked.last or first
    low, high = span(first, last)
    table = archive.ask(
        "SELECT changed_utc, station, part, serial, operator, state, verdict, points, simulated,"
        " fault, held FROM archived_job WHERE changed_utc >= :low AND changed_utc < :high"
        " AND (:station = '' OR station = :station) ORDER BY changed_utc DESC LIMIT :most",
        {"low": low, "high": high, "station": asked.station, "most": asked.most},
    )
    rows = tuple(
        (wall(row[0]), *row[1:8], remark(bool(row[8]), str(row[9]), bool(row[10])))
        for row in table.rows
    )
    days = first.isoformat() if first == last else f"{first.isoformat()} to {last.isoformat()}"
    return ArchiveAnswer(
        f"Measured on {days}{at_station(asked.station)}",
        ("Time", "Station", "Part", "Serial", "Operator", "State", "Verdict", "Points", "Remark"),
        rows,
        cut(rows, asked.most),
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
    needs(asked, "what")
    # Each search goes along its index and ends at the most that is shown, however many jobs there
    # are; a hash may be shortened as screens show it.
    found: dict[tuple[Cell, ...], Row] = {}
    for column, word in _words_for(archive, asked):
        table = archive.ask(
            "SELECT used_utc, station, part, serial, operator, verdict, identity, name, simulated,"  # noqa: S608 - two columns
            f" fault, held, job_uuid FROM archived_use WHERE used_kind = :kind AND {column} = :word"
            " ORDER BY used_utc DESC LIMIT :most",
            {"kind": asked.kind, "word": word, "most": asked.most},
        )
        found |= {(row[11], row[6]): row for row in table.rows}
    newest = sorted(found.values(), key=lambda row: str(row[0]), reverse=True)[: asked.most]
    rows = tuple(
        (
            wall(row[0]), *row[1:6], row[7], str(row[6])[:12],
            remark(bool(row[8]), str(row[9]), bool(row[10])),
        )
        for row in newest
    )  # fmt: skip
    return ArchiveAnswer(
        f"Measured with {asked.kind} {asked.what[:40]}",
        ("Begun", "Station", "Part", "Serial", "Operator", "Verdict", "Name", "Identity", "Remark"),
        rows,
        cut(rows, asked.most),
    )


def _words_for(archive: Archive, asked: Asked) -> Iterator[tuple[str, str]]:
    """Give what is looked for in which column: a name, an identity, those that begin with it."""
    yield "name", asked.what
    yield "identity", asked.what
    # Only hashes are shortened: a serial number B-1 is not B-17.
    if not _is_short_hash(asked.what):
        return
    last = asked.what
    for _ in range(_MOST_HASHES):
        # One step along the index for each: a DISTINCT would look at every job.
        table = archive.ask(
            "SELECT identity FROM archived_use WHERE used_kind = :kind AND identity > :last"
            " AND identity < :beyond ORDER BY identity LIMIT 1",
            {"kind": asked.kind, "last": last, "beyond": f"{asked.what}g"},
        )
        if not table.rows:
            return
        last = str(table.rows[0][0])
        yield "identity", last


def passed(archive: Archive, asked: Asked) -> ArchiveAnswer:
    """Return who passed what: finished real jobs by operator, part and verdict."""
    low, high = span(asked.first or date(1970, 1, 1), asked.last or date(9000, 1, 1))
    table = archive.ask(
        "SELECT operator, part, station, count(*),"
        " sum(CASE WHEN verdict = :conforms THEN 1 ELSE 0 END),"
        " sum(CASE WHEN verdict = :fails THEN 1 ELSE 0 END),"
        " sum(CASE WHEN verdict NOT IN (:conforms, :fails)"
        " THEN 1 ELSE 0 END), max(changed_utc) FROM archived_job"
        " WHERE state = 'finished' AND simulated = 0 AND fault = '' AND held = 0"
        " AND changed_utc >= :low AND changed_utc < :high"
        " AND (:operator = '' OR operator = :operator) AND (:part = '' OR part = :part)"
        " AND (:station = '' OR station = :station)"
        " GROUP BY operator, part, station ORDER BY operator, part, station LIMIT :most",
        {
            "low": low, "high": high, "operator": asked.operator, "part": asked.part,
            "station": asked.station, "most": asked.most, "conforms": PartWord.CONFORMS.value,
            "fails": PartWord.DOES_NOT_CONFORM.value,
        },
    )  # fmt: skip
    rows = tuple(
        (*row[:3], *(int(str(cell)) for cell in row[3:7]), wall(row[7])) for row in table.rows
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
        (*notes, *cut(rows, asked.most)),
    )


def _is_short_hash(text: str) -> bool:
    return 6 <= len(text) <= 64 and all(c in "0123456789abcdef" for c in text)
