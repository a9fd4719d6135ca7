"""An independent search for least-squares elements: scipy's least_squares from very many starts.

Distances are derived independently from the definition of each shape, without the product's starts,
kernels or solvers. Starts are the truth, available only in a simulation, places around it at
growing distances, and random ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from benchmarks.hard_samples import HardSet
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float

LARGEST = 1e4
"""Ratio of its size to that of the points, beyond which no element exists."""
AROUND = (0.003, 0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 1.0)
"""How far from the truth starts lie, as shares of the sizes and in rad."""
AT_REST = 1e-5
"""Part of the residuals that a step could still remove, below which a minimum is reached."""

SINGULAR = 1e-13
"""Singular value against the greatest below which nothing depends on that direction."""

Terms = Callable[[Float], tuple[Float, Float]]


@dataclass(frozen=True, slots=True)
class Minimum:
    """A minimum.

    Attributes
    ----------
    cost
        mm^2.
    sizes
        mm or rad.
    condition
        Of its Jacobian with columns of length one.
    deviations
        Standard deviations of the sizes where points scatter by one.
    at_rest
        False where the descent came to no end: a lower place exists further on.
    """

    cost: float
    sizes: Float
    condition: float
    deviations: Float
    at_rest: bool


@dataclass(frozen=True, slots=True)
class Reference:
    """Minima, best first, and the least cost of a descent that came to no end in a shape."""

    minima: tuple[Minimum, ...]
    open_cost: float


def reference_of(hard: HardSet, starts: int, around: Sequence[float] = AROUND) -> Reference:
    """Return the minima of a set, from the truth, two starts at each distance, and random ones."""
    rng = np.random.default_rng(len(hard.points))
    flat = hard.shape in (Shape.ELLIPSE, Shape.ROUND_SLOT, Shape.SQUARE_SLOT)
    search = _flat_search if flat else _axis_search
    found: list[Minimum] = []
    open_cost = np.inf
    for minimum in search(hard, starts, rng, around):
        if not minimum.at_rest:
            open_cost = min(open_cost, minimum.cost)
        elif not any(_same(hard.shape, minimum, other) for other in found):
            found.append(minimum)
    return Reference(tuple(sorted(found, key=lambda minimum: minimum.cost)), open_cost)


def _same(shape: Shape, one: Minimum, other: Minimum) -> bool:
    if abs(one.cost - other.cost) > 1e-6 * other.cost + 1e-18:
        return False
    if shape is Shape.CONE:
        # Its size depends on the point of the axis from which a start went down.
        return bool(abs(abs(one.sizes[0]) - abs(other.sizes[0])) < 1e-4)
    return bool(np.allclose(np.sort(one.sizes), np.sort(other.sizes), rtol=1e-3))


def cost_of(fit: Fit, points: Float) -> float:
    """Return the sum of squared distances of the points from a fit, by the distances here."""
    if fit.across.any():
        beside = np.cross(fit.direction, fit.across)
        arms = points - fit.point
        flat = np.stack([arms @ fit.across, arms @ beside], axis=1)
        p = np.array([0.0, 0.0, 0.0, fit.radius, fit.second])
        residuals, _ = _flat_terms(fit.shape, flat, p)
    else:
        sizes = {
            Shape.CYLINDER: [fit.radius],
            Shape.CONE: [fit.half_angle, fit.radius * np.cos(fit.half_angle)],
            Shape.TORUS: [fit.radius, fit.second],
        }[fit.shape]
        frame = _frame(fit.direction)
        p = np.concatenate([np.zeros(5 if fit.shape is Shape.TORUS else 4), sizes])
        residuals, _ = _axis_terms(fit.shape, (points - fit.point) @ frame.T, p)
    return float(residuals @ residuals)


def _axis_search(
    hard: HardSet, starts: int, rng: np.random.Generator, around: Sequence[float]
) -> list[Minimum]:
    points = hard.points
    middle = points.mean(axis=0)
    spread = float(np.sqrt(np.mean(np.sum((points - middle) ** 2, axis=1))))
    axis, place, sizes = hard.rotation[:, 2], hard.place, hard.sizes
    scale = hard.sizes[0] if hard.shape is not Shape.CONE else hard.sizes[1]
    tries: list[tuple[Float, Float, Float]] = [(axis, place, sizes)]
    for far in around:
        for _ in range(2):
            moved = place + far * scale * rng.normal(size=3)
            tries.append(
                (axis + far * rng.normal(size=3), moved, sizes * np.exp(far * rng.normal(size=1)))
            )
    for _ in range(starts):
        far = spread * 10.0 ** rng.uniform(-0.5, 1.0)
        through = middle + far * _unit(rng.normal(size=3))
        direction = _unit(rng.normal(size=3))
        tries.append((direction, through, _sizes_near(hard.shape, points, through, direction, rng)))
    found = []
    for direction, through, own in tries:
        frame = _frame(direction)
        local = (points - through) @ frame.T
        first = np.zeros(5 if hard.shape is Shape.TORUS else 4)
        minimum = _descend(
            partial(_axis_terms, hard.shape, local), np.concatenate([first, own]), len(own)
        )
        if minimum is None:
            continue
        if hard.shape is Shape.TORUS and 0.0 < minimum.sizes[0] <= minimum.sizes[1]:
            # A tube thicker than its ring is a degenerate torus: if it fits better, tori end in it.
            minimum = replace(minimum, at_rest=False)
            if minimum.sizes[1] < LARGEST * spread:
                found.append(minimum)
        elif _possible(hard.shape, minimum.sizes, spread):
            found.append(minimum)
    return found


def _sizes_near(
    shape: Shape, points: Float, through: Float, axis: Float, rng: np.random.Generator
) -> Float:
    """Return sizes with which a random axis passes somewhere near the points."""
    arms = points - through
    heights = arms @ axis
    rho = np.linalg.norm(arms - np.outer(heights, axis), axis=1)
    if shape is Shape.CYLINDER:
        return np.array([rho.mean()])
    if shape is Shape.CONE:
        angle = rng.uniform(-1.5, 1.5)
        return np.array([angle, np.mean(rho * np.cos(angle) - heights * np.sin(angle))])
    ring = rho.mean() * rng.uniform(0.2, 1.5)
    return np.array([ring, np.hypot(rho - ring, heights).mean()])


def _flat_search(
    hard: HardSet, starts: int, rng: np.random.Generator, around: Sequence[float]
) -> list[Minimum]:
    middle = hard.points.mean(axis=0)
    plane = np.linalg.svd(hard.points - middle, full_matrices=True)[2]
    flat = (hard.points - middle) @ plane[:2].T
    spread = float(np.sqrt(np.mean(np.sum(flat**2, axis=1))))
    along, centre = plane[:2] @ hard.rotation[:, 0], plane[:2] @ (hard.place - middle)
    truth = np.array([*centre, np.arctan2(along[1], along[0]), *hard.sizes])
    tries = [truth]
    for far in around:
        for _ in range(2):
            near = truth.copy()
            near[:2] += far * hard.sizes[0] * rng.normal(size=2)
            near[2] += far * rng.normal()
            near[3:] *= np.exp(far * rng.normal(size=2))
            tries.append(near)
    for side, place in ((1.0, 3), (-1.0, 3), (1.0, 4), (-1.0, 4)):
        # Points on a part of an outline may leave the rest of it anywhere.
        longer = truth.copy()
        longer[place] += 2.0 * truth[3]
        turn = truth[2] + (0.0 if place == 3 else 0.5 * np.pi)
        longer[:2] += side * 2.0 * truth[3] * np.array([np.cos(turn), np.sin(turn)])
        tries.append(longer)
    for _ in range(starts):
        turn = rng.uniform(0.0, np.pi)
        half = spread * 10.0 ** rng.uniform(-0.5, 0.7, 2)
        shift = spread * 10.0 ** rng.uniform(-1.0, 0.7) * rng.normal(size=2)
        tries.append(np.array([*shift, turn, max(half), min(half)]))
    found = []
    for start in tries:
        minimum = _descend(partial(_flat_terms, hard.shape, flat), start, 2)
        if minimum is not None and _possible(hard.shape, minimum.sizes, spread):
            found.append(minimum)
    return found


def _possible(shape: Shape, sizes: Float, spread: float) -> bool:
    if shape is Shape.CONE:
        return bool(abs(sizes[0]) < np.deg2rad(89.9) and 0.0 < sizes[1] < LARGEST * spread)
    inside = bool(np.all(sizes > 0.0) and np.all(sizes < LARGEST * spread))
    if shape in (Shape.TORUS, Shape.ROUND_SLOT):
        return inside and bool(sizes[1] < sizes[0])
    return inside


def _descend(terms: Terms, start: Float, sizes: int) -> Minimum | None:
    """Return the minimum reached from a start, or None."""
    with np.errstate(all="ignore"):
        try:
            held = _Held(terms)
            end = least_squares(
                held.residuals, start, jac=held.jacobian, method="lm",
                x_scale="jac", ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=200,
            )  # fmt: skip
        except ValueError:
            return None
    residuals, jacobian = terms(end.x)
    lengths = np.linalg.norm(jacobian, axis=0)
    rest = float(np.linalg.norm(residuals))
    if not np.isfinite(rest) or not np.all(lengths > 0.0):
        return None
    across, singular, _ = np.linalg.svd(jacobian / lengths, full_matrices=False)
    # Gain of one more whole Gauss-Newton step, along any valley.
    across = across[:, singular > SINGULAR * singular[0]]
    at_rest = bool(np.linalg.norm(across.T @ residuals) <= AT_REST * rest + 1e-12)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else np.inf
    inverse = np.linalg.pinv(jacobian / lengths) / lengths[:, None]
    deviations = np.linalg.norm(inverse[-sizes:], axis=1)
    return Minimum(rest**2, end.x[-sizes:].copy(), condition, deviations, at_rest)


class _Held:
    """Residuals and Jacobian in two calls, computed once."""

    def __init__(self, terms: Terms) -> None:
        self._terms = terms
        self._at: Float | None = None
        self._found: tuple[Float, Float] | None = None

    def residuals(self, p: Float) -> Float:
        """Return the residuals (n,)."""
        return self._both(p)[0]

    def jacobian(self, p: Float) -> Float:
        """Return their derivatives (n, k)."""
        return self._both(p)[1]

    def _both(self, p: Float) -> tuple[Float, Float]:
        if self._found is None or self._at is None or not np.array_equal(self._at, p):
            self._at, self._found = p.copy(), self._terms(p)
        return self._found


def _unit(vector: Float) -> Float:
    scaled: Float = vector / np.linalg.norm(vector)
    return scaled


def _frame(direction: Float) -> Float:
    """Return axes (3, 3) by rows, the third along ``direction``."""
    axis = _unit(direction)
    aside = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = _unit(np.cross(aside, axis))
    return np.stack([first, np.cross(axis, first), axis])


def _axis_terms(shape: Shape, local: Float, p: Float) -> tuple[Float, Float]:
    """Return distances (n,) and their derivatives (n, k) by place, lean and sizes."""
    places = 3 if shape is Shape.TORUS else 2
    arms = local.copy()
    arms[:, :places] -= p[:places]
    lean = np.array([p[places], p[places + 1], 1.0])
    length = float(np.linalg.norm(lean))
    axis = lean / length
    leans = (np.eye(3)[:2] - np.outer(axis[:2], axis)) / length
    t = arms @ axis
    out = arms - np.outer(t, axis)
    rho = np.maximum(np.linalg.norm(out, axis=1), 1e-15)
    out = out / rho[:, None]
    by_t = np.column_stack([np.tile(-axis[:places], (len(t), 1)), arms @ leans.T])
    by_rho = np.column_stack([-out[:, :places], -t[:, None] * (out @ leans.T)])
    one = np.ones(len(t))
    if shape is Shape.CYLINDER:
        return rho - p[-1], np.column_stack([by_rho, -one])
    if shape is Shape.CONE:
        c, s = np.cos(p[-2]), np.sin(p[-2])
        return rho * c - t * s - p[-1], np.column_stack(
            [by_rho * c - by_t * s, -rho * s - t * c, -one]
        )
    beyond = rho - p[-2]
    tube = np.maximum(np.hypot(beyond, t), 1e-15)
    u, v = beyond / tube, t / tube
    return tube - p[-1], np.column_stack([u[:, None] * by_rho + v[:, None] * by_t, -u, -one])


def _flat_terms(shape: Shape, points: Float, p: Float) -> tuple[Float, Float]:
    """Return distances (n,) and derivatives (n, 5) by centre, turn and half sizes."""
    c, s = np.cos(p[2]), np.sin(p[2])
    arms = points - p[:2]
    x, y = c * arms[:, 0] + s * arms[:, 1], c * arms[:, 1] - s * arms[:, 0]
    a, b = float(p[3]), float(p[4])
    if shape is Shape.ELLIPSE:
        cosine, sine = _anomaly(np.abs(x), np.abs(y), abs(a), abs(b))
        cosine, sine = np.copysign(cosine, x), np.copysign(sine, y)
        normal = np.stack([abs(b) * cosine, abs(a) * sine])
        normal = normal / np.maximum(np.hypot(*normal), 1e-300)
        away = normal[0] * (x - abs(a) * cosine) + normal[1] * (y - abs(b) * sine)
        by_a, by_b = -normal[0] * cosine, -normal[1] * sine
        if min(a, b) <= 0.0:
            away = np.full_like(x, 1e6 * float(np.abs(points).max()))
    elif shape is Shape.ROUND_SLOT:
        reach = np.maximum(np.abs(x) - (a - b), 0.0)
        length = np.maximum(np.hypot(reach, y), 1e-15)
        away = length - b
        normal = np.stack([np.copysign(reach, x), y]) / length
        by_a = -reach / length
        by_b = reach / length - 1.0
    else:
        over_x, over_y = np.abs(x) - a, np.abs(y) - b
        corner = (over_x > 0.0) & (over_y > 0.0)
        hypot = np.maximum(np.hypot(over_x, over_y), 1e-15)
        first = np.where(corner, over_x / hypot, np.where(over_x > over_y, 1.0, 0.0))
        other = np.where(corner, over_y / hypot, np.where(over_x > over_y, 0.0, 1.0))
        away = np.where(corner, hypot, np.maximum(over_x, over_y))
        normal = np.stack([np.copysign(first, x), np.copysign(other, y)])
        by_a, by_b = -first, -other
    by_turn = normal[0] * y - normal[1] * x
    by_x = -(c * normal[0] - s * normal[1])
    by_y = -(s * normal[0] + c * normal[1])
    return away, np.column_stack([by_x, by_y, by_turn, by_a, by_b])


def _anomaly(x: Float, y: Float, a: float, b: float) -> tuple[Float, Float]:
    """Return cosine and sine of the foot on an ellipse of points in the first quadrant.

    Bisection and Newton's steps on (a x / (t + a^2))^2 + (b y / (t + b^2))^2 = 1.
    """
    if a < b:
        sine, cosine = _anomaly(y, x, b, a)
        return cosine, sine
    y = np.maximum(y, 1e-14 * a)
    low = b * y - b * b
    high = np.hypot(a * x, b * y) - b * b
    low = np.maximum(low, a * x - a * a)
    t = low.copy()
    for _ in range(40):
        u, v = a * x / (t + a * a), b * y / (t + b * b)
        value = u * u + v * v - 1.0
        low, high = np.where(value > 0.0, t, low), np.where(value > 0.0, high, t)
        slope = 2.0 * (u * u / (t + a * a) + v * v / (t + b * b))
        after = t + value / np.maximum(slope, 1e-300)
        after = np.where((after < low) | (after > high), 0.5 * (low + high), after)
        # The distance changes with the square of the remainder.
        if np.all(np.abs(after - t) <= 1e-11 * (t + b * b)):
            t = after
            break
        t = after
    cosine, sine = a * x / (t + a * a), b * y / (t + b * b)
    length = np.hypot(cosine, sine)
    return cosine / length, sine / length
