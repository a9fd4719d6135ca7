"""Which calibration a job is measured with, and whether points may be taken with it.

Virtual rigs are measured with the rig document itself. Real cameras, also recorded ones, need a
record from the store of calibrations whose standing is usable; without one no points are taken,
or, when somebody insists, every verdict is NOT PROVEN.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path

import platformdirs

from ocmm_core.calibration.records._history import CalibrationStore
from ocmm_core.calibration.records._record_store import Standing
from ocmm_core.calibration.records._records import CameraRecord, rig_from_record
from ocmm_core.calibration.records._sealed import canonical, record_hash
from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import read_bytes
from ocmm_core.errors import CalibrationError, InputError, OcmmError

_FOLDER_NAME = re.compile(r"[A-Za-z0-9_]([A-Za-z0-9 _.-]{0,58}[A-Za-z0-9_-])?")


class Word(StrEnum):
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
class Obstacle:
    """Why no points may be taken, and what to do about it."""

    what: str
    remedy: str

    def __str__(self) -> str:
        """Return both sentences."""
        return f"{self.what} {self.remedy}"


@dataclass(frozen=True, slots=True)
class CalibrationInUse:
    """The calibration that a job was begun with.

    Attributes
    ----------
    rig
        What is measured with.
    rig_text
        The complete text that it comes from, for the job file; its SHA-256 is ``rig.identity``.
    record
        The record it comes from; None where it comes from the rig document.
    store
        The calibrations of the rig; None for virtual rigs, and where it is damaged.
    fault
        Word and reason why it must not be used, found when it was opened; None where it may.
    uncalibrated
        Somebody insists on measuring all the same.
    """

    rig: Rig
    rig_text: str
    record: CameraRecord | None = None
    store: CalibrationStore | None = None
    fault: tuple[Word, Obstacle] | None = None
    uncalibrated: bool = False


@dataclass(frozen=True, slots=True)
class CalibrationView:
    """What is to be said about the calibration at a moment.

    Attributes
    ----------
    word
        In one word.
    rig, identity
        Name of the rig and hash of what it comes from.
    obstacle
        Why no points may be taken; None where they may.
    uncalibrated
        They are taken all the same, and prove nothing.
    warnings
        What somebody should know who measures.
    since_utc
        For SUSPECT: points since then are in doubt. Empty otherwise.
    record
        None where the rig comes from the rig document.
    """

    word: Word
    rig: str
    identity: str
    obstacle: Obstacle | None = None
    uncalibrated: bool = False
    warnings: tuple[str, ...] = ()
    since_utc: str = ""
    record: CameraRecord | None = None

    @property
    def hindrance(self) -> Obstacle | None:
        """Return why no points may be taken; None where they may, or are taken all the same."""
        return None if self.uncalibrated else self.obstacle

    @property
    def unproven(self) -> str:
        """Return why a job that is measured so proves nothing; empty where it does."""
        if not self.uncalibrated:
            return ""
        why = f" {self.obstacle.what}" if self.obstacle is not None else ""
        return f"Measured as uncalibrated.{why}"

    @property
    def label(self) -> str:
        """Return word and shortened hash, for reports; pure ASCII."""
        word = "UNCALIBRATED" if self.uncalibrated else self.word.value
        return f"{word} {self.identity[:12]}"


def default_folder() -> Path:
    """Return where calibrations of this user are kept, rig by rig."""
    return platformdirs.user_data_path("ocmm") / "calibrations"


def store_folder(folder: Path, rig: str) -> Path:
    """Return the folder of a rig's store below ``folder``.

    Raises
    ------
    InputError
        The rig's name cannot be that of a folder on every system.
    """
    return named_folder(folder, rig, "rig")


def named_folder(folder: Path, name: str, kind: str) -> Path:
    """Return the folder below ``folder`` of a rig or probe; InputError as `store_folder`."""
    if not _FOLDER_NAME.fullmatch(name):
        raise InputError(
            f"{kind}.name",
            f"A {kind} called {name!r} cannot have calibrations: they are kept under its name.",
            "Use 1 to 60 letters, digits, spaces, '_', '.' or '-', beginning with a letter, a "
            f"digit or '_', in field 'name' of the {kind} document.",
        )
    return folder / name


def open_design(document: Path, *, uncalibrated: bool = False) -> CalibrationInUse:
    """Return the rig of a document as it stands there, for virtual rigs.

    Raises
    ------
    InputError
        The document cannot be used.
    """
    text = read_bytes(document).decode("utf-8")
    return CalibrationInUse(load_rig(document), text, uncalibrated=uncalibrated)


def open_calibration(
    document: Path, folder: Path, *, uncalibrated: bool = False
) -> CalibrationInUse:
    """Return the calibration in force of the rig that a document describes.

    Parameters
    ----------
    document
        The rig document: the name of the rig, its cameras, and how fast they run.
    folder
        Where calibrations are kept, see `default_folder`.
    uncalibrated
        Points are taken whatever is the matter with the calibration.

    Returns
    -------
    CalibrationInUse
        With a fault where there is no usable record; its rig is then that of the document.

    Raises
    ------
    InputError
        The document cannot be used, or the name of the rig.
    """
    design = open_design(document, uncalibrated=uncalibrated)
    place = store_folder(folder, design.rig.name)
    try:
        store = CalibrationStore(place)
    except OcmmError as error:
        return replace(design, fault=(Word.UNUSABLE, obstacle_of(error)))
    design = replace(design, store=store)
    try:
        record = store.active()
        if record is None:
            return replace(design, fault=(Word.NONE, _never(design.rig)))
        rig = rig_from_record(record)
    except OcmmError as error:
        return replace(design, fault=(Word.UNUSABLE, obstacle_of(error)))
    if record.rig != design.rig.name:
        other = _other_rig(document, design.rig.name, record.rig, place)
        return replace(design, fault=(Word.UNUSABLE, other))
    if _cameras(rig) != _cameras(design.rig):
        return replace(design, fault=(Word.UNUSABLE, _others(document, design.rig, rig)))
    # How fast the cameras run is no matter of calibration.
    rig = replace(rig, frame_rate_hz=design.rig.frame_rate_hz)
    return replace(design, rig=rig, rig_text=canonical(record).decode("utf-8"), record=record)


def require_record(in_use: CalibrationInUse) -> CameraRecord:
    """Return the record that is measured with.

    Raises
    ------
    CalibrationError
        There is none, or none that may be used.
    """
    if in_use.fault is not None:
        _, obstacle = in_use.fault
        raise CalibrationError("calibration.not_usable", obstacle.what, obstacle.remedy)
    if in_use.record is None:
        raise CalibrationError(
            "calibration.none",
            "This job is measured with the rig document, without a calibration.",
            "Give the folder of calibrations: --calibrations.",
        )
    return in_use.record


def judge(in_use: CalibrationInUse, now: datetime) -> CalibrationView:
    """Return what is to be said about a calibration at a moment.

    The first time after it was opened all files that it rests on are read, some milliseconds; then
    it takes a fraction of one.
    """
    view = CalibrationView(
        Word.DESIGN,
        in_use.rig.name,
        in_use.rig.identity,
        uncalibrated=in_use.uncalibrated,
        record=in_use.record,
    )
    if in_use.fault is not None:
        word, obstacle = in_use.fault
        return replace(view, word=word, obstacle=obstacle)
    if in_use.record is None or in_use.store is None:
        return view
    try:
        in_use.store.refresh()
    except (OcmmError, OSError) as error:
        return replace(view, word=Word.UNUSABLE, obstacle=obstacle_of(error))
    if in_use.store.active_hash != record_hash(in_use.record):
        exchanged = in_use.store.exchanged
        other = _REPLACED if exchanged is None else obstacle_of(exchanged)
        return replace(view, word=Word.UNUSABLE, obstacle=other)
    found = in_use.store.standing_of(in_use.record, now, thorough=False)
    word, doubt, warnings, since = words_of(found)
    return replace(view, word=word, obstacle=doubt, warnings=warnings, since_utc=since)


def words_of(found: Standing) -> tuple[Word, Obstacle | None, tuple[str, ...], str]:
    """Return word, obstacle, warnings and since when points are in doubt, of a standing."""
    word = Word(found.state.value)
    if not found.state.usable:
        return word, Obstacle(found.reason, found.remedy), (), found.since_utc
    return word, None, (f"{found.reason} {found.remedy}",) if found.reason else (), ""


_REPLACED = Obstacle(
    "Another calibration was put in force since this job was begun.",
    "End this job and begin a new one.",
)


def obstacle_of(error: OcmmError | OSError) -> Obstacle:
    """Return what stands in the way where a store cannot be read."""
    if isinstance(error, OcmmError):
        return Obstacle(error.what, error.remedy)
    return Obstacle(
        f"The history of the calibration cannot be read ({error.strerror}).",
        "Restore the right to read it.",
    )


def _never(rig: Rig) -> Obstacle:
    return Obstacle(f"The cameras of rig '{rig.name}' were never calibrated.", "Calibrate them.")


def _other_rig(document: Path, name: str, found: str, place: Path) -> Obstacle:
    return Obstacle(
        f"The calibration in {place} is that of rig '{found}', but {document.name} describes rig "
        f"'{name}'.",
        f"Restore the folder of rig '{name}' from a backup, or calibrate this rig in an empty one.",
    )


def _others(document: Path, design: Rig, calibrated: Rig) -> Obstacle:
    return Obstacle(
        f"The calibration in force is that of {_names(calibrated)}, but {document.name} names "
        f"{_names(design)}.",
        "Give the rig document of the cameras that were calibrated, or calibrate these.",
    )


def _cameras(rig: Rig) -> list[tuple[str, int, int, int, int]]:
    return [
        (camera.name, camera.serial, alias, camera.width, camera.height)
        for camera, alias in zip(rig.cameras, rig.aliases, strict=True)
    ]


def _names(rig: Rig) -> str:
    return ", ".join(
        f"'{camera.name}' (serial {camera.serial}, alias {alias})"
        for camera, alias in zip(rig.cameras, rig.aliases, strict=True)
    )
