"""Power cuts and disk faults.

A cut leaves the disk content at a moment, without anything that is only in memory. A job is written
on a file system in a file. A copy of that file, made while the program is stopped, is what a disk
would hold after a power cut: unsynced data are not in it. Every disk has a control file that was
synced first. A copy without it is invalid as a copy and proves nothing about the program: its
trials are repeated on a new disk.

Faults: every writing system call fails with every disk error, once or permanently. Trials enumerate
work, call, occurrence, error and duration. A separate program with the faulty disk preloaded forks
for each of them.
"""

from __future__ import annotations

import errno
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from ocmm_bench.campaign._faulty_disk import CALLS, FAULTY_DISK, FaultyDisk, served
from ocmm_bench.campaign._trials import NotRunError, Trial, forked, read_numbers
from ocmm_bench.campaign._work import WORKS, append_points, lost_points, outcome_of
from ocmm_core.documents import write_atomic
from ocmm_core.errors import OcmmError

_SIZE = 24 << 20
_CUTS_A_DISK = 20
_LONGEST_S = 0.25
_CONTROL = "control"
_MOST_BAD_DISKS = 3
_ENDLESS = 1_000_000
REOPEN_LIMIT_S = 2.0


def cuts(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the result of each cut; NotRunError if such a disk cannot be made."""
    if os.geteuid() != 0 or not shutil.which("mkfs.ext4"):
        raise NotRunError("needs root and mkfs.ext4, to mount a disk in a file")
    left = [number for number in range(runs) if number not in done]
    bad = 0
    with tempfile.TemporaryDirectory() as name:
        while left:
            # Never reuse a file: a loop device may still have its old content cached.
            folder = Path(tempfile.mkdtemp(dir=name))
            try:
                for trial in _on_one_disk(folder, seed, left[:_CUTS_A_DISK]):
                    left.remove(trial.number)
                    yield trial
            except _NoCopyError:
                bad += 1
                if bad > _MOST_BAD_DISKS:
                    raise NotRunError("disks in files do not hold what was synced") from None
            finally:
                shutil.rmtree(folder, ignore_errors=True)


class _NoCopyError(Exception):
    """A copy lacks the control."""


def _on_one_disk(folder: Path, seed: int, numbers: list[int]) -> Iterator[Trial]:
    image, live = folder / "live.img", folder / "live"
    with image.open("wb") as stream:
        stream.truncate(_SIZE)
    _run("mkfs.ext4", "-q", "-F", str(image))
    _mount(image, live)
    try:
        write_atomic(live / _CONTROL, folder.name.encode())
        for at, number in enumerate(numbers):
            # Every other job is cut while it is made or soon after.
            yield _cut(folder, live / f"{at // 2}.ocmm", seed, number)
    finally:
        _run("umount", str(live))


def _cut(folder: Path, path: Path, seed: int, number: int) -> Trial:
    import fcntl

    rng = random.Random(f"{seed} {number}")  # noqa: S311 - moments of a cut, no secret
    before = _points_of(path)
    child, pipe = forked(
        lambda to: append_points(path, lambda point: os.write(to, b"%d\n" % point), _ENDLESS)
    )
    time.sleep(rng.uniform(0.0, _LONGEST_S))
    os.kill(child, signal.SIGSTOP)
    os.waitpid(child, os.WUNTRACED)
    fcntl.fcntl(pipe, fcntl.F_SETFL, os.O_NONBLOCK)
    acknowledged = [*before, *read_numbers(pipe)]
    image, dead = folder / f"dead-{number}.img", folder / "dead"
    shutil.copyfile(folder / "live.img", image)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os.close(pipe)
    found: dict[str, int] = {}
    note = ""
    _mount(image, dead)
    try:
        control = dead / _CONTROL
        if not control.exists() or control.read_bytes() != folder.name.encode():
            raise _NoCopyError
        begin = time.process_time()
        try:
            lost = lost_points(dead / path.name, acknowledged)
        except OcmmError as error:
            found["jobs unreadable"], note = 1, str(error)
        else:
            if lost:
                found["acknowledged points lost"], note = lost, f"acknowledged {acknowledged}"
            if time.process_time() - begin > REOPEN_LIMIT_S:
                found["reopened after 2 s"] = 1
    finally:
        _run("umount", str(dead))
        image.unlink()
    return Trial("cuts", seed, number, len(acknowledged) - len(before), found, note)


def _points_of(path: Path) -> list[int]:
    from ocmm_core.storage import JobFile

    if not path.exists():
        return []
    with JobFile.read(path) as job:
        return [point.number for point in job.points()]


def _mount(image: Path, where: Path) -> None:
    where.mkdir(exist_ok=True)
    _run("mount", "-o", "loop", str(image), str(where))


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - fixed commands
    if done.returncode:
        raise NotRunError(f"{command[0]}: {done.stderr.strip()}")


ERRORS = (errno.EIO, errno.ENOSPC, errno.EROFS, errno.EDQUOT)
_ENDS = ("done", "told", "traceback")
_STRIDE = 37
"""Usually coprime to the number of trials: a short run samples everything."""


def faults(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the result of each fault; about 1,500 in all, ``runs`` limits them."""
    yield from served("faults", FAULTY_DISK, serve_faults.__name__, (seed, runs, done))


def serve_faults() -> None:
    """Run the faults and print a line each; runs with the faulty disk preloaded."""
    seed, runs, done, name = json.loads(sys.argv[1])
    disk = FaultyDisk()
    trials = _trials(disk, Path(name))
    order = sorted(range(len(trials)), key=lambda at: ((at + seed) * _STRIDE) % len(trials))
    for number, at in enumerate(order[:runs]):
        if number not in done:
            sys.stdout.write(json.dumps([number, *_try(disk, Path(name), *trials[at])]) + "\n")
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
    whole = len(acknowledged) == (2 if work in ("report", "settings") else 3)
    found["errors not told"] = int(hits > 0 and _ENDS[ended] == "done" and not whole)
    found["tracebacks"] = int(_ENDS[ended] == "traceback")
    found["descriptors synced again"] = again
    shutil.rmtree(there)
    found = {finding: count for finding, count in found.items() if count}
    if found:
        kind = "and all after it" if stay else "once"
        note = f"{work}: {call} {nth} {kind}, {errno.errorcode[code]}. {note}".strip()
    return len(acknowledged), found, note
