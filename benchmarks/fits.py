"""Fits of 1,000 points against other packages, in ratios of time, and what the results are worth.

Peers: scikit-image (CircleModel, EllipseModel, LineModelND), pyransac3d (plane, sphere, circle,
cylinder), scipy's least_squares from the true start, which ours do not know, and numpy. Our fits
start cold from points in space, and give the derivatives of the result by every point, from which
its uncertainty follows; none of the peers does. CircleModel and EllipseModel are of the plane: they
get the plane of the points first (from numpy), as somebody who measures in space would do. Times
are medians, taken in turns in one process with one thread. "Error" is the distance from the
orthogonal-distance optimum in what the shape's points determine (centre or axis, and radius), mm.
Run: ``python -m benchmarks.fits``.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import random
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import pyransac3d
from scipy.optimize import least_squares
from skimage.measure import CircleModel, EllipseModel, LineModelND

from ocmm_core.blas import use_one_thread
from ocmm_core.features.fit import fit_shape
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3, rotation_from_vector

N, RADIUS, SECOND, HALF_ANGLE, NOISE = 1000, 12.0, 5.0, 0.3, 0.01
ARC = 2.0
"""rad: of circle, ellipse and cylinder; a fit that is not orthogonal shows on a partial arc."""


@dataclass(frozen=True, slots=True)
class Peer:
    """Another way to the same element: a call that returns its point and radius."""

    name: str
    fit: Callable[[], tuple[Float, float]]


def main() -> int:
    """Print the table; return 1 if a peer is faster than ours at no less accuracy."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--rounds", type=int, default=30)
    rounds = parser.parse_args().rounds
    use_one_thread()
    rng = np.random.default_rng(5)
    print(f"{N} points, noise {NOISE} mm, radius {RADIUS} mm; medians of {rounds} rounds")
    print(f"{'shape':<10}{'peer':<36}{'ours us':>9}{'peer us':>10}{'ratio':>8}{'error mm':>11}")
    good = True
    for shape in (
        Shape.LINE, Shape.PLANE, Shape.CIRCLE, Shape.ELLIPSE, Shape.SPHERE, Shape.CYLINDER,
        Shape.CONE, Shape.TORUS,
    ):  # fmt: skip
        points, truth = _sample(shape, rng)
        fit = fit_shape(shape, points)
        for peer in _peers(shape, points, truth):
            times = _in_turns(partial(fit_shape, shape, points), peer.fit, rounds)
            error = _error(shape, fit, *peer.fit())
            ratio = times[1] / times[0]
            good = good and (ratio >= 1.0 or error > 1e-9)
            print(
                f"{shape.value:<10}{peer.name:<36}{times[0]:>9.0f}{times[1]:>10.0f}{ratio:>8.2f}"
                f"{error:>11.1e}"
            )
    print("ratio: peer's time over ours")
    return int(not good)


def _in_turns(
    first: Callable[[], object], second: Callable[[], object], rounds: int
) -> tuple[float, float]:
    """Return the median times of both, us; a slow call gets fewer rounds."""
    taken: tuple[list[float], list[float]] = ([], [])
    first(), second()
    began = time.perf_counter()
    for _ in range(rounds):
        for call, times in zip((first, second), taken, strict=True):
            start = time.perf_counter()
            call()
            times.append(1e6 * (time.perf_counter() - start))
        if time.perf_counter() - began > 5.0:
            break
    return float(np.median(taken[0])), float(np.median(taken[1]))


def _sample(shape: Shape, rng: np.random.Generator) -> tuple[Points3, Float]:
    """Return points (n, 3) somewhere in space, and the true motion's rotation and place, (4, 3)."""
    turn, height = rng.uniform(0.0, ARC, N), rng.uniform(-15.0, 15.0, N)
    flat = np.stack([RADIUS * np.cos(turn), RADIUS * np.sin(turn), np.zeros(N)], axis=1)
    match shape:
        case Shape.LINE:
            points = np.outer(height, [0.0, 0.0, 1.0])
        case Shape.PLANE:
            points = np.stack([height, rng.uniform(-15.0, 15.0, N), np.zeros(N)], axis=1)
        case Shape.ELLIPSE:
            points = flat * [1.0, SECOND / RADIUS, 0.0]
        case Shape.SPHERE:
            up = rng.uniform(0.2, 1.0, N)
            points = flat * np.sqrt(1.0 - up**2)[:, None] + np.outer(RADIUS * up, [0.0, 0.0, 1.0])
        case Shape.CYLINDER:
            points = flat + np.outer(height, [0.0, 0.0, 1.0])
        case Shape.CONE:
            scale = 1.0 + np.tan(HALF_ANGLE) * height / RADIUS
            points = flat * scale[:, None] + np.outer(height, [0.0, 0.0, 1.0])
        case Shape.TORUS:
            tube = rng.uniform(0.0, 2.0 * np.pi, N)
            points = flat * (1.0 + SECOND / RADIUS * np.cos(tube))[:, None]
            points[:, 2] = SECOND * np.sin(tube)
        case _:
            points = flat
    rotation = rotation_from_vector(rng.normal(size=3))
    place = rng.uniform(-300.0, 300.0, 3)
    moved = (points + rng.normal(0.0, NOISE, points.shape)) @ rotation.T + place
    return moved, np.vstack([rotation, place])


def _error(shape: Shape, fit: Fit, point: Float, radius: float) -> float:
    arm = point - fit.point
    if shape in (Shape.LINE, Shape.CYLINDER, Shape.CONE):
        along = float(arm @ fit.direction)
        arm = arm - along * fit.direction
        radius = radius - along * np.tan(fit.half_angle)
    if shape is Shape.PLANE:
        arm = (arm @ fit.direction) * fit.direction
    own = 0.0 if shape in (Shape.LINE, Shape.PLANE) else fit.radius
    return max(float(np.linalg.norm(arm)), float(abs(radius - own)))


def _peers(shape: Shape, points: Points3, truth: Float) -> list[Peer]:
    peers = [Peer("scipy least_squares, from the truth", _by_scipy(shape, points, truth))]
    match shape:
        case Shape.LINE:
            peers = [Peer("scikit-image LineModelND", lambda: _line(points))]
        case Shape.PLANE:
            peers = [Peer("numpy svd", lambda: _plane(points)[:2])]
            peers.append(Peer("pyransac3d Plane", lambda: _ransac_plane(points)))
        case Shape.CIRCLE:
            peers.append(Peer("scikit-image CircleModel in plane", lambda: _circle(points)))
            peers.append(Peer("pyransac3d Circle", lambda: _ransac(pyransac3d.Circle(), points)))
        case Shape.ELLIPSE:
            peers.append(Peer("scikit-image EllipseModel in plane", lambda: _ellipse(points)))
        case Shape.SPHERE:
            peers.append(Peer("pyransac3d Sphere", lambda: _ransac(pyransac3d.Sphere(), points)))
        case Shape.CYLINDER:
            ransac = pyransac3d.Cylinder()
            peers.append(Peer("pyransac3d Cylinder", lambda: _ransac(ransac, points)))
        case _:
            pass
    return peers


def _line(points: Points3) -> tuple[Float, float]:
    model = LineModelND.from_estimate(points)
    return model.origin, 0.0


def _plane(points: Points3) -> tuple[Float, float, Float]:
    centroid = points.mean(axis=0)
    return centroid, 0.0, np.linalg.svd(points - centroid, full_matrices=False)[2]


def _circle(points: Points3) -> tuple[Float, float]:
    centroid, _, axes = _plane(points)
    model = CircleModel.from_estimate((points - centroid) @ axes[:2].T)
    return centroid + np.asarray(model.center) @ axes[:2], float(model.radius)


def _ellipse(points: Points3) -> tuple[Float, float]:
    centroid, _, axes = _plane(points)
    model = EllipseModel.from_estimate((points - centroid) @ axes[:2].T)
    return centroid + np.asarray(model.center) @ axes[:2], float(max(model.axis_lengths))


def _ransac_plane(points: Points3) -> tuple[Float, float]:
    equation, _ = pyransac3d.Plane().fit(points, 3.0 * NOISE)
    normal = np.array(equation[:3])
    return -float(equation[3]) * normal / float(normal @ normal), 0.0


def _ransac(
    model: pyransac3d.Circle | pyransac3d.Sphere | pyransac3d.Cylinder, points: Points3
) -> tuple[Float, float]:
    random.seed(5)
    with contextlib.redirect_stdout(io.StringIO()):
        found = model.fit(points, 3.0 * NOISE)
    if len(found[0]) != 3:
        return np.full(3, np.inf), np.inf
    # A sphere gives centre, radius, points; the others have the axis between.
    return np.asarray(found[0]), float(found[1] if len(found) == 3 else found[2])


def _by_scipy(
    shape: Shape, points: Points3, truth: Float
) -> Callable[[], tuple[Float, float]]:
    rotation, place = truth[:3], truth[3]
    local = (points - place) @ rotation
    sizes = {Shape.TORUS: [RADIUS, SECOND], Shape.CONE: [RADIUS, HALF_ANGLE]}
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, *sizes.get(shape, [RADIUS])])
    if shape is Shape.ELLIPSE:
        start = np.array([0.0, 0.0, 0.0, RADIUS, SECOND, *np.arctan2(local[:, 1], local[:, 0])])
        return lambda: _scipy_ellipse(points)

    def residuals(p: Float) -> Float:
        axis = np.array([np.sin(p[4]), -np.sin(p[3]) * np.cos(p[4]), np.cos(p[3]) * np.cos(p[4])])
        arms = local - p[:3]
        t = arms @ axis
        rho = np.linalg.norm(arms - t[:, None] * axis, axis=1)
        taper = p[6] if shape is Shape.CONE else 0.0
        found: Float = (rho - p[5]) * np.cos(taper) - t * np.sin(taper)
        if shape is Shape.SPHERE:
            found = np.linalg.norm(arms, axis=1) - p[5]
        elif shape is Shape.CIRCLE:
            found = np.concatenate([rho - p[5], t])
        elif shape is Shape.TORUS:
            found = np.hypot(rho - p[5], t) - p[6]
        return found

    def fit() -> tuple[Float, float]:
        p = least_squares(residuals, start, method="trf", x_scale="jac").x
        return place + rotation @ p[:3], float(p[5])

    return fit


def _scipy_ellipse(points: Points3) -> tuple[Float, float]:
    """Return the ellipse by least_squares over the anomaly of every point, from EllipseModel."""
    from scipy.sparse import lil_matrix

    centroid, _, axes = _plane(points)
    flat = (points - centroid) @ axes[:2].T
    model = EllipseModel.from_estimate(flat)
    (x, y), (a, b), turn = model.center, model.axis_lengths, model.theta
    n = len(flat)
    pattern = lil_matrix((2 * n, 5 + n))
    pattern[:, :5] = 1
    rows = np.arange(n)
    pattern[rows, 5 + rows] = 1
    pattern[n + rows, 5 + rows] = 1

    def residuals(p: Float) -> Float:
        c, s = np.cos(p[2]), np.sin(p[2])
        u, v = p[3] * np.cos(p[5:]), p[4] * np.sin(p[5:])
        x_off, y_off = p[0] + c * u - s * v - flat[:, 0], p[1] + s * u + c * v - flat[:, 1]
        return np.concatenate([x_off, y_off])

    c, s = np.cos(turn), np.sin(turn)
    arms = flat - [x, y]
    start = np.arctan2((arms[:, 1] * c - arms[:, 0] * s) / b, (arms[:, 0] * c + arms[:, 1] * s) / a)
    p = least_squares(residuals, np.array([x, y, turn, a, b, *start]), jac_sparsity=pattern).x
    return centroid + p[:2] @ axes[:2], float(max(p[3:5]))


if __name__ == "__main__":
    sys.exit(main())
