"""Guided tip qualification and quick check on the virtual rig, and who may not begin one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.calibration.guided import SessionSite
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import ProbeStore, State
from ocmm_core.calibration.tip import (
    CHECK_RINGS,
    QUALIFICATION_RINGS,
    CheckVerdict,
    Phase,
    QualificationSetup,
    TipCheckProcedure,
    TipLimits,
    TipQualificationProcedure,
    TouchSetup,
)
from ocmm_core.errors import CalibrationError
from ocmm_sim.calibration_scenes import CalibrationScenesRig, TipFault, TouchSeats
from ocmm_sim.sources import scene_of_tip
from tests.core.calibration.made_probe_records import make_probe_record, make_tip_record
from tests.core.calibration.procedure_site import BEGIN, FULL_HZ, SEED, Bench, show
from tests.core.calibration.touched_tip import SIGMA_PX, TipWorld
from tests.slow_rig import CALM_HZ

TIP = "6 mm"


@dataclass(slots=True)
class Tips:
    """A bench with a probe that was calibrated with one tip."""

    bench: Bench
    store: ProbeStore

    @classmethod
    def at(cls, folder: Path, rate_hz: int = CALM_HZ, *, qualified: bool = False) -> Tips:
        bench = Bench.at(folder, rate_hz)
        store = ProbeStore(folder / "probe")
        record = make_probe_record(made_utc=BEGIN.isoformat())
        store.calibrate(record, "technician", "", bench.now())
        if qualified:
            good = make_tip_record(record, diameter_mm=6.0, diameter_sigma_mm=0.0045)
            store.qualify(good, bench.now())
        return cls(bench, store)

    def site(self, hold_s: float = 0.0) -> SessionSite:
        bench = self.bench
        return SessionSite(bench.sessions, bench.rig, bench.body, self.store.folder, hold_s=hold_s)

    def qualification(self, hold_s: float = 0.0) -> TipQualificationProcedure:
        bench = self.bench
        return TipQualificationProcedure.start(
            self.site(hold_s),
            QualificationSetup(
                who="technician",
                temperature=Temperature(20.5, 0.3, ""),
                tip=TIP,
                sphere=bench.sphere,
            ),
            bench.now(),
        )

    def check(self) -> TipCheckProcedure:
        bench = self.bench
        return TipCheckProcedure.start(
            self.site(),
            TouchSetup(
                who="inspector",
                temperature=Temperature(20.5, 0.3, ""),
                tip=TIP,
                sphere=bench.sphere,
            ),
            bench.now(),
        )

    def resumed(self, procedure: TipQualificationProcedure) -> TipQualificationProcedure:
        return TipQualificationProcedure.resume(self.site(), procedure.base.session)

    def touching(
        self,
        procedure: TipQualificationProcedure | TipCheckProcedure,
        fault: TipFault | None = None,
    ) -> CalibrationScenesRig:
        scene = scene_of_tip(
            procedure.view, self.bench.sphere, self.bench.rig, SEED, fault or TipFault()
        )
        return CalibrationScenesRig(self.bench.rig, self.bench.body, (scene,), SEED)


def take(
    procedure: TipQualificationProcedure | TipCheckProcedure, bench: Bench, sphere: int, cone: int
) -> None:
    """Take computed spots on the first places of the layout, and in the first attitudes."""
    rng = np.random.default_rng(SEED)
    world = TipWorld(bench.rig, bench.body, bench.sphere)
    truth = world.draw(rng)
    rings = CHECK_RINGS if isinstance(procedure, TipCheckProcedure) else QUALIFICATION_RINGS
    for plan, count in ((world.on_sphere(rings, rng, np.inf), sphere), (world.in_cone(rng), cone)):
        if count:
            procedure.advance(bench.now())
        for uv in world.seen(plan, truth, rng)[:count]:
            procedure.take_shot(uv, SIGMA_PX, bench.now())


def test_a_tip_is_qualified_across_a_crash_and_is_then_valid(tmp_path: Path) -> None:
    tips = Tips.at(tmp_path)
    now = tips.bench.now
    first = tips.qualification()
    assert show(first, tips.touching(first), now, at_most=9) == 9
    before = first.view.sphere
    assert np.isfinite(before.diameter_sigma_end_mm)
    assert before.diameter_sigma_end_mm < before.diameter_sigma_mm
    procedure = tips.resumed(first)
    after = procedure.view.sphere
    assert after.tips_world == pytest.approx(before.tips_world, abs=0.0)
    assert after.missing == before.missing
    assert not procedure.base.step.gate.open
    with pytest.raises(CalibrationError, match="missing"):
        procedure.compute()
    show(procedure, tips.touching(procedure), now)
    view = procedure.view
    assert view.base.step.name == "result"
    assert view.sphere.missing == ()
    assert view.sphere.diameter_sigma_mm < view.sphere.diameter_sigma_limit_mm
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    record = outcome.record
    assert record.passed
    assert (record.points, record.attitudes) == (25, 5)
    # The virtual ball matches its document to 1 um.
    assert abs(record.diameter_mm - 6.0) < 3.0 * record.diameter_sigma_mm
    assert tips.store.status(TIP, now()).state is State.SUSPECT
    procedure.accept(now(), "")
    procedure.accept(now(), "")
    tips.store.refresh()
    assert tips.store.status(TIP, now()).state is State.VALID
    assert [one.passed for one in tips.store.qualifications()] == [True]
    active = tips.store.active(TIP)
    assert active is not None
    assert active.qualification == record
    assert tips.resumed(procedure).base.stored


def test_a_point_may_be_taken_back_and_the_file_says_so(tmp_path: Path) -> None:
    tips = Tips.at(tmp_path)
    now = tips.bench.now
    procedure = tips.qualification()
    take(procedure, tips.bench, 4, 0)
    held = procedure.view.sphere.tips_world
    procedure.take_back(1, now())
    assert procedure.view.sphere.tips_world == pytest.approx(held[[0, 2, 3]])
    procedure.drop(now())
    assert procedure.view.sphere.tips_world == pytest.approx(held[[0, 2]])
    with pytest.raises(CalibrationError, match="No point 3"):
        procedure.take_back(2, now())
    assert tips.resumed(procedure).view.sphere.tips_world == pytest.approx(held[[0, 2]])
    assert procedure.base.session.read_text().count("TakenBack") == 1


@pytest.mark.parametrize(
    ("fault", "code"),
    [
        (TipFault(), None),
        (TipFault(diameter_mm=0.05), "tip_check.diameter"),
        (TipFault(length_mm=1.0), "tip_check.length"),
        (TipFault(sideways_mm=0.3), "tip_check.length"),
    ],
)
def test_a_check_on_the_virtual_rig(tmp_path: Path, fault: TipFault, code: str | None) -> None:
    tips = Tips.at(tmp_path, qualified=True)
    now = tips.bench.now
    tips.store.doubt("inspector", "dropped", now(), now())
    assert tips.store.status(TIP, now()).state is State.SUSPECT
    procedure = tips.check()
    assert procedure.view.so_far is CheckVerdict.INCONCLUSIVE
    assert show(procedure, tips.touching(procedure, fault), now) == 18
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    assert [one.code for one in outcome.findings] == ([code] if code else [])
    assert outcome.record.passed is (code is None)
    procedure.accept(now(), "")
    expected = State.VALID if code is None else State.SUSPECT
    assert tips.store.status(TIP, now()).state is expected


def test_an_insensitive_qualification_makes_every_check_inconclusive(tmp_path: Path) -> None:
    tips = Tips.at(tmp_path)
    record = make_probe_record(made_utc=BEGIN.isoformat())
    vague = make_tip_record(record, diameter_mm=6.0, diameter_sigma_mm=0.0085)
    tips.store.qualify(vague, tips.bench.now())
    procedure = tips.check()
    take(procedure, tips.bench, 13, 0)
    gate = procedure.base.step.gate
    assert "too uncertain for any check" in gate.reason
    assert gate.remedy == "Qualify the tip again."


def test_the_diameter_must_be_known_well_enough(tmp_path: Path) -> None:
    tips = Tips.at(tmp_path)
    bench = tips.bench
    procedure = TipQualificationProcedure.start(
        tips.site(),
        QualificationSetup(
            who="technician", limits=TipLimits(diameter_sigma=0.001), tip=TIP, sphere=bench.sphere
        ),
        bench.now(),
    )
    take(procedure, bench, 25, 0)
    gate = procedure.base.step.gate
    assert "Go closer to the equator: touch the sphere at the equator" in gate.remedy
    assert procedure.view.sphere.also_world is not None


def test_step_and_gate_ask_for_the_same_attitude(tmp_path: Path) -> None:
    tips = Tips.at(tmp_path)
    procedure = tips.qualification()
    take(procedure, tips.bench, 25, 2)
    view = procedure.view
    assert view.cone.next_attitude is not None
    wanted = view.cone.attitudes[view.cone.next_attitude].name
    assert wanted in view.base.step.instruction
    assert view.base.step.gate.remedy.endswith(f"hold the probe {wanted}.")


def test_what_is_not_wanted_is_not_taken_and_says_why(tmp_path: Path) -> None:
    tips = Tips.at(tmp_path)
    now, bench = tips.bench.now, tips.bench
    procedure = tips.qualification()
    take(procedure, bench, 6, 0)
    seat = CalibrationScenesRig(
        bench.rig, bench.body, (TouchSeats(tips=((60.0, 20.0, -120.0),), seed=1),), SEED
    )
    assert show(procedure, seat, now) == 0
    live = procedure.base.live
    assert not live.ready
    assert "rest it on the sphere" in live.hint
    with pytest.raises(CalibrationError, match="rest it on the sphere"):
        procedure.record(now())
    assert procedure.view.countdown.phase is Phase.SEARCHING


def test_a_hand_gets_time_to_settle(tmp_path: Path) -> None:
    tips = Tips.at(tmp_path, FULL_HZ)
    bench = tips.bench
    procedure = tips.qualification(hold_s=0.02)
    procedure.advance(bench.now())
    rig = tips.touching(procedure)
    phases, left = [], []
    for first in range(0, 1600, 16):
        procedure.watch(rig.frames(first, 16))
        countdown = procedure.view.countdown
        phases.append(countdown.phase)
        left.append(countdown.seconds_left)
        assert procedure.base.live.ready is (countdown.phase is Phase.READY)
    order = list(dict.fromkeys(phases))
    assert order[-2:] == [Phase.RESTING, Phase.READY]
    resting = [one for one, phase in zip(left, phases, strict=True) if phase is Phase.RESTING]
    assert resting[-1] < 0.02
    assert resting[0] > resting[-1]


def test_who_may_not_begin(tmp_path: Path) -> None:
    tips = Tips.at(tmp_path)
    bench = tips.bench
    with pytest.raises(CalibrationError, match="was not qualified since"):
        tips.check()
    ended = replace(
        bench.sphere.artefact,
        use=msgspec.structs.replace(bench.sphere.artefact.use, due_utc=BEGIN.isoformat()),
    )
    with pytest.raises(CalibrationError, match="expired on"):
        TipQualificationProcedure.start(
            tips.site(),
            QualificationSetup(
                who="technician", tip=TIP, sphere=replace(bench.sphere, artefact=ended)
            ),
            bench.now(),
        )
    with pytest.raises(CalibrationError, match="never calibrated"):
        TipQualificationProcedure.start(
            tips.site(),
            QualificationSetup(who="technician", tip="other", sphere=bench.sphere),
            bench.now(),
        )
    other = make_probe_record(made_utc=BEGIN.isoformat(), tip="3 mm")
    tips.store.calibrate(other, "technician", "", bench.now())
    with pytest.raises(CalibrationError, match="The mounted tip is recorded as '3 mm'"):
        tips.qualification()


def test_what_was_overtaken_is_not_stored(tmp_path: Path) -> None:
    tips = Tips.at(tmp_path, qualified=True)
    now = tips.bench.now
    procedure = tips.check()
    take(procedure, tips.bench, 13, 5)
    procedure.advance(now())
    procedure.compute()
    record = make_probe_record(made_utc=BEGIN.isoformat())
    newer = make_tip_record(record, diameter_mm=6.001, diameter_sigma_mm=0.004)
    tips.store.qualify(newer, now() + timedelta(seconds=1))
    with pytest.raises(CalibrationError, match="requalified"):
        procedure.accept(now(), "")
    with pytest.raises(CalibrationError, match="requalified"):
        TipCheckProcedure.resume(tips.site(), procedure.base.session)
    assert tips.store.checks() == ()
