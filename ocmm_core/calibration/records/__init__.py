"""Sealed and chained records of cameras, probes and tips, and their usability.

In: outcomes of procedures, certificates of artefacts, events such as a shock or a mounted tip.
Out: records in force, their status with its reason, their history, and whether points may be
recorded.

Read `_sealed` (write-once records, exchanged files), `_chain_seal` and `_event_folder` (chain of
events), `_record_store` and `_events` (common part of both stores; status of a record), then the
specific parts: `_records` and `_history` (cameras), `_probe_records` and `_probe_store` (probe and
tips). `_usable` decides whether records may be used now, for `_in_use` (cameras and probes);
`_artefacts` and `_overview` serve the pages. The package is independent of how calibrations are
computed.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.records._artefacts import (
        Artefact, ArtefactCertificate, ArtefactHead, Finding, LengthBar, Sphere, artefact_of,
        let_pass, load_bar, load_sphere, rests_on, same_serial,
    )  # fmt: skip
    from ocmm_core.calibration.records._chain_seal import NAME
    from ocmm_core.calibration.records._events import (
        Event, EventKind, TipEvent, TipEventKind, TipRecords, judgements,
    )  # fmt: skip
    from ocmm_core.calibration.records._history import CalibrationStore
    from ocmm_core.calibration.records._in_use import (
        TEXT_SCHEMA, CalibrationInUse, CalibrationView, ProbeInUse, ProbeText, ProbeView,
        default_folder, default_probe_folder, open_calibration, open_design, open_probe,
        open_probe_design, probe_store_folder, require_record, require_records, rig_in_force,
        store_folder,
    )  # fmt: skip
    from ocmm_core.calibration.records._overview import (
        CalibrationOverview, Course, ProbeOverview, Sample, TipState, overview, probe_overview,
    )  # fmt: skip
    from ocmm_core.calibration.records._probe_records import (
        CHECK_SCHEMA, PROBE_SCHEMA, TIP_SCHEMA, MadeRecord, PivotCheck, ProbeRecord, TipCheckRecord,
        TipRecord, probe_from_records,
    )  # fmt: skip
    from ocmm_core.calibration.records._probe_store import MONITOR, ProbeStore
    from ocmm_core.calibration.records._record_store import RecordStore, State
    from ocmm_core.calibration.records._records import (
        SCHEMA, VERIFICATION_SCHEMA, ArtefactUse, CameraRecord, Check, Corner, ErrorInterval,
        Method, Objection, RepeatedSeat, ResidualMap, ScaleError, ThermalTerm, VerificationRecord,
        entry_of, rig_from_record,
    )  # fmt: skip
    from ocmm_core.calibration.records._sealed import (
        SignedRecord, canonical, load, load_named, load_signed, record_hash, save, seal,
        seal_signed,
    )  # fmt: skip
    from ocmm_core.calibration.records._usable import (
        PRACTICE, Blocker, CalibrationStatus, check_camera_temperature, compare_with_cameras,
        is_practice, judge, practice_name, require_real_name, write_to_cameras,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CHECK_SCHEMA", "MONITOR", "NAME", "PRACTICE", "PROBE_SCHEMA", "SCHEMA", "TEXT_SCHEMA",
    "TIP_SCHEMA", "VERIFICATION_SCHEMA", "Artefact", "ArtefactCertificate", "ArtefactHead",
    "ArtefactUse", "Blocker", "CalibrationInUse", "CalibrationOverview", "CalibrationStatus",
    "CalibrationStore", "CalibrationView", "CameraRecord", "Check", "Corner", "Course",
    "ErrorInterval", "Event", "EventKind", "Finding", "LengthBar", "MadeRecord", "Method",
    "Objection", "PivotCheck", "ProbeInUse", "ProbeOverview", "ProbeRecord", "ProbeStore",
    "ProbeText", "ProbeView", "RecordStore", "RepeatedSeat", "ResidualMap", "Sample", "ScaleError",
    "SignedRecord", "Sphere", "State", "ThermalTerm", "TipCheckRecord", "TipEvent", "TipEventKind",
    "TipRecord", "TipRecords", "TipState", "VerificationRecord", "artefact_of", "canonical",
    "check_camera_temperature", "compare_with_cameras", "default_folder", "default_probe_folder",
    "entry_of", "is_practice", "judge", "judgements", "let_pass", "load", "load_bar", "load_named",
    "load_signed", "load_sphere", "open_calibration", "open_design", "open_probe",
    "open_probe_design", "overview", "practice_name", "probe_from_records", "probe_overview",
    "probe_store_folder", "record_hash", "require_real_name", "require_record", "require_records",
    "rests_on", "rig_from_record", "rig_in_force", "same_serial", "save", "seal", "seal_signed",
    "store_folder", "write_to_cameras",
]  # fmt: skip
