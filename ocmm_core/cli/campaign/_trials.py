"""The reliability campaign: its trials, what was found, and the file that a run goes on from."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ocmm_core.errors import InputError

FINDINGS = {
    "kills": (
        "acknowledged points lost", "jobs half made", "audit faults", "reopened after 2 s",
        "rings left", "temporary files left",
    ),
    "cuts": ("acknowledged points lost", "jobs unreadable", "reopened after 2 s"),
    "faults": (
        "acknowledged items lost", "files unreadable", "errors not told", "tracebacks",
        "descriptors synced again",
    ),
    "names": (
        "acknowledged points lost", "losses not told", "told after 1 s", "exit code 0",
        "audit faults", "jobs called damaged", "reports of lost jobs",
    ),
    "writers": (
        "acknowledged items lost", "items twice", "audit faults", "writers that gave up",
    ),
    "clock": (
        "expired became valid", "steps back not told", "honest steps accused",
        "times that run backwards", "measuring disturbed",
    ),
    "soak": (
        "memory above 1 MiB/h", "descriptors more", "threads more", "shared memory more",
        "jobs without all points",
    ),
    "hostile": (
        "tracebacks", "hangs above 5 s", "above 512 MB", "wrongly used", "without a sentence",
    ),
    "sides": (
        "tracebacks", "hangs above 5 s", "above 512 MB", "without a sentence",
        "other files changed",
    ),
}  # fmt: skip
"""What each lane looks for; none of it may ever happen."""


class Trial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One kill, cut or fault, and what it showed."""

    lane: str
    seed: int
    number: int
    """`lane`, `seed`, `number`: Which it was."""
    acknowledged: int
    """Points or other items that were acknowledged before it."""
    found: dict[str, int]
    """How often each finding was met; those that were not are left out."""
    note: str = ""
    """Details of a finding; of the lane names without one, the seconds until the loss is shown."""


class NotRunError(Exception):
    """The computer cannot do it; the message says why."""


Lane = Callable[[int, int, frozenset[int]], Iterator[Trial]]
"""From a seed, how many, and those that are done already to the trials that are left."""


@dataclass(frozen=True, slots=True)
class LaneResult:
    """A row of the table: a lane, all its trials, and why it was not run, if so."""

    lane: str
    trials: tuple[Trial, ...]
    why_not: str = ""

    @property
    def failed(self) -> bool:
        """Return whether anything was found that may not happen."""
        return any(trial.found for trial in self.trials)

    @property
    def acknowledged(self) -> int:
        """Return how many items were acknowledged in all."""
        return sum(trial.acknowledged for trial in self.trials)

    def count(self, finding: str) -> int:
        """Return how often something was found."""
        return sum(trial.found.get(finding, 0) for trial in self.trials)


def read_state(path: Path) -> list[Trial]:
    """Return the trials of a state file; a line that was being written is left out.

    Raises
    ------
    InputError
        It is none, or cannot be read.
    """
    if not path.exists():
        return []
    try:
        lines = path.read_bytes().splitlines(keepends=True)
        return [msgspec.json.decode(line, type=Trial) for line in lines if line.endswith(b"\n")]
    except (OSError, msgspec.DecodeError) as error:
        raise InputError(
            "reliability.state",
            f"{path}: this is not the state of a reliability run ({error}).",
            "Give another file with --state.",
        ) from error


def run_lane(
    name: str,
    lane: Lane,
    seed: int,
    runs: int,
    state: Path | None,
    until_s: float,
    told: Callable[[int], None],
) -> LaneResult:
    """Do what is left of a lane, and return all of it.

    Parameters
    ----------
    state
        Every trial is appended to it; None to keep nothing.
    until_s
        No trial begins after it, `time.monotonic`.
    told
        How many trials there are.
    """
    before = [] if state is None else read_state(state)
    trials = [
        trial for trial in before
        if (trial.lane, trial.seed) == (name, seed) and trial.number < runs
    ]  # fmt: skip
    done = frozenset(trial.number for trial in trials)
    try:
        for trial in lane(seed, runs, done):
            trials.append(trial)
            if state is not None:
                _keep(state, trial)
            told(len(trials))
            if time.monotonic() > until_s:
                break
    except NotRunError as error:
        return LaneResult(name, tuple(trials), str(error))
    return LaneResult(name, tuple(trials))


def bound(trials: int) -> float:
    """Return the rate that nothing in so many trials excludes with 95 %: the rule of three."""
    return min(1.0, 3.0 / trials) if trials else 1.0


def forked(work: Callable[[int], None]) -> tuple[int, int]:
    """Run ``work`` in a copy of this warm program; return its process and what it writes to.

    A program that starts anew would spend its life importing.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child:
        os.close(writing)
        return child, reading
    try:
        os.close(reading)
        quiet = os.open(os.devnull, os.O_RDWR)
        for standard in (0, 1, 2):
            os.dup2(quiet, standard)
        work(writing)
    finally:
        os._exit(1)


def read_numbers(pipe: int) -> list[int]:
    """Return all whole lines that a program wrote that has ended or stands still."""
    content = b""
    while True:
        try:
            more = os.read(pipe, 65536)
        except BlockingIOError:
            break
        if not more:
            break
        content += more
    return [int(line) for line in content.split(b"\n")[:-1]]


def _keep(state: Path, trial: Trial) -> None:
    state.parent.mkdir(parents=True, exist_ok=True)
    content = state.read_bytes() if state.exists() else b""
    with state.open("r+b" if state.exists() else "wb") as stream:
        # Behind the last whole line: the run before may have been killed in one.
        stream.seek(content.rfind(b"\n") + 1)
        stream.truncate()
        stream.write(msgspec.json.encode(trial) + b"\n")
