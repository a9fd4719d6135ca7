"""Whether what a job is measured with may be used: what cameras and probe have in common.

Virtual rigs are measured with documents as they stand. Real cameras, also recorded ones, need
records whose standing is usable; without them no points are taken, or, when somebody insists,
every verdict is NOT PROVEN.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Any, Generic, TypeVar

from ocmm_core.calibration.records._record_store import RecordStatus, RecordStore
from ocmm_core.errors import CalibrationError, InputError, OcmmError

_FOLDER_NAME = re.compile(r"[A-Za-z0-9_]([A-Za-z0-9 _.-]{0,58}[A-Za-z0-9_-])?")


class CalibrationStatus(StrEnum):
    """What is said about the calibration of a job, in one word."""

    VALID = "VALID"
    DUE = "DUE"
    EXPIRED = "EXPIRED"
    SUSPECT = "SUSPECT"
    DESIGN = "DESIGN"
    """A virtual rig, also a recorded one: the cameras are taken to be as the rig document says."""
    NONE = "NONE"
    """The cameras were never calibrated."""
    UNUSABLE = "UNUSABLE"
    """There is a calibration, but it is damaged, replaced, or not that of these cameras."""


@dataclass(frozen=True, slots=True)
class Blocker:
    """Why no points may be taken, and what to do about it."""

    what: str
    remedy: str

    def __str__(self) -> str:
        """Return both sentences."""
        return f"{self.what} {self.remedy}"


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewInUse:
    """What is to be said at a moment about what a job is measured with."""

    word: CalibrationStatus
    identity: str
    """Hash of what the geometry comes from."""
    blocker: Blocker | None = None
    """Why no points may be taken; None where they may."""
    uncalibrated: bool = False
    """They are taken all the same, and prove nothing."""
    warnings: tuple[str, ...] = ()
    """What somebody should know who measures."""
    since_utc: str = ""
    """For SUSPECT: points since then are in doubt. Empty otherwise."""

    @property
    def blocking_reason(self) -> Blocker | None:
        """Return why no points may be taken; None where they may, or are taken all the same."""
        return None if self.uncalibrated else self.blocker

    @property
    def unproven(self) -> str:
        """Return why a job that is measured so proves nothing; empty where it does."""
        if not self.uncalibrated:
            return ""
        why = f" {self.blocker.what}" if self.blocker is not None else ""
        return f"Measured as uncalibrated.{why}"


V = TypeVar("V", bound=ViewInUse)
S = TypeVar("S", bound=RecordStore[Any])


@dataclass(frozen=True, slots=True, kw_only=True)
class InUse(ABC, Generic[S, V]):
    """What a job was begun with."""

    store: S | None = None
    """Where its records are; None for virtual rigs, and where it is damaged."""
    fault: tuple[CalibrationStatus, Blocker] | None = None
    """Word and reason why it must not be used, found when it was opened; None where it may."""
    uncalibrated: bool = False
    """Somebody insists on measuring all the same."""

    @property
    @abstractmethod
    def is_design(self) -> bool:
        """Return whether it comes from a document alone."""

    @property
    @abstractmethod
    def as_opened(self) -> V:
        """Return what is said of it before anything was judged."""

    @abstractmethod
    def overtaken(self, store: S) -> Blocker | None:
        """Return what was put in its place since the job was begun; None where nothing was."""

    @abstractmethod
    def status(self, store: S, now: datetime) -> RecordStatus:
        """Return whether its records may be trusted."""

    def refuse_fault(self, code: str) -> None:
        """Raise CalibrationError with a code where it must not be used."""
        if self.fault is not None:
            _, blocker = self.fault
            raise CalibrationError(code, blocker.what, blocker.remedy)


PRACTICE = "PRACTICE"
"""The word on everything that was made in practice, with a virtual hand.

Who practises signs as ``PRACTICE: name``. The name is in every record, under its hash and in the
chain of events, and on every paper that comes of it; records need no other field for it, which
would change the hashes of all that there are.
"""


def practice_name(who: str) -> str:
    """Return how somebody signs in practice; an empty name stays empty."""
    who = who.strip()
    return who if not who or is_practice(who) else f"{PRACTICE}: {who}"


def is_practice(made_by: str) -> bool:
    """Return whether something was made in practice, by who made it."""
    return made_by.strip().upper().startswith(PRACTICE)


def require_real_name(who: str) -> str:
    """Return a name that does not stand for practice.

    Raises
    ------
    InputError
        It does: what is signed with it is never valid.
    """
    if is_practice(who):
        raise InputError(
            "record.practice_name",
            f"A name that begins with {PRACTICE} stands for practice, which counts for nothing.",
            "Enter your own name in 'Done by'.",
        )
    return who


def judge(in_use: InUse[S, V], now: datetime) -> V:
    """Return what is to be said at a moment about what a job is measured with.

    The first time after it was opened all files that it rests on are read, some milliseconds; then
    it takes a fraction of one.
    """
    view = in_use.as_opened
    if in_use.fault is not None:
        word, blocker = in_use.fault
        return replace(view, word=word, blocker=blocker)
    store = in_use.store
    if in_use.is_design or store is None:
        return view
    try:
        store.refresh()
    except (OcmmError, OSError) as error:
        return replace(view, word=CalibrationStatus.UNUSABLE, blocker=blocker_of(error))
    other = in_use.overtaken(store)
    if other is not None:
        return replace(view, word=CalibrationStatus.UNUSABLE, blocker=other)
    found = in_use.status(store, now)
    word = CalibrationStatus(found.state.value)
    if not found.state.usable:
        doubt = Blocker(found.reason, found.remedy)
        return replace(view, word=word, blocker=doubt, since_utc=found.since_utc)
    warnings = (f"{found.reason} {found.remedy}",) if found.reason else ()
    return replace(view, word=word, warnings=(*view.warnings, *warnings))


def replaced_in(store: RecordStore[Any], otherwise: Blocker) -> Blocker:
    """Return why other records are in force: the history was exchanged, or what is said else."""
    return otherwise if store.exchanged is None else blocker_of(store.exchanged)


def named_folder(folder: Path, name: str, kind: str) -> Path:
    """Return the folder below ``folder`` of a rig or probe; InputError as `store_folder`."""
    if not _FOLDER_NAME.fullmatch(name):
        raise InputError(
            f"{kind}.name",
            f"A {kind} named {name!r} cannot have calibrations: they are stored under its name.",
            "Use 1 to 60 letters, digits, spaces, '_', '.' or '-', starting with a letter, a "
            f"digit or '_', in field 'name' of the {kind} document.",
        )
    return folder / name


def blocker_of(error: OcmmError | OSError) -> Blocker:
    """Return what stands in the way where a store cannot be read."""
    if isinstance(error, OcmmError):
        return Blocker(error.what, error.remedy)
    return Blocker(
        f"The history of the calibration cannot be read ({error.strerror}).",
        "Restore read permission.",
    )
