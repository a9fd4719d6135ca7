"""Fits of 1,000 points against other packages, in ratios of time, and what the results are worth.

Peers: scikit-image (CircleModel, EllipseModel, LineModelND), pyransac3d (plane, sphere, circle,
cylinder), scipy's least_squares and ODR from the true start, which ours do not know, and numpy. Our
fits start cold from points in space, and give the derivatives of the result by every point, from
which its uncertainty follows; none of the peers does, and the time for them counts as ours.
CircleModel and EllipseModel are of the plane: they get the plane of the points first (from numpy),
as somebody who measures in space would do.

Times are process times, the least of many calls taken in turns with one thread. "Error" is the
distance of the peer's result from the orthogonal-distance optimum in what the shape's points
determine (centre or axis, and radius), mm; that ours is this optimum to 1e-8 mm is what
`tests/core/features/test_fit_mpmath.py` checks against 50 digits.

The limit: ours takes no longer than the fastest peer whose error is less than the noise of the
points, whether that peer is as accurate or less. A peer that is further off than a single point
solves another problem (pyransac3d samples, EllipseModel minimises algebraic distances); it is shown
with its ratio and marked, and no limit is taken from it.
Run: ``python -m benchmarks.fits``.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import random
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pyransac3d
from scipy import odr
from scipy.optimize import least_squares
from skimage.measure import CircleModel, EllipseModel, LineModelND

from ocmm_core.blas import use_one_thread
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float, Points3, rotation_from_vector

N, RADIUS, SECOND, HALF_ANGLE, NOISE = 1000, 12.0, 5.0, 0.3, 0.01
ARC = 2.0
"""rad: of circle, ellipse and cylinder; a fit that is not orthogonal shows on a partial arc."""

SECONDS, SLOWEST, LEAST_CALLS = 2.0, 1.0, 20
"""s a pair may take, s after which a peer is not called twice, and the least calls of ours."""


@dataclass(frozen=True, slots=True)
class Peer:
    """Another way to the same element: a call that returns its point and radius."""

    name: str
    fit: Callable[[], tuple[Float, float]]


@dataclass(frozen=True, slots=True)
class Row:
    """A shape and a peer: times, us, and the peer's distance from the optimum, mm."""

    shape: Shape
    peer: str
    ours_us: float
    peer_us: float
    error: float

    @property
    def ratio(self) -> float:
        """Return the peer's time over ours."""
        return self.peer_us / self.ours_us

    @property
    def same(self) -> bool:
        """Whether the peer solves the same problem."""
        return self.error < NOISE


SHAPES = (
    Shape.LINE, Shape.PLANE, Shape.CIRCLE, Shape.ELLIPSE, Shape.SPHERE, Shape.CYLINDER, Shape.CONE,
    Shape.TORUS,
)  # fmt: skip


def rows(rounds: int, shapes: Sequence[Shape] = SHAPES) -> Iterator[Row]:
    """Yield every shape with each of its peers."""
    for shape in shapes:
        # Each shape has its own points, independent of the other selected ones.
        points, truth = sample(shape, np.random.default_rng([5, SHAPES.index(shape)]))
        fit = fit_shape(shape, points)
        for peer in _peers(shape, points, truth):
            ours, theirs, found = _in_turns(partial(fit_shape, shape, points), peer.fit, rounds)
            yield Row(shape, peer.name, ours, theirs, _error(shape, fit, *found))


def main() -> int:
    """Print the table; return 1 if a peer that solves the same problem is faster than ours."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--rounds", type=int, default=200)
    rounds = parser.parse_args().rounds
    use_one_thread()
    print(f"{N} points, noise {NOISE} mm, radius {RADIUS} mm; least of up to {rounds} calls")
    print(f"{'shape':<10}{'peer':<36}{'ours us':>9}{'peer us':>10}{'ratio':>8}{'error mm':>11}")
    slower = []
    for row in rows(rounds):
        if row.same and row.ratio < 1.0:
            slower.append(f"{row.shape.value} than {row.peer}")
        print(
            f"{row.shape.value:<10}{row.peer:<36}{row.ours_us:>9.0f}{row.peer_us:>10.0f}"
            f"{row.ratio:>8.2f}{row.error:>11.1e}{'' if row.same else '  another problem'}"
        )
    print("ratio: peer's time over ours; limit: at least 1 against every peer of the same problem")
    print("slower: " + ", ".join(slower) if slower else "limit kept")
    return int(bool(slower))


def _in_turns(
    ours: Callable[[], object], peer: Callable[[], tuple[Float, float]], rounds: int
) -> tuple[float, float, tuple[Float, float]]:
    """Return the least times of both, us, and the peer's result; a slow peer gets fewer calls."""
    ours()
    times: tuple[list[int], list[int]] = ([], [])
    began = time.perf_counter()
    found = None
    # The first call of each warms up, unless there is time for no other.
    for round_number in range(rounds + 1):
        start = time.process_time_ns()
        ours()
        between = time.process_time_ns()
        found = peer()
        times[0].append(between - start)
        times[1].append(time.process_time_ns() - between)
        if time.perf_counter() - began > SECONDS and round_number >= 1:
            break
        if time.perf_counter() - began > SLOWEST:
            break
    # A single call of ours next to a slow peer is no measure.
    for _ in range(max(0, LEAST_CALLS - len(times[0]))):
        start = time.process_time_ns()
        ours()
        times[0].append(time.process_time_ns() - start)
    assert found is not None
    return 1e-3 * min(times[0]), 1e-3 * min(times[1]), found


def sample(
    shape: Shape, rng: np.random.Generator, n: int = N, arc: float = ARC
) -> tuple[Points3, Float]:
    """Return points (n, 3), mm, somewhere in space, and the true rotation and place, (4, 3).

    Round elements are touched over ``arc``, rad.
    """
    turn, height = rng.uniform(0.0, arc, n), rng.uniform(-15.0, 15.0, n)
    flat = np.stack([RADIUS * np.cos(turn), RADIUS * np.sin(turn), np.zeros(n)], axis=1)
    match shape:
        case Shape.LINE:
            points = np.outer(height, [0.0, 0.0, 1.0])
        case Shape.PLANE:
            points = np.stack([height, rng.uniform(-15.0, 15.0, n), np.zeros(n)], axis=1)
        case Shape.ELLIPSE:
            points = flat * [1.0, SECOND / RADIUS, 0.0]
        case Shape.SPHERE:
            up = rng.uniform(0.2, 1.0, n)
            points = flat * np.sqrt(1.0 - up**2)[:, None] + np.outer(RADIUS * up, [0.0, 0.0, 1.0])
        case Shape.CYLINDER:
            points = flat + np.outer(height, [0.0, 0.0, 1.0])
        case Shape.CONE:
            scale = 1.0 + np.tan(HALF_ANGLE) * height / RADIUS
            points = flat * scale[:, None] + np.outer(height, [0.0, 0.0, 1.0])
        case Shape.TORUS:
            tube = rng.uniform(0.0, 2.0 * np.pi, n)
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
    peers = [Peer("scipy least_squares, from the truth", by_scipy(shape, points, truth))]
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
            peers = [
                Peer("scipy least_squares, from EllipseModel", lambda: _scipy_ellipse(points)),
                Peer("scipy ODR, from EllipseModel", lambda: _odr_ellipse(points)),
                Peer("scikit-image EllipseModel in plane", lambda: _ellipse(points)),
            ]
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


def by_scipy(shape: Shape, points: Points3, truth: Float) -> Callable[[], tuple[Float, float]]:
    """Return least_squares of points and truth of `sample`, started at the truth."""
    rotation, place = truth[:3], truth[3]
    local = (points - place) @ rotation
    sizes = {Shape.TORUS: [RADIUS, SECOND], Shape.CONE: [RADIUS, HALF_ANGLE]}
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, *sizes.get(shape, [RADIUS])])

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
    """Return the ellipse by least_squares over five parameters, feet by Newton's iteration."""
    centroid, axes, flat, start = _algebraic(points)

    def residuals(p: Float) -> Float:
        c, s = np.cos(p[2]), np.sin(p[2])
        x, y = flat[:, 0] - p[0], flat[:, 1] - p[1]
        u, v = c * x + s * y, c * y - s * x
        turn = np.arctan2(v * p[3], u * p[4])
        for _ in range(6):
            cosine, sine = np.cos(turn), np.sin(turn)
            off_u, off_v = u - p[3] * cosine, v - p[4] * sine
            slope = p[3] * sine * off_u - p[4] * cosine * off_v
            bend = (p[3] * sine) ** 2 + (p[4] * cosine) ** 2
            turn -= slope / (bend + p[3] * cosine * off_u + p[4] * sine * off_v)
        cosine, sine = np.cos(turn), np.sin(turn)
        normal = np.stack([p[4] * cosine, p[3] * sine])
        normal /= np.hypot(*normal)
        found: Float = normal[0] * (u - p[3] * cosine) + normal[1] * (v - p[4] * sine)
        return found

    p = least_squares(residuals, start, method="lm", x_scale="jac").x
    return centroid + p[:2] @ axes[:2], float(max(p[3:5]))


def _odr_ellipse(points: Points3) -> tuple[Float, float]:
    """Return the ellipse by scipy's orthogonal distance regression of its equation."""
    centroid, axes, flat, start = _algebraic(points)

    def equation(p: Float, at: Float) -> Float:
        c, s = np.cos(p[2]), np.sin(p[2])
        x, y = at[0] - p[0], at[1] - p[1]
        level: Float = ((c * x + s * y) / p[3]) ** 2 + ((c * y - s * x) / p[4]) ** 2 - 1.0
        return level

    model = odr.Model(equation, implicit=True)
    p = odr.ODR(odr.Data(np.ascontiguousarray(flat.T), 1), model, beta0=start).run().beta
    return centroid + p[:2] @ axes[:2], float(max(p[3:5]))


def _algebraic(points: Points3) -> tuple[Float, Float, Float, Float]:
    """Return centroid, axes of the plane, points in it (n, 2), and EllipseModel's ellipse (5,)."""
    centroid, _, axes = _plane(points)
    flat = (points - centroid) @ axes[:2].T
    model = EllipseModel.from_estimate(flat)
    return centroid, axes, flat, np.array([*model.center, model.theta, *model.axis_lengths])


if __name__ == "__main__":
    sys.exit(main())
