"""Tapped holes by a gauge screwed in: centre in the face, play in U, refusals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import (
    ActualFeature,
    Construction,
    TappedHole,
    actual_features,
    constructed_features,
    construction_fault,
)
from ocmm_core.features.shapes import POINT, Shape
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import IMAGE_NOISE, TIP_RADIUS, Contribution, MeasuredPoint, factors_of
from ocmm_core.tolerances.decisions import evaluate_all
from tests.core.tolerances.known_part import PLACES, KnownPart, asked, face, motion, ring
from tests.host import looser

pytestmark = pytest.mark.numerics

PLAY = 0.02
HOLE = TappedHole(name="HOLE", features=("GAUGE", "FACE"), play=PLAY)
LEVELS = (8.0, 30.0)
"""mm above the face: heights at which the gauge is touched."""
RUNS = 600


def gauged(
    at: tuple[float, float] = (20.0, -10.0),
    tilt: float = 0.0,
    levels: Sequence[float] = LEVELS,
    radius: float = 5.0,
) -> KnownPart:
    """Return a face, a gauge with its axis through a place of it, and a wall 20 mm away."""
    part = KnownPart(PLACES[0])
    part.add("FACE", Shape.PLANE, face(motion(0.0, 0.0, 0.0)))
    pose = motion(*at, 0.0, 0.0, tilt, 0.0)
    part.add("GAUGE", Shape.CYLINDER, ring(pose, radius, levels), diameter=10.0)
    x, z = (a.ravel() for a in np.meshgrid([-15.0, 0.0, 15.0], [-1.0, -12.0, -20.0]))
    wall = np.stack([np.zeros(9), x, z], axis=1), np.tile([-1.0, 0.0, 0.0], (9, 1))
    return part.add("WALL", Shape.PLANE, wall, direction=(-1, 0, 0))


def hole_of(
    part: KnownPart, points: Sequence[MeasuredPoint] | None = None
) -> Mapping[str, ActualFeature]:
    found = actual_features(part.nominals, part.points if points is None else points)
    found |= constructed_features([HOLE], found, {})
    for item in found.values():
        if isinstance(item, FitError):
            raise item
    return {k: v for k, v in found.items() if isinstance(v, ActualFeature)}


@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_the_centre_lies_in_the_face_on_the_axis_of_the_gauge(tilt: float) -> None:
    part = gauged(tilt=tilt)
    centre = part.place.inverse().apply(hole_of(part)["HOLE"].fit.point)
    assert centre == pytest.approx([20.0, -10.0, 0.0], abs=1e-9)


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (gauged(levels=(-3.0, 20.0)), "3.0 mm below FACE"),
        (gauged(levels=(28.0, 31.0)), "3.0 mm only, 31.0 mm above FACE"),
        (gauged(radius=5.2), "measures 10.400 mm; the gauge of the plan has 10.000"),
    ],
)
def test_what_is_no_gauge_gives_no_hole(part: KnownPart, words: str) -> None:
    with pytest.raises(FitError, match=words) as caught:
        hole_of(part)
    assert caught.value.what.startswith("HOLE: ")
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"play": 0.0}, "play"),
        ({"features": ("FACE", "GAUGE")}, "features"),
        ({"features": ("THICKER", "FACE")}, "features"),
        ({"engaged": -1.0}, "engaged"),
    ],
)
def test_a_plan_names_a_touched_gauge_and_its_play(changed: dict[str, object], field: str) -> None:
    shapes = {"GAUGE": Shape.CYLINDER, "FACE": Shape.PLANE}
    thicker = {"name": "THICKER", "kind": "offset", "features": ("GAUGE",), "distance": 1.0}
    items = msgspec.convert([thicker, {**msgspec.to_builtins(HOLE), **changed}], list[Construction])
    fault = construction_fault(shapes, items)
    assert fault is not None
    assert fault[0] == f"constructions[1].{field}"
    assert construction_fault(shapes, [HOLE]) is None


def planned(part: KnownPart, play: float = PLAY, engaged: float = 0.0) -> Plan:
    hole = msgspec.structs.replace(HOLE, play=play, engaged=engaged)
    return Plan(
        schema="ocmm.plan/1", unit="mm", name="P", part="P", characteristics=[],
        features=part.nominals, constructions=[hole],
    )  # fmt: skip


def test_the_play_moves_the_hole_and_nothing_else() -> None:
    part = gauged()
    (play,) = planned(part).common_uncertainties
    share = play.contribution(part.points)
    actual = hole_of(part)
    moved = share.covariance_of(actual["HOLE"].jacobian[POINT])
    in_face = np.eye(3) - np.outer(actual["FACE"].fit.direction, actual["FACE"].fit.direction)
    # Of a place uniform in a circle of radius r, each coordinate has the variance r^2 / 4.
    assert moved == pytest.approx(0.25 * PLAY**2 * in_face, abs=1e-12)
    assert np.all(share.covariance_of(actual["WALL"].jacobian[POINT]) == 0.0)
    assert share.source.name == "Play of GAUGE"


@pytest.mark.parametrize(("play", "most"), [(0.004, 0.97), (0.02, 1.0)])
def test_u_of_a_tapped_hole_holds_the_truth(
    play: float, most: float, repeats: Callable[..., int]
) -> None:
    """The axis of the gauge anywhere in a circle of the play, errors of 3 um and of the ball.

    A uniform error has no tails: if the play dominates, 2 u hold more than of a normal error.
    """
    runs = repeats(60, RUNS, 30)
    part, rng = gauged(), np.random.default_rng(21)
    count = len(part.points)
    radius = np.zeros((3 * count + 1, 1))
    radius[-1] = 1.0
    parts = [
        Contribution(IMAGE_NOISE, own=np.tile(0.003**2 * np.eye(3), (count, 1, 1))),
        Contribution(TIP_RADIUS, radius, np.array([[0.002**2]])),
        *(one.contribution(part.points) for one in planned(part, play).common_uncertainties),
    ]
    factors = factors_of(parts, count)
    item = asked("distance", "HOLE,WALL", nominal=20.0, lower=-0.1)
    held = 0
    for _ in range(runs):
        turn, out = rng.uniform(0.0, 2.0 * np.pi), play * np.sqrt(rng.uniform())
        at = (20.0 + out * np.cos(turn), -10.0 + out * np.sin(turn))
        ball, noise = 0.002 * rng.normal(), 0.003 * rng.normal(size=(count, 3))
        points = [
            replace(one, tip_world=one.tip_world + by + ball * one.direction)
            for one, by in zip(gauged(at).points, noise, strict=True)
        ]
        (result,) = evaluate_all([item], None, hole_of(part, points), factors, "simple")
        assert result.measured is not None, result.note
        assert result.uncertainty is not None
        held += abs(result.measured - 20.0) <= result.uncertainty
    away = looser(0.026, runs, RUNS)
    assert 0.955 - away <= held / runs <= most + away


ENGAGED = 12.0


def leaning(rng: np.random.Generator, play: float) -> KnownPart:
    """Return a gauge with its axis anywhere in the play at the face and at the thread's end."""
    turns, outs = rng.uniform(0.0, 2.0 * np.pi, 2), play * np.sqrt(rng.uniform(size=2))
    top, end = np.stack([outs * np.cos(turns), outs * np.sin(turns)], axis=1)
    x, y = (top - end) / ENGAGED
    part = KnownPart(PLACES[0])
    part.add("FACE", Shape.PLANE, face(motion(0.0, 0.0, 0.0)))
    pose = motion(20.0 + top[0], -10.0 + top[1], 0.0, -y, x, 0.0)
    part.add("GAUGE", Shape.CYLINDER, ring(pose, 5.0, LEVELS), diameter=10.0)
    ramp = motion(-40.0, 0.0, 0.0, 0.0, 0.25 * np.pi, 0.0)
    return part.add("RAMP", Shape.PLANE, face(ramp), direction=(0.7071, 0.0, 0.7071))


def test_the_play_over_the_engaged_length_tilts_the_gauge() -> None:
    part, rng = gauged(), np.random.default_rng(8)
    (play,) = planned(part, PLAY, ENGAGED).common_uncertainties
    actual = hole_of(part)
    share = play.contribution(part.points)
    tilts = share.covariance_of(actual["GAUGE"].jacobian[3:6])
    square = np.eye(3) - np.outer(actual["GAUGE"].fit.direction, actual["GAUGE"].fit.direction)
    # Two places uniform in a circle, one engaged length apart.
    assert tilts == pytest.approx(2.0 * 0.25 * PLAY**2 / ENGAGED**2 * square, rel=1e-3, abs=1e-12)
    held = share.covariance_of(actual["HOLE"].jacobian[POINT])
    assert np.trace(held) == pytest.approx(2.0 * 0.25 * PLAY**2, rel=1e-3)
    back = part.place.rotation.T
    known = np.array([
        back @ hole_of(leaning(rng, PLAY))["GAUGE"].fit.direction for _ in range(300)
    ])  # fmt: skip
    # Four standard errors of 300 draws.
    wanted = 2.0 * 0.25 * PLAY**2 / ENGAGED**2
    assert np.var(known[:, :2], axis=0) == pytest.approx([wanted, wanted], rel=0.33)


def test_u_of_the_angle_of_a_gauge_holds_the_truth(repeats: Callable[..., int]) -> None:
    runs = repeats(60, RUNS, 30)
    rng, item = np.random.default_rng(22), asked("angle", "GAUGE,RAMP", nominal=45.0, lower=-0.1)
    held = 0
    for _ in range(runs):
        part = leaning(rng, PLAY)
        count = len(part.points)
        parts = [
            Contribution(IMAGE_NOISE, own=np.tile(0.003**2 * np.eye(3), (count, 1, 1))),
            *(
                one.contribution(part.points)
                for one in planned(part, PLAY, ENGAGED).common_uncertainties
            ),
        ]
        points = [
            replace(one, tip_world=one.tip_world + by)
            for one, by in zip(part.points, 0.003 * rng.normal(size=(count, 3)), strict=True)
        ]
        factors = factors_of(parts, count)
        (result,) = evaluate_all([item], None, hole_of(part, points), factors, "simple")
        assert result.measured is not None, result.note
        assert result.uncertainty is not None
        held += abs(result.measured - 45.0) <= result.uncertainty
    # Uniform errors have no tails.
    assert held / runs >= 0.955 - looser(0.026, runs, RUNS)
