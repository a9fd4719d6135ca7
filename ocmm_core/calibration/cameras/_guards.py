"""Criteria of a camera calibration: its design may be overruled, contradictions not.

One of them: k3 and the thin prism must not be needed, by fits with and without them. If a list does
not fit its spots, the reason is sought: order, handedness or unit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy

from ocmm_core.calibration.cameras._dlt import cloud_of
from ocmm_core.calibration.cameras._least_squares import covariance_of, minimise
from ocmm_core.calibration.cameras._lens import EXTRA_TERMS, LensCamera, project_extended
from ocmm_core.calibration.cameras._model_fit import (
    CameraFit,
    CameraProblem,
    fit_camera,
    free_parameters,
    indices_of_wrong,
    whitening_of,
    without_wrong_points,
)
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import PARAMETERS, CameraModel
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Pixels, Points3
from ocmm_core.units import named_unit

SIGNIFICANT = 1e-4
"""Probability below which a gain by the extra terms is not attributed to chance."""

ENOUGH = 1e-4
"""Chi-square; a prism and a shifted principal point are nearly equivalent, and the end of that
valley would take longer than all the rest. At a hundredth, the chance gain was missed."""

Pattern: TypeAlias = tuple[str, str, Points3, Pixels]

UNITS_MM = {
    word: named_unit(word, "length").factor
    for word in ("inches", "centimetres", "metres", "micrometres")
}
"""A list in one of these that was taken for millimetres makes the rig this much too small."""

UNIT_TOLERANCE = 0.15
"""Relative deviation of a baseline from the rig document within which the unit is named."""

MAX_BASELINE_RATIO = 1.5


@dataclass(frozen=True, slots=True)
class LensTerms:
    """The extra lens terms and their effect."""

    values: Float
    sigmas: Float
    """`values`, `sigmas`: (3,), in the order of `lens.EXTRA_TERMS`; infinite sigmas if the points
    cannot separate the terms from the running model, as in a small field, where they have no
    effect."""
    p_value: float
    """Probability of at least the gain in chi-square by chance (F-test of nested models; valid also
    for a spot sigma of unknown scale)."""
    effect_rms_px: float
    """Shift of the calibrated spots, per coordinate, when the terms are added and all else is
    refitted: the error of the running model."""

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
    return _tested(problem, fit.camera, fit.free)


def _tested(problem: CameraProblem, camera: LensCamera, free: tuple[int, ...]) -> LensTerms:
    full, used = without_wrong_points(problem, camera, ENOUGH)
    covariance = covariance_of(full.jacobian)
    dof = 2 * int(used.sum()) - len(problem.free)
    points = problem.points_world[used]
    base = minimise(
        CameraProblem(points, problem.uv[used], problem.whitening[:, used], free), camera,
        enough=ENOUGH,
    )  # fmt: skip
    terms = len(EXTRA_TERMS)
    variances = np.full(terms, np.inf) if covariance is None else np.diag(covariance)[-terms:]
    gain = max(base.cost - full.cost, 0.0) / terms
    statistic = gain * dof / full.cost if full.cost > 0.0 else 0.0
    effect = project_extended(full.state, points) - project_extended(base.state, points)
    return LensTerms(
        values=full.state.extra,
        sigmas=np.sqrt(variances),
        p_value=float(scipy.special.fdtrc(terms, dof, statistic)),
        effect_rms_px=float(np.sqrt(np.mean(effect**2))),
    )


FLAT_REFUSED, FLAT_WARNED = 0.1, 0.25
"""Depth over width of the points. 15 mm on 400 costs 30 um at 100 mm depth, 200 mm 4.8 um."""

SMALL_REFUSED, SMALL_WARNED = 0.03, 0.1
"""Width of the points over their distance from the camera."""

FEW_POINTS = 50

RMS_REFUSED = 10.0
"""Residuals over their sigmas; a wrong minimum gives a hundred."""

RMS_FORCED = 2.0
CHI2_DEVIATION = 4.0
"""Standard deviations of chi-square from its expectation that cause a finding."""

FOCAL_SIGMA = 1e-4
OUTLIERS_REFUSED = 0.1
LENS_EFFECT = 1.0
"""RMS effect of the missing lens terms, in sigmas of a spot."""


def judge_fit(fit: CameraFit, names: Sequence[str]) -> list[Finding]:
    """Return findings on the fit of one camera to the points ``names``."""
    name = fit.camera.model.name
    return [
        *_residuals(fit, name),
        *_wrong_points(fit, name, names),
        *_volume(fit, name),
        *_focal(fit, name),
    ]


def judge_lens(name: str, sigma_px: float, terms: LensTerms) -> list[Finding]:
    if not terms.significant:
        return []
    size = terms.effect_rms_px / sigma_px
    return [
        Finding(
            "calibration.lens_model",
            f"The lens of camera '{name}' has more distortion than the model covers: the term "
            f"{terms.strongest()} and its neighbours move the spots by "
            f"{terms.effect_rms_px:.4f} px RMS, {size:.1f} times their sigma.",
            "Use only the middle of its field, or a lens with less distortion."
            if size > LENS_EFFECT
            else "No action needed; watch this figure at the next calibration.",
            refuses=size > LENS_EFFECT,
        )
    ]


def lens_effect(
    camera: CameraModel, points_world: Points3, uv: Pixels, weights: Float, sigma_px: float
) -> list[Finding]:
    """Return findings on the lens of a camera, adjusted elsewhere to points (n, 3), mm.

    ``weights`` (n,), 1/px: inverse standard deviations of the spots; ``sigma_px``: their usual one.
    """
    whitening = np.stack([weights, np.zeros(len(weights)), weights])
    problem = CameraProblem(points_world, uv, whitening, free_parameters(EXTRA_TERMS))
    terms = _tested(problem, LensCamera(camera), free_parameters())
    return judge_lens(camera.name, sigma_px, terms)


def ratio_of(fit: CameraFit) -> float:
    """Return the ratio of the residuals to their sigmas."""
    return float(np.sqrt(fit.chi2 / max(fit.dof, 1)))


def _residuals(fit: CameraFit, name: str) -> Iterator[Finding]:
    ratio = ratio_of(fit)
    said = (
        f"Camera '{name}' has residuals of {fit.rms_px:.4f} px RMS, {ratio:.1f} times what "
        "their uncertainty explains"
    )
    if ratio > RMS_REFUSED or not np.isfinite(ratio):
        yield Finding(
            "calibration.rms",
            f"{said}; not a valid calibration.",
            "Check that every spot belongs to its reference point, that the axes of the list "
            "are right-handed, and that the pixel pitch and focal length of the camera are "
            "those of the rig document.",
            refuses=True,
        )
        return
    if not fit.converged:
        yield Finding(
            "calibration.not_converged",
            f"The fit of camera '{name}' did not converge.",
            "Take more points, spread over a deeper volume.",
            refuses=True,
        )
    deviation = CHI2_DEVIATION * np.sqrt(2.0 / max(fit.dof, 1))
    if ratio**2 > 1.0 + deviation:
        yield Finding(
            "calibration.chi2",
            f"{said} (chi-square {fit.chi2:.0f} for {fit.dof} degrees of freedom).",
            "Look for vibration, a loose target or a temperature change during acquisition, "
            "and check the sigma of the spots and the uncertainty in the list.",
            refuses=ratio > RMS_FORCED,
            forcible=True,
        )
    elif ratio**2 < 1.0 - deviation:
        yield Finding(
            "calibration.chi2_low",
            f"The residuals of camera '{name}' are {1.0 / max(ratio, 1e-9):.1f} times "
            "smaller than the stated uncertainty.",
            "State the true sigma of the averaged spots and uncertainty of the list; the "
            "uncertainty of this calibration is too large.",
            refuses=False,
        )


def _wrong_points(fit: CameraFit, name: str, names: Sequence[str]) -> list[Finding]:
    wrong = indices_of_wrong(fit)
    if not len(wrong):
        return []
    listed = ", ".join(f"{names[i]} ({fit.distances[i]:.0f} sigma)" for i in wrong[:10])
    if len(wrong) > 10:
        listed += f" and {len(wrong) - 10} more"
    return [
        Finding(
            "calibration.outliers",
            f"Camera '{name}' sees {len(wrong)} of {len(fit.uv)} points elsewhere than the list "
            f"says: {listed}; they were left out.",
            "Repeat these points, or correct them in the list.",
            refuses=len(wrong) > OUTLIERS_REFUSED * len(fit.uv),
        )
    ]


def _volume(fit: CameraFit, name: str) -> Iterator[Finding]:
    points = fit.points_world[fit.used]
    if len(points) < FEW_POINTS:
        yield Finding(
            "calibration.few_points",
            f"Camera '{name}' is calibrated with only {len(points)} points.",
            "Take 200 points or more.",
            refuses=False,
        )
    flat = cloud_of(points).flatness
    if flat < FLAT_WARNED:
        yield Finding(
            "calibration.flat_volume",
            f"The points of camera '{name}' fill a volume that is {flat:.2f} times as deep "
            "as wide: the focal length is then poorly determined, and points in front of "
            "and behind this volume are measured wrong.",
            "Take points in a volume at least a quarter as deep as wide; 200 mm of depth make "
            "the calibration six times better than 15 mm.",
            refuses=flat < FLAT_REFUSED,
            forcible=True,
        )
    centre = fit.camera.model.centre_world
    distance = float(np.linalg.norm(points.mean(axis=0) - centre))
    width = float(np.ptp(points, axis=0).max()) / distance
    if width < SMALL_WARNED:
        yield Finding(
            "calibration.small_volume",
            f"The points of camera '{name}' span only {100.0 * width:.1f} % of their distance.",
            "Spread the points over the whole measuring volume.",
            refuses=width < SMALL_REFUSED,
            forcible=True,
        )


def _focal(fit: CameraFit, name: str) -> list[Finding]:
    focal = PARAMETERS.index("focal")
    sigma = float(np.sqrt(fit.covariance[focal, focal])) / fit.camera.model.focal
    if sigma <= FOCAL_SIGMA:
        return []
    return [
        Finding(
            "calibration.focal_sigma",
            f"The focal length of camera '{name}' is known only to {sigma:.1e} of its value; "
            f"the limit is {FOCAL_SIGMA:.0e}.",
            "Take points in a deeper volume, or more points.",
            refuses=True,
            forcible=True,
        )
    ]


def explain_misfit(
    nominal: CameraModel, points_world: Points3, uv: Pixels, sigma_px: float, reference_sigma: float
) -> Finding | None:
    """Return the mix-up of the list that makes it fit the spots, or None.

    (n, 3), mm, and (n, 2), px, in list order. Two swapped axes, one reversed axis, and swapped u
    and v differ by a rotation only, which the pose absorbs: they are named together.
    """
    for code, sentence, points, spots in _patterns(points_world, uv):
        try:
            fit = fit_camera(nominal, points, spots, sigma_px, reference_sigma)
        except CalibrationError:
            continue
        good = ratio_of(fit) < RMS_REFUSED and np.mean(~fit.used) <= OUTLIERS_REFUSED
        if good:
            return Finding(
                code,
                f"The list of points does not fit the spots of camera '{nominal.name}', but it "
                f"would {sentence}.",
                "Correct the list of points or of spots, and calibrate again.",
                refuses=True,
            )
    return None


def explain_baseline(first: str, second: str, found_mm: float, expected_mm: float) -> list[Finding]:
    """Return findings on the unit by the camera distance of the rig; residuals hide it."""
    ratio = found_mm / expected_mm
    said = (
        f"According to the list of points, cameras '{first}' and '{second}' are {found_mm:.4g} "
        f"mm apart, according to the rig document {expected_mm:.4g} mm"
    )
    for unit, size in UNITS_MM.items():
        for factor, problem in (
            (1.0 / size, f"the list is in {unit}, but declares mm"),
            (size, f"the list is in mm, but declares {unit}"),
        ):
            if abs(ratio / factor - 1.0) <= UNIT_TOLERANCE:
                return [
                    Finding(
                        "calibration.wrong_unit",
                        f"{said}: {problem}.",
                        "Correct the unit in the header of the list.",
                        refuses=True,
                    )
                ]
    if 1.0 / MAX_BASELINE_RATIO <= ratio <= MAX_BASELINE_RATIO:
        return []
    return [
        Finding(
            "calibration.baseline",
            f"{said}.",
            "Check the unit of the list, and the camera positions in the rig document.",
            refuses=True,
            forcible=True,
        )
    ]


def _patterns(points: Points3, uv: Pixels) -> Iterator[Pattern]:
    order = "calibration.wrong_order"
    yield order, "if the points were in reverse order", points[::-1], uv
    yield order, "if every spot belonged to the next point", points[1:], uv[:-1]
    yield order, "if every spot belonged to the previous point", points[:-1], uv[1:]
    yield (
        "calibration.wrong_axes",
        "if it were mirrored: two of its axes are swapped, one has the wrong sign, or u and v of "
        "the spots are swapped",
        points * np.array([1.0, 1.0, -1.0]),
        uv,
    )
