"""The fixed pattern of the sensors in the uncertainty of a swept probe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.pivot import calibrate_probe
from ocmm_core.calibration.pivot_bundle import adjust_pivot, inverse_pinned, normals_at
from ocmm_core.calibration.pivot_coverage import preview_pivot
from ocmm_core.calibration.pivot_data import PivotOptions, PivotSweep
from ocmm_core.calibration.pivot_pattern import spot_influences
from ocmm_core.calibration.pivot_start import start_pivot
from ocmm_core.geometry import Pixels
from ocmm_core.simulation.spot_pattern import draw_pattern
from tests.core.calibration.swept_probe import (
    CONE_WORLD,
    probe,
    rig,
    spots,
    sweep,
    tip_of,
    waved_attitudes,
)

WHITE_PX = 0.0105


def patterned(uv: Pixels, rng: np.random.Generator) -> Pixels:
    """Return spots on sensors with a pattern of their own."""
    known = rig()
    found = uv.copy()
    for c, camera in enumerate(known.cameras):
        pattern = draw_pattern(known.noise, camera.width, camera.height, rng)
        place = uv[:, c] / pattern.step_px
        low = np.floor(place).astype(np.int64)
        g, h = (place - low)[..., 0], (place - low)[..., 1]
        column, row = low[..., 0], low[..., 1]
        for axis, nodes in enumerate(pattern.nodes):
            found[:, c, :, axis] += (
                (1 - g) * (1 - h) * nodes[row, column] + g * (1 - h) * nodes[row, column + 1]
                + (1 - g) * h * nodes[row + 1, column] + g * h * nodes[row + 1, column + 1]
            )  # fmt: skip
    return found


@pytest.mark.parametrize("slack_mm", [0.0, 0.005])
def test_influences_are_what_the_adjustment_does(slack_mm: float) -> None:
    frames = sweep(120, 25.0, 1)
    state = adjust_pivot(rig(), frames, start_pivot(rig(), frames, 1).state, slack_mm).state
    here = normals_at(rig(), frames, state, slack_mm)
    inverse = inverse_pinned(here.normals[0], state.turns())
    assert inverse is not None
    off = 1e-3 * np.random.default_rng(2).standard_normal(frames.uv.shape)
    there = normals_at(rig(), replace(frames, uv=frames.uv + off), state, slack_mm)
    step = -inverse @ (there.gradients[0] - here.gradients[0])
    followed = spot_influences(rig(), frames, state, inverse, slack_mm, slice(None))
    assert np.einsum("nclam,ncla->m", followed, off) == pytest.approx(step, abs=1e-9)


def test_stated_uncertainty_holds_with_a_pattern() -> None:
    known, body = rig(), probe()
    sigma = float(np.hypot(WHITE_PX, known.noise.pattern_px))
    squares: dict[bool, list[float]] = {False: [], True: []}
    for seed in range(12):
        rng = np.random.default_rng(seed)
        clean = spots(known, body, waved_attitudes(400, 25.0, rng), CONE_WORLD, rng)
        frames = PivotSweep.even(patterned(clean, rng), sigma)
        for pattern, found in squares.items():
            options = PivotOptions(pattern=pattern, resamples=100)
            result = calibrate_probe(known, body, frames, options, force=True)
            off = result.tip_probe - tip_of(body.leds_probe - body.tip_probe, body)
            found.append(float(off @ np.linalg.solve(result.tip_covariance, off)) / 3.0)
        if seed == 0:
            shown = preview_pivot(known, body, frames, pattern=True).tip_sigma
            # What is shown live has fewer waves, and knows nothing of the bootstrap.
            assert shown == pytest.approx(result.tip_sigma, rel=0.5)
    # 36 coordinates: the mean of their squares scatters by a quarter; the cameras are true here,
    # so that the stated uncertainty has something to spare.
    assert 0.3 < np.mean(squares[True]) < 1.6
    # Without it the same sweeps flatter: that is why it is there.
    assert np.mean(squares[False]) > 1.5 * np.mean(squares[True])
