"""Files of running jobs removed, moved, replaced, unmounted, or on a full disk."""

from __future__ import annotations

import contextlib
import os
import random
import re
import select
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from ocmm_bench.campaign._kills import QUICK_PLAN, RATE_HZ, measure_job
from ocmm_bench.campaign._trials import Trial, forked
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.finished import reopen_job

_TOLD_S = 1.0
_PATIENCE_S = 120.0
_LAST_POINT = 8
"""Latest point after which the name is lost; the plan has more."""
_BETWEEN_S = 0.05
"""Time in which the virtual rig records about one point."""
_AT_CLOSE = 0.25
"""Share of the jobs that are closed at once."""
_SAVED = re.compile(r"All points taken are saved in (.*\.ocmm)\.")


def _replace(job: Path) -> None:
    other = job.with_name("other.ocmm")
    other.write_bytes(b"another file" * 500)
    other.replace(job)


def _unmount(job: Path) -> None:
    subprocess.run(["umount", "-l", job.parent], check=True, capture_output=True)  # noqa: S603, S607


def _fill(job: Path) -> None:
    with contextlib.suppress(OSError), job.with_name("other").open("wb", buffering=0) as other:
        while other.write(bytes(4096)):
            pass


FULL = "disk filled"
"""The only kind that leaves the job in place."""
LOSSES: dict[str, Callable[[Path], object]] = {
    "file removed": Path.unlink,
    "folder removed": lambda job: shutil.rmtree(job.parent),
    "file moved": lambda job: job.rename(job.with_name("moved.ocmm")),
    "folder moved": lambda job: job.parent.rename(job.parent.with_name("elsewhere")),
    "file replaced": _replace,
    "file emptied": lambda job: os.truncate(job, 0),
    "file overwritten": lambda job: job.write_bytes(b"another file" * 500),
    "log removed": lambda job: job.with_name(f"{job.name}-wal").unlink(),
    "unmounted": _unmount,
    FULL: _fill,
}
"""Action on a job, by its name in the notes."""


def lost_names(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the result of each loss of a name; see `FINDINGS`."""
    kinds = possible_losses()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Warm up, so that every fork is warm.
        measure_job(folder / "warm", None)
        for number in range(runs):
            if number not in done:
                kind = kinds[number % len(kinds)]
                yield lose_name(folder / f"{number}", seed, number, kind)


def possible_losses() -> list[str]:
    """Return the kinds that this user has the rights to try."""
    return [kind for kind in LOSSES if kind not in ("unmounted", FULL) or os.geteuid() == 0]


def _measure(jobs: Path, pipe: int, stopping: int) -> None:
    """Measure a job on the virtual rig until it is to stop, and write what an inspector sees."""

    def write(line: str) -> None:
        os.write(pipe, f"{line}\n".encode())

    request = StationRequest(plan=QUICK_PLAN, out=jobs, speed=0.0, frame_rate_hz=RATE_HZ)
    station = build_station(request).station
    station.events.point_taken.connect(lambda point: write(f"point {point.number}"))
    station.faults.failed.connect(lambda _error: write("failed"))
    write("made")
    try:
        station.start()
    except OcmmError:
        # Lost before the first step.
        write("failed")
    # Ends also where the other side has gone.
    select.select([stopping], [], [], _PATIENCE_S)
    station.close()
    lost = station.job.lost
    if lost is not None:
        write(f"lost {lost.what}")
    os._exit(0 if lost is None else 2)


def lose_name(
    out: Path,
    seed: int,
    number: int,
    kind: str,
    measure: Callable[[Path, int, int], None] = _measure,
) -> Trial:
    """Lose the name of a running job at a random moment after a random point, and count its points.

    A quarter of the jobs are closed at once, before a timer could notice. ``measure`` measures in a
    folder, writes lines to a pipe and stops when the other pipe is closed.
    """
    rng = random.Random(f"{seed} {number}")  # noqa: S311 - moments, no secret
    jobs = out / "jobs"
    jobs.mkdir(parents=True)
    if kind in ("unmounted", FULL):
        size = "size=64m" if kind == "unmounted" else "size=3m"
        mount = ["mount", "-t", "tmpfs", "-o", size, "none", str(jobs)]
        subprocess.run(mount, check=True, capture_output=True)  # noqa: S603
    stopping, stop = os.pipe()

    def work(to: int) -> None:
        os.close(stop)
        measure(jobs, to, stopping)

    child, pipe = forked(work)
    os.close(stopping)
    with os.fdopen(pipe, "r", encoding="utf-8") as said, os.fdopen(stop, "wb") as stopper:
        lines: list[str] = []
        first = said.readline()
        lines += [said.readline().rstrip("\n") for _ in range(rng.randint(0, _LAST_POINT))]
        time.sleep(rng.uniform(0.0, _BETWEEN_S))
        begin = time.monotonic()
        LOSSES[kind](next(jobs.glob("*.ocmm")))
        at_close = rng.random() < _AT_CLOSE
        if at_close:
            stopper.close()
        for line in said:
            lines.append(line.rstrip("\n"))
            if line.startswith("failed"):
                lines[-1] = f"failed {time.monotonic() - begin:.2f}"
                stopper.close()
        _, status = os.waitpid(child, 0)
    if kind == FULL:
        found, note = _judge_full(jobs, lines)
        _unmount(jobs / "-")
    else:
        found, note = _judge(lines, os.waitstatus_to_exitcode(status), at_close=at_close)
    shutil.rmtree(out, ignore_errors=True)
    acknowledged = sum(line.startswith("point ") for line in lines)
    told = "".join(line.removeprefix("failed ") for line in lines if line.startswith("failed "))
    note = f"{kind}: {note} {first.strip()} {lines}" if found else told
    return Trial("names", seed, number, acknowledged, found, note)


def _judge_full(jobs: Path, lines: list[str]) -> tuple[dict[str, int], str]:
    """Read the job on the full disk, and again with free space; see `_judge`."""
    acknowledged = {int(line.split()[1]) for line in lines if line.startswith("point ")}
    for line in lines:
        if saved := _SAVED.search(line):
            # Points acknowledged after the disk filled up are in the second folder.
            rescued = reopen_job(Path(saved[1]), alone=True)
            acknowledged -= {point.number for point in rescued.points}
            Path(saved[1]).unlink()
    for _ in range(2):
        try:
            job = reopen_job(next(jobs.glob("*.ocmm")), alone=True)
        except OcmmError as error:
            return {"jobs called damaged": 1}, str(error)
        if lost := acknowledged - {point.number for point in job.points}:
            return {"acknowledged points lost": len(lost)}, ""
        (jobs / "other").unlink(missing_ok=True)
    return {}, ""


def _judge(lines: list[str], code: int, *, at_close: bool) -> tuple[dict[str, int], str]:
    """Return the findings, and why a job could not be read."""
    found = {"reports of lost jobs": lines.count("report")}
    words = [line for line in lines if line.startswith("lost ")]
    if not words:
        return {"losses not told": 1}, ""
    if code == 0:
        found["exit code 0"] = 1
    told_s = [float(line.split()[1]) for line in lines if line.startswith("failed")]
    if not at_close and not (told_s and told_s[0] <= _TOLD_S):
        found["told after 1 s"] = 1
    acknowledged = {int(line.split()[1]) for line in lines if line.startswith("point ")}
    saved = _SAVED.search(words[0])
    if saved is None:
        return {**found, "acknowledged points lost": max(len(acknowledged), 1)}, ""
    try:
        job = reopen_job(Path(saved[1]), alone=True)
    except OcmmError as error:
        return {**found, "acknowledged points lost": max(len(acknowledged), 1)}, str(error)
    finally:
        Path(saved[1]).unlink(missing_ok=True)
    lost = acknowledged - {point.number for point in job.points}
    found |= {"acknowledged points lost": len(lost), "audit faults": len(job.faults)}
    return {finding: count for finding, count in found.items() if count}, ""
