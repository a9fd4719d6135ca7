"""A blow during a tip check: a check begun before it cannot lift the suspicion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag
from ocmm_core.calibration.guided import SessionSite, ShockDetector
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import MONITOR, ProbeStore, TipEventKind
from ocmm_core.calibration.tip import TipCheckProcedure, TouchSetup
from ocmm_core.errors import CalibrationError
from ocmm_sim.calibration_scenes import CalibrationScenesRig, TipFault
from ocmm_sim.sources import scene_of_tip
from tests.core.calibration.made_probe_records import make_probe_record, make_tip_record
from tests.core.calibration.procedure_site import BEGIN, SEED, Bench, show

TIP = "6 mm"
_NOTHING = FrameBlock(
    counter=np.empty(0, dtype=np.int64),
    time_ns=np.empty(0, dtype=np.int64),
    flags=np.empty(0, dtype=np.uint32),
    valid=np.empty((0, 2), dtype=np.uint64),
    uv=np.empty((0, 2, 8, 2)),
)


def test_a_check_that_felt_a_blow_is_made_anew(tmp_path: Path) -> None:
    bench, store = Bench.at(tmp_path), ProbeStore(tmp_path / "probe")
    record = make_probe_record(made_utc=BEGIN.isoformat())
    store.calibrate(record, "technician", "", bench.now())
    store.qualify(make_tip_record(record, diameter_mm=6.0, diameter_sigma_mm=0.0045), bench.now())
    procedure = TipCheckProcedure.start(
        SessionSite(bench.sessions, bench.rig, bench.body, store.folder),
        TouchSetup(
            who="inspector", temperature=Temperature(20.5, 0.3, ""), tip=TIP, sphere=bench.sphere
        ),
        bench.now(),
    )
    scene = scene_of_tip(procedure.view, bench.sphere, bench.rig, SEED, TipFault())
    rig = CalibrationScenesRig(bench.rig, bench.body, (scene,), SEED)
    frames = rig.frames(0, 40)
    flags = np.where(np.arange(40) >= 10, FrameFlag.DROPPED, 0).astype(np.uint32)
    for _ in range(2):
        # The bit stays set for a second: one blow.
        procedure.watch(replace(frames, flags=flags))
        flags = np.full(40, FrameFlag.DROPPED, dtype=np.uint32)
    store.refresh()
    last = store.events[-1]
    assert (last.kind, last.who, last.tip) == (TipEventKind.DOUBTED, MONITOR, TIP)
    assert [one.kind for one in store.events].count(TipEventKind.DOUBTED) == 1
    show(procedure, rig, bench.now)
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    assert outcome.record.passed
    with pytest.raises(CalibrationError, match="shock detected"):
        procedure.accept(bench.now(), "")
    store.refresh()
    assert store.checks() == ()


def test_where_a_blow_begins() -> None:
    sense = ShockDetector()
    felt = int(FrameFlag.DROPPED)
    for flags, begun in (
        ([0, felt, felt, 0, felt | 1], [1, 4]), ([felt, 0], []), ([1, 0], []), ([felt], [0]),
    ):  # fmt: skip
        count = len(flags)
        block = replace(
            _NOTHING,
            counter=np.arange(count),
            time_ns=np.arange(count),
            flags=np.array(flags, dtype=np.uint32),
        )
        assert sense.push(block).tolist() == begun
    assert sense.push(_NOTHING).tolist() == []
