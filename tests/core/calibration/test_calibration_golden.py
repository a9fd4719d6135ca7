"""Signed calibrations of version 0.2.0 are valid, and their waiting sessions resume."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import pytest

from ocmm_core.calibration.guided import (
    Procedure,
    ProcedureDecision,
    ProcedureKind,
    SessionSite,
    sessions,
)
from ocmm_core.calibration.records import (
    CalibrationStore,
    EventKind,
    ProbeStore,
    State,
    TipEventKind,
    rig_from_record,
)
from ocmm_core.calibration.tip import TipCheckProcedure
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.camera import Rig
from ocmm_core.documents import resource
from ocmm_core.errors import StorageError
from ocmm_core.seals import SealWord
from ocmm_core.tracking import load_probe
from tests.core.golden_station import copied_station

TIP = "6 mm"
BODY = load_probe(resource("probes", "standard.toml"))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    return copied_station("0.2", tmp_path, monkeypatch, "calibration")


def _cameras(folder: Path) -> CalibrationStore:
    return CalibrationStore(folder / "cameras" / "recommended")


def _probe(folder: Path) -> ProbeStore:
    return ProbeStore(folder / "probes" / "standard")


def _rig(store: CalibrationStore) -> Rig:
    record = store.active()
    assert record is not None
    return rig_from_record(record)


def _after(store: CalibrationStore | ProbeStore) -> datetime:
    return datetime.fromisoformat(store.events[-1].utc) + timedelta(hours=1)


def _resumed(folder: Path, kind: ProcedureKind) -> Procedure:
    cameras, probe = _cameras(folder), _probe(folder)
    store = "cameras/recommended" if kind is ProcedureKind.VERIFICATION else "probes/standard"
    waiting = max(sessions(folder / store / "sessions", kind))
    if kind is ProcedureKind.VERIFICATION:
        return VerificationProcedure.resume(
            SessionSite(waiting.parent, _rig(cameras), BODY, cameras.folder), waiting
        )
    return TipCheckProcedure.resume(
        SessionSite(waiting.parent, _rig(cameras), BODY, probe.folder), waiting
    )


def test_the_cameras_are_valid_and_signed(folder: Path) -> None:
    store = _cameras(folder)
    assert [one.kind for one in store.events] == [EventKind.ACCEPTED, EventKind.PASSED]
    assert store.status(_after(store)).state is State.VALID
    assert store.signer.word is SealWord.SEALED
    assert [one.passed for one in store.verifications()] == [True]


def test_the_tip_is_valid_and_signed(folder: Path) -> None:
    store = _probe(folder)
    assert [one.kind for one in store.events] == [
        TipEventKind.CALIBRATED, TipEventKind.QUALIFIED, TipEventKind.PASSED,
    ]  # fmt: skip
    assert (store.mounted, store.status(TIP, _after(store)).state) == (TIP, State.VALID)
    assert store.signer.word is SealWord.SEALED


def test_a_changed_history_is_refused(folder: Path) -> None:
    events = folder / "cameras/recommended/events.jsonl"
    events.write_text(events.read_text("utf-8").replace("Q. Engineer", "Q. Operator", 1), "utf-8")
    with pytest.raises(StorageError, match="line 1 was changed"):
        _cameras(folder)


@pytest.mark.parametrize("kind", [ProcedureKind.VERIFICATION, ProcedureKind.TIP_CHECK])
def test_a_waiting_session_is_accepted(folder: Path, kind: ProcedureKind) -> None:
    store = _cameras(folder) if kind is ProcedureKind.VERIFICATION else _probe(folder)
    before = len(store.events)
    procedure = _resumed(folder, kind)
    assert procedure.base.decision is ProcedureDecision.OPEN
    procedure.compute()
    procedure.accept(_after(store), "golden")
    again = _cameras(folder) if kind is ProcedureKind.VERIFICATION else _probe(folder)
    assert len(again.events) == before + 1
    assert _resumed(folder, kind).base.decision is ProcedureDecision.ACCEPTED
