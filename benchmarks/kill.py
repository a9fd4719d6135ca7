"""Kill -9 at random moments of a job: every acknowledged point must be there, and soon.

A job is measured by a program of its own, which acknowledges every step only when it is durable,
as the beep does: points taken, undone, turned to the other side. It is killed at a random moment,
from the making of the file on. Then the file is opened again and the session goes on from it: the
points must be those that were acknowledged (the one step that was under way may be there or not),
the audit must find no fault, and reopening must take less than 2 s.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import StorageError
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import Refusal, Touch, TouchCollector
from ocmm_core.storage import JobFile, make_head
from ocmm_core.tracking import ProbeBody, TrackingPipeline, load_probe
from ocmm_sim.scene import VirtualRig, load_part

RUNS = 500
EARLY = 0.2
"""Part of the programs that are killed while they begin."""
LONGEST_BEGINNING_S = 0.05
MOST_STEPS = 8
"""The others are killed at most this number of steps later, within the following step."""
LONGEST_STEP_S = 0.004
REOPEN_LIMIT_S = 2.0
FRAME_RATE_HZ = 500

PLAN = resource("plans", "quick.toml")
RIG = resource("rigs", "recommended.toml")
PROBE = resource("probes", "standard.toml")


@dataclass(frozen=True, slots=True)
class Bench:
    """What every job is measured with."""

    plan: Plan
    rig: Rig
    body: ProbeBody
    touches: tuple[Touch, ...]

    def session(self, job: JobFile) -> InspectionSession:
        """Return a session on ``job``."""
        return InspectionSession(self.plan, self.rig, self.body, job, SessionOptions())


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one kill left behind.

    Attributes
    ----------
    acknowledged
        Steps.
    lost
        Acknowledged points that are not there, or points that are there against the book.
    faults
        Sentences of the audit.
    reopen_s
        From opening the file to the evaluated job.
    """

    acknowledged: int
    lost: int
    faults: int
    reopen_s: float


def make_bench() -> Bench:
    """Return the touches of the quick plan on the virtual rig."""
    rig, body, plan = load_rig(RIG), load_probe(PROBE), load_plan(PLAN)
    part = load_part(resource("parts", "demo.toml"))
    script = [(feature.name, feature.points) for feature in plan.features]
    virtual = VirtualRig(rig, body, part, script, seed=1, frame_rate_hz=FRAME_RATE_HZ)
    collector = TouchCollector(1.0 / FRAME_RATE_HZ, SessionOptions().point)
    frames = virtual.frames(0, virtual.n_frames)
    touches = collector.push(TrackingPipeline(rig, body).process(frames))
    return Bench(plan, rig, body, tuple(touches))


def measure_until_killed(bench: Bench, path: Path, seed: int, book: int) -> None:
    """Measure, and write every step that is durable to the pipe ``book``; does not return."""
    rng = np.random.default_rng(seed)
    if path.exists():
        job = JobFile.open(path)
    else:
        head = make_head(plan=PLAN, rig=RIG, probe=PROBE, operator="me", part="P", serial="1")
        job = JobFile.create(path, head)
    session = bench.session(job)
    while True:
        taken = session.steps.missing()
        kind = str(rng.choice(["take", "take", "undo", "flip", "flip", "flip", "look"]))
        if kind == "look":
            _ = session.view
            continue
        os.write(book, f"{kind}\n".encode())
        if kind == "take":
            touch = bench.touches[int(rng.integers(len(bench.touches)))]
            feature = taken[0][0] if taken else bench.plan.features[0].name
            outcome = session.touches.record_touch(touch, feature)
            if isinstance(outcome, Refusal):
                continue
        elif not job.points():
            continue
        elif kind == "undo":
            session.steps.undo()
        else:
            session.points.flip()
        os.write(book, f"{' '.join(str(p.number) for p in job.points())}\n".encode())


def one_kill(bench: Bench, path: Path, before: list[int], seed: int) -> tuple[Outcome, list[int]]:
    """Measure, kill and reopen once; return the outcome and the present points."""
    rng = np.random.default_rng(seed)
    reading, writing = os.pipe()
    # A fork of this warm program: a new one would spend its life importing.
    child = os.fork()
    if child == 0:
        try:
            os.close(reading)
            measure_until_killed(bench, path, seed, writing)
        finally:
            os._exit(1)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        lines = wait_for_moment(pipe, rng)
        os.kill(child, signal.SIGKILL)
        lines += pipe.read().split(b"\n")[:-1]
    _, status = os.waitpid(child, 0)
    if not os.WIFSIGNALED(status):
        raise SystemExit("The measuring program ended by itself: that is no kill.")
    acknowledged = [line for line in lines if not line.isalpha()]
    book = [int(word) for word in acknowledged[-1].split()] if acknowledged else before
    under_way = lines[-1].decode() if lines and lines[-1].isalpha() else ""
    begin = time.perf_counter()
    try:
        job = JobFile.open(path)
    except StorageError:
        # Killed while the file was made: nothing was acknowledged yet.
        path.unlink(missing_ok=True)
        return Outcome(len(acknowledged), len(book), 0, time.perf_counter() - begin), []
    with job:
        session = bench.session(job)
        _ = session.view
        reopened = time.perf_counter() - begin
        found = [point.number for point in job.points()]
        faults = job.verify()
    wrong = wrong_points(book, found, under_way)
    return Outcome(len(acknowledged), wrong, len(faults), reopened), found


def wait_for_moment(pipe: BinaryIO, rng: np.random.Generator) -> list[bytes]:
    """Wait for the moment of a kill, and return the lines read meanwhile."""
    if rng.random() < EARLY:
        time.sleep(float(rng.uniform(0.0, LONGEST_BEGINNING_S)))
        return []
    # By steps, not only by the clock: independent of the load.
    lines: list[bytes] = []
    wanted = int(rng.integers(1, MOST_STEPS + 1))
    while sum(not line.isalpha() for line in lines) < wanted:
        lines.append(pipe.readline().rstrip(b"\n"))
    time.sleep(float(rng.uniform(0.0, LONGEST_STEP_S)))
    return lines


def wrong_points(book: list[int], found: list[int], under_way: str) -> int:
    """Return the number of points that contradict the list, except the unfinished step."""
    gone = [number for number in book if number not in found]
    new = [number for number in found if number not in book]
    done = {
        "take": not gone and len(new) == 1,
        # A flip that is undone puts the point back that was there before, with a new number.
        "undo": gone == book[-1:] and len(new) <= 1,
        "flip": gone == book[-1:] and len(new) == 1,
    }
    if (not gone and not new) or done.get(under_way, False):
        return 0
    return len(gone) + len(new)


def run(runs: int, seed: int, folder: Path) -> list[Outcome]:
    """Return the outcomes of ``runs`` kills, on jobs restarted every 25 kills."""
    bench = make_bench()
    outcomes: list[Outcome] = []
    found: list[int] = []
    for index in range(runs):
        path = folder / f"job-{index // 25}.ocmm"
        if index % 25 == 0:
            found = []
        outcome, found = one_kill(bench, path, found, seed + index)
        outcomes.append(outcome)
    return outcomes


def main() -> int:
    """Print the table; 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=RUNS)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        outcomes = run(arguments.runs, arguments.seed, Path(folder))
    reopen = np.array([outcome.reopen_s for outcome in outcomes])
    lost = sum(outcome.lost for outcome in outcomes)
    faults = sum(outcome.faults for outcome in outcomes)
    print(f"kills                          {len(outcomes)}")
    print(f"acknowledged steps             {sum(outcome.acknowledged for outcome in outcomes)}")
    print(f"points against the book        {lost}   (limit 0)")
    print(f"faults found by the audit      {faults}   (limit 0)")
    print(f"reopening: median              {1e3 * np.median(reopen):.0f} ms")
    print(f"reopening: longest             {reopen.max():.3f} s   (limit {REOPEN_LIMIT_S:g} s)")
    return int(lost > 0 or faults > 0 or reopen.max() > REOPEN_LIMIT_S)


if __name__ == "__main__":
    sys.exit(main())
