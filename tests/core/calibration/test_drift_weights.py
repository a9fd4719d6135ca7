"""The weights of the watch over a calibration, against the dense formula."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.calibration.monitor._residual_samples import SpotRows, spot_weights


def spots_of(n_looks: int, n_leds: int, seed: int) -> SpotRows:
    """Return spots all over a sensor, and those of two looks at the same places."""
    rng = np.random.default_rng(seed)
    n = n_looks * n_leds
    uv = rng.uniform(0.0, 1000.0, (n, 2))
    uv[:n_leds] = uv[n_leds : 2 * n_leds]
    return SpotRows(
        look=np.repeat(np.arange(n_looks), n_leds), led=np.tile(np.arange(n_leds), n_looks), uv=uv,
        residuals=np.zeros((n, 2)), white_px=rng.uniform(0.001, 0.005, n),
        pattern_px=rng.uniform(0.001, 0.010, n), still=rng.uniform(0.2, 1.0, n),
        by_pose=np.zeros((n, 2, 6)), by_camera=np.zeros((n, 2, 14)), by_led=np.zeros((n, 2, 3)),
    )  # fmt: skip


@pytest.mark.parametrize("n_leds", [1, 4, 16])
@pytest.mark.parametrize(("floor_px", "pixel_px"), [(0.0, 0.0), (4e-4, 0.0), (4e-4, 0.005)])
def test_weights_are_the_inverse_of_the_covariance(
    n_leds: int, floor_px: float, pixel_px: float
) -> None:
    spots = spots_of(20, n_leds, n_leds)
    n = len(spots.look)
    covariance = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            apart = np.sum((spots.uv[i] - spots.uv[j]) ** 2)
            covariance[i, j] = spots.pattern_px[i] * spots.pattern_px[j] * np.exp(-apart / 800.0)
            fine = pixel_px**2 * spots.still[i] * spots.still[j]
            covariance[i, j] += fine * np.exp(-0.5 * apart / 1.2**2)
            covariance[i, j] += floor_px**2 * (spots.led[i] == spots.led[j])
        covariance[i, i] += spots.white_px[i] ** 2
    weights = spot_weights(spots, 20.0, floor_px, pixel_px)
    dense = np.linalg.inv(covariance)
    # The condition is below 100: some 1e-14 of rounding, and room for other processors.
    assert np.max(np.abs(weights - dense)) < 1e-11 * np.max(np.abs(dense))
    assert np.array_equal(weights, weights.T)
