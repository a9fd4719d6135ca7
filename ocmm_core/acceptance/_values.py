"""Test values without limits: pure functions of points and lengths."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ocmm_core.calibration.verification import fit_sphere
from ocmm_core.errors import MeasuringError
from ocmm_core.geometry import Float, Points3

_ROUNDING = 1e-12
"""Relative tolerance for points on the sphere."""


@dataclass(frozen=True, slots=True)
class SphereValues:
    centre: Float
    diameter: float
    """Diameter of the sphere through the ball centres, mm."""
    form: float
    """Range of the distances from the centre, mm (P_Form)."""
    gain: float
    """Standard deviation of the diameter over that of one point."""


@dataclass(frozen=True, slots=True)
class SpatValues:
    """Single point articulation (ASME B89.4.22)."""

    largest: float
    """Distance of the farthest point from the mean, mm."""
    two_sigma: float
    """2 sqrt(sum d^2 / (n - 1)), mm."""
    half_ranges: Float
    """Half of the coordinate ranges (3,), mm."""


@dataclass(frozen=True, slots=True)
class VolumetricValues:
    """Volumetric performance (ASME B89.4.22): deviations D_i = L_i - L_cal of one bar."""

    largest: float
    half_range: float
    two_rms: float
    """`largest`, `half_range`, `two_rms`: max |D|, (max - min) / 2, and 2 sqrt(sum D^2 / n), mm."""


def nest_lengths(nests: Points3) -> Float:
    """Return the distances (n - 1,), mm, of nests (n, 3) from the first one."""
    lengths: Float = np.linalg.norm(nests[1:] - nests[0], axis=1)
    return lengths


def sphere_values(points: Points3) -> SphereValues:
    """Return size and form of a sphere by centres (n, 3), mm (ISO 10360-5); CalibrationError."""
    centre, radius, gain = fit_sphere(points)
    form = float(np.ptp(np.linalg.norm(points - centre, axis=1)))
    return SphereValues(centre, 2.0 * radius, form, gain)


def smallest_ball(points: Points3) -> tuple[Float, float]:
    """Return centre (3,) and radius of the smallest ball around a few points (n, 3).

    It is the circumscribed ball of two, three or four of them; all are tried, which is exact and
    cheap for the five centres of a location test. The circumcentre of p_0 ... p_k is p_0 + A^T x
    with 2 A A^T x = diag(A A^T), A = rows p_i - p_0. Raises MeasuringError without points.
    """
    if not len(points):
        raise MeasuringError("acceptance.no_points", "No centres were measured.", "Probe them.")
    first = points.mean(axis=0)
    at = points - first
    scale = float(np.abs(at).max())
    if len(at) == 1 or scale == 0.0:
        return first, 0.0
    best: tuple[Float, float] | None = None
    for k in (2, 3, 4):
        if k > len(at):
            break
        corners = at[list(combinations(range(len(at)), k))]
        arms = corners[:, 1:] - corners[:, :1]
        gram = arms @ np.swapaxes(arms, 1, 2)
        square = np.diagonal(gram, axis1=1, axis2=2)
        # Three collinear or four coplanar points: fewer of them span the ball.
        usable = np.abs(np.linalg.det(gram)) > 1e-12 * np.prod(square, axis=1)
        if not usable.any():
            continue
        arms, gram, square = arms[usable], gram[usable], square[usable]
        share = np.linalg.solve(2.0 * gram, square[:, :, None])
        centres = corners[usable, 0] + (np.swapaxes(arms, 1, 2) @ share)[:, :, 0]
        radii = np.linalg.norm(centres - corners[usable, 0], axis=1)
        away = np.linalg.norm(at[None] - centres[:, None], axis=2).max(axis=1)
        holds = away <= radii * (1.0 + 1e3 * _ROUNDING) + _ROUNDING * scale
        if holds.any():
            index = int(np.argmin(np.where(holds, radii, np.inf)))
            if best is None or radii[index] < best[1]:
                best = centres[index], float(radii[index])
    if best is None:  # pragma: no cover - the pair that lies farthest apart spans a ball at least
        raise MeasuringError("acceptance.ball", "The centres span no ball.", "Probe them again.")
    return best[0] + first, best[1]


def location_value(centres: Points3) -> float:
    """Return L_Dia, mm: the diameter of the smallest ball around all centres (n, 3)."""
    return 2.0 * smallest_ball(centres)[1]


def repeat_ranges(repeats: Float) -> Float:
    """Return R0, the range of lengths (..., r) measured r times."""
    ranges: Float = np.ptp(repeats, axis=-1)
    return ranges


def spat_values(points: Points3) -> SpatValues:
    """Return the single point articulation of ball centres (n, 3), mm, in one cone."""
    if len(points) < 2:
        raise MeasuringError(
            "acceptance.spat", f"{len(points)} points show no scatter.", "Take ten."
        )
    away = np.linalg.norm(points - points.mean(axis=0), axis=1)
    return SpatValues(
        float(away.max()),
        2.0 * float(np.sqrt(np.sum(away**2) / (len(points) - 1))),
        0.5 * np.ptp(points, axis=0),
    )


def volumetric_values(errors: Float) -> VolumetricValues:
    """Return the volumetric performance of deviations (n,), mm, of one bar."""
    return VolumetricValues(
        float(np.abs(errors).max()),
        0.5 * float(np.ptp(errors)),
        2.0 * float(np.sqrt(np.mean(errors**2))),
    )


def block_length(first: Points3, second: Points3, direction: Float, radius: float) -> float:
    """Return the length of a block probed from both sides, mm.

    `first`, `second`: ball centres (n, 3), mm, on each face; averaged. `direction`: (3,): unit
    vector of the certified direction, from the first face to the second. `radius`: ball radius, mm.
    """
    between = second.mean(axis=0) - first.mean(axis=0)
    return float(between @ direction) - 2.0 * radius


def faces_normal(first: Points3, second: Points3) -> Float:
    """Return the common normal (3,) of two faces, from first to second.

    Ball centres (n, 3), mm, on each face; individual positions and one normal by least squares.
    """
    arms = np.concatenate([first - first.mean(axis=0), second - second.mean(axis=0)])
    normal: Float = np.linalg.svd(arms, full_matrices=False)[2][-1]
    across = second.mean(axis=0) - first.mean(axis=0)
    return normal if float(across @ normal) >= 0.0 else -normal


def flatness(points: Points3) -> float:
    """Return the range of the distances, mm, of points (n, 3) from their plane."""
    at = points - points.mean(axis=0)
    normal = np.linalg.svd(at, full_matrices=False)[2][-1]
    return float(np.ptp(at @ normal))


def thickness(bottom: Points3, top: Points3, radius: float) -> Float:
    """Return distances of ball centres (n, 3) from the bottom plane, mm, less two ball radii."""
    centre = bottom.mean(axis=0)
    normal = np.linalg.svd(bottom - centre, full_matrices=False)[2][-1]
    distances = (top - centre) @ normal
    if distances.mean() < 0.0:
        distances = -distances
    result: Float = distances - 2.0 * radius
    return result
