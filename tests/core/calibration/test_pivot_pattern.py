"""The fixed pattern of the sensors in the uncertainty of a swept probe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.pivot import (
    PivotOptions,
    PivotSweep,
    adjust_pivot,
    calibrate_probe,
    preview_pivot,
    start_pivot,
)
from ocmm_core.calibration.pivot._bundle import inverse_pinned, normals_at
from ocmm_core.calibration.pivot._covariance import spot_influences
from tests.core.calibration.swept_probe import (
    CONE_WORLD,
    SIGMA_PX,
    patterned,
    probe,
    rig,
    spots,
    sweep,
    tip_of,
    waved_attitudes,
)


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
    sigma = float(np.hypot(SIGMA_PX, known.noise.pattern_px))
    squares: dict[bool, list[float]] = {False: [], True: []}
    for seed in range(12):
        rng = np.random.default_rng(seed)
        clean = spots(known, body, waved_attitudes(400, 25.0, rng), CONE_WORLD, rng)
        frames = PivotSweep.even(patterned(clean, rng), sigma)
        options = PivotOptions(pattern=True, resamples=100)
        result = calibrate_probe(known, body, frames, options, force=True)
        off = result.tip_probe - tip_of(body.leds_probe - body.tip_probe, body)
        by = result.by_cameras[-3:]
        white = result.formal_covariance[-3:, -3:] + by @ known.parameter_covariance @ by.T
        for pattern, covariance in ((True, result.tip_covariance), (False, white)):
            squares[pattern].append(float(off @ np.linalg.solve(covariance, off)) / 3.0)
        if seed == 0:
            shown = preview_pivot(known, body, frames, pattern=True).tip_sigma
            # The live value uses fewer waves and no bootstrap.
            assert shown == pytest.approx(result.tip_sigma, rel=0.5)
    # 36 coordinates: the mean of their squares scatters by a quarter; the cameras are true here,
    # so that the stated uncertainty has something to spare.
    assert 0.3 < np.mean(squares[True]) < 1.6
    # White noise alone would flatter the same sweeps: that is why the pattern is in it.
    assert np.mean(squares[False]) > 1.5 * np.mean(squares[True])
