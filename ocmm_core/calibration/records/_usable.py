"""Decide whether the cameras and probe of a job may be used; common part of both.

Virtual rigs use their documents. Real cameras, also recorded ones, need records with a usable
status; else points are refused or, if the user insists, all verdicts are NOT PROVEN.

Intrinsics are also in the cameras' own memory. They are written when a calibration is accepted, and
read back at every start: differing values mean another camera, or a calibration by another program.
The sensor temperature is checked likewise.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

from ocmm_core.calibration.records._record_store import RecordStore
from ocmm_core.calibration.records._records import CameraRecord
from ocmm_core.calibration.records._sealed import record_hash
from ocmm_core.camera import CameraEntry, camera_of
from ocmm_core.errors import CalibrationError, InputError, OcmmError
from ocmm_core.fieldbus.device import Intrinsics
from ocmm_core.fieldbus.objects import ObjectAccess, read_intrinsics, write_intrinsics

_FOLDER_NAME = re.compile(r"[A-Za-z0-9_]([A-Za-z0-9 _.-]{0,58}[A-Za-z0-9_-])?")


class CalibrationStatus(StrEnum):
    """Calibration status of a job."""

    VALID = "VALID"
    DUE = "DUE"
    EXPIRED = "EXPIRED"
    SUSPECT = "SUSPECT"
    DESIGN = "DESIGN"
    """Virtual rig, also a recorded one: the cameras are as the rig document describes."""
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
        return f"{self.what} {self.remedy}"


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewInUse:
    """Status of the cameras or probe of a job at a moment."""

    word: CalibrationStatus
    identity: str
    """Hash of the source of the geometry."""
    blocker: Blocker | None = None
    """Reason why points are refused, or None."""
    uncalibrated: bool = False
    """Points are recorded despite the blocker, and prove nothing."""
    warnings: tuple[str, ...] = ()
    since_utc: str = ""
    """For SUSPECT: points since then are suspect. Otherwise empty."""

    @property
    def blocking_reason(self) -> Blocker | None:
        """Return why points are refused; None if allowed or overridden."""
        return None if self.uncalibrated else self.blocker

    @property
    def unproven(self) -> str:
        """Return why the job proves nothing; empty if it does."""
        if not self.uncalibrated:
            return ""
        why = f" {self.blocker.what}" if self.blocker is not None else ""
        return f"Measured as uncalibrated.{why}"


V = TypeVar("V", bound=ViewInUse)
S = TypeVar("S", bound=RecordStore[Any])
R = TypeVar("R")


@dataclass(frozen=True, slots=True, kw_only=True)
class InUse(ABC, Generic[S, V, R]):
    """Cameras or probe as opened at the start of a job."""

    store: S | None = None
    """None for virtual rigs and damaged stores."""
    fault: tuple[CalibrationStatus, Blocker] | None = None
    """Status and reason found on opening that forbid use; None if usable."""
    uncalibrated: bool = False
    """The user insists on measuring without a usable calibration."""

    @property
    @abstractmethod
    def used(self) -> R | None:
        """Return the records in use; None if the geometry comes from a document alone."""

    @property
    @abstractmethod
    def as_opened(self) -> V:
        """Return the view before any status is evaluated."""

    @abstractmethod
    def overtaken(self, store: S, used: R) -> Blocker | None:
        """Return what replaced its records since the start of the job, or None."""

    def refuse_fault(self, code: str) -> None:
        """Raise CalibrationError with ``code`` if use is forbidden."""
        if self.fault is not None:
            _, blocker = self.fault
            raise CalibrationError(code, blocker.what, blocker.remedy)

    def refused(
        self, blocker: Blocker, word: CalibrationStatus = CalibrationStatus.UNUSABLE
    ) -> Self:
        return replace(self, fault=(word, blocker))

    def opened(self, store: Callable[[], S], with_store: Callable[[Self, S], Self]) -> Self:
        """Return it with the records of a store, or with the fault that prevents their use."""
        found = self
        try:
            records = store()
            found = replace(self, store=records)
            return with_store(found, records)
        except OcmmError as error:
            return found.refused(blocker_of(error))


PRACTICE = "PRACTICE"
"""Marks everything made in practice with a virtual hand: trainees sign as ``PRACTICE: name``, part
of every record's hash. A separate field would change existing hashes."""


def practice_name(who: str) -> str:
    """Return the signature used in practice; an empty name stays empty."""
    who = who.strip()
    return who if not who or is_practice(who) else f"{PRACTICE}: {who}"


def is_practice(made_by: str) -> bool:
    """Return whether the author's name marks practice."""
    return made_by.strip().upper().startswith(PRACTICE)


def require_real_name(who: str) -> str:
    """Return ``who``; InputError for practice, whose records are never valid."""
    if is_practice(who):
        raise InputError(
            "record.practice_name",
            f"A name that begins with {PRACTICE} stands for practice, which counts for nothing.",
            "Enter your own name in 'Done by'.",
        )
    return who


def judge(in_use: InUse[S, V, R], now: datetime) -> V:
    """Return the status at a moment; the first call reads all evidence, some milliseconds."""
    view = in_use.as_opened
    if in_use.fault is not None:
        word, blocker = in_use.fault
        return replace(view, word=word, blocker=blocker)
    store, used = in_use.store, in_use.used
    if used is None or store is None:
        return view
    try:
        store.refresh()
    except (OcmmError, OSError) as error:
        return replace(view, word=CalibrationStatus.UNUSABLE, blocker=blocker_of(error))
    other = in_use.overtaken(store, used)
    if other is not None:
        return replace(view, word=CalibrationStatus.UNUSABLE, blocker=other)
    found = store.status_of(used, now, thorough=False)
    word = CalibrationStatus(found.state.value)
    if not found.state.usable:
        doubt = Blocker(found.reason, found.remedy)
        return replace(view, word=word, blocker=doubt, since_utc=found.since_utc)
    warnings = (f"{found.reason} {found.remedy}",) if found.reason else ()
    return replace(view, word=word, warnings=(*view.warnings, *warnings))


def replaced_in(store: RecordStore[Any], otherwise: Blocker) -> Blocker:
    """Return why other records are in force: exchanged history, or ``otherwise``."""
    return otherwise if store.exchanged is None else blocker_of(store.exchanged)


def named_folder(folder: Path, name: str, kind: str) -> Path:
    """Return the subfolder of a rig or probe; InputError as `store_folder`."""
    if not _FOLDER_NAME.fullmatch(name):
        raise InputError(
            f"{kind}.name",
            f"A {kind} named {name!r} cannot have calibrations: they are stored under its name.",
            "Use 1 to 60 letters, digits, spaces, '_', '.' or '-', starting with a letter, a "
            f"digit or '_', in field 'name' of the {kind} document.",
        )
    return folder / name


def blocker_of(error: OcmmError | OSError) -> Blocker:
    """Return the blocker for a store that cannot be read."""
    if isinstance(error, OcmmError):
        return Blocker(error.what, error.remedy)
    return Blocker(
        f"The history of the calibration cannot be read ({error.strerror}).",
        "Restore read permission.",
    )


WARNS_K = 2.0
BLOCKS_K = 5.0
"""Sensor temperature differences above which the lens may have moved, K; to be tuned."""

_WRITE = "Maintain, Calibration, Write to cameras; or ocmm calibrate write-cameras"


def write_to_cameras(record: CameraRecord, objects: Callable[[str], ObjectAccess]) -> None:
    """Write the intrinsics of a calibration to all its cameras and read them back.

    The record's hash is in the note stored with them. ``objects``: object access by camera name.
    BusError if a camera refuses, does not answer, or reads back other values; earlier cameras then
    hold the new intrinsics: repeat the call.
    """
    for entry in record.cameras:
        write_intrinsics(
            objects(entry.name), _intrinsics(record, entry), f"calibration {record_hash(record)}"
        )


def compare_with_cameras(
    record: CameraRecord, objects: Callable[[str], ObjectAccess]
) -> Blocker | None:
    """Return why cameras are not the calibrated ones; BusError if silent or damaged."""
    for entry in record.cameras:
        found = read_intrinsics(objects(entry.name))
        expected = _intrinsics(record, entry)
        if found is None:
            return Blocker(
                f"Camera '{entry.name}' stores no intrinsics, so it cannot be identified as the "
                "calibrated one.",
                f"If it is, write them to it ({_WRITE}); if not, calibrate.",
            )
        if replace(found, date_s=expected.date_s) != expected:
            return Blocker(
                f"The intrinsics stored in camera '{entry.name}' differ from the active "
                f"calibration ({_difference(found, expected)}).",
                f"Verify the calibration, then write its intrinsics ({_WRITE}).",
            )
    return None


def check_camera_temperature(
    record: CameraRecord, temperatures_c: Sequence[float | None]
) -> tuple[Blocker | None, tuple[str, ...]]:
    """Return the blocker (or None) and warnings for the cameras' temperature difference.

    Sensor temperatures camera by camera, None if unknown. No judgement without any in the record.
    """
    blocker: Blocker | None = None
    warnings = []
    pairs = zip(record.cameras, record.sensor_temperatures_c, temperatures_c, strict=False)
    for entry, then_c, now_c in pairs:
        if now_c is None or abs(now_c - then_c) <= WARNS_K:
            continue
        side = "warmer" if now_c > then_c else "colder"
        words = (
            f"Camera '{entry.name}' is {abs(now_c - then_c):.1f} K {side} than at its "
            f"calibration ({now_c:.1f} against {then_c:.1f} °C)."
        )
        if abs(now_c - then_c) > BLOCKS_K and blocker is None:
            blocker = Blocker(
                words,
                ("Wait until the cameras reach that temperature, or calibrate at the present one."),
            )
        else:
            warnings.append(words)
    return blocker, tuple(warnings)


def _intrinsics(record: CameraRecord, entry: CameraEntry) -> Intrinsics:
    made = int(datetime.fromisoformat(record.made_utc).timestamp())
    return Intrinsics.from_camera(camera_of(entry), made)


def _difference(found: Intrinsics, expected: Intrinsics) -> str:
    for name in Intrinsics.__slots__:
        ours, theirs = getattr(expected, name), getattr(found, name)
        if name != "date_s" and ours != theirs:
            return f"{name} is {theirs!r} instead of {ours!r}"
    return "nothing"
