"""Test whether k3 and the thin prism are needed, by fits with and without them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from ocmm_core.calibration.cameras._least_squares import covariance_of, minimise
from ocmm_core.calibration.cameras._lens import EXTRA_TERMS, project_extended
from ocmm_core.calibration.cameras._model_fit import CameraFit, without_wrong_points
from ocmm_core.calibration.cameras._problem import CameraProblem, free_parameters, whitening_of
from ocmm_core.geometry import Float

SIGNIFICANT = 1e-4
"""Probability below which a gain by the extra terms is not attributed to chance."""

ENOUGH = 1e-4
"""Chi-square; a prism and a shifted principal point are nearly equivalent, and the end of that
valley would take longer than all the rest. At a hundredth, the chance gain was missed."""


@dataclass(frozen=True, slots=True)
class LensTerms:
    """The extra lens terms and their effect."""

    values: Float
    sigmas: Float
    """`values`, `sigmas`: (3,), in the order of `lens.EXTRA_TERMS`; infinite sigmas if the points
    cannot separate the terms from the running model, as in a small field, where they have no
    effect."""
    f_statistic: float
    p_value: float
    """`f_statistic`, `p_value`: Gain in chi-square per term over the remaining chi-square per
    degree of freedom, and the probability of at least that gain by chance (F-test of nested models;
    valid also for a spot sigma of unknown scale)."""
    effect_rms_px: float
    effect_max_px: float
    """`effect_rms_px`, `effect_max_px`: Shift of the calibrated spots, per coordinate and at most,
    when the terms are added and all else is refitted: the error of the running model."""

    @property
    def significant(self) -> bool:
        return self.p_value < SIGNIFICANT

    def strongest(self) -> str:
        """Return the term with the largest ratio to its sigma."""
        return EXTRA_TERMS[int(np.argmax(np.abs(self.values) / self.sigmas))]


def judge_lens_terms(fit: CameraFit) -> LensTerms:
    """Return the test of the extra terms; uses outliers that they explain, mostly at the rim."""
    whitening = whitening_of(fit.camera, fit.points_world, fit.sigma_px, fit.reference_sigma)
    problem = CameraProblem(fit.points_world, fit.uv, whitening, free_parameters(EXTRA_TERMS))
    full, used = without_wrong_points(problem, fit.camera, ENOUGH)
    covariance = covariance_of(full.jacobian)
    dof = 2 * int(used.sum()) - len(problem.free)
    points = fit.points_world[used]
    base = minimise(
        CameraProblem(points, fit.uv[used], whitening[:, used], fit.free), fit.camera, enough=ENOUGH
    )
    terms = len(EXTRA_TERMS)
    variances = np.full(terms, np.inf) if covariance is None else np.diag(covariance)[-terms:]
    gain = max(base.cost - full.cost, 0.0) / terms
    statistic = gain * dof / full.cost if full.cost > 0.0 else 0.0
    effect = project_extended(full.state, points) - project_extended(base.state, points)
    return LensTerms(
        values=full.state.extra,
        sigmas=np.sqrt(variances),
        f_statistic=statistic,
        p_value=float(fdtrc(terms, dof, statistic)),
        effect_rms_px=float(np.sqrt(np.mean(effect**2))),
        effect_max_px=float(np.linalg.norm(effect, axis=1).max()),
    )
