"""Worn cones and balls with dirt or lobes: refused by name, honest sweeps accepted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.worn_seats import SEAT, run, sweep_of
from ocmm_core.calibration.pivot import (
    PivotOptions,
    PivotSweep,
    calibrate_probe,
    find_jump,
    free_poses,
    start_pivot,
    tips_by_cameras,
)
from ocmm_core.calibration.pivot._bundle import PivotState
from ocmm_core.calibration.pivot._robust import adjust_pivot_robustly
from ocmm_core.calibration.pivot._seat import SeatWander
from ocmm_core.calibration.records import Finding
from ocmm_core.errors import CalibrationError
from ocmm_sim.calibration_scenes import SeatFault, SweepProbe
from tests.core.calibration.pivot_site import CONE, PivotBench
from tests.core.calibration.swept_probe import (
    CONE_WORLD,
    SIGMA_PX,
    attitudes,
    disturbed,
    patterned,
    probe,
    rig,
    spots,
    waved_attitudes,
)
from tests.host import amount

QUICK = PivotOptions(resamples=50)


def test_names_the_seat_and_accepts_nothing_beyond_its_uncertainty() -> None:
    count = amount(3, 60)
    found = run(count, seed=11)

    assert found.outcomes["beyond U"] == 0, found.sentences
    assert found.named >= 0.8 * count - 0.5, found.sentences


def test_honest_sweep_over_sensor_patterns_is_accepted() -> None:
    rng = np.random.default_rng(4)
    uv = patterned(spots(rig(), probe(), attitudes(400, 35.0, rng), CONE_WORLD, rng), rng)
    sigma = float(np.hypot(SIGMA_PX, rig().noise.pattern_px))

    found = calibrate_probe(
        rig(), probe(), PivotSweep.even(uv, sigma), replace(QUICK, pattern=True)
    )

    assert not SEAT & {one.code for one in found.warnings}
    assert np.linalg.norm(found.tip_probe) <= 2.0 * found.tip_sigma


def test_short_sweep_that_hides_a_worn_cone_has_a_large_uncertainty() -> None:
    rng = np.random.default_rng((1, 400, 20))
    held = waved_attitudes(400, 20.0, rng)
    fault = SeatFault(worn_mm=(0.05, 0.05, 0.0))
    uv = spots(disturbed(rig(), rng), probe(), held, CONE_WORLD + fault.shifts(held), rng)
    sweep = PivotSweep.even(uv, SIGMA_PX)

    found = calibrate_probe(rig(), probe(), sweep, QUICK)

    (warning,) = [one for one in found.warnings if one.code == "pivot.seat_open"]
    assert "Sweep wider" in warning.remedy
    off = float(np.linalg.norm(found.tip_probe - probe().tip_probe))
    assert 0.03 < off <= 2.0 * found.tip_sigma


def test_turn_about_the_handle_distinguishes_lobes_from_a_worn_cone() -> None:
    rng = np.random.default_rng(2)
    held = attitudes(600, 55.0, rng)
    refused = {}
    for name, fault in (
        ("cone", SeatFault(worn_mm=(0.1, 0.0, 0.05))),
        ("ball", SeatFault(lobes_mm=0.03)),
    ):
        uv = spots(rig(), probe(), held, CONE_WORLD + fault.shifts(held), rng)
        with pytest.raises(CalibrationError) as caught:
            calibrate_probe(rig(), probe(), PivotSweep.even(uv, SIGMA_PX), QUICK)
        refused[name] = caught.value

    assert refused["cone"].code == "pivot.worn_cone"
    assert refused["ball"].code == "pivot.ball_form"
    assert "sphere" in refused["cone"].remedy


def test_frame_at_the_limit_does_not_leave_and_return_forever() -> None:
    _, sweep = sweep_of(33)

    found = adjust_pivot_robustly(rig(), sweep, start_pivot(rig(), sweep, 1), 0.0)

    assert len(found.minimum.state.rotations) == np.count_nonzero(found.used)
    assert {one.frame for one in found.left_out} == set(np.flatnonzero(~found.used).tolist())


def test_virtual_cone_shifts_the_ball_with_the_tilt(tmp_path: Path) -> None:
    bench = PivotBench(tmp_path)
    scene = SweepProbe(cone=CONE, seconds=2.0, seed=3)
    worn = SweepProbe(cone=CONE, seconds=2.0, seed=3, seat=SeatFault(worn_mm=(0.1, 0.1, 0.0)))

    good, off = (
        np.concatenate([virtual.frames(first, 8).uv for first in range(4500, 16000, 500)])
        for virtual in map(bench.virtual, (scene, worn))
    )

    # 0.1 mm per radian at 27 degrees are 0.04 mm, about 0.1 px.
    assert 0.03 < np.nanmax(np.abs(good - off)) < 0.5


@pytest.mark.parametrize(
    ("worth", "jump", "codes"),
    [
        (0.0, 0.0, ["pivot.worn_cone"]),
        (60.0, 0.0, ["pivot.worn_cone"]),
        (99.0, 0.0, ["pivot.worn_cone"]),
        (150.0, 0.0, ["pivot.lens_changed"]),
        (60.0, 150.0, ["pivot.lens_changed"]),
    ],
)
def test_element_that_explains_most_is_named(worth: float, jump: float, codes: list[str]) -> None:
    seat = Finding("pivot.worn_cone", "The cone is worn.", "Use another cone.", refuses=True)
    lens = Finding("pivot.lens_changed", "The lens changed.", "Calibrate.", refuses=True)

    found = SeatWander(np.zeros((3, 3)), 100.0, seat).among([lens], worth, jump)

    assert [one.code for one in found] == codes
    assert ("The lens changed." in found[0].what) == (worth > 88.0 or jump > 100.0)


def test_part_of_a_sweep_without_poses_by_wrong_cameras_is_named() -> None:
    rng = np.random.default_rng(1)
    held = attitudes(200, 30.0, rng)
    sweep = PivotSweep.even(spots(rig(), probe(), held, CONE_WORLD, rng), SIGMA_PX)
    arms = probe().leds_probe - probe().tip_probe
    state = PivotState(CONE_WORLD, arms, held, np.zeros((200, 3)))
    tips = tips_by_cameras(rig(), sweep, state, 0.0)
    tips.shifts[20:30] = np.nan

    with pytest.raises(CalibrationError) as caught:
        find_jump(
            free_poses(rig(), sweep, arms), np.ones(200, np.bool_), CONE_WORLD, by_cameras=tips
        )

    assert caught.value.code == "pivot.camera_errors"
    assert "From frame 20 to 29" in caught.value.what
