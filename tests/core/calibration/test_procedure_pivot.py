"""Guided pivot calibration: from frames to a record, resumed after a crash, confirmed, refused."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.calibration.guided import ProcedureDecision, sessions
from ocmm_core.calibration.records import State
from ocmm_core.calibration.sweeping import BATCH, PivotSetup, SweepPhase, led_paths
from ocmm_core.errors import CalibrationError
from ocmm_sim.calibration_scenes import SweepProbe
from tests.core.calibration.pivot_site import CONE, OTHER_CONE, SIGMA_PX, PivotBench, show_sweeps
from tests.core.calibration.procedure_site import without_field
from tests.other_station import forget_histories

REACH = (30.0, 30.0, 14.0)


@pytest.fixture
def bench(tmp_path: Path) -> PivotBench:
    return PivotBench(tmp_path)


@pytest.mark.slow
def test_two_sweeps_begin_and_end_by_themselves(bench: PivotBench) -> None:
    virtual = bench.virtual(
        SweepProbe(cone=CONE, seconds=16.0, seed=1, reach_deg=REACH),
        SweepProbe(cone=OTHER_CONE, seconds=16.0, seed=2, reach_deg=REACH),
        SweepProbe(cone=CONE, seconds=2.0, seed=3, reach_deg=(0.0, 0.0, 0.0)),
    )
    procedure = bench.begin(poses=250)
    frame, views = show_sweeps(procedure, virtual, bench.now, at_most=6)
    # The program is killed in the middle of the first sweep and goes on.
    resumed = bench.resume(procedure.base.session)
    assert resumed.view.first.poses == procedure.view.first.poses == 6 * BATCH
    end, more = show_sweeps(resumed, virtual, bench.now, first=frame)
    views += more
    assert resumed.base.step.name == "result"
    assert end < virtual.n_frames, "it did not end before the hand did"
    phases = [view.sweep.phase for view in views if view.sweep is not None]
    for phase in (SweepPhase.WAITING, SweepPhase.COUNTDOWN, SweepPhase.TAKING):
        assert phase in phases
    assert all(view.countdown_s is None or 0.0 <= view.countdown_s <= 1.5 for view in views)
    assert not any(view.warnings for view in views), "nothing was wrong"
    resumed.compute()
    view = resumed.view
    outcome = view.outcome
    assert outcome is not None
    assert view.place_distance_mm == pytest.approx(73.5, abs=0.2)
    # Truth lies within the stated uncertainty: three coordinates, 4 sigma.
    off = outcome.first.tip_probe - bench.true_tip(virtual)
    assert np.all(np.abs(off) < 4.0 * np.sqrt(np.diag(outcome.first.tip_covariance)))
    assert np.linalg.norm(off) < 0.02
    assert outcome.change is None
    record = outcome.record
    assert record.tip_mm == tuple(outcome.first.tip_probe)
    assert record.thesis_spread_mm == outcome.first.thesis.spread
    made, until = map(datetime.fromisoformat, (record.made_utc, record.valid_until_utc))
    assert until - made == timedelta(days=365)
    # All LEDs stay on spheres about the ball.
    paths = led_paths(outcome.first)
    radii = np.linalg.norm(paths - outcome.first.centre_world, axis=2)
    assert np.nanmax(np.ptp(radii, axis=0)) < 1e-9
    resumed.accept(bench.now(), "")
    store = bench.store()
    assert store.mounted == "A"
    active = store.active("A")
    assert active is not None
    assert active.calibration == record
    assert store.status("A", bench.now()).state is State.SUSPECT, "it was not qualified yet"


def test_a_kill_at_any_moment_gives_the_same_result(bench: PivotBench, tmp_path: Path) -> None:
    procedure = bench.begin()
    bench.both(procedure)
    procedure.compute()
    wanted = procedure.view.outcome
    assert wanted is not None
    content = procedure.base.session.read_bytes()
    sweeps = {"first": bench.swept(1, CONE), "second": bench.swept(2, OTHER_CONE)}
    rng = np.random.default_rng(4)
    first = content.index(b"\n") + 1
    for cut in sorted({*rng.integers(first, len(content), 8).tolist(), len(content)}):
        path = tmp_path / f"cut-{cut}.jsonl"
        path.write_bytes(content[:cut])
        forget_histories()
        resumed = bench.resume(path)
        while resumed.base.step.name != "result":
            view = resumed.view
            if view.sweep is not None and not view.sweep.good:
                left = sweeps[view.base.step.name][view.sweep.poses :]
                resumed.take_sweep(left, SIGMA_PX, bench.now())
            elif view.base.step.name == "again" and not view.base.step.gate.open:
                resumed.take_visit(bench.rested(), SIGMA_PX, bench.now())
            resumed.advance(bench.now())
        resumed.compute()
        found = resumed.view.outcome
        assert found is not None
        assert found.record.leds_mm == wanted.record.leds_mm
        assert found.record.tip_mm == wanted.record.tip_mm
        assert found.record.covariance == wanted.record.covariance
        assert found.record.data_sha256 == wanted.record.data_sha256
        assert np.array_equal(found.second.tips_world, wanted.second.tips_world)
        if cut == len(content):
            assert found.record == wanted.record, "nothing was taken anew"


def test_a_kill_between_decision_and_record_stores_it_once(bench: PivotBench) -> None:
    procedure = bench.begin()
    bench.both(procedure)
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    # The decision is on the disk, the record is not.
    procedure._put = lambda *_: None  # type: ignore[method-assign]  # noqa: SLF001 - the kill
    procedure.accept(bench.now(), "new probe")
    resumed = bench.resume(procedure.base.session)
    assert resumed.base.decision is ProcedureDecision.ACCEPTED
    assert not resumed.base.stored
    for _ in range(2):
        resumed.compute()
        resumed.accept(bench.now(), "")
    assert resumed.base.stored
    assert [event.reason for event in bench.store().events] == ["new probe"]


def test_a_larger_change_of_the_tip_wants_a_reason(bench: PivotBench) -> None:
    first = bench.begin()
    bench.both(first)
    first.compute()
    first.accept(bench.now(), "")
    bent = replace(bench.body, tip_probe=bench.body.tip_probe + np.array([0.0, 0.08, 0.0]))
    second = bench.begin()
    bench.both(second, bent)
    second.compute()
    outcome = second.view.outcome
    assert outcome is not None
    change = outcome.change
    assert change is not None
    assert outcome.must_be_confirmed
    # Two calibrations of a few micrometres each.
    assert change.tip_difference == pytest.approx([0.0, 0.08, 0.0], abs=0.012)
    assert change.led_rms < 0.012
    with pytest.raises(CalibrationError) as refused:
        second.accept(bench.now(), "  ")
    assert refused.value.code == "pivot.unconfirmed"
    assert "Give the reason" in refused.value.remedy
    assert second.base.decision is ProcedureDecision.OPEN
    second.accept(bench.now(), "fell to the floor")
    active = bench.store().active("A")
    assert active is not None
    assert active.calibration.change_reason == "fell to the floor"
    assert active.calibration.change_mm == pytest.approx(0.08, abs=0.012)
    assert active.calibration.previous == change_hash(bench)
    # In the new sweep the same probe differs by chance only.
    third = bench.begin()
    bench.both(third, bent)
    third.compute()
    again = third.view.outcome
    assert again is not None
    assert not again.must_be_confirmed
    third.accept(bench.now(), "")
    assert len(bench.store().calibrations()) == 3


def change_hash(bench: PivotBench) -> str:
    return bench.store().events[0].record


def test_sweeps_in_one_place_are_no_validation(bench: PivotBench) -> None:
    procedure = bench.begin()
    procedure.advance(bench.now())
    procedure.take_sweep(bench.swept(1), SIGMA_PX, bench.now())
    procedure.advance(bench.now())
    procedure.take_sweep(bench.swept(2), SIGMA_PX, bench.now())
    gate = procedure.base.step.gate
    assert not gate.open
    assert "repeat the first one's errors" in gate.reason
    with pytest.raises(CalibrationError, match="repeat"):
        procedure.compute()
    # Repeated elsewhere it counts.
    procedure.sweep_anew(bench.now())
    assert procedure.view.second.poses == 0
    procedure.take_sweep(bench.swept(2, OTHER_CONE), SIGMA_PX, bench.now())
    assert procedure.base.step.gate.open


def test_guards_speak_while_the_sweep_goes_on(bench: PivotBench) -> None:
    leds = bench.body.leds_probe.copy()
    leds[2, 0] += 4.0
    hidden = bench.swept(1)
    hidden[:, 1, 3] = np.nan
    cases = {
        "Hardly any sweep": bench.swept(1, n=5),
        "Sweep wider": bench.swept(1, range_deg=10.0),
        "poses to go": bench.swept(1, n=120),
        "um after": bench.swept(1, shift=np.array([0.1, 0.0, 0.0])),
        "off the document": bench.swept(1, body=replace(bench.body, leds_probe=leds)),
        "The tip is 2.0": bench.swept(
            1, body=replace(bench.body, tip_probe=np.array([0.0, 0.0, 2.0]))
        ),
        "LED 4 least": hidden,
    }
    for words, uv in cases.items():
        procedure = bench.begin()
        procedure.advance(bench.now())
        procedure.take_sweep(uv, SIGMA_PX, bench.now())
        gate = procedure.base.step.gate
        assert not gate.open, words
        assert words in gate.reason
        assert gate.remedy
        with pytest.raises(CalibrationError) as refused:
            procedure.compute()
        assert refused.value.code == "pivot.incomplete", words
        with pytest.raises(CalibrationError, match=words):
            procedure.end_sweep(bench.now())


def test_who_knows_why_may_overrule_what_may_be_overruled(bench: PivotBench) -> None:
    narrow = bench.begin()
    narrow.advance(bench.now())
    narrow.take_sweep(bench.swept(1, range_deg=8.0), SIGMA_PX, bench.now())
    narrow.force(bench.now(), "no more room")
    assert not narrow.base.step.gate.open, "it does not end by itself"
    assert narrow.view.first.may_end
    narrow.end_sweep(bench.now())
    narrow.take_sweep(bench.swept(2, OTHER_CONE, range_deg=8.0), SIGMA_PX, bench.now())
    narrow.end_sweep(bench.now())
    # Nobody overrules the visit of the first cone.
    with pytest.raises(CalibrationError, match="not put back into the first cone"):
        narrow.compute()
    narrow.take_visit(bench.rested(), SIGMA_PX, bench.now())
    narrow.compute()
    outcome = narrow.view.outcome
    assert outcome is not None
    assert outcome.record.forced
    assert any("degrees" in warning for warning in outcome.record.warnings)
    # Another stylus may be overruled too; another probe may not.
    leds = bench.body.leds_probe.copy()
    leds[2, 0] += 4.0
    other = bench.begin()
    other.advance(bench.now())
    other.take_sweep(
        bench.swept(1, body=replace(bench.body, leds_probe=leds)), SIGMA_PX, bench.now()
    )
    other.force(bench.now(), "I know better")
    assert not other.view.first.may_end


def test_an_unknown_tip_and_a_second_tip_have_records_of_their_own(bench: PivotBench) -> None:
    long = replace(bench.body, tip_probe=np.array([1.0, -2.0, -40.0]))
    procedure = bench.begin(tip_unknown=True)
    bench.both(procedure, long)
    procedure.compute()
    outcome = procedure.view.outcome
    assert outcome is not None
    assert outcome.record.tip_mm == pytest.approx((1.0, -2.0, -40.0), abs=0.03)
    procedure.accept(bench.now(), "")
    # Once recorded, the same tip is expected.
    again = bench.begin()
    bench.both(again, long)
    again.compute()
    assert again.view.outcome is not None


def test_a_cone_that_moved_meanwhile_refuses_and_cannot_be_forced(bench: PivotBench) -> None:
    procedure = bench.begin()
    # Some eight standard deviations of the shift between both visits.
    bench.both(procedure, again=(CONE[0] + 0.1, CONE[1], CONE[2]))
    procedure.force(bench.now(), "in a hurry")
    with pytest.raises(CalibrationError) as caught:
        procedure.compute()
    assert caught.value.code == "repeat.moved"
    assert "the ball in the first cone by" in caught.value.what
    assert "It happened between 2026-03-02 08:00:" in caught.value.what
    assert "calibrate the probe again" in caught.value.remedy


def test_sweeping_after_the_visit_asks_for_it_once_more(bench: PivotBench) -> None:
    procedure = bench.begin()
    bench.both(procedure)
    assert procedure.base.step.name == "result"
    procedure.back(bench.now())
    with pytest.raises(CalibrationError, match="Take it once, after both sweeps"):
        procedure.take_visit(bench.rested(), SIGMA_PX, bench.now())
    # A visit is a result, and is not taken back.
    procedure.drop(bench.now())
    assert procedure.base.step.gate.open
    procedure.back(bench.now())
    procedure.take_sweep(bench.swept(5, OTHER_CONE, n=20), SIGMA_PX, bench.now())
    procedure.advance(bench.now())
    assert "not put back" in procedure.base.step.gate.reason
    state = procedure._state  # noqa: SLF001 - the rule alone
    assert " mm from the first cone" in state.judge_visit(bench.rested(OTHER_CONE), SIGMA_PX)
    assert state.judge_visit(bench.rested(), SIGMA_PX) == ""


def test_a_session_of_an_earlier_version_is_left_out_with_a_sentence(bench: PivotBench) -> None:
    session = bench.begin().base.session
    without_field(session, "again")
    with pytest.raises(CalibrationError, match="started by an earlier version"):
        bench.resume(session)


def test_what_was_taken_can_be_taken_back(bench: PivotBench) -> None:
    procedure = bench.begin()
    with pytest.raises(CalibrationError) as early:
        procedure.take_sweep(bench.swept(1), SIGMA_PX, bench.now())
    assert early.value.code == "pivot.recorded"
    procedure.advance(bench.now())
    procedure.take_sweep(bench.swept(1), SIGMA_PX, bench.now())
    assert procedure.view.first.good
    procedure.drop(bench.now())
    assert procedure.view.first.poses == 0
    assert not procedure.view.first.good
    resumed = bench.resume(sessions(bench.folder / "sessions", procedure.kind)[0])
    assert resumed.view.first.poses == 0
    with pytest.raises(CalibrationError) as unnamed:
        type(procedure).start(bench.site(), PivotSetup(who="x", tip=" "), bench.now())
    assert unnamed.value.code == "pivot.tip_name"
