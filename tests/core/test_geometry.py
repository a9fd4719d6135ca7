from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.geometry import (
    RigidTransform,
    perpendicular_pair,
    rotation_from_vector,
    rotation_xyz,
    skew,
    unit,
)

# Products of a few numbers of size one: some tens of rounding errors of 1e-16.
ROUNDING = 1e-14


def test_transforms_compose_and_invert() -> None:
    rng = np.random.default_rng(1)
    for _ in range(100):
        a, b = (
            RigidTransform(rotation_from_vector(rng.normal(size=3)), 100.0 * rng.normal(size=3))
            for _ in range(2)
        )
        points = 100.0 * rng.normal(size=(5, 3))
        # Coordinates up to some 500 mm, so some thousand times the rounding of one.
        assert np.abs(a.compose(b).apply(points) - a.apply(b.apply(points))).max() < 1e-11
        assert np.abs(a.inverse().apply(a.apply(points)) - points).max() < 1e-11
    assert np.array_equal(RigidTransform.identity().apply(points), points)


@pytest.mark.parametrize("angle", [0.0, 1e-15, 1e-9, 1e-3, 1.0, np.pi, 5.0])
def test_rotation_from_vector_turns_by_its_length_about_itself(angle: float) -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        axis = unit(rng.normal(size=3))
        rotation = rotation_from_vector(angle * axis)
        assert np.abs(rotation @ rotation.T - np.eye(3)).max() < ROUNDING
        assert np.linalg.det(rotation) == pytest.approx(1.0, abs=ROUNDING)
        assert np.abs(rotation @ axis - axis).max() < ROUNDING
        side, _ = perpendicular_pair(axis)
        turned = np.cos(angle) * side + np.sin(angle) * np.cross(axis, side)
        assert np.abs(rotation @ side - turned).max() < ROUNDING


def test_rotation_xyz_turns_about_x_then_y_then_z_actively() -> None:
    a, b, c = 0.3, -0.7, 1.1
    x, y, z = np.eye(3)
    expected = (
        rotation_from_vector(c * z) @ rotation_from_vector(b * y) @ rotation_from_vector(a * x)
    )
    assert np.abs(rotation_xyz(a, b, c) - expected).max() < ROUNDING


def test_skew_is_the_cross_product() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 3))
    assert np.abs(skew(a) @ b - np.cross(a, b)).max() < ROUNDING


def test_unit_scales_and_refuses_zero() -> None:
    vectors = np.array([[3.0, 0.0, 4.0], [0.0, -1e-100, 0.0]])
    assert np.abs(unit(vectors) - [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0]]).max() < ROUNDING
    with pytest.raises(ValueError, match="no direction"):
        unit(np.zeros((2, 3)))


def test_perpendicular_pair_is_right_handed_for_every_direction() -> None:
    rng = np.random.default_rng(4)
    directions = np.vstack([np.eye(3), -np.eye(3), rng.normal(size=(100, 3))])
    for direction in directions:
        first, second = perpendicular_pair(direction)
        frame = np.stack([first, second, unit(direction)])
        assert np.abs(frame @ frame.T - np.eye(3)).max() < ROUNDING
        assert np.linalg.det(frame) == pytest.approx(1.0, abs=ROUNDING)
