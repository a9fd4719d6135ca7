"""Relocation: from a bad start, with wrong spots, in every mode, and its refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.guided import length_sigma
from ocmm_core.calibration.relocation import (
    BarDistance,
    GeometryMode,
    KeptByPoints,
    LensMode,
    Observations,
    ProbeFrames,
    RelocationOptions,
    relocate,
)
from ocmm_core.calibration.relocation._data import SetByPoints
from ocmm_core.camera import N_PARAMETERS
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import RigidTransform, rotation_from_vector
from tests.core.calibration.waved_probe import (
    VOLUME,
    World,
    as_known_before,
    disturbed,
    four_cameras,
    joined,
    length_errors,
    normalised_square,
    observe,
    parameter_errors,
    probe,
    rig,
    with_lens_errors,
    world,
)

FREE = RelocationOptions(lens="free")
NESTS = np.array([[-150.0, 0.0, -180.0], [150.0, 20.0, -170.0], [-80.0, 120.0, -150.0],
                  [100.0, -110.0, -160.0]])  # fmt: skip
NAMES = ("a", "b", "c", "d")


def with_nests(true: World, frames: int, each: int = 4) -> Observations:
    """Return a waved probe, a shown bar, and four nests touched."""
    observed = observe(true, frames)
    seated = true.seated(NESTS, each, 0.001)
    return replace(observed, frames=joined(observed.frames, seated), seats=NAMES)


@pytest.mark.statistics
def test_bad_starts_converge_and_the_covariance_is_honest() -> None:
    normalised, squares, predicted, chi2 = [], [], [], []
    for seed in range(12):
        true = world(seed)
        observed = observe(true, 100)
        found = relocate(disturbed(rig(), true.rng), true.body, observed, FREE)
        after = found.applied_to(rig(), "test")
        normalised.append(normalised_square(true, found))
        squares.append(np.mean(length_errors(true.rig, after) ** 2))
        predicted.append(length_sigma(after, VOLUME))
        chi2.append(found.chi2 / found.dof)
    # 12 x 22 squares of normal numbers: their mean scatters by 9 %.
    assert np.mean(normalised) == pytest.approx(1.0, abs=0.35)
    assert np.mean(chi2) == pytest.approx(1.0, abs=0.05)
    # Mostly one number a run, the scale: the RMS of 12 scatters by 20 %.
    ratio = np.sqrt(np.mean(squares) / np.mean(np.square(predicted)))
    assert ratio == pytest.approx(1.0, abs=0.6)


@pytest.mark.statistics
@pytest.mark.parametrize("lens", ["prior", "fixed"])
def test_uncertain_lenses_stay_in_the_covariance(lens: LensMode) -> None:
    known = as_known_before(rig())
    normalised, focal = [], []
    for seed in range(8):
        true = world(seed)
        observed = observe(true, 60)
        start = disturbed(with_lens_errors(known, true.rng), true.rng, lenses=False)
        found = relocate(start, true.body, observed, RelocationOptions(lens=lens), force=True)
        normalised.append(normalised_square(true, found))
        focal.append(found.covariance[6, 6])
        scale = np.sqrt(found.covariance.diagonal())
        # Six motions of the world have no variance; less than none would be nonsense.
        correlation = found.covariance / np.outer(scale, scale)
        assert np.linalg.eigvalsh(correlation).min() > -1e-9
    # 8 x 22 squares: 11 %. The lenses that are kept misfit by a few per cent of chi-square.
    assert np.mean(normalised) == pytest.approx(1.0, abs=0.4)
    before = known.parameter_covariance[6, 6]
    assert np.all(np.array(focal) < 1.3 * before)
    if lens == "fixed":
        assert np.all(np.array(focal) >= before)


@pytest.mark.parametrize("geometry", ["known", "uncertain", "unknown"])
def test_every_knowledge_of_the_probe_gives_its_length(geometry: GeometryMode) -> None:
    true = world(5, body=probe({"known": 1e-9, "uncertain": 0.001, "unknown": 0.3}[geometry]))
    options = RelocationOptions(lens="free", geometry=geometry)
    found = relocate(disturbed(rig(), true.rng), true.body, observe(true, 150), options)
    after = found.applied_to(rig(), "test")
    errors = length_errors(true.rig, after)
    assert np.sqrt(np.mean(errors**2)) < 3.0 * length_sigma(after, VOLUME)
    # The shape of the probe, independent of its frame.
    was, now = (np.linalg.norm(x[:, None] - x[None], axis=2) for x in (true.leds, found.leds_probe))
    assert np.abs(now - was).max() < 0.006


def test_without_a_bar_the_scale_hangs_on_the_probe() -> None:
    true = world(2)
    observed = observe(true, 150, placements=0)
    found = relocate(rig(), true.body, observed, FREE)
    assert [one.code for one in found.warnings] == ["relocation.no_bar"]
    nothing = RelocationOptions(lens="free", geometry="unknown")
    with pytest.raises(CalibrationError, match="nothing defines the scale"):
        relocate(rig(), true.body, observed, nothing)


def test_wrong_spots_are_named_and_do_no_harm() -> None:
    true = world(4)
    observed = observe(true, 150)
    clean = relocate(rig(), true.body, observed, FREE)
    uv = observed.frames.uv.copy()
    reflections = {(3, 0, 1), (40, 1, 2), (90, 0, 0)}
    for frame, camera, led in reflections:
        uv[frame, camera, led] += [0.4, -0.3]
    swapped = (60, 61)
    for frame in swapped:
        uv[frame] = uv[frame][:, [1, 0, 2, 3]]
    frames = replace(observed.frames, uv=uv)
    start = disturbed(rig(), np.random.default_rng(4))
    found = relocate(start, true.body, replace(observed, frames=frames), FREE)
    named = {(spot.frame, spot.camera, spot.led) for spot in found.wrong_spots}
    assert reflections <= named
    assert {frame for frame, _, _ in named - reflections} == set(swapped)
    assert found.wrong_spots[0].sigmas == max(spot.sigmas for spot in found.wrong_spots)
    assert not found.frames_used[list(swapped)].any()
    assert "calibration.outliers" in [one.code for one in found.warnings]
    difference = length_errors(true.rig, found.applied_to(rig(), "test")) - length_errors(
        true.rig, clean.applied_to(rig(), "test")
    )
    # Some fifteen of 1,200 spots are missing.
    assert np.abs(difference).max() < 0.002


def test_a_wrong_placement_of_the_bar_is_left_out() -> None:
    true = world(6)
    observed = observe(true, 100)
    bar = observed.shown_bars[0]
    uv = bar.uv.copy()
    uv[3, 0, 1] += 0.5
    found = relocate(rig(), true.body, replace(observed, shown_bars=(replace(bar, uv=uv),)), FREE)
    assert [one.used for one in found.bars] == [index != 3 for index in range(10)]
    assert abs(found.bars[3].error_mm) > 5.0 * found.bars[3].sigma_mm
    good = [one.error_mm / one.sigma_mm for one in found.bars if one.used]
    assert np.abs(good).max() < 4.0


def test_a_touched_bar_gives_the_scale_too() -> None:
    true = world(8, body=probe(0.3))
    touched, seated, names = true.touched(10, 4, 0.001)
    observed = Observations(
        frames=joined(seated, true.waved(120)), touched_bars=(touched,), seats=names
    )
    options = RelocationOptions(lens="free", geometry="unknown")
    found = relocate(disturbed(rig(), true.rng), true.body, observed, options)
    after = found.applied_to(rig(), "test")
    sigma = length_sigma(after, VOLUME)
    assert sigma < 0.02
    assert np.sqrt(np.mean(length_errors(true.rig, after) ** 2)) < 3.0 * sigma
    assert len(found.bars) == 10
    assert max(abs(one.error_mm) / one.sigma_mm for one in found.bars) < 4.0


@pytest.mark.statistics
def test_the_world_is_kept_by_points_and_its_uncertainty_is_honest() -> None:
    squares = []
    for seed in range(6):
        true = world(seed)
        observed = with_nests(true, 100)
        sigma = 0.004
        listed = NESTS + sigma * true.rng.standard_normal(NESTS.shape)
        kept = KeptByPoints(dict(zip(NAMES, listed, strict=True)), sigma)
        options = RelocationOptions(lens="free", world=kept)
        # The frame was at another place before: only the points determine it.
        moved = RigidTransform(rotation_from_vector(np.array([0.0, 0.0, 0.1])), np.full(3, 50.0))
        before = replace(
            rig(),
            cameras=tuple(
                replace(c, T_camera_from_world=c.T_camera_from_world.compose(moved))
                for c in rig().cameras
            ),
        )
        found = relocate(before, true.body, observed, options)
        errors = parameter_errors(true.rig.cameras, found.cameras)
        scale = np.sqrt(found.covariance.diagonal())
        rest = errors / scale
        correlation = found.covariance / np.outer(scale, scale)
        squares.append(float(rest @ np.linalg.solve(correlation, rest) / len(rest)))
    # 6 x 28 squares: 11 %.
    assert np.mean(squares) == pytest.approx(1.0, abs=0.4)


def test_three_points_make_a_world() -> None:
    true = world(11)
    options = RelocationOptions(lens="free", world=SetByPoints("a", "b", "c"))
    found = relocate(rig(), true.body, with_nests(true, 100), options)
    a, b, c = (found.seats_world[name] for name in "abc")
    np.testing.assert_allclose(a, 0.0, atol=1e-9)
    np.testing.assert_allclose(b[1:], 0.0, atol=1e-9)
    assert b[0] == pytest.approx(np.linalg.norm(NESTS[1] - NESTS[0]), abs=0.05)
    assert c[2] == pytest.approx(0.0, abs=1e-9)
    assert c[1] > 0.0


def test_a_moved_nest_is_refused_by_name() -> None:
    true = world(12)
    observed = with_nests(true, 100)
    places = NESTS.copy()
    places[2] += [0.0, 0.0, 0.3]
    kept = KeptByPoints(dict(zip(NAMES, places, strict=True)), 0.002)
    with pytest.raises(CalibrationError, match="'c'") as refusal:
        relocate(rig(), true.body, observed, RelocationOptions(lens="free", world=kept))
    assert refusal.value.code == "relocation.points_moved"


def test_a_wrong_length_of_the_bar_is_noticed() -> None:
    true = world(13)
    observed = observe(true, 150)
    shown = observed.shown_bars[0]
    wrong = replace(shown, bar=BarDistance("bar", 400.08, 0.001))
    with pytest.raises(CalibrationError) as refusal:
        relocate(rig(), true.body, replace(observed, shown_bars=(wrong,)), FREE)
    assert refusal.value.code == "relocation.bar_contradicts"
    # By so little every placement fits, but not all of them together.
    near = replace(shown, bar=BarDistance("bar", 400.03, 0.001))
    with pytest.raises(CalibrationError) as refusal:
        relocate(rig(), true.body, replace(observed, shown_bars=(near,)), FREE)
    assert refusal.value.code == "relocation.bar_contradicts"


def test_a_bent_probe_is_noticed() -> None:
    true = world(14)
    leds = true.body.leds_probe.copy()
    leds[0, 2] += 0.05
    bent = replace(true.body, leds_probe=leds)
    with pytest.raises(CalibrationError, match="LED 1 ") as refusal:
        relocate(rig(), bent, observe(true, 150), FREE)
    assert refusal.value.code == "relocation.probe_changed"


def test_a_changed_lens_is_noticed_where_it_was_known() -> None:
    true = world(15)
    known = as_known_before(rig())
    change = np.zeros(N_PARAMETERS)
    change[6] = 0.05
    loose = replace(known, cameras=(known.cameras[0].perturbed(change), known.cameras[1]))
    observed = observe(true, 150)
    with pytest.raises(CalibrationError, match="'left'") as refusal:
        relocate(loose, true.body, observed, RelocationOptions(lens="prior"))
    assert refusal.value.code == "relocation.lens_changed"
    assert relocate(loose, true.body, observed, FREE).chi2 > 0.0


def test_four_cameras_that_do_not_all_see_everything() -> None:
    true = world(16, four_cameras())
    observed = observe(true, 120)
    observed.frames.uv[:60, 3] = np.nan
    observed.frames.uv[60:, 0, :2] = np.nan
    start = disturbed(replace(true.rig, parameter_covariance=np.zeros((56, 56))), true.rng)
    found = relocate(start, true.body, observed, FREE)
    after = found.applied_to(start, "test")
    assert after.parameter_covariance.shape == (56, 56)
    errors = length_errors(true.rig, after)
    assert np.sqrt(np.mean(errors**2)) < 3.0 * length_sigma(after, VOLUME)
    assert normalised_square(true, found) < 2.0


def test_the_order_of_the_frames_does_not_matter() -> None:
    true = world(17)
    observed = with_nests(true, 60)
    n = len(observed.frames.uv)
    order = np.random.default_rng(0).permutation(n)
    shuffled = ProbeFrames(
        observed.frames.uv[order], observed.frames.sigma_px[order], observed.frames.seats[order]
    )
    options = RelocationOptions(lens="free", world=SetByPoints("a", "b", "c"))
    one = relocate(rig(), true.body, observed, options)
    other = relocate(rig(), true.body, replace(observed, frames=shuffled), options)
    np.testing.assert_allclose(other.tips_world, one.tips_world[order], atol=1e-6)
    np.testing.assert_allclose(other.residuals_px, one.residuals_px[order], atol=1e-6)


def test_the_result_says_where_it_holds() -> None:
    true = world(18)
    found = relocate(rig(), true.body, observe(true, 120), FREE)
    low, high = found.volume_world
    assert np.all((found.tips_world >= low) & (found.tips_world <= high))
    assert found.frames_used.all()
    assert len(found.hull_world) >= 8
    # The hull of the LEDs is that of the tips, displaced by the LEDs' offset from the tip.
    assert found.hull_world[:, 2].max() > high[2] + 50.0
    assert found.rms_px == pytest.approx(0.0105, rel=0.3)


def test_a_camera_that_sees_too_little_is_refused_by_name() -> None:
    true = world(19, four_cameras())
    observed = observe(true, 40)
    observed.frames.uv[5:, 3] = np.nan
    start = replace(true.rig, parameter_covariance=np.zeros((56, 56)))
    with pytest.raises(CalibrationError, match="'extra 1'") as refusal:
        relocate(start, true.body, observed, FREE)
    assert refusal.value.code == "relocation.camera_sees_little"


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        ("few", "relocation.too_few_frames"),
        ("shape", "relocation.shape"),
        ("bar of three cameras", "relocation.shape"),
        ("nameless seat", "relocation.unknown_seat"),
        ("unknown seat", "relocation.unknown_seat"),
        ("two visible points", "relocation.few_seats"),
        ("noise", "calibration.rms"),
        ("flat", "calibration.flat_volume"),
    ],
)
def test_what_cannot_work_is_refused_with_the_reason(spoil: str, code: str) -> None:
    true = world(19)
    observed, options = observe(true, 60), FREE
    frames = observed.frames
    if spoil == "few":
        frames = ProbeFrames(frames.uv[:15], frames.sigma_px[:15], frames.seats[:15])
    elif spoil == "shape":
        frames = replace(frames, uv=frames.uv[:, :, :3])
    elif spoil == "bar of three cameras":
        bar = observed.shown_bars[0]
        observed = replace(observed, shown_bars=(replace(bar, uv=bar.uv[:, [0, 1, 1]]),))
    elif spoil == "nameless seat":
        frames = replace(frames, seats=np.zeros(60, dtype=np.int64))
    elif spoil == "unknown seat":
        options = RelocationOptions(lens="free", world=SetByPoints("a", "b", "c"))
    elif spoil == "two visible points":
        observed = with_nests(true, 60)
        frames = observed.frames
        options = RelocationOptions(world=KeptByPoints({"a": NESTS[0], "b": NESTS[1]}))
    elif spoil == "noise":
        frames = replace(frames, uv=frames.uv + true.rng.normal(0.0, 1.0, frames.uv.shape))
    elif spoil == "flat":
        frames = true.waved(150, depth=10.0, tilt=0.15)
    with pytest.raises(CalibrationError) as refusal:
        relocate(rig(), true.body, replace(observed, frames=frames), options)
    assert refusal.value.code == code
