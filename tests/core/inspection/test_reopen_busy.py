"""A job is reopened while another process stores points in it, closes it and opens it again."""

from __future__ import annotations

import multiprocessing
from collections import Counter
from collections.abc import Callable, Iterator
from multiprocessing.context import SpawnProcess
from multiprocessing.synchronize import Event
from pathlib import Path

import pytest

from ocmm_core.camera import load_rig
from ocmm_core.errors import OcmmError
from ocmm_core.host import HOST
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import load_plan
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import Touch
from ocmm_core.storage import JobFile
from ocmm_core.tracking import load_probe
from tests.core.inspection.conftest import PLAN, PROBE, RIG, Bench
from tests.host import HANG_S, amount

REOPENED = amount(30, 2000)
BUSY_LOOPS = amount(0, HOST.processors())
STEPS = 600
"""Steps between two openings by the writer: more than two checkpoints."""
A_JOB = 400
"""Reopenings of one job: a long one takes longer."""


def write(touches: tuple[Touch, ...], path: Path, stored: Event, stop: Event) -> None:
    """Take and undo points until the event; close the job after `STEPS` steps."""
    plan, rig, body = load_plan(PLAN), load_rig(RIG), load_probe(PROBE)
    while not stop.is_set():
        with JobFile.open(path) as job:
            session = InspectionSession(plan, rig, body, job, SessionOptions())
            done = 0
            while done < STEPS and not stop.is_set():
                session.touches.record_touch(touches[done % 2])
                session.steps.undo()
                job.append_event("note", f"step {done}")
                done += 3
                stored.set()


def load(stop: Event) -> None:
    """Keep a processor busy."""
    while not stop.is_set():
        sum(range(10_000))


@pytest.fixture
def writer(bench: Bench) -> Iterator[Callable[[int], Path]]:
    """Return what makes a job that another process writes from then on."""
    spawn = multiprocessing.get_context("spawn")
    stop = spawn.Event()
    running: list[tuple[Event, SpawnProcess]] = []

    def start(until: Event, process: SpawnProcess) -> None:
        process.start()
        running.append((until, process))

    for _ in range(BUSY_LOOPS):
        start(stop, spawn.Process(target=load, args=(stop,)))

    def make(number: int) -> Path:
        path = bench.folder / f"job{number}.ocmm"
        bench.job_at(path).close()
        if number:
            running[-1][0].set()
        stored, until = spawn.Event(), spawn.Event()
        start(until, spawn.Process(target=write, args=(bench.touches[:2], path, stored, until)))
        assert stored.wait(HANG_S)
        return path

    try:
        yield make
    finally:
        for until, process in running:
            until.set()
            process.join(HANG_S)
        assert [process.exitcode for _, process in running] == [0] * len(running)


def test_a_job_that_is_being_measured_is_read_at_each_try(
    writer: Callable[[int], Path], record_property: Callable[[str, object], None]
) -> None:
    """No reader finds it busy, unreadable, or an older copy of itself."""
    found: Counter[str] = Counter()
    path, last, logs = Path(), 0, 0
    for number in range(REOPENED):
        if number % A_JOB == 0:
            path, last = writer(number), 0
        logs += path.with_name(f"{path.name}-wal").exists()
        try:
            again = reopen_job(path)
        except OcmmError as error:
            found[error.code] += 1
            continue
        found.update((*again.faults, *again.differences))
        # Nothing that was read once is missing later.
        assert again.seal.steps >= last
        last = again.seal.steps
    record_property("reopened", f"{REOPENED} times, {logs} with a log, {last} steps at last")
    assert found == {}
    assert last > 0
