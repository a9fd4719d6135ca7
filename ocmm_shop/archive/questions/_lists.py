"""Lists of jobs: measured on a day, by equipment, and passed by operator."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from datetime import date, datetime

from ocmm_core.errors import InputError
from ocmm_core.tolerances.decisions import PartWord
from ocmm_shop.archive.questions import _judge
from ocmm_shop.archive.records import USES
from ocmm_shop.archive.stores import Archive, Cell

_MOST_HASHES = 20
"""Identities that one shortened hash may match."""


def today(archive: Archive, asked: _judge.Query) -> _judge.ArchiveAnswer:
    """Return the jobs measured on a day, newest first."""
    first = asked.first or datetime.now().astimezone().date()
    last = asked.last or first
    low, high = _judge.span(first, last)
    entries = [
        entry
        for entry in _judge.Judge(archive).rows(
            f"SELECT {_judge.JUDGED}, changed_utc, part, serial, operator, state, verdict, points,"  # noqa: S608
            " simulated, requirements FROM archived_line"
            " WHERE changed_utc >= :low AND changed_utc < :high"
            " ORDER BY changed_utc DESC, job_id DESC",
            {"low": low, "high": high}, asked.most, lambda entry: _is_at(entry, asked),
        )
        if _is_at(entry, asked)
    ]  # fmt: skip
    shown = ("station", "part", "serial", "operator", "state", "verdict", "points")
    rows = tuple(
        (_judge.wall(one["changed_utc"]), *(one[name] for name in shown), _judge.remark(one))
        for one in entries
    )
    finished = [one for one in entries if one["state"] == "finished" and not one["doubt"]]
    real = {(one["part"], _judge.part_of(one)) for one in finished if not one["simulated"]}
    days = first.isoformat() if first == last else f"{first.isoformat()} to {last.isoformat()}"
    return _judge.ArchiveAnswer(
        f"Measured on {days}{_judge.at_station(asked.station)}",
        ("Time", "Station", "Part", "Serial", "Operator", "State", "Verdict", "Points", "Remark"),
        rows,
        (f"Finished real parts: {len(real)}.", *_judge.cut(rows, asked.most)) if rows else (),
    )


def _is_at(entry: _judge.Entry, asked: _judge.Query) -> bool:
    return not asked.station or entry["station"] == asked.station


def used(archive: Archive, asked: _judge.Query) -> _judge.ArchiveAnswer:
    """Return jobs by equipment, newest first; InputError if kind or name is invalid."""
    if asked.kind not in USES:
        raise InputError(
            "archive.used", f"{asked.kind!r} is nothing that is used.", f"One of {', '.join(USES)}."
        )
    _judge.needs(asked, "what")
    # Each search uses its index and ends at the limit, regardless of the number of jobs; a hash may
    # be shortened as on screens.
    found: dict[tuple[Cell, ...], _judge.Entry] = {}
    judge = _judge.Judge(archive)
    for column, word in _words_for(archive, asked):
        entries = judge.rows(
            f"SELECT {_judge.JUDGED}, used_utc, part, serial, operator, verdict, identity, name,"  # noqa: S608
            " simulated, requirements FROM archived_use"
            f" WHERE used_kind = :kind AND {column} = :word ORDER BY used_utc DESC",
            {"kind": asked.kind, "word": word}, asked.most, lambda _: True,
        )  # fmt: skip
        found |= {(one["job_uuid"], one["identity"]): one for one in entries}
    newest = sorted(found.values(), key=lambda one: str(one["used_utc"]), reverse=True)
    shown = ("station", "part", "serial", "operator", "verdict", "name")
    rows = tuple(
        (
            _judge.wall(one["used_utc"]), *(one[name] for name in shown), str(one["identity"])[:12],
            _judge.remark(one),
        )
        for one in newest[: asked.most]
    )  # fmt: skip
    return _judge.ArchiveAnswer(
        f"Measured with {asked.kind} {asked.what[:40]}",
        ("Begun", "Station", "Part", "Serial", "Operator", "Verdict", "Name", "Identity", "Remark"),
        rows,
        _judge.cut(rows, asked.most),
    )


def _words_for(archive: Archive, asked: _judge.Query) -> Iterator[tuple[str, str]]:
    """Yield column and value of each search: a name, an identity, identities with a prefix."""
    yield "name", asked.what
    yield "identity", asked.what
    # Only hashes are shortened: serial number B-1 is not B-17.
    if not re.fullmatch("[0-9a-f]{6,64}", asked.what):
        return
    last = asked.what
    for _ in range(_MOST_HASHES):
        # One index step each: a DISTINCT would read every job.
        table = archive.query(
            "SELECT identity FROM archived_use WHERE used_kind = :kind AND identity > :last"
            " AND identity < :beyond ORDER BY identity LIMIT 1",
            {"kind": asked.kind, "last": last, "beyond": f"{asked.what}g"},
        )
        if not table.rows:
            return
        last = str(table.rows[0][0])
        yield "identity", last


def passed(archive: Archive, asked: _judge.Query) -> _judge.ArchiveAnswer:
    """Return finished real parts by operator, part and verdict."""
    low, high = _judge.span(asked.first or date(1970, 1, 1), asked.last or date(9000, 1, 1))
    entries = list(
        _judge.Judge(archive).rows(
            f"SELECT {_judge.JUDGED}, operator, part, serial, verdict, changed_utc, requirements"  # noqa: S608
            " FROM archived_line WHERE state = 'finished' AND simulated = 0"
            " AND changed_utc >= :low AND changed_utc < :high AND (:operator = '' OR operator = "
            ":operator) AND (:part = '' OR part = :part) ORDER BY changed_utc DESC, job_id DESC",
            {"low": low, "high": high, "operator": asked.operator, "part": asked.part},
            _judge.MOST_VALUES, lambda _: True,
        )
    )  # fmt: skip
    entries = [one for one in entries if _is_at(one, asked)]
    # For a part measured again the last result counts, for its operator.
    last: dict[tuple[Cell, str], _judge.Entry] = {}
    for one in entries:
        if not one["doubt"]:
            last.setdefault((one["part"], _judge.part_of(one)), one)
    groups: dict[tuple[str, str, str], list[_judge.Entry]] = defaultdict(list)
    for one in last.values():
        groups[str(one["operator"]), str(one["part"]), str(one["station"])].append(one)
    rows = tuple(
        (
            *names,
            len(group),
            *_verdicts(group),
            _judge.wall(max(str(one["changed_utc"]) for one in group)),
        )
        for names, group in sorted(groups.items())
    )[: asked.most]
    left = sum(bool(one["doubt"]) for one in entries)
    again = len(entries) - left - len(last)
    notes = [f"Jobs in doubt, not counted: {left}."] if left else []
    notes += [f"Measured again, counted once: {again}."] if again else []
    counts = Counter(
        str(one["requirements"])
        for one in last.values()
        if one["requirements"] and one["verdict"] == PartWord.CONFORMS.value
    )
    notes += [f"Conform, {n:d} parts: {sentence}." for sentence, n in counts.items()]
    return _judge.ArchiveAnswer(
        "Who passed what",
        ("Operator", "Part", "Station", "Parts", "Conform", "Do not conform", "Neither", "Last"),
        rows,
        (*notes, *_judge.cut(rows, asked.most), *_judge.cut(entries, _judge.MOST_VALUES)),
    )


def _verdicts(group: Sequence[_judge.Entry]) -> tuple[int, int, int]:
    words = [one["verdict"] for one in group]
    good, bad = words.count(PartWord.CONFORMS.value), words.count(PartWord.DOES_NOT_CONFORM.value)
    return good, bad, len(words) - good - bad
