"""Choose the calibration, probe and tip of a job: documents if virtual, else usable records."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core.calibration.records import _usable as usable
from ocmm_core.calibration.records._events import TipEventKind, TipRecords
from ocmm_core.calibration.records._history import CalibrationStore
from ocmm_core.calibration.records._probe_records import ProbeRecord, TipRecord, probe_from_records
from ocmm_core.calibration.records._probe_store import ProbeStore
from ocmm_core.calibration.records._records import CameraRecord, rig_from_record
from ocmm_core.calibration.records._sealed import canonical, record_hash
from ocmm_core.camera import Rig, read_rig
from ocmm_core.errors import CalibrationError
from ocmm_core.fieldbus.described import DeviceDescription, doubt_line, doubt_sentences, load_device
from ocmm_core.tracking import ProbeBody, read_probe


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
    place = store_folder(folder, design.rig.name)

    def with_store(design: CalibrationInUse, store: CalibrationStore) -> CalibrationInUse:
        record, name = store.active(), design.rig.name
        if record is None:
            never = usable.Blocker(
                f"The cameras of rig '{name}' were never calibrated.", "Calibrate them."
            )
            if design.rig.markers is not None:
                never = usable.Blocker(
                    f"Nothing on this computer proves the stated noise and scale of tracker "
                    f"'{name}'.",
                    "Measure its noise, then verify it: ocmm calibrate tracker and verify.",
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
        if not _is_same_device(rig, design.rig):
            other = usable.Blocker(
                f"The active calibration belongs to {_names(rig)}, but {document.name} names "
                f"{_names(design.rig)}.",
                "Give the rig document of the calibrated cameras, or calibrate these.",
            )
            if design.rig.markers is not None:
                other = usable.Blocker(
                    f"Serial number, unit, axes, volume or markers in {document.name} are not "
                    f"those of the calibrated tracker '{name}'.",
                    "Give the document it was calibrated with, or calibrate it again.",
                )
            return design.refused(other)
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


def _is_same_device(rig: Rig, design: Rig) -> bool:
    """Return whether a record is of the cameras or the tracker of a document."""
    if rig.markers is None or design.markers is None:
        return rig.markers is design.markers and _cameras(rig) == _cameras(design)
    # The noise of the document is only what was stated before.
    stated = design.markers.document.noise
    return msgspec.structs.replace(rig.markers.document, noise=stated) == design.markers.document


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


TEXT_SCHEMA = "ocmm.probe-in-use/1"


class ProbeText(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Source of a calibrated probe's geometry, as kept in jobs."""

    schema: str
    document: str
    calibration: ProbeRecord
    qualification: TipRecord | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbeView(usable.ViewInUse):
    """Status of the probe at a moment; see also `ViewInUse`."""

    probe: str
    tip: str
    """`probe`, `tip`: Names; the tip's is empty without a record."""
    diameter_mm: float
    records: TipRecords | None = None
    """None if the geometry comes from the document."""

    @property
    def title(self) -> str:
        return f"{self.probe}, tip {self.tip}" if self.tip else self.probe

    @property
    def due_utc(self) -> str:
        """Return the expiry of the records, ISO 8601 text; empty without records."""
        return "" if self.records is None else self.records.due_utc

    @property
    def note(self) -> str:
        """Return status, names and all hashes, for the job file."""
        hashes = [self.identity]
        if self.records is not None:
            hashes.append(f"calibration {record_hash(self.records.calibration)}")
        if self.records is not None and self.records.qualification is not None:
            hashes.append(f"qualification {record_hash(self.records.qualification)}")
        due = [f"due {self.due_utc}"] if self.due_utc else []
        return " ".join([self.word.value, f"{self.title}:", *hashes, *due])

    @property
    def label(self) -> str:
        """Return status, names, short hash and due date for reports; ASCII, no commas."""
        word = "UNCALIBRATED" if self.uncalibrated else self.word.value
        names = f"{self.probe}/{self.tip}" if self.tip else self.probe
        plain = "".join(sign if sign.isascii() and sign.isprintable() else "?" for sign in names)
        due = f" due {self.due_utc[:10]}" if self.due_utc else ""
        return f"{word} {plain.replace(',', ' ')} {self.identity[:12]}{due}"


@dataclass(frozen=True, slots=True)
class ProbeInUse(usable.InUse[ProbeStore, ProbeView, TipRecords]):
    """Probe at the start of a job; see also `InUse`."""

    body: ProbeBody
    probe_text: str
    """Complete source text, for the job file; its SHA-256 is ``body.identity``."""
    design: ProbeBody
    """Nominal probe of the document; records are checked against its identity."""
    tip: str = ""
    """Name of the tip; empty without a record."""
    records: TipRecords | None = None
    """None if the geometry comes from the document."""

    @property
    def used(self) -> TipRecords | None:
        return self.records

    @property
    def as_opened(self) -> ProbeView:
        """Return the view before any status is evaluated."""
        return ProbeView(
            word=usable.CalibrationStatus.DESIGN, probe=self.body.name, tip=self.tip,
            identity=self.body.identity, diameter_mm=2.0 * self.body.tip_radius,
            uncalibrated=self.uncalibrated, records=self.records,
        )  # fmt: skip

    def overtaken(self, store: ProbeStore, used: TipRecords) -> usable.Blocker | None:
        if _is_replaced(used, store):
            return usable.replaced_in(
                store,
                usable.Blocker(
                    f"Another calibration or qualification of tip '{self.tip}' has been activated "
                    "since this job was started.",
                    "End this job and start a new one.",
                ),
            )
        if store.mounted == self.tip:
            return None
        return usable.Blocker(
            f"Tip '{store.mounted or ''}' is mounted, but this job was started with tip "
            f"'{self.tip}'.",
            f"Mount tip '{self.tip}' again and check it, or end this job and start a new one.",
        )


def default_probe_folder() -> Path:
    """Return the folder of the user's probe records, with one subfolder a probe."""
    return platformdirs.user_data_path("ocmm") / "probes"


def probe_store_folder(folder: Path, probe: str) -> Path:
    """Return a probe's folder below ``folder``; InputError unless a valid name everywhere."""
    return usable.named_folder(folder, probe, "probe")


def open_probe_design(document: Path, *, uncalibrated: bool = False) -> ProbeInUse:
    """Return the probe exactly as in its document; InputError if that cannot be used."""
    body, text = read_probe(document)
    return ProbeInUse(body, text, body, uncalibrated=uncalibrated)


def open_probe(
    document: Path, folder: Path, tip: str | None = None, *, uncalibrated: bool = False
) -> ProbeInUse:
    """Return the probe of a document with the records in force for one of its tips.

    If no records are usable: with a fault, and the geometry of the document. ``folder``: root, see
    `default_probe_folder`; ``tip``: None for the mounted one; ``uncalibrated`` records points
    regardless of its status. InputError if the document, or the name of the probe, cannot be used.
    """
    design = open_probe_design(document, uncalibrated=uncalibrated)
    place = probe_store_folder(folder, design.body.name)

    def with_store(design: ProbeInUse, store: ProbeStore) -> ProbeInUse:
        wanted = tip if tip is not None else store.mounted
        design = replace(design, tip=wanted or "")
        records = store.active(wanted) if wanted is not None else None
        if records is None:
            with_tip = f" with tip '{design.tip}'" if design.tip else ""
            never = usable.Blocker(
                f"Probe '{design.body.name}' was never calibrated{with_tip}.",
                "Calibrate the probe.",
            )
            return design.refused(never, usable.CalibrationStatus.NONE)
        body = probe_from_records(design.body, records.calibration, records.qualification)
        source = ProbeText(
            schema=TEXT_SCHEMA, document=design.probe_text, calibration=records.calibration,
            qualification=records.qualification,
        )  # fmt: skip
        text = canonical(source)
        body = replace(body, identity=hashlib.sha256(text).hexdigest())
        return replace(design, body=body, probe_text=text.decode("utf-8"), records=records)

    return replace(design, tip=tip or "").opened(lambda: ProbeStore(place), with_store)


def require_records(in_use: ProbeInUse) -> TipRecords:
    """Return the records in use; CalibrationError if none may be used."""
    in_use.refuse_fault("probe_record.not_usable")
    if in_use.records is None:
        raise CalibrationError(
            "probe_record.design",
            "This job uses the probe document, without records of the tip.",
            "Choose the folder of tip records (Settings, Instrument).",
        )
    return in_use.records


def _is_replaced(records: TipRecords, store: ProbeStore) -> bool:
    """Return whether newer records of the tip were put in force; reads no file."""
    tip = records.calibration.tip
    if store.active_hash(tip) != record_hash(records.calibration):
        return True
    own = [one for one in store.events if one.tip == tip]
    begun = max(i for i, one in enumerate(own) if one.kind is TipEventKind.CALIBRATED)
    newer = [one.record for one in own[begun:] if one.kind is TipEventKind.QUALIFIED]
    used = None if records.qualification is None else record_hash(records.qualification)
    return bool(newer) and newer[-1] != used
