"""Stores that the campaign writes to, its own station identity, and concurrent writers.

Two programs write a job (one trial in three), or a store of calibrations or a probe.
"""

from __future__ import annotations

import os
import random
import shutil
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from ocmm_bench.campaign._trials import Trial, changed_environment, forked, read_numbers
from ocmm_bench.campaign._work import append_points, sample_point
from ocmm_core.calibration.records import CalibrationStore, ProbeStore, State
from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.storage import JobFile
from ocmm_sim.calibration_scenes import (
    RECORDS_MADE,
    made_camera_record,
    made_probe_record,
    made_tip_record,
    made_verification,
)


def other_station(home: Path) -> AbstractContextManager[None]:
    """Act as another station: another key, another memory."""
    names = ("XDG_DATA_HOME", "XDG_STATE_HOME")
    return changed_environment({name: home / name.lower() for name in names})


@dataclass(frozen=True, slots=True)
class CalibrationSite:
    """Store with calibrated and verified cameras, reopened."""

    folder: Path
    store: CalibrationStore
    until = RECORDS_MADE + timedelta(days=365)

    @classmethod
    def made(cls, folder: Path) -> CalibrationSite:
        """Return a new store with VALID cameras."""
        store, record = CalibrationStore(folder), made_camera_record()
        store.accept(record, "technician", "new", RECORDS_MADE)
        store.verify(made_verification(record), RECORDS_MADE + timedelta(hours=1))
        return cls(folder, store)

    @classmethod
    def opened(cls, folder: Path) -> CalibrationSite:
        """Return the store as a newly started program reads it."""
        return cls(folder, CalibrationStore(folder))

    def state(self, now: datetime) -> State:
        return self.store.status(now).state

    def add(self, text: str, now: datetime) -> None:
        self.store.suspect("campaign", text, None, now)

    def verify(self, now: datetime) -> None:
        if (active := self.store.active()) is not None:
            self.store.verify(made_verification(active), now)


@dataclass(frozen=True, slots=True)
class ProbeSite:
    """Store with a calibrated and qualified probe, reopened."""

    folder: Path
    store: ProbeStore
    until = RECORDS_MADE + timedelta(hours=1, days=30)

    @classmethod
    def made(cls, folder: Path) -> ProbeSite:
        store, record = ProbeStore(folder), made_probe_record()
        store.calibrate(record, "technician", "new", RECORDS_MADE)
        store.qualify(made_tip_record(record), RECORDS_MADE + timedelta(hours=1))
        return cls(folder, store)

    @classmethod
    def opened(cls, folder: Path) -> ProbeSite:
        return cls(folder, ProbeStore(folder))

    def state(self, now: datetime) -> State:
        return self.store.status(self._tip, now).state

    def add(self, text: str, now: datetime) -> None:
        self.store.doubt("campaign", text, now, now)

    def verify(self, now: datetime) -> None:
        """Add a passed qualification."""
        if (active := self.store.active(self._tip)) is not None:
            again = made_tip_record(active.calibration, points=len(self.store.events))
            self.store.qualify(again, now)

    @property
    def _tip(self) -> str:
        return self.store.mounted or ""


Site = CalibrationSite | ProbeSite
SITES: tuple[type[CalibrationSite] | type[ProbeSite], ...] = (CalibrationSite, ProbeSite)


_POINTS_A_TURN = 5
_TURNS = 10
_EVENTS = 100
"""Per program, in a store."""
_AT_ONCE_MOST = 8
"""Events that one program adds before it yields to the other."""
_OPENED_ANEW = 0.05
_RETRIED = ("job.locked", "job.exists", "events.busy")


def writers(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the results of two programs that take turns as fast as they can."""
    with tempfile.TemporaryDirectory() as name, other_station(Path(name) / "home"):
        for number in range(runs):
            if number in done:
                continue
            place = Path(name) / f"{number}"
            kind = number % (1 + len(SITES))
            if kind == 0:
                yield _both(place.with_suffix(".ocmm"), seed, number)
            else:
                yield _both_in_store(SITES[kind - 1].made(place), seed, number)
                shutil.rmtree(place)


def _both(path: Path, seed: int, number: int) -> Trial:
    heard = _heard(lambda who, to: _write(path, f"{seed} {number} {who}", to))
    with JobFile.open(path) as job:
        stored = {point.number: point.spots.tobytes() for point in job.points()}
        faults = len(job.verify())
    found = {
        "acknowledged items lost": sum(
            stored.get(at) != sample_point(at).spots.tobytes() for at in heard
        ),
        "items twice": len(heard) - len(set(heard)),
        "audit faults": faults,
        "writers that gave up": int(len(heard) < 2 * _TURNS * _POINTS_A_TURN),
    }
    return _trial(seed, number, len(heard), found)


def _both_in_store(site: Site, seed: int, number: int) -> Trial:
    heard = _heard(lambda who, to: _add(site, f"{seed} {number} {who}", who, to))
    try:
        again = type(site).opened(site.folder)
        state = again.state(RECORDS_MADE + timedelta(days=1))
    except OcmmError as error:
        found = {"acknowledged items lost": len(heard), "audit faults": 1}
        return Trial("writers", seed, number, len(heard), found, str(error))
    texts = [event.reason for event in again.store.events]
    stored = Counter(int(text) for text in texts if text.isdecimal())
    # Events of each program must be in order.
    lines = [int(text) for text in texts if text.isdecimal()]
    orders = [[one for one in lines if one % 2 == who] for who in range(2)]
    whole = again.store.exchanged is None and again.store.signer.sound
    found = {
        "acknowledged items lost": sum(not stored[one] for one in heard),
        "items twice": sum(many - 1 for many in stored.values()),
        "audit faults": sum(one != sorted(one) for one in orders)
        + (not whole)
        # Only the last suspicion counts against it.
        + (state is not State.SUSPECT),
        "writers that gave up": int(len(heard) < 2 * _EVENTS),
    }
    return _trial(seed, number, len(heard), found)


def _trial(seed: int, number: int, heard: int, found: dict[str, int]) -> Trial:
    return Trial(
        "writers", seed, number, heard, {name: many for name, many in found.items() if many}
    )


def _heard(write: Callable[[int, int], None]) -> list[int]:
    """Let two programs write; return the acknowledged numbers of both."""
    pairs = [forked(lambda to, who=who: write(who, to)) for who in range(2)]  # type: ignore[misc]
    heard: list[int] = []
    for child, pipe in pairs:
        # Read while it writes: more than a pipe holds.
        heard += read_numbers(pipe)
        os.close(pipe)
        os.waitpid(child, 0)
    return heard


def _add(site: Site, seed: str, who: int, pipe: int) -> None:
    rng = random.Random(seed)  # noqa: S311 - moments, no secret
    own, added = type(site).opened(site.folder), 0
    while added < _EVENTS:
        try:
            for _ in range(rng.randint(1, _AT_ONCE_MOST)):
                if added < _EVENTS:
                    one = 2 * added + who
                    own.add(str(one), RECORDS_MADE + timedelta(hours=2, seconds=added))
                    os.write(pipe, b"%d\n" % one)
                    added += 1
        except StorageError as error:
            if error.code not in _RETRIED:
                raise
        if rng.random() < _OPENED_ANEW:
            own = type(site).opened(site.folder)


def _write(path: Path, seed: str, pipe: int) -> None:
    rng = random.Random(seed)  # noqa: S311 - moments, no secret
    turns = 0
    while turns < _TURNS:
        try:
            append_points(path, lambda point: os.write(pipe, b"%d\n" % point), _POINTS_A_TURN)
            turns += 1
        except StorageError as error:
            if error.code not in _RETRIED:
                raise
        time.sleep(rng.uniform(0.0, 0.002))
