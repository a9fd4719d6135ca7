"""Possible effect of a single false LED on a pose: a hidden LED does not change it."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.geometry import Float
from ocmm_core.tracking.kernels._decide_kernel import ambiguity_score
from ocmm_core.tracking.kernels._kernel import normal_equations
from ocmm_core.tracking.kernels._small_algebra import backward, cholesky, forward

FOCAL_MM, PX_PER_MM, SIGMA_PX = 25.0, 100.0, 0.03
LEDS = np.array(
    [[0, 0, 0], [120, 10, 20], [30, 110, -20], [100, 120, 30], [60, 50, -30], [10, 60, 25]],
    dtype=np.float64,
)
ORIGIN = np.array([-50.0, -50.0, 0.0])


def _camera(x_mm: float) -> Float:
    """Return a camera 1 m in front of the world with a view from the side, packed."""
    angle = np.arctan(x_mm / 1000.0)
    c, s = np.cos(angle), np.sin(angle)
    R_camera_from_world = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    centre_world = np.array([x_mm, 0.0, -1000.0])
    rest = [FOCAL_MM, PX_PER_MM, PX_PER_MM, 1000.0, 800.0, 0.0, 0.0, 0.0, 0.0]
    return np.concatenate(
        [R_camera_from_world.ravel(), -R_camera_from_world @ centre_world, np.array(rest)]
    )


CAMERAS = np.stack([_camera(-300.0), _camera(300.0)])


def _images(leds_world: Float) -> Float:
    """Return where ideal cameras see LEDs (2, n, 2), mm."""
    seen = np.empty((2, len(leds_world), 2))
    for c, camera in enumerate(CAMERAS):
        x, y, z = camera[:9].reshape(3, 3) @ leds_world.T + camera[9:12, None]
        seen[c] = FOCAL_MM * np.stack([x / z, y / z], axis=1)
    return seen


@pytest.mark.parametrize("hidden", range(6))
@pytest.mark.parametrize("seed", range(20))
def test_a_hidden_led_counts_as_if_the_body_had_none(hidden: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    ideal = _images(LEDS + ORIGIN) + rng.normal(0.0, SIGMA_PX / PX_PER_MM, (2, 6, 2))
    jacobian = np.zeros((2, 6, 4))
    jacobian[..., 0] = jacobian[..., 3] = PX_PER_MM
    seen = np.ones((2, 6), dtype=np.bool_)
    seen[:, hidden] = False
    rotation, origin = np.eye(3), ORIGIN.copy()
    h, g = np.empty((6, 6)), np.empty(6)
    normal_equations(ideal, jacobian, seen, CAMERAS, LEDS, rotation, origin, h, g)
    assert cholesky(h)
    forward(h, g)
    backward(h, g)
    # The turn of about 1e-5 rad stays: both are evaluated at the same pose.
    origin += g[3:]
    there = np.arange(6) != hidden
    expected = ambiguity_score(
        np.ascontiguousarray(ideal[:, there]),
        np.ascontiguousarray(jacobian[:, there]),
        np.ascontiguousarray(seen[:, there]),
        CAMERAS, LEDS[there], rotation, origin, SIGMA_PX,
    )  # fmt: skip
    found = ambiguity_score(ideal, jacobian, seen, CAMERAS, LEDS, rotation, origin, SIGMA_PX)
    # The same sums with zeros among them: a thousandth leaves room for any order of rounding.
    assert found == pytest.approx(expected, rel=1e-3)
