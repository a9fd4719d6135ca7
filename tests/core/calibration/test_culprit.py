"""Who lied: bar, LED, camera, lens or points are named, and no option leads round the refusal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.lie_scenes import (
    Scene,
    barely_nudged,
    bent_led,
    drifting,
    honest,
    honest_twin,
    moved_point,
    nudged,
    swapped_points,
    wrong_bar,
    wrong_probe,
    wrong_rig,
)
from ocmm_core.calibration.bundle import explain_points, scale_between
from ocmm_core.calibration.monitor import camera_changes
from ocmm_core.calibration.pivot import PivotSweep, calibrate_probe
from ocmm_core.calibration.relocation import RelocationOptions, relocate
from ocmm_core.calibration.relocation._data import RelocationResult
from ocmm_core.errors import CalibrationError
from tests.core.calibration import swept_probe

POSES = 72


def found_in(
    scene: Scene, options: RelocationOptions | None = None, *, force: bool
) -> RelocationResult:
    return relocate(scene.start, scene.body, scene.observed(), options or scene.options, force)


def refusal(
    scene: Scene, options: RelocationOptions | None = None, *, force: bool = False
) -> CalibrationError:
    with pytest.raises(CalibrationError) as refused:
        found_in(scene, options, force=force)
    return refused.value


@pytest.mark.parametrize("seed", [1, 2])
def test_nobody_is_accused_in_an_honest_session(seed: int) -> None:
    found = found_in(honest(seed, POSES), force=False)
    assert not [one.code for one in found.warnings if one.refuses]
    assert not [one for one in found.warnings if "moved" in one.code or "probe" in one.code]


@pytest.mark.parametrize(
    ("tell", "seed"),
    [(bent_led, 3), (nudged, 4), (drifting, 5), (wrong_probe, 6), (wrong_rig, 7),
     (swapped_points, 8), (moved_point, 9), (barely_nudged, 10)],
)  # fmt: skip
def test_the_culprit_is_named(tell: object, seed: int) -> None:
    scene = honest(seed, POSES)
    assert callable(tell)
    expected = tell(scene)
    error = refusal(scene, force=True)
    assert any(error.code == code and word in error.what + error.remedy for code, word in expected)
    assert not any(word in error.remedy for word in ("unknown", "free lens", "force"))


def test_bar_and_size_of_the_probe_are_told_apart_by_known_points_alone() -> None:
    # Without points (an even seed) one bar against one probe is a word against a word.
    for seed, alone in ((12, False), (13, True)):
        scene = honest(seed, POSES)
        scene.bar = replace(scene.bar, length=scene.bar.length + 0.2)
        error = refusal(scene)
        assert error.code == "relocation.bar_contradicts"
        assert "ar 'bar' is" in error.what
        assert ("cannot tell which" not in error.what) == alone
        assert "another" in error.remedy


def test_a_wrong_bar_is_not_accepted_with_an_unknown_probe() -> None:
    scene = honest(14, POSES)
    wrong_bar(scene)
    scene.bar = replace(scene.bar, length=scene.length + 0.1)
    for options in (
        replace(scene.options, geometry="unknown"),
        replace(scene.options, lens="free"),
        replace(scene.options, geometry="unknown", lens="free"),
    ):
        assert refusal(scene, options, force=True).code == "relocation.bar_contradicts"


def test_the_moment_of_a_nudge_is_found_to_the_pose() -> None:
    scene = honest(16, POSES)
    before = scene.cameras
    turn = np.array([3e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    after = (before[0], before[1].perturbed(camera_changes(before[1]) @ turn))
    moment = 40.0 / (POSES + 9.0)
    scene.moves = lambda t: after if t >= moment - 1e-9 else before
    assert "just before pose 41" in refusal(scene).what


def test_a_bar_that_nothing_else_checks_is_named() -> None:
    scene = honest(18, POSES)
    body = scene.body
    scene.body = replace(body, geometry_covariance=0.05**2 * np.eye(len(body.geometry_covariance)))
    codes = {one.code: one.what for one in found_in(scene, force=False).warnings}
    assert "'bar' alone" in codes["relocation.one_bar"]


def test_points_that_fit_in_two_ways_blame_both() -> None:
    # The corners of a square: exchanging any two neighbours leaves a mirror image.
    square = np.array([[0.0, 0, 0], [100, 0, 0], [100, 100, 0], [0, 100, 0]])
    moved = square.copy()
    moved[1, 2] = 0.5
    names = ("A", "B", "C", "D")
    sigmas = np.full(4, 0.005)
    blamed = {one.names for one in explain_points(names, moved, square, sigmas)}
    assert blamed == {("A",), ("B",), ("C",), ("D",)}
    ratio, sigma = scale_between(1.0001 * square + 5.0, square, sigmas)
    assert ratio == pytest.approx(1.0001, abs=1e-9)
    # Four corners 71 mm from their middle: 5 um over the root of 4 x 71^2.
    assert sigma == pytest.approx(0.005 / 141.42, rel=1e-3)


def test_a_camera_nudged_in_a_sweep_is_named_and_a_clean_sweep_is_not() -> None:
    known, body = swept_probe.rig(), swept_probe.probe()
    rng = np.random.default_rng(21)
    rotations = swept_probe.attitudes(600, 30.0, rng)
    clean = swept_probe.spots(known, body, rotations, swept_probe.CONE_WORLD, rng)
    found = calibrate_probe(known, body, PivotSweep.even(clean, swept_probe.SIGMA_PX))
    assert not [one for one in found.warnings if "camera" in one.code]
    camera = known.cameras[1]
    change = camera_changes(camera) @ np.array([1e-4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    after = replace(known, cameras=(known.cameras[0], camera.perturbed(change)))
    uv = clean.copy()
    uv[400:] = swept_probe.spots(after, body, rotations[400:], swept_probe.CONE_WORLD, rng)
    with pytest.raises(CalibrationError) as refused:
        calibrate_probe(known, body, PivotSweep.even(uv, swept_probe.SIGMA_PX), force=True)
    assert refused.value.code == "pivot.camera_moved"
    assert f"'{camera.name}'" in refused.value.what
    assert "frame 400" in refused.value.what


@pytest.mark.parametrize("seed", [24, 30])
def test_second_lie_is_found_behind_bent_led(seed: int) -> None:
    """The first lie is granted, also as unknown geometry; the bar is then tried again."""
    scene = honest(seed, POSES)
    scene.bar = replace(scene.bar, length=scene.length + 0.06)
    scene.leds[1] += np.array([0.0, 0.0, 0.15])
    for options in (scene.options, replace(scene.options, geometry="unknown")):
        error = refusal(scene, options)
        assert "LED 2 of the probe" in error.what
        assert "ar 'bar' is" in error.what
        assert "In addition" in error.what


def test_two_bent_leds_are_both_named() -> None:
    scene = honest(25, POSES)
    scene.leds[0] += np.array([0.1, 0.0, 0.1])
    scene.leds[2] += np.array([0.0, 0.12, 0.15])
    error = refusal(scene)
    assert "LED 1 " in error.what
    assert "LED 3 " in error.what


def test_honest_twin_has_the_noise_of_the_session_and_true_documents() -> None:
    scene = honest(277, POSES)
    bent_led(scene)
    noise = scene.rng.bit_generator.state
    seen = scene.observed()
    twin = honest_twin(scene, noise)

    # Only the document was wrong, so that the cameras see the same.
    np.testing.assert_array_equal(twin.observed().frames.uv, seen.frames.uv)
    np.testing.assert_array_equal(twin.body.leds_probe, scene.leds)
    wrong_bar(scene)
    drifting(scene)
    honest_again = honest_twin(scene, noise)
    assert honest_again.bar.length == honest(277, POSES).bar.length
    for first, last in zip(honest_again.moves(0.0), scene.moves(1.0), strict=True):
        np.testing.assert_array_equal(first.centre_world, last.centre_world)
