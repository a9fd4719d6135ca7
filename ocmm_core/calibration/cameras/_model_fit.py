"""Fit of one camera to known points with several starts and outlier detection.

Thesis 3.1 (after Heikkila and Silven 1997) with its errata. Nominal focal length or DLT leads to
the global minimum; starts are tried until the residuals match the sigma, and the best is kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.cameras import _least_squares as least_squares
from ocmm_core.calibration.cameras import _lens as lens
from ocmm_core.calibration.cameras._dlt import Start, starts
from ocmm_core.camera import N_PARAMETERS, PARAMETERS, CameraModel
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int, Pixels, Points3

BEHIND_PX = 1e9


@dataclass(frozen=True, slots=True)
class CameraProblem:
    """Reference points, their spots, and uncertainties."""

    points_world: Points3
    uv: Pixels
    """`points_world`, `uv`: (n, 3), mm, and (n, 2), px."""
    whitening: Float
    """(3, n), 1/px: triangle (00, 10, 11) that scales residuals to unit variance, weighted."""
    free: tuple[int, ...]
    """Indices into `ALL_PARAMETERS` of the fitted parameters; the others are fixed."""

    def linearise(self, state: lens.LensCamera) -> tuple[Float, Float]:
        """Return whitened residuals (2n,), predicted minus observed, all u first; (2n, p)."""
        terms = max(N_PARAMETERS, self.free[-1] + 1)
        seen = lens.project_with_jacobian(state, self.points_world, terms, self.uv, self.whitening)
        rows = seen.rows if terms == len(self.free) else seen.rows[list(self.free)]
        return seen.residuals.reshape(-1), rows.reshape(len(self.free), -1).T

    def miss(self, state: lens.LensCamera) -> Pixels:
        """Return predicted minus observed, (n, 2), px."""
        return lens.project_extended(state, self.points_world) - self.uv

    def distances(self, miss: Pixels) -> Float:
        """Return the whitened length (n,) of each point's residual (n, 2), px."""
        u, v = np.where(np.isfinite(miss), miss, BEHIND_PX).T
        first, across, second = self.whitening
        distances: Float = np.hypot(first * u, across * u + second * v)
        return distances

    def moved(self, state: lens.LensCamera, step: Float) -> lens.LensCamera:
        """Return the camera after a step (p,) of the free parameters."""
        change = np.zeros(len(lens.ALL_PARAMETERS))
        change[list(self.free)] = step
        return state.moved(change)

    def scaled(self, factors: Float) -> CameraProblem:
        return replace(self, whitening=self.whitening * factors)


def free_parameters(extra_terms: tuple[str, ...] = ()) -> tuple[int, ...]:
    """Return the indices of the running model's parameters and of the named extra terms."""
    return tuple(
        index
        for index, name in enumerate(lens.ALL_PARAMETERS)
        if name in PARAMETERS or name in extra_terms
    )


def whitening_of(
    camera: lens.LensCamera, points_world: Points3, sigma_px: float, reference_sigma: float
) -> Float:
    """Return the whitening (3, n), 1/px, for uncertain spots and reference points.

    An error ``reference_sigma`` (mm per axis) moves a spot by d(pixel)/d(point). Each point occurs
    once in this fit, so the sum is to first order the fit with unknown points (errors in
    variables).
    """
    n = len(points_world)
    whitening = np.zeros((3, n))
    if reference_sigma == 0.0:
        whitening[0] = whitening[2] = 1.0 / sigma_px
        return whitening
    u, v = lens.by_point(
        camera, lens.project_with_jacobian(camera, points_world, N_PARAMETERS).rows
    )
    variance_u = sigma_px**2 + reference_sigma**2 * np.einsum("in,in->n", u, u)
    variance_v = sigma_px**2 + reference_sigma**2 * np.einsum("in,in->n", v, v)
    common = reference_sigma**2 * np.einsum("in,in->n", u, v)
    # Inverse of the lower Cholesky factor, written out.
    first = np.sqrt(variance_u)
    across = common / first
    second = np.sqrt(variance_v - across**2)
    whitening[0] = 1.0 / first
    whitening[1] = -across / (first * second)
    whitening[2] = 1.0 / second
    return whitening


MINIMUM_POINTS = 20
"""Below this, 14 parameters leave too little redundancy to detect a wrong point."""

OUTLIER_PROBABILITY = 1e-3
"""Probability that any good point is classified as wrong."""

_MEDIAN_OF_RAYLEIGH = 1.1774
_ROUNDS = 12
_STEPS_PER_ROUND = 5
_POSE = tuple(range(6))


@dataclass(frozen=True, slots=True)
class CameraFit:
    """Result of a fit of one camera, not judged."""

    camera: lens.LensCamera
    """Extra terms are zero unless fitted."""
    free: tuple[int, ...]
    """Indices into `lens.ALL_PARAMETERS` of the fitted parameters."""
    covariance: Float
    """(p, p) of the fitted parameters, from the sigma of spots and of reference points."""
    points_world: Points3
    uv: Pixels
    """`points_world`, `uv`: (n, 3), mm, and (n, 2), px: all points seen by the camera."""
    used: np.ndarray[tuple[int], np.dtype[np.bool_]]
    """(n,): False for outliers."""
    distances: Float
    """(n,): length of the whitened residual; about 1 for a good point."""
    residuals_px: Pixels
    """(n, 2), observed minus predicted."""
    chi2: float
    dof: int
    """`chi2`, `dof`: Of the used points."""
    sigma_px: float
    reference_sigma: float
    """`sigma_px`, `reference_sigma`: Assumed, px and mm per axis."""
    converged: bool
    start: str

    @property
    def rms_px(self) -> float:
        """Return the RMS residual of the used points, px per coordinate."""
        return float(np.sqrt(np.mean(self.residuals_px[self.used] ** 2)))


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A minimum, its inliers, and chi-square per degree of freedom."""

    start: Start
    minimum: least_squares.Minimum[lens.LensCamera]
    used: np.ndarray[tuple[int], np.dtype[np.bool_]]
    ratio: float

    @property
    def score(self) -> float:
        """Return the score to minimise; penalises exclusion of points."""
        return self.ratio + 100.0 * float(np.mean(~self.used))


def fit_camera(
    nominal: CameraModel,
    points_world: Points3,
    uv: Pixels,
    sigma_px: float,
    reference_sigma: float = 0.0,
    extra_terms: tuple[str, ...] = (),
) -> CameraFit:
    """Return the camera that explains the spots of known points.

    ``nominal``: sensor size, pitch and focal length used. ``points_world`` (n, 3), mm; ``uv`` (n,
    2), px; ``sigma_px``, ``reference_sigma``: px and mm per axis; ``extra_terms`` of
    `lens.EXTRA_TERMS`. CalibrationError with fewer than `MINIMUM_POINTS` points, or if they do not
    determine the camera.
    """
    if len(points_world) < MINIMUM_POINTS:
        raise CalibrationError(
            "calibration.too_few_points",
            f"Camera '{nominal.name}' saw {len(points_world)} of the reference points, but at "
            f"least {MINIMUM_POINTS} are needed.",
            "Take more points; 200 or more, spread over a deep volume, make a good calibration.",
        )
    candidates: list[_Candidate] = []
    expected = 2 * len(uv) - len(free_parameters(extra_terms))
    for start in starts(nominal, points_world, uv):
        found = _from_start(start, points_world, uv, sigma_px, reference_sigma, extra_terms)
        if found is None:
            continue
        candidates.append(found)
        noise_only = found.ratio <= 1.0 + 4.0 * np.sqrt(2.0 / expected)
        clean = noise_only and float(np.mean(found.used)) >= 0.9
        # Pure noise cannot be improved clearly.
        if clean and found.minimum.converged:
            break
    if not candidates:
        raise CalibrationError(
            "calibration.no_start",
            f"No pose of camera '{nominal.name}' can see the points at these spots.",
            "Check that the points are not on a line, and that spots and points belong together.",
        )
    best = min(candidates, key=lambda candidate: candidate.score)
    return _result(best, points_world, uv, sigma_px, reference_sigma, extra_terms)


def _from_start(
    start: Start,
    points_world: Points3,
    uv: Pixels,
    sigma_px: float,
    reference_sigma: float,
    extra_terms: tuple[str, ...],
) -> _Candidate | None:
    """Return the minimum from one start, without outliers; None on failure."""
    camera = lens.LensCamera(start.camera)
    problem = CameraProblem(
        points_world,
        uv,
        whitening_of(camera, points_world, sigma_px, reference_sigma),
        free_parameters(extra_terms),
    )
    minimum = least_squares.minimise(problem, camera)
    if not np.isfinite(minimum.cost):
        return None
    if reference_sigma > 0.0:
        problem, minimum = _whitened_again(problem, minimum, sigma_px, reference_sigma)
    used = np.ones(len(uv), dtype=np.bool_)
    distances = np.linalg.norm(minimum.residuals.reshape(2, -1), axis=0)
    if distances.max() > _least_limit(len(uv)) and distances.max() > _limit(distances):
        # Outliers may have misled the fit irrecoverably.
        minimum = _robust(problem, camera)
        if reference_sigma > 0.0:
            problem, _ = _whitened_again(problem, minimum, sigma_px, reference_sigma, steps=0)
        minimum, used = without_wrong_points(problem, minimum.state)
    dof = max(2 * int(used.sum()) - len(problem.free), 1)
    return _Candidate(start, minimum, used, minimum.cost / dof)


def _whitened_again(
    problem: CameraProblem,
    minimum: least_squares.Minimum[lens.LensCamera],
    sigma_px: float,
    reference_sigma: float,
    steps: int = 60,
) -> tuple[CameraProblem, least_squares.Minimum[lens.LensCamera]]:
    whitening = whitening_of(minimum.state, problem.points_world, sigma_px, reference_sigma)
    problem = replace(problem, whitening=whitening)
    return problem, (least_squares.minimise(problem, minimum.state, steps) if steps else minimum)


def _robust(
    problem: CameraProblem, camera: lens.LensCamera
) -> least_squares.Minimum[lens.LensCamera]:
    """Return the robust minimum, pose first: a lens fitted to a wrong pose can diverge."""
    for free in (_POSE, problem.free):
        part = replace(problem, free=free)
        last = np.inf
        for _ in range(_ROUNDS):
            distances = part.distances(part.miss(camera))
            scale = 3.0 * _scale_of(distances)
            weights = 1.0 / np.sqrt(1.0 + (distances / scale) ** 2)
            minimum = least_squares.minimise(part.scaled(weights), camera, _STEPS_PER_ROUND)
            camera = minimum.state
            if abs(last - scale) <= 1e-3 * scale:
                break
            last = scale
    return minimum


def without_wrong_points(
    problem: CameraProblem, camera: lens.LensCamera, enough: float = least_squares.ABSOLUTE_DECREASE
) -> tuple[least_squares.Minimum[lens.LensCamera], np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Return the minimum of the inliers, and their mask.

    Re-judged after every fit (first by ``camera``), until chi-square can fall by ``enough``.
    """
    distances = problem.distances(problem.miss(camera))
    used = distances <= _limit(distances)
    for _ in range(_ROUNDS):
        minimum = least_squares.minimise(
            problem.scaled(used.astype(np.float64)), camera, enough=enough
        )
        camera = minimum.state
        distances = problem.distances(problem.miss(camera))
        again = distances <= _limit(distances)
        if np.array_equal(again, used):
            break
        used = again
    return minimum, used


def _scale_of(distances: Float) -> float:
    """Return the ratio of good residuals to sigma, at least one."""
    return max(float(np.median(distances)) / _MEDIAN_OF_RAYLEIGH, 1.0)


def _limit(distances: Float) -> float:
    """Return the outlier distance: P(d > x) = exp(-x^2 / 2), over all points (Bonferroni)."""
    return _scale_of(distances) * _least_limit(len(distances))


def _least_limit(n: int) -> float:
    return math.sqrt(-2.0 * math.log(OUTLIER_PROBABILITY / n))


def _result(
    best: _Candidate,
    points_world: Points3,
    uv: Pixels,
    sigma_px: float,
    reference_sigma: float,
    extra_terms: tuple[str, ...],
) -> CameraFit:
    camera = best.minimum.state
    free = free_parameters(extra_terms)
    problem = CameraProblem(
        points_world, uv, whitening_of(camera, points_world, sigma_px, reference_sigma), free
    )
    covariance = least_squares.covariance_of(best.minimum.jacobian)
    if covariance is None:
        raise CalibrationError(
            "calibration.undetermined",
            f"The points do not determine camera '{camera.model.name}'.",
            "Take points that fill a volume, not a plane or a line.",
        )
    residuals_px = uv - lens.project_extended(camera, points_world)
    return CameraFit(
        camera=camera, free=free, covariance=covariance, points_world=points_world, uv=uv,
        used=best.used, distances=problem.distances(residuals_px), residuals_px=residuals_px,
        chi2=best.minimum.cost, dof=2 * int(best.used.sum()) - len(free), sigma_px=sigma_px,
        reference_sigma=reference_sigma, converged=best.minimum.converged, start=best.start.name,
    )  # fmt: skip


def indices_of_wrong(fit: CameraFit) -> Int:
    """Return the indices of outliers, the worst first."""
    wrong = np.flatnonzero(~fit.used)
    return wrong[np.argsort(-fit.distances[wrong])].astype(np.int64)
