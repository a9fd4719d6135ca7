"""An artefact found wrong invalidates everything based on it.

Every later calibration and verification with a bar or sphere gets an entry in the history of its
rig, from which its state, points and jobs follow (`calibration.history.judgements`,
`inspection.camera_doubts`).
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.calibration.records import CalibrationStore, EventKind, record_hash, rests_on
from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError


@dataclass(frozen=True, slots=True)
class Fallen:
    """An invalidated calibration or verification."""

    rig: str
    made_utc: str
    kind: str
    """``"calibration"`` or ``"verification"``."""
    calibration: str
    """Hash of the calibration that it is, or that it was about."""


def artefact_wrong(
    calibrations: Path, serial: str, since: datetime, who: str, now: datetime
) -> tuple[Fallen, ...]:
    """Invalidate all that is based on an artefact since a moment, once; return what was.

    ``calibrations``: one subfolder per rig; ``serial``: as in its document, see
    `serials.same_serial`; ``since``: start of the error. InputError if no record here is based on
    it since then; OcmmError if a history or a record cannot be read, or written.
    """
    folders = [folder for folder in files_of_folder(calibrations, "") if folder.is_dir()]
    stores = [CalibrationStore(one) for one in folders if files_of_folder(one, "events.jsonl")]
    # All are read before the first write.
    found = [(store, *_resting_on(store, serial, since)) for store in stores]
    if not any(records or checks for _, records, checks in found):
        raise InputError(
            "recall.artefact",
            f"No calibration or verification in {calibrations} is based on an artefact with "
            f"serial number {serial!r} since {since.date().isoformat()}.",
            "Check serial number and date; the Calibration page lists the artefacts.",
        )
    fallen: list[Fallen] = []
    reason = f"Artefact {serial} was found to be wrong since {since.date().isoformat()}."
    for store, records, checks in found:
        known = {
            (one.calibration, one.evidence) for one in store.events if one.kind is EventKind.FALLEN
        }
        rig = store.folder.name
        lines = [(digest, "", made, "calibration") for digest, made in records]
        lines += [(about, digest, made, "verification") for about, digest, made in checks]
        for about, evidence, made, kind in lines:
            if (about, evidence) not in known:
                store.fall(about, evidence, who=who, reason=reason, since=since, now=now)
                fallen.append(Fallen(rig, made, kind, about))
    return tuple(fallen)


def _resting_on(
    store: CalibrationStore, serial: str, since: datetime
) -> tuple[list[tuple[str, str]], list[tuple[str, str, str]]]:
    """Return calibrations (hash, made) and verifications (about, hash, made) on an artefact."""
    records = [
        (record_hash(one), one.made_utc)
        for one in store.records()
        if rests_on(one.artefacts, serial) and _time(one.made_utc) >= since
    ]
    checks = [
        (one.calibration, record_hash(one), one.made_utc)
        for one in store.verifications()
        if rests_on(one.artefacts, serial) and _time(one.made_utc) >= since
    ]
    return records, checks


def _time(utc: str) -> datetime:
    found = datetime.fromisoformat(utc)
    return found if found.tzinfo is not None else found.replace(tzinfo=UTC)
