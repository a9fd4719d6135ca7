"""How time and memory of an evaluation grow with the points and the features of a job.

    python -m benchmarks.scaling [--most N]

Spheres on a table, touched in turn, with the rig and probe of the resources: the uncertainty of all
points, fits, and the diameter of every sphere with U. First 10 features and ever more points, then
20 points a feature and ever more features, then 25 features and ever more distances of two of them,
and last the flatness of a face and the diameter of a bore along a path with U. Processor time from
nothing, the best of two, and after one more point of a job that was evaluated before, the best of
five; memory is the peak of what was allocated from nothing. Ends with 1 if time or memory from
nothing grow faster with the points than their number to the power of 1.1, or if one more point of
the largest job takes more than a fiftieth of it.
"""

from __future__ import annotations

import argparse
import sys
import time
import tracemalloc
from dataclasses import dataclass, replace
from itertools import combinations, islice

import numpy as np

from ocmm_core.blas import use_one_thread
from ocmm_core.camera import Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.inspection.evaluation import EvaluationCache, SessionOptions, evaluate_job
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import PATH, MeasuredPoint
from ocmm_core.tolerances.zones import Characteristic
from ocmm_core.tracking import ProbeBody, TipSensitivity, load_probe, tip_sensitivity

_LARGEST_EXPONENT = 1.1
_LARGEST_SHARE = 0.02
_POSES = 200
_RADIUS = 5.0
DISTANCES = (50, 100, 200)
"""Distances of two of 25 spheres; they have 300 pairs."""


@dataclass(frozen=True)
class Bench:
    """Rig and probe that everything is measured with."""

    rig: Rig
    body: ProbeBody


@dataclass(frozen=True)
class Row:
    """One size of a job: processor time, s, of it and of one more point, and peak of memory, MB."""

    points: int
    features: int
    seconds: float
    more: float
    memory: float


def measure(
    points: int, features: int, poses: list[TipSensitivity], bench: Bench, distances: int = 0
) -> Row:
    """Return the cost of one evaluation, with distances of spheres in addition to the diameters."""
    rng = np.random.default_rng(points)
    taken, found = [], []
    for number in range(points):
        name = number % features
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        taken.append(_point(number, f"S{name}", _centre(name), normal, bench.body.tip_radius))
        found.append(poses[number % len(poses)])
    nominals = [
        NominalFeature(
            name=f"S{k}",
            shape=Shape.SPHERE,
            points=4,
            point=(0.0, 0.0, 0.0),
            diameter=2.0 * _RADIUS,
        )
        for k in range(features)
    ]
    wanted = [
        Characteristic(
            name=f"D{k}", kind="diameter", features=[f"S{k}"], nominal=2.0 * _RADIUS,
            lower=-0.1, upper=0.1,
        )
        for k in range(features)
    ]  # fmt: skip
    pairs = combinations(range(features), 2)
    wanted += [
        Characteristic(
            name=f"L{i}-{k}", kind="distance", features=[f"S{i}", f"S{k}"],
            nominal=float(np.linalg.norm(_centre(k) - _centre(i))), lower=-0.1, upper=0.1,
        )
        for i, k in islice(pairs, distances)
    ]  # fmt: skip

    names = frozenset(item.name for item in nominals)
    plan = Plan(
        schema="ocmm.plan/1", unit="mm", name="scaling", part="spheres", features=nominals,
        characteristics=wanted, rule="simple",
    )  # fmt: skip
    options = SessionOptions()

    def evaluated(count: int, cache: EvaluationCache) -> float:
        """Return the processor time of an evaluation of the first points, s."""
        begun = time.process_time()
        job = evaluate_job(
            plan, taken[:count], found[:count], bench.rig, bench.body, options, names, cache=cache
        )
        taken_s = time.process_time() - begun
        if any(result.uncertainty is None for result in job.results):
            raise SystemExit("A sphere has no uncertainty.")
        return taken_s

    times = [evaluated(points, EvaluationCache()) for _ in range(2)]
    cache, more = EvaluationCache(), []
    for _ in range(5):
        evaluated(points - 1, cache)
        more.append(evaluated(points, cache))
    tracemalloc.start()
    evaluated(points, EvaluationCache())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return Row(points, features, min(times), min(more), peak / 1e6)


def _centre(sphere: int) -> Float:
    """Return the place of a sphere on the table, (3,), mm."""
    return np.array([30.0 * (sphere % 25), 30.0 * (sphere // 25), 0.0])


def _point(
    number: int, feature: str, centre: Float, normal: Float, tip_radius: float
) -> MeasuredPoint:
    return MeasuredPoint(
        number=number + 1, feature=feature, time_s=float(number), first_frame=0, last_frame=9,
        n_frames=10, tip_world=centre + (_RADIUS + tip_radius) * normal,
        random_covariance=1e-6 * np.eye(3), direction=normal, tip_radius=tip_radius,
        rotation_world_from_probe=np.eye(3), spots=np.full((2, 6, 2), np.nan), chi2_per_dof=1.0,
        approach="trail",
    )  # fmt: skip


def poses_of(bench: Bench) -> list[TipSensitivity]:
    """Return answers of tips all over the volume, for a probe held a little differently each."""
    rng = np.random.default_rng(1)
    found = []
    for _ in range(_POSES):
        rotation = rotation_from_vector(rng.normal(0.0, 0.1, 3))
        leds = (bench.body.leds_probe - bench.body.tip_probe) @ rotation.T
        leds = leds + rng.uniform(-60.0, 60.0, 3)
        spots = np.stack([project(camera, leds) for camera in bench.rig.cameras])
        found.append(tip_sensitivity(spots, bench.rig, bench.body))
    return found


def of_path(points: int, poses: list[TipSensitivity], bench: Bench, *, bore: bool = False) -> float:
    """Return the processor time, s, of a flatness or of a bore's diameter with U, from nothing."""
    rng = np.random.default_rng(points)
    share, zero = np.linspace(0.0, 10.0, points, endpoint=False), np.zeros(points)
    radius, size = bench.body.tip_radius, 40.0
    normals = np.tile([0.0, 0.0, 1.0], (points, 1))
    places = np.stack([120.0 * (share % 1.0), 8.0 * np.floor(share), zero], axis=1)
    if bore:
        turn = 2.0 * np.pi * share
        normals = np.stack([-np.cos(turn), -np.sin(turn), zero], axis=1)
        places = np.stack([zero, zero, 4.0 * share], axis=1) - 0.5 * size * normals
    places += (radius + rng.normal(0.0, 0.002, (points, 1))) * normals
    taken = [
        replace(_point(n, "F", place, normal, radius), tip_world=place, approach=PATH)
        for n, (place, normal) in enumerate(zip(places, normals, strict=True))
    ]
    feature = NominalFeature(
        name="F", shape=Shape.CYLINDER if bore else Shape.PLANE, points=6, point=(0.0, 0.0, 0.0),
        direction=(0.0, 0.0, 1.0), spacing=1.0, diameter=size if bore else 0.0,
        side="inner" if bore else "outer",
    )  # fmt: skip
    nominal = size if bore else 0.0
    wanted = Characteristic(
        name="it", kind="diameter" if bore else "flatness", features=["F"], nominal=nominal,
        lower=-0.1 if bore else 0.0, upper=0.1,
    )  # fmt: skip
    plan = Plan(
        schema="ocmm.plan/1", unit="mm", name="path", part="one", features=[feature],
        characteristics=[wanted],
    )  # fmt: skip
    found = [poses[n % len(poses)] for n in range(points)]
    begun = time.process_time()
    job = evaluate_job(
        plan, taken, found, bench.rig, bench.body, SessionOptions(), frozenset(["F"]),
        cache=EvaluationCache(),
    )  # fmt: skip
    if job.results[0].uncertainty is None:
        raise SystemExit(f"The path has no uncertainty: {job.results[0].note}")
    return time.process_time() - begun


def exponent(first: float, last: float, ratio: float) -> float:
    """Return the power of the size with which a cost grew."""
    return float(np.log(last / first) / np.log(ratio))


def main() -> int:
    """Print the tables; return 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--most", type=int, default=10000, help="points of the largest job")
    most = parser.parse_args().most
    use_one_thread()
    bench = Bench(
        load_rig(resource("rigs", "recommended.toml")),
        load_probe(resource("probes", "standard.toml")),
    )
    poses = poses_of(bench)
    measure(40, 2, poses, bench)
    by_points = [measure(n, 10, poses, bench) for n in (600, 1200, 2500, 5000, 10000) if n <= most]
    by_both = [measure(20 * f, f, poses, bench) for f in (25, 50, 100, 250, 500) if 20 * f <= most]
    by_wanted = [(n, measure(250, 25, poses, bench, n)) for n in (0, *DISTANCES)]
    print(f"{'points':>7} {'features':>8} {'s':>8} {'one more, ms':>13} {'MB':>7}")
    for row in (*by_points, *by_both):
        print(
            f"{row.points:7d} {row.features:8d} {row.seconds:8.3f} {1e3 * row.more:13.1f} "
            f"{row.memory:7.1f}"
        )
    good = True
    for words, rows, held in (("points", by_points, True), ("points and features", by_both, False)):
        ratio = rows[-1].points / rows[0].points
        of_time = exponent(rows[0].seconds, rows[-1].seconds, ratio)
        of_memory = exponent(rows[0].memory, rows[-1].memory, ratio)
        print(f"exponent over {words}: time {of_time:.2f}, memory {of_memory:.2f}")
        good &= not held or max(of_time, of_memory) <= _LARGEST_EXPONENT
    for distances, row in by_wanted:
        print(f"25 features, {distances} distances: {row.seconds:.3f} s, {row.memory:.1f} MB")
    first, last = by_wanted[1][1], by_wanted[-1][1]
    of_time = exponent(first.seconds, last.seconds, DISTANCES[-1] / DISTANCES[0])
    print(f"exponent over characteristics: time {of_time:.2f}")
    of_path(50, poses, bench)
    forms = [(n, of_path(n, poses, bench)) for n in (300, 1000, 3000, 10000) if n <= most]
    for points, seconds in forms:
        print(f"flatness of {points} points along a path, with U: {seconds:.2f} s")
    of_time = exponent(forms[0][1], forms[-1][1], forms[-1][0] / forms[0][0])
    print(f"exponent over points of a form: {of_time:.2f}")
    good &= of_time <= _LARGEST_EXPONENT
    for points in (1000, 10000, 100000):
        if points <= 10 * most:
            seconds = of_path(points, poses, bench, bore=True)
            print(f"diameter of {points} points along a path, with U: {seconds:.2f} s")
    share = by_both[-1].more / by_both[-1].seconds
    print(f"one more point of the largest job: {100.0 * share:.1f} % of it")
    good &= share <= _LARGEST_SHARE
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
