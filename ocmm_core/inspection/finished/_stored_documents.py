"""Documents in a job file: plan, cameras, probe and conditions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import msgspec

from ocmm_core.calibration import records
from ocmm_core.calibration.probe_design import body_in_use, contact_force, load_design
from ocmm_core.calibration.records import SCHEMA as CAMERA_RECORD_SCHEMA
from ocmm_core.camera import Rig, load_rig
from ocmm_core.cleanup import scratch_folder
from ocmm_core.documents import decode_json
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.evaluation import SessionOptions, with_stored_limits
from ocmm_core.inspection.plan import Plan, load_plan
from ocmm_core.measuring import CLIMATE_EVENT, Climate, climate_of_text
from ocmm_core.storage import JobEvent, JobHead, JobReference
from ocmm_core.tracking import ProbeBody, ReferenceBody, load_probe, load_reference

T = TypeVar("T")

_DOCUMENT = "document.toml"


@dataclass(frozen=True, slots=True)
class StoredDocuments:
    """Read the documents of a job; all methods raise InputError if one cannot be used."""

    path: Path
    """The opened file, for messages."""
    head: JobHead

    def plan(self) -> Plan:
        return self._from_text("plan", self.head.plan_text, load_plan)

    def rig(self) -> Rig:
        """Return the cameras, from a calibration record or the rig document."""
        record = self.camera_record()
        if record is None:
            return self._from_text("rig", self.head.rig_text, load_rig)
        return records.rig_from_record(record)

    def camera_record(self) -> records.CameraRecord | None:
        """Return the calibration; None if the job has a rig document."""
        try:
            return _camera_record(self.head.rig_text)
        except msgspec.MsgspecError as error:
            raise self._unreadable("rig", error) from error

    def probe_records(self) -> records.ProbeText | None:
        """Return the records of the probe; None if the job has a probe document."""
        if _schema(self.head.probe_text) != records.TEXT_SCHEMA:
            return None
        return self._record("probe", self.head.probe_text, records.ProbeText)

    def probe(self) -> ProbeBody:
        """Return the probe, from its records or the probe document."""
        text = self.probe_records()
        if text is None:
            return self._from_text("probe", self.head.probe_text, load_probe)
        design = self._from_text("probe", text.document, load_probe)
        body = records.probe_from_records(design, text.calibration, text.qualification)
        return replace(body, identity=self.head.probe_identity)

    def measured_with(
        self, events: Sequence[JobEvent], stored: JobReference | None
    ) -> tuple[ProbeBody, SessionOptions]:
        """Return the probe at the job's temperature, and the options of the session."""
        body = self.probe()
        recorded = [event.text for event in events if event.kind == CLIMATE_EVENT]
        climate = climate_of_text(recorded[-1]) if recorded else Climate()
        contact = None
        if climate.probe_design:
            cold = body
            design = self._from_text(
                "design of the probe", climate.probe_design, lambda file: load_design(file, cold)
            )
            contact = contact_force(design, body)
            body = body_in_use(body, design, climate.probe)
        reference: ReferenceBody | None = None
        if stored is not None:
            reference = self._from_text("reference body", stored.text, load_reference)
        options = SessionOptions(climate=climate, contact=contact, reference=reference)
        return body, with_stored_limits(options, events)

    def _record(self, what: str, text: str, kind: type[T]) -> T:
        try:
            return decode_json(text, kind)
        except msgspec.MsgspecError as error:
            raise self._unreadable(what, error) from error

    def _unreadable(self, what: str, error: msgspec.MsgspecError) -> InputError:
        return InputError(
            "job.record",
            f"{self.path}: the record of the {what} in the job cannot be read: {error}.",
            "Open the job with the program version that wrote it.",
        )

    def _from_text(self, what: str, text: str, load: Callable[[Path], T]) -> T:
        try:
            found: T = _loaded(text, load)
            return found
        except OcmmError as error:
            raise named(error, _DOCUMENT, f"{self.path} ({what})") from error


@lru_cache(maxsize=16)
def _camera_record(text: str) -> records.CameraRecord | None:
    """Return the calibration in a text, None for a document; cached like `_loaded`."""
    return (
        decode_json(text, records.CameraRecord) if _schema(text) == CAMERA_RECORD_SCHEMA else None
    )


@lru_cache(maxsize=16)
def _loaded(text: str, load: Callable[[Path], T]) -> T:
    """Load a text; cached, as the jobs of a batch hold the same ones."""
    with scratch_folder("document") as folder:
        file = folder / _DOCUMENT
        file.write_bytes(text.encode("utf-8"))
        try:
            return load(file)
        except OcmmError as error:
            raise named(error, str(file), _DOCUMENT) from error


def named(error: OcmmError, name: str, told: str) -> OcmmError:
    """Return an error that names the opened file instead of its copy."""
    return type(error)(error.code, error.what.replace(name, told), error.remedy.replace(name, told))


def about(error: OcmmError, path: Path) -> OcmmError:
    if str(path) in error.what:
        return error
    return type(error)(error.code, f"{path}: {error.what}", error.remedy)


class _Head(msgspec.Struct, frozen=True):
    schema: str = ""


def _schema(text: str) -> str:
    """Return the ``schema`` of a record; empty for a document, which is no JSON."""
    try:
        return decode_json(text, _Head).schema
    except msgspec.MsgspecError:
        return ""
