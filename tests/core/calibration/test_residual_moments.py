"""The compiled moments of a look are those of plain arrays."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ocmm_core.calibration.monitor._residual_samples import spot_moments
from ocmm_core.camera import load_rig, project
from ocmm_core.documents import resource
from ocmm_core.tracking import load_probe

pytestmark = pytest.mark.numerics


@pytest.mark.parametrize("mapped", [False, True])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_moments_are_those_of_plain_arrays(seed: int, *, mapped: bool) -> None:
    rng = np.random.default_rng(seed)
    rig, body = load_rig(resource("rigs", "recommended.toml")), load_probe(
        resource("probes", "thesis.toml")
    )  # fmt: skip
    n = 60
    rotations = Rotation.from_rotvec(0.3 * rng.standard_normal((n, 3))).as_matrix()
    origins = rig.volume_world.mean(axis=0) + rng.uniform(-40.0, 40.0, (n, 3))
    leds_world = body.leds_probe @ rotations.transpose(0, 2, 1) + origins[:, None]
    predicted = np.stack([project(camera, leds_world) for camera in rig.cameras], axis=1)
    uv = predicted + rng.normal(0.0, 0.05, predicted.shape)
    seen = rng.random(uv.shape[1:3]) < 0.7
    uv[:, ~seen] = np.nan
    expected = rng.normal(0.0, 0.02, uv.shape) if mapped else np.zeros((0, *uv.shape[1:]))
    moments = np.full((3, *uv.shape[1:]), np.nan)
    squares, reach = spot_moments(
        uv, seen, rotations, origins, body.leds_probe, rig.packed(), expected, moments
    )
    residuals = uv - predicted - (expected if mapped else 0.0)
    wanted = np.stack([residuals.mean(axis=0), uv.mean(axis=0), uv.var(axis=0)])
    # Places of some 1,000 px have steps of 1e-13 px, and 60 of them are added.
    np.testing.assert_allclose(moments[:2], wanted[:2], rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(moments[2], wanted[2], rtol=1e-10)
    about = np.sum((residuals - residuals.mean(axis=0))[:, seen] ** 2)
    assert squares == pytest.approx(float(about), rel=1e-9)
    assert reach == float(np.ptp(uv[:, seen], axis=0).max())
