"""Records, histories and sessions that were written before the stores and procedures were joined.

Version 0.1.0 wrote the folder ``golden/0.1/calibration`` on 2026-11-22: a store of each kind with
every kind of event but one that failed, and an unfinished session of each procedure. Never rewrite
it: the files of users are like it.
"""

from __future__ import annotations

import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from ocmm_core.calibration.cameras import KnownPointsProcedure
from ocmm_core.calibration.guided import (
    GuidedProcedure,
    ProbeProcedure,
    ProcedureDecision,
    ProcedureKind,
    SessionSite,
)
from ocmm_core.calibration.records import (
    CalibrationStore,
    EventKind,
    ProbeStore,
    State,
    TipEventKind,
    record_hash,
    rig_from_record,
)
from ocmm_core.calibration.records._events import status
from ocmm_core.calibration.relocation import RelocationProcedure
from ocmm_core.calibration.sweeping import PivotProcedure
from ocmm_core.calibration.tip import TipCheckProcedure, TipQualificationProcedure
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.camera import Rig, load_rig
from ocmm_core.seals import SealWord
from ocmm_core.tracking import load_probe

BEFORE = Path(__file__).parents[2] / "golden" / "0.1" / "calibration"
LATER = datetime(2026, 3, 3, 8, 0, tzinfo=UTC)
TIP = "6 mm"


class Kept:
    """A copy of the folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(BEFORE, folder)
        self.cameras = CalibrationStore(folder / "cameras")
        self.probe = ProbeStore(folder / "probe")
        self.rig = load_rig(folder / "rig.toml")
        self.body = load_probe(folder / "probe.toml")

    def session(self, kind: ProcedureKind) -> Path:
        (path,) = (self.folder / "sessions").glob(f"{kind.value}-2*.jsonl")
        return path

    def site(self, kind: ProcedureKind) -> SessionSite:
        rig = self.calibrated() if kind is ProcedureKind.VERIFICATION else self.rig
        records = self.folder / "none"
        if kind is ProcedureKind.VERIFICATION:
            records = self.cameras.folder
        elif issubclass(PROCEDURES[kind], ProbeProcedure):
            records = self.probe.folder
        return SessionSite(self.folder / "sessions", rig, self.body, records)

    def calibrated(self) -> Rig:
        record = self.cameras.active()
        assert record is not None
        return rig_from_record(record)


@pytest.fixture
def kept(tmp_path: Path) -> Kept:
    return Kept(tmp_path / "before")


PROCEDURES: dict[ProcedureKind, type[GuidedProcedure[Any, Any, Any, Any]]] = {
    one.kind: one
    for one in (
        KnownPointsProcedure, RelocationProcedure, VerificationProcedure, PivotProcedure,
        TipQualificationProcedure, TipCheckProcedure,
    )
}  # fmt: skip
DONE = {
    ProcedureKind.KNOWN_POINTS: {"collect": 6},
    ProcedureKind.RELOCATION: {"seats": 2, "wave": 1, "bar": 1},
    ProcedureKind.VERIFICATION: {"seats": 1},
    ProcedureKind.PIVOT: {"first": 4},
    ProcedureKind.QUALIFICATION: {"sphere": 1},
    ProcedureKind.TIP_CHECK: {"sphere": 1},
}
"""Observations that count, by step; the others have none."""


def test_the_store_of_the_cameras_opens_and_stands(kept: Kept) -> None:
    store = kept.cameras
    assert {one.kind for one in store.events} == set(EventKind)
    # Without a signature, anyone with write access can be the author.
    assert (store.status(LATER).state, store.signer.word) == (State.SUSPECT, SealWord.NOT_SIGNED)
    assert status(store.records()[0], store.events, LATER).state is State.VALID
    assert [record_hash(one) for one in store.records()] == [store.active_hash]
    assert [one.passed for one in store.verifications()] == [False, True]


def test_the_store_of_the_probe_opens_and_stands(kept: Kept) -> None:
    store = kept.probe
    kinds = {one.kind for one in store.events}
    assert kinds == set(TipEventKind) - {TipEventKind.FAILED, TipEventKind.NOT_QUALIFIED}
    assert (store.status(TIP, LATER).state, store.signer.word) == (
        State.SUSPECT, SealWord.NOT_SIGNED,
    )  # fmt: skip
    assert (store.mounted, store.tips) == (TIP, (TIP,))
    assert [record_hash(one) for one in store.calibrations()] == [store.active_hash(TIP)]
    assert len(store.qualifications()) == len(store.checks()) == 1


@pytest.mark.parametrize("kind", list(PROCEDURES))
def test_a_session_of_each_procedure_opens(kept: Kept, kind: ProcedureKind) -> None:
    procedure = PROCEDURES[kind].resume(kept.site(kind), kept.session(kind))
    base = procedure.base
    assert (base.kind, base.begun_utc[:10]) == (kind, "2026-03-02")
    assert {step.name: step.done for step in base.steps if step.done} == DONE[kind]
    ended = kind is ProcedureKind.PIVOT
    assert base.decision is (ProcedureDecision.KEPT if ended else ProcedureDecision.OPEN)


@pytest.mark.parametrize("kind", [kind for kind in PROCEDURES if kind is not ProcedureKind.PIVOT])
def test_it_goes_on_and_opens_once_more(kept: Kept, kind: ProcedureKind) -> None:
    path = kept.session(kind)
    PROCEDURES[kind].resume(kept.site(kind), path).keep(LATER, "enough")
    again = PROCEDURES[kind].resume(kept.site(kind), path).base
    assert again.decision is ProcedureDecision.KEPT
    assert {step.name: step.done for step in again.steps if step.done} == DONE[kind]


def test_what_is_stored_now_goes_on_in_the_same_history(kept: Kept) -> None:
    kept.cameras.suspect("engineer", "A doubt.", None, LATER)
    kept.probe.doubt("engineer", "A doubt.", LATER - timedelta(hours=1), LATER)
    again = CalibrationStore(kept.folder / "cameras"), ProbeStore(kept.folder / "probe")
    assert again[0].status(LATER).state is State.SUSPECT
    assert again[1].status(TIP, LATER).state is State.SUSPECT
