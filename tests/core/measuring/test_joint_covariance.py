from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from ocmm_core.camera import Rig
from ocmm_core.documents import resource
from ocmm_core.geometry import Float
from ocmm_core.measuring import (
    MeasuredPoint,
    joint_factors,
    point_uncertainty,
    systematic_covariance,
)
from ocmm_core.tracking import ProbeBody, TipSensitivity, ordered_spots, tip_sensitivity
from ocmm_sim.scene import Part, VirtualRig, WorldOptions, load_part
from tests.host import amount, looser

WORLDS, MANY = amount(100, 300), 300
TOUCHES = (("BED", 1), ("SPHERE", 1))


@pytest.fixture(scope="module")
def coarse(recommended: Rig) -> Rig:
    """Return the recommended rig with a pattern alike over 350 px: drawn fast, shared by LEDs."""
    noise = recommended.noise
    wide = type(noise)(
        white_px=noise.white_px, pattern_px=noise.pattern_px, pattern_length_px=350.0
    )
    return replace(recommended, noise=wide)


@dataclass(frozen=True)
class World:
    """Points of one drawn world: their sensitivities and errors."""

    sensitivities: list[TipSensitivity]
    errors: Float


def measured(rig: Rig, body: ProbeBody, seed: int, part: Part) -> World:
    """Return two touches, each with a second place a few millimetres before it.

    White noise is off: only errors unaffected by averaging remain.
    """
    options = WorldOptions(white_noise=False)
    virtual = VirtualRig(rig, body, part, TOUCHES, seed, options, 500)
    truth = virtual.truth
    sensitivities, errors = [], []
    for touch in truth.touches:
        for frame in (touch.last_frame, touch.first_frame - 60):
            spots = ordered_spots(virtual.frames(frame, 1).uv, truth.slots)[0]
            found = tip_sensitivity(spots, rig, body)
            sensitivities.append(found)
            errors.append(found.tip_world - virtual.motion(frame, 1).tip_world[0])
    return World(sensitivities, np.array(errors))


@pytest.fixture(scope="module")
def demo_part() -> Part:
    return load_part(resource("parts", "demo.toml"))


@pytest.fixture(scope="module")
def worlds(coarse: Rig, standard_probe: ProbeBody, demo_part: Part) -> list[World]:
    return [measured(coarse, standard_probe, seed, demo_part) for seed in range(WORLDS)]


@pytest.mark.statistics
def test_points_are_as_wrong_as_they_say(
    worlds: list[World], coarse: Rig, standard_probe: ProbeBody
) -> None:
    squares = []
    for world in worlds:
        for item, error in zip(world.sensitivities, world.errors, strict=True):
            covariance = systematic_covariance([item], coarse, standard_probe)
            squares.append(error @ np.linalg.solve(covariance, error))
    print(f"points: NEES / 3 = {np.mean(squares) / 3.0:.3f}")  # noqa: T201 - to be seen with -s
    # The scatter from world to world gives the mean of 300 a standard error of 0.04; three of them.
    # Longer runs, too slow for here, hold 0.93 to 1.07: 500 worlds with a pattern alike over 60 px
    # gave 1.000 +- 0.026, and their differences 0.990 +- 0.021.
    assert abs(np.mean(squares) / 3.0 - 1.0) < looser(0.12, WORLDS, MANY)


@pytest.mark.statistics
def test_neighbours_share_their_errors_as_they_say(
    worlds: list[World], coarse: Rig, standard_probe: ProbeBody
) -> None:
    """Errors common to two places a few millimetres apart cancel in their difference."""
    difference = np.hstack([np.eye(3), -np.eye(3)])
    squares, share = [], []
    for world in worlds:
        for first in range(0, len(world.errors), 2):
            pair = world.sensitivities[first : first + 2]
            covariance = systematic_covariance(pair, coarse, standard_probe)
            of_difference = difference @ covariance @ difference.T
            error = world.errors[first] - world.errors[first + 1]
            squares.append(error @ np.linalg.solve(of_difference, error))
            alone = np.trace(covariance[:3, :3]) + np.trace(covariance[3:, 3:])
            share.append(np.trace(of_difference) / alone)
    print(f"differences: NEES / 3 = {np.mean(squares) / 3.0:.3f}")  # noqa: T201 - as above
    assert abs(np.mean(squares) / 3.0 - 1.0) < looser(0.12, WORLDS, MANY)
    # The test would prove nothing if there were nothing in common.
    assert np.mean(share) < 0.8


@pytest.mark.statistics
def test_all_points_of_a_world_are_as_wrong_as_they_say_together(
    worlds: list[World], coarse: Rig, standard_probe: ProbeBody
) -> None:
    squares = []
    for world in worlds:
        covariance = systematic_covariance(world.sensitivities, coarse, standard_probe)
        error = world.errors.ravel()
        squares.append(error @ np.linalg.solve(covariance, error) / error.size)
    # 12 degrees of freedom in each of 300 worlds: 0.02, three of them; the second order of the
    # projection and the grid of the drawn pattern add a few per cent.
    assert abs(np.mean(squares) - 1.0) < 0.04 + looser(0.06, WORLDS, MANY)


def point(number: int, item: TipSensitivity) -> MeasuredPoint:
    return MeasuredPoint(
        number=number,
        feature="BED",
        time_s=0.0,
        first_frame=0,
        last_frame=9,
        n_frames=10,
        tip_world=item.tip_world,
        random_covariance=number * 1e-6 * np.diag([1.0, 4.0, 9.0]),
        direction=np.array([0.0, 0.0, 1.0]),
        tip_radius=3.0,
        rotation_world_from_probe=np.eye(3),
        spots=np.full((2, 6, 2), np.nan),
        chi2_per_dof=1.0,
        approach="trail",
    )


def test_joint_covariance_holds_every_source_once(
    coarse: Rig, standard_probe: ProbeBody, demo_part: Part
) -> None:
    items = measured(coarse, standard_probe, 1, demo_part).sensitivities
    points = [point(number, item) for number, item in enumerate(items, start=1)]
    n = 3 * len(items)
    joint = joint_factors(points, items, coarse, standard_probe).covariance_of(np.eye(n + 1))
    assert joint.shape == (n + 1, n + 1)
    assert np.abs(joint - joint.T).max() < 1e-15
    assert np.linalg.eigvalsh(joint).min() > 0.0
    assert joint[n, n] == pytest.approx(standard_probe.tip_radius_sigma**2)
    assert not joint[n, :n].any()
    alone = joint[:n, :n] - systematic_covariance(items, coarse, standard_probe)
    expected = np.zeros((n, n))
    for index, item in enumerate(points):
        part = slice(3 * index, 3 * index + 3)
        expected[part, part] = item.random_covariance
    assert np.abs(alone - expected).max() < 1e-15


def test_order_of_the_points_does_not_matter(
    coarse: Rig, standard_probe: ProbeBody, demo_part: Part
) -> None:
    items = measured(coarse, standard_probe, 2, demo_part).sensitivities
    forward = systematic_covariance(items, coarse, standard_probe)
    backward = systematic_covariance(items[::-1], coarse, standard_probe)
    order = np.arange(len(forward)).reshape(-1, 3)[::-1].ravel()
    assert np.abs(forward[np.ix_(order, order)] - backward).max() < 1e-15


def test_no_points_have_the_radius_alone(coarse: Rig, standard_probe: ProbeBody) -> None:
    joint = joint_factors([], [], coarse, standard_probe).covariance_of(np.eye(1))
    assert joint == pytest.approx(np.array([[standard_probe.tip_radius_sigma**2]]))


def test_point_uncertainty_is_twice_the_worst_sigma(
    coarse: Rig, standard_probe: ProbeBody, demo_part: Part
) -> None:
    item = measured(coarse, standard_probe, 3, demo_part).sensitivities[0]
    covariance = systematic_covariance([item], coarse, standard_probe)
    worst = np.sqrt(np.linalg.eigvalsh(covariance).max())
    # The joint covariance sums bumps (`LARGEST_ERROR`), one point its exact correlation.
    assert point_uncertainty(item, coarse, standard_probe) == pytest.approx(2.0 * worst, rel=2e-4)
    # The spot pattern is one of the sources: without it the point is more certain.
    noise = coarse.noise
    clean = type(noise)(
        white_px=noise.white_px, pattern_px=0.0, pattern_length_px=noise.pattern_length_px
    )
    quiet = replace(coarse, noise=clean)
    assert point_uncertainty(item, quiet, standard_probe) < 2.0 * worst
