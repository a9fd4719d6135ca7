"""Reliability campaign: trials, findings, and the state file that a run resumes from."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
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
"""Findings of each lane; none may ever occur."""


class Trial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One kill, cut or fault, and its result."""

    lane: str
    seed: int
    number: int
    acknowledged: int
    """Points or other items acknowledged before it."""
    found: dict[str, int]
    """Count of each finding; zeros are omitted."""
    note: str = ""
    """Details of a finding; of the lane names without one, the seconds until the loss is shown."""


@contextmanager
def changed_environment(folders: Mapping[str, Path]) -> Iterator[None]:
    """Set variables of the environment to folders, and restore them at the end."""
    before = {name: os.environ.get(name) for name in folders}
    os.environ.update({name: str(folder) for name, folder in folders.items()})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


class NotRunError(Exception):
    """Lane that this computer cannot run; the message gives the reason."""


Lane = Callable[[int, int, frozenset[int]], Iterator[Trial]]
"""From seed, number of trials, and finished trials to the remaining trials."""


@dataclass(frozen=True, slots=True)
class LaneResult:
    """A row of the table: a lane, all its trials, and why it was not run, if so."""

    lane: str
    trials: tuple[Trial, ...]
    why_not: str = ""

    @property
    def failed(self) -> bool:
        return any(trial.found for trial in self.trials)

    @property
    def acknowledged(self) -> int:
        return sum(trial.acknowledged for trial in self.trials)

    def count(self, finding: str) -> int:
        return sum(trial.found.get(finding, 0) for trial in self.trials)


def read_state(path: Path) -> list[Trial]:
    """Return the trials of a state file, without a truncated last line; or raise InputError."""
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
    """Run the remaining trials of a lane, none started after ``until_s``, and return all.

    Each is appended to ``state``, if any; ``told`` receives their number.
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
    """Return the 95 % upper bound of the rate after no finding in ``trials``: rule of three."""
    return min(1.0, 3.0 / trials) if trials else 1.0


def forked(work: Callable[[int], None]) -> tuple[int, int]:
    """Run ``work`` in a fork of this warm program; return its pid and the pipe it writes to.

    A newly started program would spend its time on imports.
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
    """Return all whole lines written by a program that has ended or is stopped."""
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
        # After the last whole line: the previous run may have been killed within one.
        stream.seek(content.rfind(b"\n") + 1)
        stream.truncate()
        stream.write(msgspec.json.encode(trial) + b"\n")
