"""Smallest zones of outlines for the tests: by exhaustion, in 50 digits, by linear programs."""

from __future__ import annotations

from itertools import combinations

import mpmath as mp
import numpy as np
from scipy.optimize import linprog

from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3, perpendicular_pair

_STEP = 1e-6
"""Step of the differences."""


def narrowest_rectangle(sides: list[Float]) -> float:
    """Return the width of the smallest zone about a rectangle near the axes.

    Every side moves independently, so that the widest band decides: the turn that minimises
    the greatest of all differences across their side lies at the equality of two of these.

    Parameters
    ----------
    sides
        Points (n, 2) of every side; the first two run along x, the others along y.
    """
    waves = []
    for number, points in enumerate(sides):
        for i, j in combinations(range(len(points)), 2):
            x, y = points[i] - points[j]
            # Across a side at turn t: y cos t - x sin t, or x cos t + y sin t.
            wave = [y, -x] if number < 2 else [x, y]
            waves += [wave, [-wave[0], -wave[1]]]
    cosine, sine = np.array(waves).T
    first, second = np.triu_indices(len(waves), 1)
    turn = np.arctan2(cosine[second] - cosine[first], sine[first] - sine[second])
    turn = (turn + 0.5 * np.pi) % np.pi - 0.5 * np.pi
    turn = turn[np.abs(turn) < 0.3]
    widths = np.outer(np.cos(turn), cosine) + np.outer(np.sin(turn), sine)
    return float(widths.max(axis=1).min())


def even_zone(shape: Shape, points: Float, start: Float, rounds: int = 60) -> float:
    """Return the greatest distance that a sequence of linear programs reaches from ``start``."""
    p, n = start.copy(), len(points)
    best, trust = float(np.abs(_distances(shape, points, p)).max()), 0.1
    for _ in range(rounds):
        found = _distances(shape, points, p)
        jacobian = np.stack([
            (_distances(shape, points, p + step) - _distances(shape, points, p - step))
            / (2.0 * _STEP)
            for step in _STEP * np.eye(5)
        ], axis=1)  # fmt: skip
        ones = np.ones((n, 1))
        answer = linprog(
            [0.0] * 5 + [1.0], np.block([[jacobian, -ones], [-jacobian, -ones]]),
            np.concatenate([-found, found]), bounds=[(-trust, trust)] * 5 + [(None, None)],
            method="highs",
        )  # fmt: skip
        moved = p + np.asarray(answer.x)[:5]
        half = float(np.abs(_distances(shape, points, moved)).max())
        if half < best:
            p, best = moved, half
        else:
            trust *= 0.25
        if trust < 1e-12:
            break
    return best


def _distances(shape: Shape, points: Float, p: Float) -> Float:
    c, s = np.cos(p[2]), np.sin(p[2])
    x, y = ((points - p[:2]) @ np.array([[c, -s], [s, c]])).T
    a, b = p[3:]
    if shape is Shape.ROUND_SLOT:
        along = np.clip(x, b - a, a - b)
        return np.asarray(np.hypot(x - along, y) - b)
    if shape is not Shape.ELLIPSE:
        over_x, over_y = np.abs(x) - a, np.abs(y) - b
        outside = np.hypot(np.maximum(over_x, 0.0), np.maximum(over_y, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(over_x, over_y), 0.0))
    turn = np.arctan2(a * y, b * x)
    for _ in range(8):
        sine, cosine = np.sin(turn), np.cos(turn)
        gap = a * x * sine - b * y * cosine - (a * a - b * b) * sine * cosine
        bend = a * x * cosine + b * y * sine - (a * a - b * b) * np.cos(2.0 * turn)
        turn = turn - gap / bend
    sine, cosine = np.sin(turn), np.cos(turn)
    inner = b * cosine * (x - a * cosine) + a * sine * (y - b * sine)
    return np.asarray(inner / np.hypot(b * cosine, a * sine))


def ellipse_in_fifty_digits(
    contacts: Float, above: list[bool], guess: Float
) -> tuple[Float, float]:
    """Return x y turn a b and the greatest distance for six contacts (6, 2).

    Every foot is a separate unknown.
    """
    with mp.workdps(50):
        places = [[mp.mpf(float(value)) for value in row] for row in contacts]

        def equations(*unknown: mp.mpf) -> list[mp.mpf]:
            x, y, turn, a, b, half, *feet = unknown
            gaps = []
            for (px, py), outside, foot in zip(places, above, feet, strict=True):
                c, s = mp.cos(turn), mp.sin(turn)
                arm = [c * (px - x) + s * (py - y), c * (py - y) - s * (px - x)]
                normal = [b * mp.cos(foot), a * mp.sin(foot)]
                scale = (half if outside else -half) / mp.hypot(*normal)
                gaps.append(arm[0] - a * mp.cos(foot) - scale * normal[0])
                gaps.append(arm[1] - b * mp.sin(foot) - scale * normal[1])
            return gaps

        x, y, turn, a, b, _ = guess
        c, s = np.cos(turn), np.sin(turn)
        local = (contacts - [x, y]) @ np.array([[c, -s], [s, c]])
        feet = np.arctan2(a * local[:, 1], b * local[:, 0])
        start = [mp.mpf(float(value)) for value in (*guess, *feet)]
        found = mp.findroot(equations, start, tol=mp.mpf(10) ** -80, maxsteps=40)
        return np.array([float(value) for value in found[:5]]), float(found[5])


def tube_in_fifty_digits(fit: Fit, contacts: Points3) -> tuple[Float, float]:
    """Return centre and radius (4,) of the circle that is equally far from seven points, and that.

    The circle is the one near ``fit``.
    """
    with mp.workdps(50):
        places = [mp.matrix([mp.mpf(float(value)) for value in row]) for row in contacts]
        axis, origin = mp.matrix(fit.direction.tolist()), mp.matrix(fit.point.tolist())
        first, second = (mp.matrix(v.tolist()) for v in perpendicular_pair(fit.direction))

        def equations(*unknown: mp.mpf) -> list[mp.mpf]:
            u, v, w, a, b, radius, half = unknown
            place = origin + u * first + v * second + w * axis
            lean = axis + a * first + b * second
            lean = lean / mp.norm(lean)
            gaps = []
            for point in places:
                arm = point - place
                along = sum(arm[i] * lean[i] for i in range(3))
                gaps.append(mp.hypot(mp.norm(arm - along * lean) - radius, along) - half)
            return gaps

        start = [mp.mpf(value) for value in (0, 0, 0, 0, 0, fit.radius, 0.5 * fit.form)]
        found = list(mp.findroot(equations, start, tol=mp.mpf(10) ** -80, maxsteps=40))
        place = origin + found[0] * first + found[1] * second + found[2] * axis
        return np.array([*map(float, place), float(found[5])]), 2.0 * float(found[6])
