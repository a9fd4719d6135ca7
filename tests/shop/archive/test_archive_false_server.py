"""A server that lies: each lie ends in time and memory, has its sentence, and no job is lost."""

from __future__ import annotations

import itertools
import resource
import struct
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from ocmm_core.errors import OcmmError, StorageError
from ocmm_shop.archive.outbox import Courier, Handed, ItemState, Outbox, hand_over
from ocmm_shop.archive.questions import QUESTIONS, Query
from ocmm_shop.archive.stores import Archive, parse_server
from ocmm_shop.archive.stores import _postgresql as postgresql
from ocmm_shop.archive.stores._postgresql import PostgresArchive
from tests.host import needs_package
from tests.shop.archive.false_server import (
    DATE,
    FLOAT8,
    INT8,
    TEXT,
    FalseServer,
    Lie,
    Pieces,
    answer,
    columns,
    done,
    message,
    row,
    whole,
)
from tests.shop.archive.outbox_campaign import quick_extract

LIMIT_MS, LIMIT_BYTES = 1500, 300_000_000
"""The product's limits are 30 s and 2 GB."""
LONGEST_S = 30.0
"""Far above the limit and its five seconds of grace, for a computer that does other work."""
MOST_BYTES = 4 * LIMIT_BYTES
"""An answer is checked ten times a second: data between two checks exceed the limit."""


def at(word: str, lie: Callable[[], Pieces]) -> Lie:
    """Return a server that lies about statements with a given word."""
    return lambda sql: lie() if word in sql else None


def endless_rows() -> Pieces:
    yield columns(INT8, binary=True)
    many = row(whole(1)) * 20_000
    for _ in range(50_000):
        yield many
    yield done("SELECT 1000000000")


def endless_rows_of_nothing() -> Pieces:
    yield columns(TEXT, binary=False)
    yield from itertools.repeat(row(b"x" * 50) * 20_000)


def endless_notifications() -> Pieces:
    yield from itertools.repeat(message(b"A", struct.pack("!i", 1) + b"x\0" + b"y" * 7000 + b"\0"))


def notice(size: int) -> Pieces:
    yield message(b"N", b"SNOTICE\0C00000\0M" + b"x" * size + b"\0\0")
    yield from answer([INT8], [whole(0)])


def error_of(size: int) -> Pieces:
    yield message(b"E", b"SERROR\0CXX000\0M" + b"x " * (size // 2) + b"\0\0")


def negative_length() -> Pieces:
    yield columns(INT8, binary=True)
    yield b"D" + struct.pack("!i", -5) + b"garbage"


def negative_cell() -> Pieces:
    yield columns(INT8, binary=True)
    yield message(b"D", struct.pack("!hi", 1, -7) + b"12345678")
    yield done("SELECT 1")


@dataclass(frozen=True)
class Lying:
    """A lie, and the resulting message."""

    lie: Lie
    codes: tuple[str, ...]


SEQUENCE = "max(CAST(sequence"
LIES = {
    "10^9 rows": Lying(at(SEQUENCE, endless_rows), ("archive.too_large", "archive.slow")),
    "rows of a BEGIN": Lying(
        at("BEGIN", endless_rows_of_nothing), ("archive.too_large", "archive.slow")
    ),
    "notifications": Lying(
        at(SEQUENCE, endless_notifications), ("archive.too_large", "archive.slow")
    ),
    "an error of 100 MB": Lying(
        at(SEQUENCE, lambda: error_of(100_000_000)),
        # A busy computer needs longer than the limit for 100 MB.
        ("archive.unreachable", "archive.too_large", "archive.slow"),
    ),
    "a text for a number": Lying(at(SEQUENCE, lambda: answer([TEXT], [b"7"])), (
        "archive.not_understood",
    )),
    "no number in a number": Lying(
        at("max(version)", lambda: answer([INT8], [b"seven"], binary=False)),
        ("archive.row", "archive.not_understood"),
    ),
    "a fraction": Lying(at(SEQUENCE, lambda: answer([FLOAT8], [struct.pack("!d", 0.5)])), (
        "archive.not_understood",
    )),
    "a date": Lying(at(SEQUENCE, lambda: answer([DATE], [struct.pack("!i", 9)])), (
        "archive.not_understood",
    )),
    "a date beyond all dates": Lying(
        at(SEQUENCE, lambda: answer([DATE], [struct.pack("!i", 2**31 - 9)])),
        ("archive.row", "archive.not_understood"),
    ),
    "two rows": Lying(at(SEQUENCE, lambda: answer([INT8], [whole(1)], [whole(2)])), (
        "archive.not_understood",
    )),
    "no row": Lying(at(SEQUENCE, lambda: answer([INT8])), ("archive.not_understood",)),
    "no column": Lying(at(SEQUENCE, lambda: answer([], [])), ("archive.not_understood",)),
    "two columns": Lying(at(SEQUENCE, lambda: answer([INT8, INT8], [whole(1), whole(2)])), (
        "archive.not_understood",
    )),
    "a negative length": Lying(at(SEQUENCE, negative_length), ("archive.not_understood",)),
    "a cell of a negative length": Lying(at(SEQUENCE, negative_cell), (
        "archive.not_understood",
    )),
    "an unknown encoding": Lying(
        at(SEQUENCE, lambda: iter([message(b"S", b"client_encoding\0KLINGON\0"),
                                   *answer([TEXT], [b"x"], binary=False)])),
        ("archive.not_understood",),
    ),
    "no UTF-8": Lying(at(SEQUENCE, lambda: answer([TEXT], [b"\xff\xfe"])), (
        "archive.row", "archive.not_understood",
    )),
    "a version of 10^18": Lying(
        at("max(version)", lambda: answer([INT8], [b"999999999999999999"], binary=False)),
        ("archive.newer",),
    ),
    "a negative version": Lying(
        at("max(version)", lambda: answer([INT8], [b"-3"], binary=False)), ("archive.older",)
    ),
    "a clock that is none": Lying(
        at("to_char(clock", lambda: answer([TEXT], [b"noon"], binary=False)),
        ("archive.not_understood",),
    ),
    "copy instead of rows": Lying(
        at(SEQUENCE, lambda: iter([message(b"G", struct.pack("!bh", 0, 0))])),
        ("archive.not_understood", "archive.slow", "archive.unreachable"),
    ),
}  # fmt: skip


@pytest.fixture
def folder() -> Iterator[Path]:
    needs_package("psycopg", "extra `shop`")
    # The path of a socket is short.
    with tempfile.TemporaryDirectory(prefix="ocmm-false-") as name:
        yield Path(name)


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(postgresql, "_ANSWER_BYTES", LIMIT_BYTES)


def opened(server: FalseServer) -> Archive:
    return PostgresArchive(replace(parse_server(server.address), limit_ms=LIMIT_MS))


def handed_to(server: FalseServer, outbox: Outbox) -> Handed:
    courier = Courier(outbox, lambda: opened(server), "S", quick_extract)
    try:
        return courier.send_waiting()
    finally:
        courier.close()


@pytest.mark.parametrize("name", LIES)
def test_a_lie_has_its_sentence_and_its_end_and_the_job_waits(
    folder: Path, tmp_path: Path, name: str
) -> None:
    lying = LIES[name]
    begun, had = time.monotonic(), peak()
    with FalseServer(folder, lying.lie) as server, Outbox(tmp_path / "outbox") as outbox:
        outbox.put_content(b"1", tmp_path / "1.ocmm")
        handed = handed_to(server, outbox)
        assert handed.error is not None, "it was believed"
        assert handed.error.code in lying.codes, str(handed.error)
        assert (handed.sent, handed.aside) == (0, 0)
        assert outbox.count(ItemState.WAITING) == 1
        told = hand_over(outbox.folder).line
    assert len(told) < 1500
    assert told.startswith("1 job waits for the archive")
    assert time.monotonic() - begun < LONGEST_S
    assert peak() - had < MOST_BYTES


def peak() -> int:
    """Return the peak memory of this process, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def test_a_notice_of_100_mb_changes_nothing(folder: Path) -> None:
    with FalseServer(folder, at(SEQUENCE, lambda: notice(100_000_000))) as server:
        archive = opened(server)
        assert archive.last_sequence("x") == 0
        archive.close()


def test_a_server_that_answers_byte_by_byte_is_given_up_in_time(
    folder: Path, tmp_path: Path
) -> None:
    begun = time.monotonic()
    with (
        FalseServer(folder, lambda sql: None, pause_s=0.2) as server,
        Outbox(tmp_path / "outbox") as outbox,
    ):
        outbox.put_content(b"1", tmp_path / "1.ocmm")
        handed = handed_to(server, outbox)
        assert handed.error is not None
        assert handed.error.code in ("archive.slow", "archive.unreachable")
        assert outbox.count(ItemState.WAITING) == 1
    assert time.monotonic() - begun < LONGEST_S


def slow_answer() -> Pieces:
    for piece in answer([INT8], [whole(0)]):
        for place in range(len(piece)):
            time.sleep(0.5)
            yield piece[place : place + 1]


def test_one_answer_that_comes_byte_by_byte_is_given_up_in_time(folder: Path) -> None:
    """The connection is good; each byte comes in time, all of them do not."""
    begun = time.monotonic()
    with FalseServer(folder, at(SEQUENCE, slow_answer)) as server:
        archive = opened(server)
        with pytest.raises(StorageError) as caught:
            archive.last_sequence("x")
        archive.close()
    assert caught.value.code == "archive.slow"
    assert time.monotonic() - begun < LONGEST_S


def test_a_server_that_says_yes_to_everything_and_keeps_nothing_gets_no_job(
    folder: Path, tmp_path: Path
) -> None:
    def yes(sql: str) -> Pieces | None:
        if "FROM station" in sql:
            return answer([TEXT] * 3, [b"", b"host", b"2026"], binary=False)
        if "RETURNING id" in sql:
            return answer([INT8], [b"7"], binary=False)
        return None

    with FalseServer(folder, yes) as server, Outbox(tmp_path / "outbox") as outbox:
        outbox.put_content(b"1", tmp_path / "1.ocmm")
        handed = handed_to(server, outbox)
        assert handed.error is not None
        assert handed.error.code in ("archive.changes", "archive.not_kept")
        assert outbox.count(ItemState.WAITING) == 1


@pytest.mark.parametrize("question", [one.name for one in QUESTIONS])
def test_a_question_shows_nothing_of_an_answer_that_is_none(folder: Path, question: str) -> None:
    """Every question, with rows of too few columns, of other kinds, and of no numbers."""
    asked = Query(part="P", characteristic="D", what="B-17", kind="artefact")
    (one,) = (one for one in QUESTIONS if one.name == question)
    nan, number = struct.pack("!d", float("nan")), struct.pack("!d", 1.0)
    for kinds, cells in (
        ([INT8], [whole(1)]), ([TEXT] * 15, [b"x"] * 15), ([FLOAT8] * 15, [nan] * 15),
        ([FLOAT8] * 9, [number] * 9),
    ):  # fmt: skip
        place = folder / str(len(list(folder.iterdir())))
        place.mkdir()
        with FalseServer(place, at("archived_", lambda k=kinds, c=cells: answer(k, c))) as server:  # type: ignore[misc]
            archive = opened(server)
            try:
                with pytest.raises(OcmmError) as caught:
                    one.answer(archive, asked)
                # Without data about a part there is no answer either.
                assert caught.value.code in ("archive.not_understood", "archive.part")
            finally:
                archive.close()
