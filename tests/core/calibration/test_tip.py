"""Arithmetic of tips: layouts, the ball on a sphere, articulation, and decisions of a check."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from ocmm_core.calibration.guided import (
    RestingTouch,
    articulate,
    joint_covariance,
    place_of_ball,
    range_limit,
)
from ocmm_core.calibration.guided._articulation import square_limit
from ocmm_core.calibration.records import Check, Finding, TipRecord
from ocmm_core.calibration.tip import (
    CHECK_RINGS,
    QUALIFICATION_RINGS,
    CheckVerdict,
    TipLimits,
    conforms,
    frame_about,
    qualification_checks,
    sphere_layout,
)
from ocmm_core.calibration.tip._check import Judged, decide_check
from ocmm_core.calibration.tip._fit import fit_ball_on, predicted_errors, sigma_of_difference
from ocmm_core.calibration.tip._qualification import sphere_warnings
from ocmm_core.calibration.tip._sphere_layout import TOLERANCE, cone_layout, match_places
from ocmm_core.calibration.verification import fit_sphere
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import rotation_from_vector
from tests.core.calibration.made_records import make_record, make_verification
from tests.core.calibration.touched_tip import (
    POLE,
    ROOM,
    Fault,
    TipWorld,
    check_plans,
    qualified,
    record_of,
)

WORLD = TipWorld.of()
NO_MORE = np.empty((0, 3))


@pytest.mark.parametrize(
    "pole", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.2, -0.3), (0.0, -1.0, 0.0)]
)
def test_the_layout_is_that_of_the_standard_about_any_pole(
    pole: tuple[float, float, float],
) -> None:
    frame = frame_about(np.array(pole), WORLD.rig)
    layout = sphere_layout(QUALIFICATION_RINGS, frame)
    polar = np.degrees(np.arccos(layout.directions @ frame.pole))
    rings, counts = np.unique(polar.round(3), return_counts=True)
    assert rings == pytest.approx([0.0, 22.5, 45.0, 67.5, 90.0])
    assert counts.tolist() == [1, 4, 8, 4, 8]
    assert np.linalg.norm(layout.directions, axis=1) == pytest.approx(np.ones(25))
    # Right-handed, and back is away from the cameras, so that "left" is left for who looks.
    assert np.cross(frame.right, frame.back) == pytest.approx(frame.pole)
    centres = [camera.centre_world for camera in WORLD.rig.cameras]
    assert frame.back @ (WORLD.rig.volume_world.mean(axis=0) - np.mean(centres, axis=0)) > -1e-6


def test_points_find_their_places_once_and_others_none() -> None:
    layout = sphere_layout(QUALIFICATION_RINGS, frame_about(POLE, WORLD.rig))
    rng = np.random.default_rng(1)
    order = rng.permutation(25)
    off = layout.directions[order] + 0.08 * rng.standard_normal((25, 3))
    off /= np.linalg.norm(off, axis=1)[:, None]
    assert match_places(off, layout).tolist() == order.tolist()
    below = np.array([[0.0, 0.0, -1.0]])
    twice = np.concatenate([layout.directions[:1], below, layout.directions[:1]])
    places = match_places(twice, layout)
    assert places[1] == -1
    assert sorted(places[[0, 2]].tolist()) == [-1, 0]
    tilted = rotation_from_vector(np.array([1.05 * TOLERANCE, 0.0, 0.0])) @ POLE
    alone = replace(layout, directions=POLE[None], names=("pole",))
    assert match_places(tilted[None], alone).tolist() == [-1]


def test_limits_are_exceeded_as_often_as_they_say() -> None:
    rng = np.random.default_rng(2)
    spread = rng.standard_normal((6, 6)) * np.array([1.0, 3.0, 0.2, 1.0, 2.0, 0.5])
    covariance = spread @ spread.T
    numbers = rng.multivariate_normal(np.zeros(6), covariance, 200_000)
    # 200 of 200,000 are expected beyond; a quarter more or less is three and a half sigmas.
    above = np.mean(np.sum(numbers**2, axis=1) > square_limit(covariance, 1e-3))
    assert 0.75e-3 < above < 1.25e-3
    # The bound of the range is from above.
    beyond = np.mean(np.ptp(numbers, axis=1) > range_limit(covariance, 1e-3))
    assert 0.4e-3 < beyond < 1.25e-3
    equal = rng.standard_normal((200_000, 25))
    assert 0.6e-3 < np.mean(np.ptp(equal, axis=1) > range_limit(np.eye(25), 1e-3)) < 1.25e-3


def test_form_and_size_of_the_standard() -> None:
    normals = sphere_layout(QUALIFICATION_RINGS, frame_about(POLE, WORLD.rig)).directions
    rng = np.random.default_rng(3)
    forms, sizes = [], []
    for _ in range(1500):
        tips = 18.0 * normals + 0.005 * rng.standard_normal(normals.shape)
        centre, radius, _ = fit_sphere(tips)
        forms.append(np.ptp(np.linalg.norm(tips - centre, axis=1)) / 0.005)
        sizes.append(2.0 * radius / 0.005)
    # Facts about ISO 10360-5: 3.66 and 0.65; 1500 runs scatter by 0.02 and 0.012.
    assert np.mean(forms) == pytest.approx(3.66, abs=0.07)
    assert np.std(sizes) == pytest.approx(0.65, abs=0.04)


@pytest.mark.parametrize("rig", ["recommended", "thesis"])
def test_checks_find_wrong_tips_and_leave_good_ones_alone(rig: str) -> None:
    world = TipWorld.of(rig)
    plans = check_plans(world, 4, 5)
    rng = np.random.default_rng(6)
    off, stated = [], []
    for run in range(24):
        plan, sign = plans[run % 4], (-1.0) ** run
        truth = world.draw(rng)
        ball = world.ball(world.touched(plan.qualification, truth, rng))
        off.append(ball.diameter - 6.0)
        stated.append(ball.diameter_sigma)
        record = record_of(ball, world)
        for fault, verdict, code in (
            (Fault(), CheckVerdict.PASSED, None),
            (Fault(diameter=0.05 * sign), CheckVerdict.FAILED, "tip_check.diameter"),
            (Fault(length=sign), CheckVerdict.FAILED, "tip_check.length"),
        ):
            found = world.check(
                world.touched(plan.sphere, truth, rng, fault),
                world.touched(plan.cone, truth, rng, fault),
                record,
            )
            assert found.verdict is verdict, found.advice
            assert [one.code for one in found.findings] == ([code] if code else [])
    # 24 runs know a standard deviation to 15 %: three of these.
    assert np.std(off) == pytest.approx(np.mean(stated), rel=0.45)


def test_what_touches_have_in_common_is_common() -> None:
    rng = np.random.default_rng(14)
    first, second = WORLD.on_sphere(CHECK_RINGS, rng, np.inf).touches[:2]
    along = np.stack([np.eye(3), np.eye(3)])
    found = joint_covariance((first, second), along, WORLD.rig, WORLD.body)
    shared = sum(
        getattr(first, name) @ covariance @ getattr(second, name).T
        for name, covariance in (
            ("by_cameras", WORLD.rig.parameter_covariance),
            ("by_geometry", WORLD.body.geometry_covariance),
        )
    )
    assert found[:3, 3:] == pytest.approx(shared, abs=1e-15)
    own = found[:3, :3] - first.noise
    # The tip of the probe (2 um) and its LEDs turn with it; alike attitudes share nearly all.
    assert np.diag(own) == pytest.approx(np.diag(shared), rel=0.5)
    assert np.sqrt(np.diag(own)).min() > 0.002


def test_what_a_check_shares_with_its_qualification_cancels() -> None:
    rng = np.random.default_rng(16)
    plan = WORLD.on_sphere(QUALIFICATION_RINGS, rng, np.inf)
    ball = WORLD.ball(plan.touches)
    record = record_of(ball, WORLD)

    def compared(other: TipRecord) -> float:
        return sigma_of_difference(ball.errors, WORLD.sphere, ROOM, other, WORLD.rig, WORLD.body)

    # The same touches once more: only their spots differ, and the warmth of the sphere.
    assert compared(record) == pytest.approx(np.sqrt(2.0) * ball.errors.noise, rel=0.02)
    cameras = ball.errors.by_cameras @ WORLD.rig.parameter_covariance @ ball.errors.by_cameras
    moved = compared(msgspec.structs.replace(record, rig_identity="another"))
    assert moved**2 - compared(record) ** 2 == pytest.approx(2.0 * cameras, rel=1e-6)
    other = compared(msgspec.structs.replace(record, artefacts=()))
    assert other**2 - compared(record) ** 2 == pytest.approx(0.0005**2, rel=0.2)
    # A record without its inputs shares nothing.
    silent = compared(msgspec.structs.replace(record, by_cameras=(), by_geometry=()))
    assert silent == pytest.approx(np.sqrt(2.0) * ball.diameter_sigma, rel=1e-6)


def test_the_sphere_has_the_size_of_its_temperature() -> None:
    rng = np.random.default_rng(15)
    plan = WORLD.on_sphere(QUALIFICATION_RINGS, rng, np.inf)
    at = {
        degrees: fit_ball_on(
            plan.touches,
            WORLD.sphere,
            WORLD.rig,
            WORLD.body,
            None if degrees is None else replace(ROOM, celsius=degrees),
        )
        for degrees in (20.0, 30.0, None)
    }
    assert at[20.0].diameter == pytest.approx(6.0, abs=1e-6)
    # 30 mm of steel grow by 11.5e-6 a degree.
    assert at[20.0].diameter - at[30.0].diameter == pytest.approx(0.00345, abs=1e-6)
    assert at[None].diameter_sigma > at[20.0].diameter_sigma


def test_the_predicted_uncertainty_says_go_closer_to_the_equator() -> None:
    rng = np.random.default_rng(7)
    good = WORLD.on_sphere(QUALIFICATION_RINGS, rng, np.inf)
    cap = WORLD.on_sphere(((0.0, 1, 0.0), (15.0, 8, 0.0), (30.0, 16, 0.0)), rng, np.inf)
    assert WORLD.sigma(good) < TipLimits().diameter_sigma
    assert WORLD.sigma(cap) > 3.0 * WORLD.sigma(good)
    # The rest of a layout is predicted from the part that was taken.
    whole = predicted_errors(good.touches, good.directions, WORLD.rig, WORLD.body, NO_MORE)
    assert whole is not None
    part = predicted_errors(
        good.touches[:9], good.directions[:9], WORLD.rig, WORLD.body, good.directions[9:]
    )
    assert part is not None
    assert part.sigma(WORLD.rig, WORLD.body) == pytest.approx(
        whole.sigma(WORLD.rig, WORLD.body), rel=0.15
    )
    assert (
        predicted_errors(good.touches[:3], good.directions[:3], WORLD.rig, WORLD.body, NO_MORE)
        is None
    )


def test_a_point_that_does_not_fit_is_named_and_stays_in() -> None:
    rng = np.random.default_rng(8)
    plan = WORLD.on_sphere(QUALIFICATION_RINGS, rng, np.inf)
    touches = list(WORLD.touched(plan, WORLD.draw(rng), rng))
    assert WORLD.ball(tuple(touches)).doubtful == ()
    clean = WORLD.ball(tuple(touches)).diameter
    lifted = touches[6].tip_world + 0.08 * plan.directions[6]
    touches[6] = replace(touches[6], tip_world=lifted)
    ball = WORLD.ball(tuple(touches))
    assert ball.doubtful == (6,)
    assert len(ball.residuals) == 25
    assert abs(ball.diameter - clean) > 0.002
    assert ball.misfit > ball.misfit_limit


def test_a_ball_of_another_size_than_its_name_does_not_qualify() -> None:
    rng = np.random.default_rng(9)
    world = TipWorld.of("thesis")
    plan = check_plans(world, 1, 9)[0]
    for wrong, passed in ((0.0, True), (-0.08, False)):
        fault, truth = Fault(diameter=wrong), world.draw(rng)
        ball = world.ball(world.touched(plan.qualification, truth, rng, fault))
        found = articulate(world.touched(plan.cone, truth, rng, fault), world.rig, world.body)
        judged = qualification_checks(ball, found, 6.0, TipLimits())
        assert [one.name for one in judged if not conforms(one)] == (
            [] if passed else ["diameter against nominal"]
        )
        assert ball.diameter == pytest.approx(6.0 + wrong, abs=4.0 * ball.diameter_sigma)


def test_the_place_of_the_ball_follows_from_the_attitudes() -> None:
    cone = WORLD.in_cone(np.random.default_rng(10))
    shift = np.array([0.3, -0.2, 0.7])
    moved = [
        replace(one, tip_world=one.tip_world - one.rotation_world_from_probe @ shift)
        for one in cone.touches
    ]
    place = place_of_ball(moved, WORLD.rig, WORLD.body)
    assert place is not None
    assert place.offset_probe == pytest.approx(shift, abs=1e-9)
    # Towards the LEDs the probe is shorter by that much.
    assert place.length_error == pytest.approx(-0.7, abs=0.02)
    same = [cone.touches[0]] * 5
    assert place_of_ball(same, WORLD.rig, WORLD.body) is None


def test_articulation_by_hand() -> None:
    offsets = np.array([[0.01, 0, 0], [-0.01, 0, 0], [0, 0.02, 0], [0, -0.02, 0], [0, 0, 0]])
    cone = WORLD.in_cone(np.random.default_rng(11))
    touches = [
        replace(one, tip_world=np.array([1.0, 2.0, 3.0]) + off)
        for one, off in zip(cone.touches, offsets, strict=True)
    ]
    found = articulate(touches, WORLD.rig, WORLD.body)
    assert found.spread_2s == pytest.approx(2.0 * np.sqrt(1e-3 / 4.0))
    assert found.largest == pytest.approx(0.02)
    assert found.half_range == pytest.approx([0.01, 0.02, 0.0])
    with pytest.raises(CalibrationError, match="five attitudes"):
        articulate(touches[:1], WORLD.rig, WORLD.body)


def test_a_check_that_cannot_tell_never_passes() -> None:
    rng = np.random.default_rng(12)
    truth, cone = WORLD.draw(rng), WORLD.in_cone(rng)
    held = WORLD.touched(cone, truth, rng)
    few = WORLD.on_sphere(((0.0, 1, 0.0), (45.0, 6, 0.0)), rng, np.inf)
    whole = WORLD.on_sphere(CHECK_RINGS, rng, 0.0045)

    def decided(touches: tuple[RestingTouch, ...], sigma: float) -> tuple[CheckVerdict, str]:
        found = decide_check(
            touches, held, WORLD.sphere, qualified(6.0, sigma), WORLD.rig, WORLD.body, ROOM
        )
        return found.verdict, found.advice

    verdict, advice = decided(WORLD.touched(few, truth, rng), 0.004)
    assert verdict is CheckVerdict.INCONCLUSIVE
    assert "take more points, at the equator" in advice
    touched = WORLD.touched(whole, truth, rng)
    assert decided(touched, 0.004) == (CheckVerdict.PASSED, "")
    verdict, advice = decided(touched, 0.008)
    assert verdict is CheckVerdict.INCONCLUSIVE
    assert "qualify the tip again" in advice
    verdict, advice = decided((), 0.004)
    assert verdict is CheckVerdict.INCONCLUSIVE
    # What no uncertainty explains fails however few points there are.
    short = WORLD.touched(cone, truth, rng, Fault(length=-1.0))
    found = decide_check(
        (), short[:3], WORLD.sphere, qualified(6.0, 0.004), WORLD.rig, WORLD.body, ROOM
    )
    assert found.verdict is CheckVerdict.FAILED
    assert "shorter" in found.advice


@pytest.mark.parametrize(
    ("error", "sigma", "verdict"),
    [
        (0.02, 0.007, CheckVerdict.PASSED),
        (0.03, 0.007, CheckVerdict.FAILED),
        (0.001, 0.008, CheckVerdict.INCONCLUSIVE),
        (0.03, 0.010, CheckVerdict.INCONCLUSIVE),
        (-0.036, 0.010, CheckVerdict.FAILED),
    ],
)
def test_what_is_not_known_well_enough_fails_only_beyond_doubt(
    error: float, sigma: float, verdict: CheckVerdict
) -> None:
    check = Check(
        name="diameter", measured_mm=6.0 + error, certified_mm=6.0, expanded_mm=2.0 * sigma,
        limit_mm=0.025,
    )  # fmt: skip
    judged = Judged(check, 0.025 / 3.5, Finding("tip_check.diameter", "", "", refuses=True))
    assert judged.verdict is verdict


def test_a_sphere_with_another_duty_is_warned_of() -> None:
    use = WORLD.sphere.artefact.use
    record = make_record(artefacts=(use,))
    verified = msgspec.structs.replace(make_verification(record), artefacts=(use,))
    codes = [one.code for one in sphere_warnings(WORLD.sphere, record, [verified])]
    assert codes == ["tip.sphere_of_cameras", "tip.sphere_of_verification"]
    otherwise = msgspec.structs.replace(use, serial=f" {use.serial.lower().replace('-', ' ')}")
    known = make_record(artefacts=(otherwise,))
    assert [one.code for one in sphere_warnings(WORLD.sphere, known, [])] == codes[:1]
    other = make_verification(make_record())
    assert sphere_warnings(WORLD.sphere, make_record(), [other]) == ()


def test_five_attitudes_are_apart() -> None:
    handles = cone_layout(frame_about(POLE, WORLD.rig)).directions
    angles = np.degrees(np.arccos(np.clip(handles @ handles.T, -1.0, 1.0)))
    assert angles[np.triu_indices(5, 1)].min() == pytest.approx(25.0)
