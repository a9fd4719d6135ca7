"""Disk faults: every writing system call fails with every disk error, once or permanently.

Trials enumerate work, call, occurrence, error and duration. A separate program with the faulty disk
preloaded forks for each of them.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ocmm_bench.campaign._faulty_disk import CALLS, FaultyDisk, build, served, why_not_here
from ocmm_bench.campaign._trials import NotRunError, Trial, forked, read_numbers
from ocmm_bench.campaign._work import WORKS, outcome_of
from ocmm_core.errors import OcmmError

ERRORS = (errno.EIO, errno.ENOSPC, errno.EROFS, errno.EDQUOT)
_ENDS = ("done", "told", "traceback")
_STRIDE = 37
"""Usually coprime to the number of trials: a short run samples everything."""


def faults(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the result of each fault; about 1,500 in all, ``runs`` limits them."""
    lacking = why_not_here()
    if lacking:
        raise NotRunError(lacking)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        order = seed, runs, done, folder
        yield from served("faults", build(folder), serve_faults.__name__, order)


def serve_faults() -> None:
    """Run the faults and print a line each; runs with the faulty disk preloaded."""
    seed, runs, done, name = json.loads(sys.argv[1])
    disk = FaultyDisk()
    trials = _trials(disk, Path(name))
    order = sorted(range(len(trials)), key=lambda at: ((at + seed) * _STRIDE) % len(trials))
    for number, at in enumerate(order[:runs]):
        if number not in done:
            answer = [number, *_try(disk, Path(name), *trials[at])]
            sys.stdout.write(json.dumps(answer) + "\n")
            sys.stdout.flush()


def _trials(disk: FaultyDisk, folder: Path) -> list[tuple[str, str, int, int, bool]]:
    """Return all faults, after counting the calls of every work in a run without faults."""
    found = []
    for work in WORKS:
        there = folder / "counted"
        there.mkdir()
        disk.fail(there, "", 0, 0, stay=False)
        WORKS[work].do(there, lambda _number: None)
        counts = disk.counts()
        disk.mend()
        shutil.rmtree(there)
        found += [
            (work, call, nth, code, stay)
            for call in CALLS
            for nth in range(1, counts[call] + 1)
            for code in ERRORS
            for stay in (False, True)
        ]
    return found


def _try(
    disk: FaultyDisk, folder: Path, work: str, call: str, nth: int, code: int, stay: bool
) -> tuple[int, dict[str, int], str]:
    there = folder / "tried"
    there.mkdir()

    def run(pipe: int) -> None:
        disk.fail(there, call, nth, code, stay=stay)
        ended = outcome_of(WORKS[work], there, pipe)
        hits, again = disk.hits(), disk.synced_again()
        disk.mend()
        # After the numbers, as negative ones.
        for value in (_ENDS.index(ended), hits, again):
            os.write(pipe, b"%d\n" % -(value + 1))

    child, pipe = forked(run)
    os.waitpid(child, 0)
    heard = read_numbers(pipe)
    os.close(pipe)
    acknowledged = [number for number in heard if number > 0]
    ended, hits, again = [-number - 1 for number in heard if number < 0] or [2, 0, 0]
    found: dict[str, int] = {}
    try:
        found["acknowledged items lost"] = WORKS[work].lost(there, acknowledged)
    except (OcmmError, OSError, ValueError) as error:
        found["files unreadable"] = 1
        note = str(error)
    else:
        note = ""
    whole = len(acknowledged) == len(_whole(work))
    found["errors not told"] = int(hits > 0 and _ENDS[ended] == "done" and not whole)
    found["tracebacks"] = int(_ENDS[ended] == "traceback")
    found["descriptors synced again"] = again
    shutil.rmtree(there)
    found = {finding: count for finding, count in found.items() if count}
    if found:
        kind = "and all after it" if stay else "once"
        note = f"{work}: {call} {nth} {kind}, {errno.errorcode[code]}. {note}".strip()
    return len(acknowledged), found, note


def _whole(work: str) -> range:
    """Return the acknowledgements of a run without faults."""
    return range(2 if work in ("report", "settings") else 3)
