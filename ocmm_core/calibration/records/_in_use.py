"""Choose a job's calibration: the document for virtual rigs, else a usable record (`usable`)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path

import platformdirs

from ocmm_core.calibration.records import _usable as usable
from ocmm_core.calibration.records._history import CalibrationStore
from ocmm_core.calibration.records._records import CameraRecord, rig_from_record
from ocmm_core.calibration.records._sealed import canonical, record_hash
from ocmm_core.camera import Rig, read_rig
from ocmm_core.errors import CalibrationError
from ocmm_core.fieldbus.described import DeviceDescription, doubt_line, doubt_sentences, load_device


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationView(usable.ViewInUse):
    """Status of the calibration at a moment; see also `ViewInUse`."""

    rig: str
    record: CameraRecord | None = None
    """None if the rig comes from the rig document."""

    @property
    def label(self) -> str:
        """Return status and shortened hash, for reports; pure ASCII."""
        word = "UNCALIBRATED" if self.uncalibrated else self.word.value
        return f"{word} {self.identity[:12]}"


_UNTIMED = (
    "The cameras do not prove when they expose. Their skew is measured from the moving probe and "
    "is in U; a moving probe gives no point."
)


@dataclass(frozen=True, slots=True)
class CalibrationInUse(usable.InUse[CalibrationStore, CalibrationView, CameraRecord]):
    """Calibration at the start of a job; see also `InUse`."""

    rig: Rig
    rig_text: str
    """Complete source text, for the job file; its SHA-256 is ``rig.identity``."""
    record: CameraRecord | None = None
    """None if the rig comes from the rig document."""
    device: DeviceDescription | None = None
    """Description of the cameras; None for our own."""
    untimed: bool = False
    """Nothing proves that the cameras expose at the same time."""

    @property
    def camera_doubts(self) -> tuple[str, ...]:
        """Return unproven properties of the cameras, in sentences; empty for our own."""
        doubts = () if self.device is None else doubt_sentences(self.device)
        return (*doubts, _UNTIMED) if self.untimed else doubts

    @property
    def used(self) -> CameraRecord | None:
        return self.record

    @property
    def as_opened(self) -> CalibrationView:
        """Return the view before any status is evaluated."""
        return CalibrationView(
            word=usable.CalibrationStatus.DESIGN,
            rig=self.rig.name,
            identity=self.rig.identity,
            uncalibrated=self.uncalibrated,
            warnings=(
                *(() if self.device is None else (doubt_line(self.device),)),
                *((_UNTIMED,) if self.untimed else ()),
            ),
            record=self.record,
        )

    def overtaken(self, store: CalibrationStore, used: CameraRecord) -> usable.Blocker | None:
        if store.active_hash == record_hash(used):
            return None
        return usable.replaced_in(
            store,
            usable.Blocker(
                "Another calibration has been activated since this job was started.",
                "End this job and start a new one.",
            ),
        )


def default_folder() -> Path:
    """Return the user's calibration folder, with one subfolder a rig."""
    return platformdirs.user_data_path("ocmm") / "calibrations"


def store_folder(folder: Path, rig: str) -> Path:
    """Return a rig's folder below ``folder``; InputError unless a valid name everywhere."""
    return usable.named_folder(folder, rig, "rig")


def open_design(document: Path, *, uncalibrated: bool = False) -> CalibrationInUse:
    """Return the rig exactly as in its document; InputError if that cannot be used."""
    rig, text = read_rig(document)
    device = load_device(rig.device) if rig.device else None
    return CalibrationInUse(rig, text, device=device, uncalibrated=uncalibrated)


def open_calibration(
    document: Path, folder: Path, *, uncalibrated: bool = False
) -> CalibrationInUse:
    """Return the calibration in force of the rig described in a document.

    If no record is usable: with a fault, and the rig of the document. ``folder``: root, see
    `default_folder`; ``uncalibrated`` records points regardless of the status. InputError if the
    document, or the name of the rig, cannot be used.
    """
    design = open_design(document, uncalibrated=uncalibrated)
    if design.rig.markers is not None:
        unproven = usable.Blocker(
            f"Nothing on this computer proves the stated noise and scale of tracker "
            f"'{design.rig.name}'.",
            "Measure with 'uncalibrated': such results prove nothing.",
        )
        return design.refused(unproven, usable.CalibrationStatus.NONE)
    place = store_folder(folder, design.rig.name)

    def with_store(design: CalibrationInUse, store: CalibrationStore) -> CalibrationInUse:
        record, name = store.active(), design.rig.name
        if record is None:
            never = usable.Blocker(
                f"The cameras of rig '{name}' were never calibrated.", "Calibrate them."
            )
            return design.refused(never, usable.CalibrationStatus.NONE)
        rig = rig_in_force(record, design.rig)
        if record.rig != name:
            return design.refused(
                usable.Blocker(
                    f"The calibration in {place} belongs to rig '{record.rig}', but "
                    f"{document.name} describes rig '{name}'.",
                    f"Restore the folder of rig '{name}' from a backup, or calibrate this rig in "
                    "an empty folder.",
                )
            )
        if _cameras(rig) != _cameras(design.rig):
            return design.refused(
                usable.Blocker(
                    f"The active calibration belongs to {_names(rig)}, but {document.name} names "
                    f"{_names(design.rig)}.",
                    "Give the rig document of the calibrated cameras, or calibrate these.",
                )
            )
        return replace(design, rig=rig, rig_text=canonical(record).decode("utf-8"), record=record)

    return design.opened(lambda: CalibrationStore(place), with_store)


def rig_in_force(record: CameraRecord, design: Rig) -> Rig:
    """Return the rig of a record, completed from its document.

    Frame rate and device description are not part of a calibration, and older records lack sensors.
    CalibrationError as `rig_from_record`.
    """
    rig = rig_from_record(record)
    pairs = zip_longest(rig.sensors, design.sensors, fillvalue=0)
    return replace(
        rig,
        frame_rate_hz=design.frame_rate_hz,
        device=design.device,
        calibrate_unproven=design.calibrate_unproven,
        sensors=tuple(calibrated or of_document for calibrated, of_document in pairs),
    )


def require_record(in_use: CalibrationInUse) -> CameraRecord:
    """Return the record in use; CalibrationError if none may be used."""
    in_use.refuse_fault("calibration.not_usable")
    if in_use.record is None:
        raise CalibrationError(
            "calibration.none",
            "This job uses the rig document, without a calibration.",
            "Choose the folder of camera records (Settings, Instrument).",
        )
    return in_use.record


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
