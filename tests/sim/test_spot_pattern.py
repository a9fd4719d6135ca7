"""The pattern of a sensor is the sum of its documented waves."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import SpotNoise
from ocmm_sim.scene._world import draw_pattern


def test_a_pattern_is_its_waves_added_up_one_by_one() -> None:
    noise = SpotNoise(white_px=0.03, pattern_px=0.01, pattern_length_px=20.0)
    seed = np.random.SeedSequence().entropy
    # More nodes than are computed from the first ones in one go, and no multiple of them.
    found = draw_pattern(noise, 410, 150, np.random.default_rng(seed))
    rng, step = np.random.default_rng(seed), 4.0
    v, u = np.meshgrid(step * np.arange(39), step * np.arange(104), indexing="ij")
    assert found.step_px == step
    assert found.nodes.shape == (2, 39, 104)
    for axis in range(2):
        wave = rng.standard_normal((2, 256)) / noise.pattern_length_px
        phase = rng.uniform(0.0, 2.0 * np.pi, 256)
        waves = np.cos(u[..., None] * wave[0] + v[..., None] * wave[1] + phase)
        expected = noise.pattern_px * np.sqrt(2.0 / 256) * waves.sum(axis=2)
        # Some 100 rad in a wave: 256 roundings of 1e-14, times 0.001 px.
        np.testing.assert_allclose(found.nodes[axis], expected, rtol=0.0, atol=1e-14)
