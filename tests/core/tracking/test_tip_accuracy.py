from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from ocmm_core.camera import Rig, projection_jacobians
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody, solve

SIGMA = 0.0105
POSES = 20_000

Draw = Callable[..., tuple[Float, Float]]
Look = Callable[..., Float]

pytestmark = pytest.mark.statistics


def cross_matrices(vectors: Float) -> Float:
    """Return (n, 3, 3) whose product with x is vector cross x."""
    x, y, z = vectors.T
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(-1, 3, 3)


def cramer_rao(rig: Rig, body: ProbeBody, rotations: Float, tips: Float, sigma: float) -> Float:
    """Return the least covariance (n, 3, 3), mm^2, of the tip, at the true poses.

    The pose moves about the true tip: its translation is the tip, so that the bound is a block of
    the inverse Fisher information. Nothing of the tracking room is used.
    """
    information: Float = np.zeros((len(tips), 6, 6))
    for led in body.leds_probe - body.tip_probe:
        arms = rotations @ led
        for camera in rig.cameras:
            d_point, _ = projection_jacobians(camera, arms + tips)
            rows = np.concatenate([-d_point @ cross_matrices(arms), d_point], axis=2)
            information += rows.transpose(0, 2, 1) @ rows
    bound: Float = sigma**2 * np.linalg.inv(information)[:, 3:, 3:].astype(np.float64)
    return bound


@dataclass(frozen=True)
class Outcome:
    """Figures of one run, all dimensionless."""

    ratio: float
    thesis_ratio: float
    nees: float
    coverage: float
    chi2_per_dof: float
    bound_um: float


def run(rig: Rig, body: ProbeBody, draw: Draw, look: Look, sigma: float, seed: int) -> Outcome:
    rng = np.random.default_rng(seed)
    rotations, tips = draw(rng, POSES)
    uv = look(rig, body, rotations, tips, sigma, rng)
    least = cramer_rao(rig, body, rotations, tips, sigma)
    bound = float(np.sqrt(np.trace(least, axis1=1, axis2=2).mean()))
    ours, thesis = solve(uv, rig, body, sigma), solve(uv, rig, body, sigma, "thesis")
    assert (ours.status == 0).all()
    errors = ours.tip_world - tips
    squares = np.einsum("ni,nij,nj->n", errors, np.linalg.inv(ours.tip_covariance), errors)

    def rms(error: Float) -> float:
        return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))

    outcome = Outcome(
        ratio=rms(errors) / bound,
        thesis_ratio=rms(thesis.tip_world - tips) / bound,
        nees=float(squares.mean()),
        coverage=float(np.mean(squares < 7.8147)),
        chi2_per_dof=float(np.mean(ours.chi2 / ours.dof)),
        bound_um=1e3 * bound,
    )
    print(outcome)  # noqa: T201 - these figures are to be seen
    return outcome


def test_thesis_rig_reaches_the_bound_and_says_so(
    thesis_rig: Rig, thesis_probe: ProbeBody, draw_poses: Draw, look: Look
) -> None:
    """With 20,000 poses: ratios scatter by 0.5 %, NEES by 0.017."""
    outcome = run(thesis_rig, thesis_probe, draw_poses, look, SIGMA, 1)
    assert outcome.bound_um == pytest.approx(21.9, rel=0.02)  # facts 2a
    assert outcome.ratio <= 1.03
    assert 1.55 < outcome.thesis_ratio < 1.70
    assert outcome.nees == pytest.approx(3.0, abs=0.10)
    # Two thirds of a degree of freedom in 200,000: 0.003.
    assert outcome.chi2_per_dof == pytest.approx(1.0, abs=0.02)
    # Binomial: 0.0015.
    assert outcome.coverage == pytest.approx(0.95, abs=0.008)


@pytest.mark.parametrize("sigma", [0.003, 0.02, 0.05])
def test_other_noise_is_as_honest(
    sigma: float, thesis_rig: Rig, thesis_probe: ProbeBody, draw_poses: Draw, look: Look
) -> None:
    """One Gauss-Newton step is enough also at five times the noise (facts 2a)."""
    outcome = run(thesis_rig, thesis_probe, draw_poses, look, sigma, 2)
    assert outcome.ratio <= 1.03
    assert outcome.nees == pytest.approx(3.0, abs=0.10)
    assert outcome.chi2_per_dof == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("n_cameras", "n_leds", "planar"), [(2, 8, False), (3, 4, True), (4, 3, True)]
)
def test_other_hardware_reaches_the_bound(
    n_cameras: int, n_leds: int, planar: bool,
    rig_of: Callable[[int], Rig], body_of: Callable[..., ProbeBody], draw_poses: Draw, look: Look,
) -> None:  # fmt: skip
    outcome = run(rig_of(n_cameras), body_of(n_leds, planar=planar), draw_poses, look, SIGMA, 3)
    assert outcome.ratio <= 1.03
    assert outcome.nees == pytest.approx(3.0, abs=0.10)
    assert outcome.chi2_per_dof == pytest.approx(1.0, abs=0.02)
