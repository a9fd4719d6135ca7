"""Stores that the campaign writes to, and its own station identity."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from ocmm_core.calibration.records import CalibrationStore, ProbeStore, State
from ocmm_sim.calibration_scenes import (
    RECORDS_MADE,
    made_camera_record,
    made_probe_record,
    made_tip_record,
    made_verification,
)


@contextmanager
def other_station(home: Path) -> Iterator[None]:
    """Act as another station: another key, another memory."""
    names = ("XDG_DATA_HOME", "XDG_STATE_HOME")
    before = {name: os.environ.get(name) for name in names}
    try:
        for name in names:
            os.environ[name] = str(home / name.lower())
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value


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
