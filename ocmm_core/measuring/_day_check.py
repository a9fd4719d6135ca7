"""Noise of the spots of a job against the stated one, camera by camera.

A pose has six numbers and each seen LED gives two per camera, so the mean spots of a touch have
residuals that no pose explains. Their covariance follows from the documents: the pattern of the
sensors, alike for near spots, and geometry of the probe and calibration of the cameras, common to
all touches; white noise follows from the scatter of the frames. The variance of the pattern of each
camera, relative to the stated one, is an unbiased quadratic estimate (C. R. Rao, J. Multivariate
Analysis 1 (1971) 257). A ratio probably above one widens the pattern of that camera in every U of
the job, by Student's factor for its degrees of freedom; one certainly above it is reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ocmm_core.camera import Rig, project, projection_jacobians
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring._factors import root_of
from ocmm_core.measuring._point import MeasuredPoint
from ocmm_core.tracking import ProbeBody, solve, spot_sigma_px

MOST_TOUCHES = 24
"""Touches used, spread over the job: more hardly sharpen the ratio, and cost their cube."""

LEAST_TOUCHES = 4

_INSIDE, _PROBABLE, _CERTAIN = 0.95, 0.84, 0.999
"""Probabilities of the stated interval, of a ratio that widens U, and of a reported one."""

_FINE = 0.1
"""Variance of the pattern in what neighbouring touches differ by, which has little weight."""

_PLAIN = 1.15
"""Smaller ratios are within the digits of a stated noise, and pixels respond unequally."""

_POSE = 6
_CAMERA_NUMBERS = 14


@dataclass(frozen=True, slots=True)
class NoiseRatio:
    """Noise of the spots of one camera, relative to the stated one."""

    camera: str
    ratio: float
    low: float
    high: float
    """`ratio`, `low`, `high`: Estimate and 95 % interval, of standard deviations."""
    exceeds: bool
    """Certainly above one."""
    widens: float = 1.0
    """Factor of the stated noise in U."""

    @property
    def message(self) -> str:
        """Return it in a sentence with its remedy."""
        return (
            f"Spots of camera '{self.camera}' scatter {self.ratio:.2f} times as much as stated "
            f"({self.low:.2f} to {self.high:.2f}): U is widened. Clean lenses and LEDs, shade "
            "other lights, and verify the cameras."
        )


@dataclass(frozen=True, slots=True)
class DayCheck:
    """Comparison of the noise of a job with the stated one."""

    cameras: tuple[NoiseRatio, ...] = ()
    """Empty with too few touches."""
    touches: int = 0
    """Number used."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Return a sentence for every camera that exceeds its stated noise."""
        return tuple(item.message for item in self.cameras if item.exceeds)

    def widened(self, rig: Rig) -> Rig:
        """Return the rig with the noise of this job; the same object if it is as stated."""
        ratios = tuple(item.widens for item in self.cameras)
        return replace(rig, noise_ratios=ratios) if max(ratios, default=1.0) > 1.0 else rig


def touches_checked(count: int) -> Int:
    """Return the indices of the touches that `check_noise` uses, of ``count``.

    They change in steps of a quarter of their number, so that a result is valid for some touches.
    """
    if count < LEAST_TOUCHES:
        return np.zeros(0, dtype=np.int64)
    step = max(LEAST_TOUCHES, 1 << max(count.bit_length() - 3, 0))
    known = count // step * step
    return np.unique(np.linspace(0, known - 1, min(known, MOST_TOUCHES)).astype(np.int64))


def check_noise(points: Sequence[MeasuredPoint], rig: Rig, body: ProbeBody) -> DayCheck:
    """Return the noise of some touches, as `touches_checked` selects, against the stated one."""
    leds = 3 * len(body.leds_probe)
    roots = root_of(body.geometry_covariance[:leds, :leds]), root_of(rig.parameter_covariance)
    seen = (_touch(point, rig, body, *roots) for point in points)
    touches = [one for one in seen if len(one.rest)]
    if len(touches) < LEAST_TOUCHES:
        return DayCheck()
    rest = np.concatenate([one.rest for one in touches])
    shared = np.concatenate([one.shared for one in touches])
    stated = _of_cameras(touches, rig)
    used = [c for c, one in enumerate(stated) if np.any(one)]
    if not used:
        return DayCheck()
    fixed = shared @ shared.T + np.diag(
        np.concatenate([np.full(len(o.rest), o.white) for o in touches])
    )
    total = fixed + sum(stated)
    # Spots of neighbouring touches differ by less than the model of the pattern is accurate to.
    weight = np.linalg.inv(total + _FINE * rig.noise.pattern_px**2 * np.eye(len(rest)))
    forms = [weight @ stated[c] @ weight for c in used]
    normal = np.linalg.inv([[float(np.sum(form * stated[c])) for c in used] for form in forms])
    squares = normal @ [rest @ form @ rest - float(np.sum(form * fixed)) for form in forms]
    spread = [form @ total for form in forms]
    variances = 2.0 * np.array([[float(np.sum(a * b.T)) for b in spread] for a in spread])
    doubt = np.diagonal(normal @ variances @ normal.T)
    found = [NoiseRatio(camera.name, 1.0, 0.0, np.inf, exceeds=False) for camera in rig.cameras]
    for c, square, variance in zip(used, np.maximum(squares, 0.0), doubt, strict=True):
        found[c] = _ratio(rig.cameras[c].name, float(square), float(variance))
    return DayCheck(tuple(found), len(touches))


def _ratio(camera: str, square: float, variance: float) -> NoiseRatio:
    """Return the ratio of a camera; ``variance`` of ``square`` holds for noise as stated."""
    degrees = 2.0 / variance
    low, high = (
        float(np.sqrt(square * degrees / scipy.special.chdtri(degrees, tail)))
        for tail in (0.5 * (1.0 - _INSIDE), 0.5 * (1.0 + _INSIDE))
    )
    ratio, chi2 = float(np.sqrt(square)), square * degrees
    beyond = chi2 > scipy.special.chdtri(degrees, 1.0 - _CERTAIN) and ratio > _PLAIN
    wider = chi2 > scipy.special.chdtri(degrees, 1.0 - _PROBABLE)
    factor = float(scipy.special.stdtrit(degrees, float(scipy.special.ndtr(2.0))))
    widens = 0.5 * ratio * factor if wider else 1.0
    return NoiseRatio(camera, ratio, low, high, bool(beyond), widens)


@dataclass(frozen=True, slots=True)
class _Touch:
    """Residuals of a touch outside the pose; s seen spots, r = 2 s - 6 residuals."""

    rest: Float
    """(r,), px."""
    shared: Float
    """(r, q), px: by common quantities, one standard deviation a column."""
    basis: Float
    """(2 s, r): directions of the residuals."""
    camera: Int
    uv: Float
    """`camera`, `uv`: (s,) and (s, 2), px: of the spots."""
    white: float
    """Variance of a mean spot by the scatter of the frames, px^2."""


def _touch(
    point: MeasuredPoint, rig: Rig, body: ProbeBody, geometry: Float, calibration: Float
) -> _Touch:
    batch = solve(point.spots[None], rig, body, spot_sigma_px(rig))
    rotation, origin = batch.rotation_world_from_probe[0], batch.origin_world[0]
    seen = np.isfinite(point.spots).all(axis=2)
    camera = np.nonzero(seen)[0]
    if not np.all(np.isfinite(origin)) or rig.per_spot * len(camera) <= _POSE:
        none = np.zeros((0, 0))
        return _Touch(none, none, none, camera, point.spots[seen], 0.0)
    arms = body.leds_probe @ rotation.T
    cameras, leds = seen.shape
    residuals, by_pose = np.zeros((cameras, leds, 2)), np.zeros((cameras, leds, 2, _POSE))
    by_leds = np.zeros((cameras, leds, 2, leds, 3))
    by_cameras = np.zeros((cameras, leds, 2, cameras, _CAMERA_NUMBERS))
    every = np.arange(leds)
    for c, model in enumerate(rig.cameras):
        d_point, by_cameras[c, :, :, c] = projection_jacobians(model, arms + origin)
        residuals[c] = point.spots[c] - project(model, arms + origin)
        by_pose[c] = np.concatenate([np.cross(arms[:, None], d_point), d_point], axis=2)
        by_leds[c, every, :, every] = d_point @ rotation
    rows = 2 * len(camera)
    if rig.markers is None:
        basis = np.linalg.qr(by_pose[seen].reshape(rows, _POSE), mode="complete")[0][:, _POSE:]
    else:
        moved = _marker_moves(by_pose[seen][..., 3:], np.nonzero(seen)[1])
        of_pose = moved.T @ by_pose[seen].reshape(rows, _POSE)
        basis = moved @ np.linalg.qr(of_pose, mode="complete")[0][:, _POSE:]
    of_geometry = by_leds[seen].reshape(rows, -1) @ geometry
    of_cameras = by_cameras[seen].reshape(rows, -1) @ calibration
    shared = basis.T @ np.hstack([of_geometry, of_cameras])
    rest = basis.T @ residuals[seen].ravel()
    scatter = point.chi2_per_dof * spot_sigma_px(rig) ** 2 - rig.noise.pattern_px**2
    white = max(scatter, 0.0) / point.n_frames
    return _Touch(rest, shared, basis, camera, point.spots[seen], white)


def _marker_moves(by_place: Float, led: Int) -> Float:
    """Return orthonormal changes (2 s, 3 m) of the spots by moving each of m markers alone.

    ``by_place`` (s, 2, 3): derivative of each spot by its marker, ``led`` (s,) the marker.
    """
    moves = []
    for one in np.unique(led):
        mine = np.where((led == one)[:, None, None], by_place, 0.0).reshape(-1, 3)
        moves.append(np.linalg.qr(mine)[0])
    return np.hstack(moves)


def _of_cameras(touches: Sequence[_Touch], rig: Rig) -> list[Float]:
    """Return the stated covariance of all residuals due to the spots of each camera."""
    camera = np.concatenate([one.camera for one in touches])
    uv = np.concatenate([one.uv for one in touches])
    apart = np.sum((uv[:, None] - uv) ** 2, axis=2)
    alike = rig.noise.pattern_px**2 * np.exp(-0.5 * apart / rig.noise.pattern_length_px**2)
    basis = scipy.linalg.block_diag(*(one.basis for one in touches))
    along = basis.reshape(len(uv), 2, -1)
    found = []
    for c in range(len(rig.cameras)):
        mine = np.flatnonzero(camera == c)
        of = alike[np.ix_(mine, mine)]
        found.append(sum(along[mine, a].T @ of @ along[mine, a] for a in range(2)))
    return found
