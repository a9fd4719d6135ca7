"""Test values without limits: pure functions of points and lengths, and the U of a measuring task.

Uncertainty from a calibrated workpiece (after ISO 15530-3):
x_i are results of one characteristic, over clamping, operators, shifts and temperatures: b =
mean(x) - x_cal, u_p = s(x), u_cal = U_cal / 2, u_b = |T - 20| u_alpha L, and U = 2 sqrt(u_cal^2 +
u_p^2 + u_w^2 + u_b^2) of a result corrected by b. For uncorrected results |b| is added. U holds for
similar parts only: see `dissimilar`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import msgspec
import numpy as np

from ocmm_core.acceptance._procedure import PartTest
from ocmm_core.calibration.verification import fit_sphere
from ocmm_core.errors import InputError, MeasuringError
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
    return SpatValues(float(away.max()), 2.0 * float(np.sqrt(np.sum(away**2) / (len(points) - 1))))


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


LEAST_CYCLES, LEAST_RESULTS = 10, 20
_USUAL = PartTest(
    cycles=LEAST_CYCLES, results=LEAST_RESULTS, large=250.0, large_share=0.10, small=25.0,
    angle_deg=5.0,
)  # fmt: skip


class PartTask(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The measuring task; a U of the study holds for similar tasks."""

    dimension: float
    """mm."""
    angle_deg: float = 0.0
    points: int
    strategy: str
    stylus: str
    material: str
    clamping: str
    """`strategy`, `stylus`, `material`, `clamping`: texts, compared exactly but without case."""


@dataclass(frozen=True, slots=True)
class PartUncertainty:
    """Result of a study of one characteristic; mm."""

    bias: float
    scatter: float
    """`bias`, `scatter`: mean minus certified value, and s of the results."""
    u_cal: float
    u_workpiece: float
    u_expansion: float
    """`u_cal`, `u_workpiece`, `u_expansion`: of certificate, workpieces and expansion."""
    expanded: float
    """U (k = 2) of a bias-corrected result."""
    expanded_uncorrected: float
    """U + |b|, of an uncorrected result."""
    normalized: float | None
    """E_n = |b| / sqrt(U_model^2 + U_cal^2); None without a U of the model."""
    results: int


def part_uncertainty(
    results: Sequence[float],
    certified: float,
    expanded_cal: float,
    *,
    u_workpiece: float = 0.0,
    temperature_c: float = 20.0,
    u_expansion: float = 0.0,
    expanded_model: float | None = None,
) -> PartUncertainty:
    """Return the uncertainty from repeated results of a calibrated part.

    Parameters
    ----------
    results
        mm.
    certified, expanded_cal
        Value and U (k = 2) of the certificate, mm.
    u_workpiece
        Standard uncertainty from the workpieces' form, roughness and spread of expansion, mm.
    temperature_c, u_expansion
        Temperature of use, degrees Celsius; standard uncertainty of the expansion, 1/K.
    expanded_model
        U stated by OCMM for the characteristic, mm.

    Raises
    ------
    InputError
        Fewer than two results, or a number that is not finite.
    """
    values = np.asarray(results, dtype=np.float64)
    if len(values) < 2 or not np.all(np.isfinite(values)):
        raise InputError(
            "acceptance.part_results",
            f"A study of a calibrated part has {len(values)} usable results.",
            f"Give {LEAST_RESULTS} results from {LEAST_CYCLES} cycles.",
        )
    bias = float(values.mean()) - certified
    scatter = float(values.std(ddof=1))
    u_cal = 0.5 * expanded_cal
    u_b = abs(temperature_c - 20.0) * u_expansion * abs(certified)
    expanded = 2.0 * math.sqrt(u_cal**2 + scatter**2 + u_workpiece**2 + u_b**2)
    normalized = None
    if expanded_model is not None:
        normalized = abs(bias) / math.hypot(expanded_model, expanded_cal)
    return PartUncertainty(
        bias, scatter, u_cal, u_workpiece, u_b, expanded, expanded + abs(bias), normalized,
        len(values),
    )  # fmt: skip


def dissimilar(studied: PartTask, wanted: PartTask, numbers: PartTest = _USUAL) -> str:
    """Return why the U of a study does not hold for another task; empty if it does."""
    large = studied.dimension > numbers.large
    allowed = numbers.large_share * studied.dimension if large else numbers.small
    off = abs(wanted.dimension - studied.dimension)
    if off > allowed:
        return (
            f"The dimension is {wanted.dimension:g} mm and the study's {studied.dimension:g} mm: "
            f"they may differ by {allowed:g} mm."
        )
    turned = abs(wanted.angle_deg - studied.angle_deg)
    if turned > numbers.angle_deg:
        return f"The angle differs by {turned:g}°, and {numbers.angle_deg:g}° are allowed."
    if wanted.points != studied.points:
        return f"{wanted.points} points are probed, and the study probed {studied.points}."
    for field in ("strategy", "stylus", "material", "clamping"):
        one, other = getattr(studied, field), getattr(wanted, field)
        if one.strip().casefold() != other.strip().casefold():
            return f"The {field} is '{other}', and the study's '{one}'."
    return ""
