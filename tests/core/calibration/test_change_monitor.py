"""The watch over a calibration: its detections, the named causes, and its false alarms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.monitor import (
    Baseline,
    CalibrationMonitor,
    ChangeCause,
    DriftReport,
    ResidualAccumulator,
    ResidualSample,
    learn_baseline,
)
from ocmm_core.calibration.monitor._baseline import pattern_maps
from ocmm_core.calibration.monitor._drift_decision import LOOK_NS, examine
from ocmm_core.calibration.monitor._drift_statistic import score_changes
from ocmm_core.calibration.monitor._residual_samples import Belief, sample_of
from ocmm_core.calibration.records import ResidualMap
from ocmm_core.camera import N_PARAMETERS, Rig, project
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.tracking import PoseBatch, ProbeBody, TrackBlock, cut, solve
from ocmm_sim.scene import ScriptedBump, WorldOptions, bumped, draw_world
from tests.core.calibration.monitored import RATE_HZ, Monitored

BUMP_S = 10.0


@pytest.fixture(scope="module")
def bench() -> Monitored:
    return Monitored.of()


@pytest.fixture(scope="module")
def waved(bench: Monitored) -> list[ResidualSample]:
    """Return the looks of a minute of waving."""
    return bench.waved(100)


@pytest.fixture(scope="module")
def baseline(bench: Monitored, waved: list[ResidualSample]) -> Baseline:
    return learn_baseline(waved, bench.rig, bench.body)


def without_pattern(rig: Rig) -> Rig:
    """Return the rig with sensors that are the same everywhere, to a ten-thousandth of a pixel."""
    noise = type(rig.noise)(white_px=rig.noise.white_px, pattern_px=1e-4, pattern_length_px=20.0)
    return replace(rig, noise=noise)


def bump(turn: tuple[float, float, float] = (0.0, 0.0, 0.0), **more: object) -> WorldOptions:
    pushed = ScriptedBump(1, int(BUMP_S * RATE_HZ), turn, **more)  # type: ignore[arg-type] # by name
    return WorldOptions(bumps=(pushed,))


def watched(
    bench: Monitored, baseline: Baseline | None, track: TrackBlock, block: int = 4
) -> list[DriftReport]:
    monitor = CalibrationMonitor(bench.rig, bench.body, baseline=baseline)
    results: list[DriftReport] = []
    for first in range(0, len(track), block):
        results += monitor.push(cut(track, first, min(first + block, len(track))))
    return results


def looks_at(
    rig: Rig, truth: Rig, body: ProbeBody, true_body: ProbeBody, count: int = 30
) -> list[ResidualSample]:
    """Return looks without any noise at poses all over the volume, taken with ``truth``."""
    rng = np.random.default_rng(4)
    low, high = rig.volume_world
    turns = [rotation_from_vector(rng.uniform(-0.3, 0.3, 3)) for _ in range(count)]
    origins = [low + (high - low) * rng.random(3) for _ in range(count)]
    return looks_of(rig, truth, body, true_body, turns, origins)


def looks_of(
    rig: Rig, truth: Rig, body: ProbeBody, true_body: ProbeBody, turns: list[Float],
    origins: list[Float],
) -> list[ResidualSample]:  # fmt: skip
    uv = [
        [project(camera, true_body.leds_probe @ turn.T + origin) for camera in truth.cameras]
        for turn, origin in zip(turns, origins, strict=True)
    ]
    spots = np.repeat(np.array(uv), 4, axis=0)
    pose = solve(spots, rig, body, 0.01)
    looks = []
    for k in range(len(turns)):
        part = slice(4 * k, 4 * k + 4)
        look = sample_of(_track(spots[part], pose, part), rig, body)
        assert look is not None
        looks.append(look)
    return looks


def _track(spots: Float, pose: PoseBatch, part: slice) -> TrackBlock:
    n = len(spots)
    values = {name: getattr(pose, name)[part] for name in (
        "status", "tip_world", "tip_covariance", "rotation_world_from_probe", "origin_world",
        "chi2", "dof",
    )}  # fmt: skip
    return TrackBlock(
        counter=np.arange(n), time_ns=np.arange(n) * 10, flags=np.zeros(n, dtype=np.uint32),
        seen=np.full((n, spots.shape[1]), 63, dtype=np.uint64), uv=spots, **values,
    )  # fmt: skip


def certain(rig: Rig, body: ProbeBody) -> Belief:
    """Return the belief that nothing is wrong with the documents."""
    size = len(Belief.of_documents(rig, body).mean)
    return Belief(np.zeros(size), np.zeros((size, size)))


def three_cameras(bench: Monitored) -> Rig:
    """Return the rig with a third camera above the first one."""
    left = bench.rig.cameras[0]
    rig = without_pattern(bench.rig)
    up = RigidTransform(np.eye(3), -left.T_camera_from_world.rotation @ np.array([0.0, 0.0, 250.0]))
    third = replace(
        left, name="top", serial=9, T_camera_from_world=up.compose(left.T_camera_from_world)
    )
    return replace(
        rig,
        cameras=(*bench.rig.cameras, third),
        aliases=(1, 2, 3),
        parameter_covariance=np.zeros((3 * N_PARAMETERS, 3 * N_PARAMETERS)),
    )


def pushed(rig: Rig, camera: int, push: ScriptedBump) -> Rig:
    cameras = list(rig.cameras)
    cameras[camera] = bumped(cameras[camera], push)
    return replace(rig, cameras=tuple(cameras))


def test_size_and_direction_of_a_push_are_found_and_the_one_of_three_cameras_is_named(
    bench: Monitored,
) -> None:
    rig = three_cameras(bench)
    push = ScriptedBump(1, 0, (12e-6, -20e-6, 7e-6), (0.010, 0.004, -0.020))
    looks = looks_at(rig, pushed(rig, 1, push), bench.body, bench.body)
    belief = certain(rig, bench.body)
    scores = score_changes(looks, rig, bench.body, belief, 0.0)
    # The looks are free of noise: the rest is of second order, and the bound of the size.
    assert scores.motions[1].size == pytest.approx([*push.turn, *push.shift], rel=0.02, abs=2e-7)
    result = examine(looks, rig, bench.body, belief)
    assert (result.cause, result.cameras) == (ChangeCause.CAMERA, (rig.cameras[1].name,))
    assert result.what.startswith(f"Camera {rig.cameras[1].name} has changed")


@pytest.mark.parametrize(
    ("axis", "words"), [(0, "pitch about 20 µrad"), (1, "yaw about 20 µrad"),
                        (2, "roll about 20 µrad"), (3, "moved sideways about 20 µm"),
                        (5, "moved along its view about 20 µm")],
)  # fmt: skip
def test_a_push_about_one_axis_is_named(bench: Monitored, axis: int, words: str) -> None:
    rig = three_cameras(bench)
    turn, shift = np.zeros(3), np.zeros(3)
    (turn if axis < 3 else shift)[axis % 3] = 20e-6 if axis < 3 else 0.020
    push = ScriptedBump(2, 0, (turn[0], turn[1], turn[2]), (shift[0], shift[1], shift[2]))
    looks = looks_at(rig, pushed(rig, 2, push), bench.body, bench.body)
    result = examine(looks, rig, bench.body, certain(rig, bench.body))
    assert result.cameras == ("top",)
    assert words in result.what


def test_a_lens_that_changed_is_told_from_a_camera_that_moved(bench: Monitored) -> None:
    rig = without_pattern(bench.rig)
    left, right = rig.cameras
    truth = replace(rig, cameras=(left, replace(right, focal=right.focal + 0.010)))
    looks = looks_at(rig, truth, bench.body, bench.body)
    result = examine(looks, rig, bench.body, certain(rig, bench.body))
    # Two cameras suffice: a motion between them cannot look like a change of scale in one.
    assert (result.cause, result.cameras) == (ChangeCause.CAMERA, ("right",))
    assert "focal length changed about 10 µm" in result.what


def test_an_led_that_came_loose_is_no_camera_that_moved(bench: Monitored) -> None:
    leds = bench.body.leds_probe.copy()
    leds[3] += [0.02, 0.0, 0.01]
    looks = looks_at(bench.rig, bench.rig, bench.body, replace(bench.body, leds_probe=leds))
    belief = certain(bench.rig, bench.body)
    result = examine(looks, bench.rig, bench.body, belief)
    assert (result.cause, result.cameras) == (ChangeCause.PROBE, ())
    assert result.what.startswith("LED 4 of the probe is 2")


def test_a_resting_probe_adds_no_certainty(bench: Monitored) -> None:
    looks = looks_at(bench.rig, bench.rig, bench.body, bench.body, count=40)
    belief = Belief.of_documents(bench.rig, bench.body)

    def sigmas(some: list[ResidualSample]) -> Float:
        scores = score_changes(some, bench.rig, bench.body, belief, 0.0)
        return np.sqrt([np.diag(item.covariance)[0] for item in scores.motions])

    # Pitch shows best. White noise is a third of the pattern in one look, a tenth in ten.
    assert np.all(sigmas(looks[:1] * 40) > 0.97 * sigmas(looks[:1] * 10))
    assert np.all(sigmas(looks) < 0.75 * sigmas(looks[:10]))


def test_a_learnt_baseline_holds_the_pattern_of_the_sensors(
    bench: Monitored, baseline: Baseline, record_property: Callable[[str, object], None]
) -> None:
    record_property("left_px", baseline.left_px)
    # The pattern has 0.010 px; a minute of waving leaves 0.0014 to 0.0019 px (six worlds).
    assert baseline.left_px < 0.0025
    patterns = draw_world(bench.rig, bench.body, bench.seed, WorldOptions()).patterns
    maps = pattern_maps(bench.rig, baseline.maps, baseline.left_px)
    for pattern, learnt, known in zip(patterns, baseline.maps, maps, strict=True):
        count = np.array(learnt.count).reshape(learnt.rows, learnt.columns)
        row, column = np.nonzero(count >= 3)
        places = (np.stack([column, row], axis=1) + 0.5) * known.cell_px
        node = np.rint(places / pattern.step_px).astype(int)
        true = pattern.nodes[:, node[:, 1], node[:, 0]].T
        mean, left = known.at(places)
        # The map also contains the smooth errors of the calibration: 0.002 px here.
        assert np.sqrt(np.mean((mean - true) ** 2)) < 0.4 * np.sqrt(np.mean(true**2))
        assert 1.0 <= np.median(left) / baseline.left_px < 3.0
        # Places without spots stay undetermined.
        assert known.at(np.array([[10.0, 10.0]]))[1][0] == pytest.approx(0.010)


def test_waving_too_short_is_refused(bench: Monitored, waved: list[ResidualSample]) -> None:
    with pytest.raises(CalibrationError) as caught:
        learn_baseline(waved[:900], bench.rig, bench.body)
    assert caught.value.code == "baseline.looks"


def test_a_coarse_residual_map_leaves_the_whole_pattern(bench: Monitored) -> None:
    coarse = ResidualMap(
        columns=8, rows=8, mean_u_px=(0.01,) * 64, mean_v_px=(0.0,) * 64, count=(5,) * 64
    )
    known = pattern_maps(bench.rig, (coarse, coarse), 0.001)[0]
    mean, left = known.at(np.array([[700.0, 900.0]]))
    assert mean[0] == pytest.approx([0.01, 0.0])
    assert left[0] == pytest.approx(bench.rig.noise.pattern_px)


def test_nothing_happens_on_a_rig_to_which_nothing_happened(
    bench: Monitored, baseline: Baseline
) -> None:
    track = bench.probing(0.0, 15.0)
    for known in (baseline, None):
        results = watched(bench, known, track)
        assert len(results) > 20
        assert not any(result.alarm for result in results)
        assert sum(result.good for result in results) > 0.5 * len(results)


@pytest.mark.parametrize(
    "push",
    [
        {"turn": (0.0, 16e-6, 0.0)},
        {"shift": (-0.018, 0.0, 0.0)},
        {"turn": (25e-6, -4e-6, 10e-6), "shift": (0.004, -0.01, 0.01)},
    ],
)
def test_a_push_that_moves_the_ball_by_30_um_is_told_within_two_seconds(
    bench: Monitored, baseline: Baseline, push: dict[str, tuple[float, float, float]]
) -> None:
    results = watched(bench, baseline, bench.probing(4.0, 8.5, bump(**push)))
    alarms = [result for result in results if result.alarm]
    assert alarms[0].cause is ChangeCause.CAMERA
    # 2 s of probing data, and the probe is not in view of both cameras all the time.
    assert BUMP_S < alarms[0].time_ns * 1e-9 < BUMP_S + 2.3
    assert alarms[0].since_ns is not None
    assert BUMP_S - 4.0 < alarms[0].since_ns * 1e-9 < BUMP_S
    # Two cameras and a probe determine their relative pose, not which of them moved.
    assert set(alarms[0].cameras) == {"left", "right"}


def test_a_camera_knocked_so_hard_that_nothing_fits_is_told(bench: Monitored) -> None:
    results = watched(bench, None, bench.probing(6.0, 8.0, bump((5e-3, 0.0, 0.0))))
    alarms = [result for result in results if result.alarm]
    assert [result.cause for result in alarms] == [ChangeCause.UNKNOWN]
    assert alarms[0].since_ns is not None
    assert BUMP_S - 0.1 < alarms[0].since_ns * 1e-9 <= BUMP_S
    assert alarms[0].time_ns * 1e-9 < BUMP_S + 2.2


def test_looks_do_not_depend_on_how_the_stream_is_cut(bench: Monitored) -> None:
    track = bench.probing(2.0, 2.0)
    whole = ResidualAccumulator(bench.rig, bench.body, LOOK_NS).push(track)
    collector = ResidualAccumulator(bench.rig, bench.body, LOOK_NS)
    pieces = [
        look for first in range(0, len(track), 7)
        for look in collector.push(cut(track, first, min(first + 7, len(track))))
    ]  # fmt: skip
    assert len(whole) == len(pieces) > 30
    for one, other in zip(whole, pieces, strict=True):
        assert np.array_equal(one.residuals, other.residuals, equal_nan=True)


def test_a_clock_set_anew_begins_anew(bench: Monitored, baseline: Baseline) -> None:
    track = bench.probing(2.0, 4.0)
    monitor = CalibrationMonitor(bench.rig, bench.body, baseline=baseline)
    assert any(result.good for result in monitor.push(track))
    earlier = replace(track, time_ns=track.time_ns - 1_000_000_000)
    again = monitor.push(cut(earlier, 0, int(1.6 * RATE_HZ)))
    # Looks of before, which would lie in the future now, are no part of it.
    assert again[-1].time_ns <= int(earlier.time_ns[int(1.6 * RATE_HZ)])
    assert again[-1].since_ns is None or again[-1].since_ns <= again[-1].time_ns


SEATS = ((-150.0, -60.0, -100.0), (150.0, -60.0, -100.0), (0.0, 80.0, -100.0), (0.0, 0.0, 20.0))


def nest_looks(rig: Rig, truth: Rig, body: ProbeBody, shift: Float) -> list[ResidualSample]:
    """Return looks at the ball in nests displaced by ``shift`` from their known places."""
    rng = np.random.default_rng(8)
    seats = np.repeat(np.array(SEATS), 4, axis=0)
    turns = [rotation_from_vector(rng.uniform(-0.3, 0.3, 3)) for _ in seats]
    origins = [
        seat + shift - turn @ body.tip_probe for seat, turn in zip(seats, turns, strict=True)
    ]
    looks = looks_of(rig, truth, body, body, turns, origins)
    covariance = np.eye(3) * 0.002**2
    return [
        replace(look, known_tip_world=seat, known_tip_covariance=covariance)
        for look, seat in zip(looks, seats, strict=True)
    ]


@pytest.mark.parametrize("camera", [0, 1])
def test_nests_tell_which_of_two_cameras_moved(bench: Monitored, camera: int) -> None:
    rig = without_pattern(bench.rig)
    push = ScriptedBump(camera, 0, (30e-6, -40e-6, 20e-6))
    belief = certain(rig, bench.body)
    without = looks_at(rig, pushed(rig, camera, push), bench.body, bench.body)
    free = examine(without, rig, bench.body, belief)
    assert set(free.cameras) == {"left", "right"}
    looks = nest_looks(rig, pushed(rig, camera, push), bench.body, np.zeros(3))
    result = examine(looks, rig, bench.body, belief)
    assert (result.cause, result.cameras) == (ChangeCause.CAMERA, (rig.cameras[camera].name,))


def test_nests_tell_that_everything_moved_together(bench: Monitored) -> None:
    rig = without_pattern(bench.rig)
    belief = certain(rig, bench.body)
    looks = nest_looks(rig, rig, bench.body, np.array([0.03, -0.04, 0.0]))
    result = examine(looks, rig, bench.body, belief)
    assert (result.cause, result.cameras) == (ChangeCause.COMMON, ())
    assert "has moved by about 50 µm" in result.what
    still = nest_looks(rig, rig, bench.body, np.zeros(3))
    assert examine(still, rig, bench.body, belief).cause is ChangeCause.NOTHING
