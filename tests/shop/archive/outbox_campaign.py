"""Kills and disconnections at random moments while jobs are put in and handed over.

A child puts jobs in, confirms each through a pipe, and hands over; it is killed at random moments,
repeatedly. Every confirmed job must be in the archive in the end, once.
"""

from __future__ import annotations

import contextlib
import os
import random
import signal
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ocmm_shop.archive.outbox import Courier, Outbox
from ocmm_shop.archive.records import ExtractedJob, JobRecord
from ocmm_shop.archive.stores._store import Archive
from tests.shop.archive.made_jobs import made_record


def quick_extract(
    content: bytes, name: str, station: str, known: Mapping[int, str] | None
) -> ExtractedJob:
    """Read rows from a file that holds nothing else, so that a round takes a millisecond."""
    number = int(content)
    return ExtractedJob(made_record(number, station, content=content), content)


_SENT = "sent"
_MOST_LINES = 8
"""A round has two to four: each job put in, and the hand-over."""
_START_S = 0.02
"""A child that is killed before its first line lives for a part of this."""


@dataclass(slots=True)
class Campaign:
    """What happened."""

    said: set[int]
    """Numbers of jobs that were put in and acknowledged."""
    kills: int = 0
    cuts: int = 0
    """How often it was cut off."""
    following: int = 1
    """The first number of the next life."""


def run(
    folder: Path, connect: Callable[[], Archive], kills: int, seed: int,
    cut: Callable[[], None] | None = None,
) -> Campaign:  # fmt: skip
    """Kill the child so often; each of its lives goes on with the numbers after the last one.

    Moments are counted in lines of the child and in shares of the time between two of them, which
    any computer reaches, however fast or busy.
    """
    rng = random.Random(seed)  # noqa: S311 - moments of kills
    done = Campaign(set())
    for _ in range(kills):
        read, write = os.pipe()
        child = os.fork()
        if child == 0:
            _live(folder, connect, done.following, write)
        os.close(write)
        wanted = rng.randint(0, _MOST_LINES)
        cut_after = rng.randint(0, wanted) if cut is not None and rng.random() < 0.5 else None
        lines: list[str] = []
        lasted = _START_S
        with os.fdopen(read) as stream:
            for number in range(wanted + 1):
                begun = time.monotonic()
                if number == cut_after and cut is not None:
                    cut()
                    done.cuts += 1
                if number < wanted:
                    lines.append(stream.readline())
                    lasted = time.monotonic() - begun
            time.sleep(rng.random() * lasted)
            os.kill(child, signal.SIGKILL)
            _, status = os.waitpid(child, 0)
            assert os.WIFSIGNALED(status), "the child ended by itself: see what it printed"
            done.kills += 1
            lines += stream.read().splitlines()
        said = {int(line) for line in lines if line.strip() != _SENT}
        assert not done.said & said
        done.said |= said
        # A number that was in work and not acknowledged is used no second time.
        done.following = max([done.following, *said]) + 2
    return done


def finish(folder: Path, connect: Callable[[], Archive]) -> None:
    """Hand over the rest."""
    with contextlib.closing(Courier(outbox := Outbox(folder), connect, "S", quick_extract)) as one:
        for _ in range(20):
            if one.send_waiting().error is None:
                break
        else:
            raise AssertionError("it cannot be handed over")
        assert not outbox.waiting()
        outbox.close()


def _live(folder: Path, connect: Callable[[], Archive], number: int, write: int) -> None:
    """Put in and hand over until killed; never returns."""
    try:
        outbox = Outbox(folder)
        courier = Courier(outbox, connect, "S", quick_extract)
        while True:
            for _ in range(1 + number % 3):
                outbox.put_content(b"%d" % number, folder / f"{number}.ocmm")
                os.write(write, b"%d\n" % number)
                number += 1
            courier.send_waiting()
            os.write(write, f"{_SENT}\n".encode())
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(1)


def count(archive: Archive) -> tuple[set[int], int, int, int]:
    """Return the arrived numbers, and the numbers of jobs, results and files."""
    files = archive.query("SELECT content FROM file").rows
    numbers = {int(row[0]) for row in files if isinstance(row[0], bytes)}
    jobs, results = (
        int(str(archive.query(f"SELECT count(*) FROM {table}").rows[0][0]))  # noqa: S608
        for table in ("job", "result")
    )
    return numbers, jobs, results, len(files)


def as_json(record: JobRecord) -> bytes:
    """Return rows as bytes, to compare them."""
    return msgspec.json.encode(record)
