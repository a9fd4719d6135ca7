"""Are k3 and the thin prism needed? The fit with them against the fit without."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import f as f_distribution

from ocmm_core.calibration.camera_model_fit import CameraFit, fit_camera
from ocmm_core.calibration.camera_problem import CameraProblem, whitening_of
from ocmm_core.calibration.least_squares import minimise
from ocmm_core.calibration.lens import EXTRA_TERMS, project_extended
from ocmm_core.geometry import Float

SIGNIFICANT = 1e-4
"""Probability below which chance does not explain the gain of the extra terms."""


@dataclass(frozen=True, slots=True)
class LensTerms:
    """What the extra lens terms would be and what they would change.

    Attributes
    ----------
    values, sigmas
        (3,), in the order of `lens.EXTRA_TERMS`.
    f_statistic, p_value
        Gain in chi-square per term over the remaining chi-square per degree of freedom, and the
        probability of at least that gain by chance (F-test of nested models, which holds also
        where the spots' sigma is known to a factor only).
    effect_rms_px, effect_max_px
        How far the calibrated spots move, per coordinate and at most, when the terms are added
        and everything else is fitted again. This is the error that the running model makes.
    """

    values: Float
    sigmas: Float
    f_statistic: float
    p_value: float
    effect_rms_px: float
    effect_max_px: float

    @property
    def significant(self) -> bool:
        """Return whether chance does not explain the gain."""
        return self.p_value < SIGNIFICANT

    def strongest(self) -> str:
        """Return the name of the term that differs most from zero, in sigmas."""
        return EXTRA_TERMS[int(np.argmax(np.abs(self.values) / self.sigmas))]


def judge_lens_terms(fit: CameraFit) -> LensTerms:
    """Return what the extra terms would be.

    Points that only the fit without them takes for wrong, as a lens that needs them bends the
    picture most at its rim, are used.

    Parameters
    ----------
    fit
        A fit of the running model, without extra terms.

    Raises
    ------
    CalibrationError
        The points do not determine the extra terms.
    """
    full = fit_camera(
        fit.camera.model, fit.points_world, fit.uv, fit.sigma_px, fit.reference_sigma, EXTRA_TERMS
    )
    points, uv = fit.points_world[full.used], fit.uv[full.used]
    whitening = whitening_of(full.camera, points, fit.sigma_px, fit.reference_sigma)
    base = minimise(CameraProblem(points, uv, whitening, fit.free), fit.camera)
    terms = len(EXTRA_TERMS)
    gain = max(base.cost - full.chi2, 0.0) / terms
    statistic = gain * full.dof / full.chi2 if full.chi2 > 0.0 else 0.0
    effect = project_extended(full.camera, points) - project_extended(base.state, points)
    return LensTerms(
        values=full.camera.extra,
        sigmas=np.sqrt(np.diag(full.covariance)[-terms:]),
        f_statistic=statistic,
        p_value=float(f_distribution.sf(statistic, terms, full.dof)),
        effect_rms_px=float(np.sqrt(np.mean(effect**2))),
        effect_max_px=float(np.linalg.norm(effect, axis=1).max()),
    )
