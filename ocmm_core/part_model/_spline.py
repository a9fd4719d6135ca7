"""Rational B-splines as Bezier patches: places, derivatives, normals and curvatures.

A knot span of a tensor product is one Bezier patch. Its poles are the values of the blossom of the
spline (L. Ramshaw, Blossoming: a connect-the-dots approach to splines, 1987) at the ends of the
span: pole j of degree p is f(a, ..., a, b, ..., b) with b j times. Patches are evaluated by
Bernstein polynomials, and the hull of their poles contains them, on which bounds rely.

Foot of a point, by Newton's method from a start near it. At a foot the vector to the point is
perpendicular to both tangents. Newton's step is that of half the squared distance; where its matrix
is not positive definite (beyond a centre of curvature) the products of the tangents replace it.
Steps that do not reduce the distance are shortened, and a side of the surface limits the
parameters.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from ocmm_core.camera import compiled
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int, Points3
from ocmm_core.part_model._part_model import SplineSurface

_FLAT = 1e-12
"""Length of a tangent, as part of the size of the surface, below which it has no direction."""
_INWARDS = 1e-6
"""Part of the range of a parameter by which a degenerate pole is left to find its normal."""


@dataclass(frozen=True, slots=True, eq=False)
class BezierSurface:
    """Surface as its knot spans."""

    poles: Float
    """(a, b, p + 1, q + 1, 4) of a by b spans: weight times place, mm, and the weight."""
    breaks_u: Float
    breaks_v: Float
    """(a + 1,) and (b + 1,), rising: limits of the spans."""
    closed_u: bool
    closed_v: bool
    """Opposite sides are the same line: the parameter continues from the beginning."""
    size: float
    """mm: diagonal of the box of its poles."""

    @property
    def low(self) -> Float:
        """Return the minimum parameters (2,)."""
        return np.array([self.breaks_u[0], self.breaks_v[0]])

    @property
    def high(self) -> Float:
        """Return the maximum parameters (2,)."""
        return np.array([self.breaks_u[-1], self.breaks_v[-1]])

    @property
    def closed(self) -> tuple[bool, bool]:
        return self.closed_u, self.closed_v


@dataclass(frozen=True, slots=True, eq=False)
class Derivatives:
    """Places (m, 3), mm, of m parameters, and the derivatives by them."""

    at: Float
    u: Float
    v: Float
    uu: Float
    uv: Float
    vv: Float


def bezier_surface(spline: SplineSurface) -> BezierSurface:
    """Return a spline as knot spans; InputError: counts, falling knots, weights not positive."""
    _check(spline)
    weighted = np.concatenate(
        [spline.poles * spline.weights[..., None], spline.weights[..., None]], axis=-1
    )
    breaks_u, by_u, from_u = _spans(spline.knots_u, spline.degree_u)
    breaks_v, by_v, from_v = _spans(spline.knots_v, spline.degree_v)
    rows = from_u[:, None] + np.arange(spline.degree_u + 1)
    columns = from_v[:, None] + np.arange(spline.degree_v + 1)
    own = weighted[rows[:, None, :, None], columns[None, :, None, :]]
    poles = np.einsum("aik,abklc,bjl->abijc", by_u, own, by_v)
    places = spline.poles.reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(places, axis=0)))
    near = 1e-9 * max(size, 1e-9)
    sides = poles[..., :3] / poles[..., 3:]
    closed_u = float(np.abs(sides[0, :, 0] - sides[-1, :, -1]).max()) < near
    closed_v = float(np.abs(sides[:, 0, :, 0] - sides[:, -1, :, -1]).max()) < near
    return BezierSurface(poles, breaks_u, breaks_v, closed_u, closed_v, size)


def derivatives_at(surface: BezierSurface, parameters: Float) -> Derivatives:
    """Return places and derivatives at parameters (m, 2) within the surface's range."""
    a, bernstein_u = _bernstein(surface.breaks_u, surface.poles.shape[2] - 1, parameters[:, 0])
    b, bernstein_v = _bernstein(surface.breaks_v, surface.poles.shape[3] - 1, parameters[:, 1])
    found = _summed(surface.poles[a, b], bernstein_u, bernstein_v)
    weights, places = found[..., 3], found[..., :3]
    w = weights[:, 0, 0, None]
    at = places[:, 0, 0] / w
    wu, wv = weights[:, 1, 0, None], weights[:, 0, 1, None]
    u = (places[:, 1, 0] - wu * at) / w
    v = (places[:, 0, 1] - wv * at) / w
    uu = (places[:, 2, 0] - 2.0 * wu * u - weights[:, 2, 0, None] * at) / w
    vv = (places[:, 0, 2] - 2.0 * wv * v - weights[:, 0, 2, None] * at) / w
    uv = (places[:, 1, 1] - wu * v - wv * u - weights[:, 1, 1, None] * at) / w
    return Derivatives(at, u, v, uu, uv, vv)


def places_at(surface: BezierSurface, parameters: Float) -> Float:
    """Return places (m, 3), mm, at parameters (m, 2)."""
    a, bernstein_u = _bernstein(surface.breaks_u, surface.poles.shape[2] - 1, parameters[:, 0], 0)
    b, bernstein_v = _bernstein(surface.breaks_v, surface.poles.shape[3] - 1, parameters[:, 1], 0)
    found = _summed(surface.poles[a, b], bernstein_u, bernstein_v)[:, 0, 0]
    return found[:, :3] / found[:, 3:]


def normals_at(surface: BezierSurface, parameters: Float) -> Float:
    """Return unit normals (m, 3) along du x dv; at a collapsed side (pole) that beside it."""
    found = derivatives_at(surface, parameters)
    normals = np.cross(found.u, found.v)
    lengths = np.linalg.norm(normals, axis=1)
    flat = lengths <= _FLAT * surface.size * (
        np.linalg.norm(found.u, axis=1) + np.linalg.norm(found.v, axis=1)
    )
    if np.any(flat):
        middle = 0.5 * (surface.low + surface.high)
        inwards = parameters[flat] + _INWARDS * (middle - parameters[flat])
        beside = derivatives_at(surface, inwards)
        normals[flat] = np.cross(beside.u, beside.v)
        lengths[flat] = np.linalg.norm(normals[flat], axis=1)
    units: Float = normals / np.maximum(lengths, 1e-300)[:, None]
    return units


def curvatures_at(surface: BezierSurface, parameters: Float, normals: Float) -> Float:
    """Return curvatures (m, 2), 1/mm, positive bending away; `normals` (m, 3) to the viewer."""
    found = derivatives_at(surface, parameters)
    e, f, g = (
        np.sum(first * second, axis=1)
        for first, second in ((found.u, found.u), (found.u, found.v), (found.v, found.v))
    )
    # The surface bends away from the normal where its second derivatives point against it.
    low, mixed, high = (
        -np.sum(second * normals, axis=1) for second in (found.uu, found.uv, found.vv)
    )
    area = e * g - f * f
    safe = np.where(area > 0.0, area, np.inf)
    mean = (e * high - 2.0 * f * mixed + g * low) / (2.0 * safe)
    gauss = (low * high - mixed * mixed) / safe
    root = np.sqrt(np.maximum(mean * mean - gauss, 0.0))
    return np.stack([mean - root, mean + root], axis=1)


def _check(spline: SplineSurface) -> None:
    poles = spline.poles
    wrong = ""
    if poles.ndim != 3 or poles.shape[2] != 3 or spline.weights.shape != poles.shape[:2]:
        wrong = "poles and weights do not belong together"
    elif not (np.all(np.isfinite(poles)) and np.all(spline.weights > 0.0)):
        wrong = "a pole is not finite, or a weight is not positive"
    else:
        for knots, degree, count in (
            (spline.knots_u, spline.degree_u, poles.shape[0]),
            (spline.knots_v, spline.degree_v, poles.shape[1]),
        ):
            if not 1 <= degree < count or knots.shape != (count + degree + 1,):
                wrong = "poles, knots and degree do not belong together"
            elif not np.all(np.diff(knots) >= 0.0) or not knots[count] > knots[degree]:
                wrong = "the knots do not rise"
    if wrong:
        raise InputError(
            "model.spline",
            f"A surface of the model is no rational B-spline: {wrong}.",
            "Read the model again.",
        )


def _spans(knots: Float, degree: int) -> tuple[Float, Float, Int]:
    """Return breaks (k + 1,), pole matrices (k, p + 1, p + 1) and the first pole of each span."""
    # Knots before and after the range belong to surfaces that are not clamped at their ends.
    rising = np.flatnonzero(np.diff(knots) > 0.0)
    spans = rising[(rising >= degree) & (rising < len(knots) - degree - 1)]
    breaks = np.append(knots[spans], knots[spans[-1] + 1])
    found = np.empty((len(spans), degree + 1, degree + 1))
    to_bezier(np.ascontiguousarray(knots), degree, spans, found)
    return breaks, found, spans - degree


def _summed(poles: Float, by_u: Float, by_v: Float) -> Float:
    """Return poles by polynomials, (m, a, b, 4); matrix products take half the time of one sum."""
    m, p, q, _ = poles.shape
    rows = (by_u @ poles.reshape(m, p, 4 * q)).reshape(m, by_u.shape[1], q, 4)
    return by_v[:, None] @ rows


def _bernstein(breaks: Float, degree: int, parameters: Float, orders: int = 2) -> tuple[Int, Float]:
    """Return the span of each parameter, and derivatives of polynomials (m, orders + 1, p + 1)."""
    spans = np.clip(np.searchsorted(breaks, parameters, side="right") - 1, 0, len(breaks) - 2)
    width = breaks[spans + 1] - breaks[spans]
    share = (parameters - breaks[spans]) / width
    found = np.zeros((len(parameters), orders + 1, degree + 1))
    found[:, 0] = _polynomials(share, degree)
    for order in range(1, orders + 1):
        if degree < order:
            break
        lower = _polynomials(share, degree - order)
        for _ in range(order):
            # d b(i, p) = p (b(i - 1, p - 1) - b(i, p - 1))
            wider = np.zeros((len(share), lower.shape[1] + 1))
            wider[:, 1:] += lower
            wider[:, :-1] -= lower
            lower = wider * (wider.shape[1] - 1) / width[:, None]
        found[:, order] = lower
    return spans, found


def _polynomials(share: Float, degree: int) -> Float:
    counts = np.array([comb(degree, i) for i in range(degree + 1)], dtype=np.float64)
    return counts * _powers(share, degree) * _powers(1.0 - share, degree)[:, ::-1]


def _powers(base: Float, most: int) -> Float:
    """Return powers 0 to ``most`` of numbers (m,), (m, most + 1)."""
    found = np.ones((len(base), most + 1))
    for power in range(1, most + 1):
        np.multiply(found[:, power - 1], base, out=found[:, power])
    return found


_STEPS = 60


_SETTLED = 1e-9
"""Step, as part of the size of the surface, below which a foot is converged.

The remaining error is the square of Newton's step, and that of the distance the square of that."""


Bool = np.ndarray[tuple[int], np.dtype[np.bool_]]


def feet_from(surface: BezierSurface, points: Points3, start: Float) -> tuple[Float, Float]:
    """Return parameters (m, 2) and places (m, 3) of feet near a start (m, 2)."""
    low, high = surface.low, surface.high
    span = high - low
    parameters = start.copy()
    now = derivatives_at(surface, parameters)
    squares = np.sum((now.at - points) ** 2, axis=1)
    places = now.at.copy()
    moving = np.arange(len(points))
    damping = np.zeros(len(points))
    for _ in range(_STEPS):
        if not len(moving):
            break
        own = parameters[moving]
        step = _step(now, points[moving], own, damping[moving], surface)
        # No step exceeds a quarter of the range: where tangents are short, Newton would jump.
        longest = np.max(np.abs(step) / (0.25 * span), axis=1)
        step = step / np.maximum(longest, 1.0)[:, None]
        ahead = _within(surface, own + step)
        then = derivatives_at(surface, ahead)
        square = np.sum((then.at - points[moving]) ** 2, axis=1)
        moved = np.linalg.norm(then.at - now.at, axis=1)
        done = moved <= _SETTLED * max(surface.size, 1.0)
        # Rounding of the squares hides steps of some nanometres.
        better = square <= squares[moving] * (1.0 + 1e-13) + 1e-26
        tiny = np.max(np.abs(step) / span, axis=1) < 1e-12
        rows = moving[better]
        parameters[rows], squares[rows], places[rows] = (
            ahead[better], square[better], then.at[better]
        )  # fmt: skip
        damping[rows] = np.where(damping[rows] < 1e-3, 0.0, 0.1 * damping[rows])
        worse = moving[~better]
        damping[worse] = np.maximum(4.0 * damping[worse], 1e-2)
        keep = ~(done & better) & ~tiny
        now = _chosen(then, now, better, keep)
        moving = moving[keep]
    return parameters, places


def _chosen(then: Derivatives, now: Derivatives, better: Bool, keep: Bool) -> Derivatives:
    pick = better[:, None]
    return Derivatives(
        *(
            np.where(pick, getattr(then, name), getattr(now, name))[keep]
            for name in ("at", "u", "v", "uu", "uv", "vv")
        )
    )


def _step(
    now: Derivatives, points: Points3, parameters: Float, damping: Float, surface: BezierSurface
) -> Float:
    arms = now.at - points
    gradient = np.stack([np.sum(arms * now.u, axis=1), np.sum(arms * now.v, axis=1)], axis=1)
    uu, uv, vv = (
        np.sum(first * second, axis=1)
        for first, second in ((now.u, now.u), (now.u, now.v), (now.v, now.v))
    )
    a = uu + np.sum(arms * now.uu, axis=1)
    b = uv + np.sum(arms * now.uv, axis=1)
    c = vv + np.sum(arms * now.vv, axis=1)
    trusted = (a > 0.05 * uu) & (c > 0.05 * vv) & (a * c - b * b > 0.01 * (uu * vv - uv * uv))
    a, b, c = np.where(trusted, a, uu), np.where(trusted, b, uv), np.where(trusted, c, vv)
    tiny = 1e-300 + 1e-14 * (a + c)
    a, c = a * (1.0 + damping) + tiny, c * (1.0 + damping) + tiny
    # A parameter limited by a side of the surface moves along that side only.
    for axis in range(2):
        if surface.closed[axis]:
            continue
        at, g = parameters[:, axis], gradient[:, axis]
        held = ((at <= surface.low[axis]) & (g > 0.0)) | ((at >= surface.high[axis]) & (g < 0.0))
        gradient[held, axis] = 0.0
        b = np.where(held, 0.0, b)
    determinant = a * c - b * b
    safe = np.where(determinant > 0.0, determinant, a * c)
    off = np.where(determinant > 0.0, b, 0.0)
    return -np.stack(
        [
            (c * gradient[:, 0] - off * gradient[:, 1]) / safe,
            (a * gradient[:, 1] - off * gradient[:, 0]) / safe,
        ],
        axis=1,
    )


def _within(surface: BezierSurface, parameters: Float) -> Float:
    low, high = surface.low, surface.high
    found = parameters.copy()
    for axis, closed in enumerate(surface.closed):
        if closed:
            span = high[axis] - low[axis]
            found[:, axis] = low[axis] + np.mod(found[:, axis] - low[axis], span)
        else:
            found[:, axis] = np.clip(found[:, axis], low[axis], high[axis])
    return found


@compiled()
def to_bezier(knots: Float, degree: int, spans: Int, found: Float) -> None:
    """Fill in ``found`` (k, p + 1, p + 1): weights of the p + 1 spline poles for each span pole.

    ``spans`` (k,) is the first knot of each. Pole j is the blossom f(a, ..., a, b, ..., b) with the
    end b of the span j times: de Boor's scheme with a separate argument in each step, the first j
    of them b. Row j of ``values`` is a pole as weights of the poles; the last row is the result.
    """
    values = np.empty((degree + 1, degree + 1))
    for s in range(len(spans)):
        span = spans[s]
        for pole in range(degree + 1):
            values[:] = 0.0
            for j in range(degree + 1):
                values[j, j] = 1.0
            for step in range(1, degree + 1):
                argument = knots[span + 1] if step <= pole else knots[span]
                for j in range(degree, step - 1, -1):
                    low, high = knots[j + span - degree], knots[j + 1 + span - step]
                    share = (argument - low) / (high - low)
                    for i in range(degree + 1):
                        values[j, i] = (1.0 - share) * values[j - 1, i] + share * values[j, i]
            found[s, pole] = values[degree]
