"""Foot of a point on a surface, by Newton's method from a start near it.

At a foot the vector to the point is perpendicular to both tangents. Newton's step is that of half
the squared distance; where its matrix is not positive definite (beyond a centre of curvature) the
products of the tangents replace it. Steps that do not reduce the distance are shortened, and a side
of the surface limits the parameters.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.geometry import Float, Points3
from ocmm_core.part_model._spline import BezierSurface, Derivatives, derivatives_at

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
    step: Float = -np.stack(
        [
            (c * gradient[:, 0] - off * gradient[:, 1]) / safe,
            (a * gradient[:, 1] - off * gradient[:, 0]) / safe,
        ],
        axis=1,
    )
    return step


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
