"""How often U of a fit holds the truth, shape by shape, from one point too many to many.

    python -m benchmarks.fit_coverage [--runs N] [--seed S] [--processes N] [--shape S]

Every run puts points with white noise on an exact element somewhere in space, fits it as `ocmm fit`
does and asks for U of all its numbers (`tolerances.fit_uncertainty`). Cells are a shape, a number
of points and the arc that they lie on.

- *covered*: how often value ± U holds the true value, of those that have U; 94 to 97 % wanted.
- *refused*: share of fits whose numbers are shown without U, as first order is not valid there, and
  of points that determine nothing. A cell in which fewer than `FEWEST` of the runs have U counts as
  refused: those that are left were picked by chance.

Ends with 1 where a cell holds less than 94 % or more than 97 % by more than three standard errors;
more than 97 % is allowed where more than `NEIGHBOUR` of the runs were refused.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from multiprocessing import get_context

import numpy as np

from ocmm_core.blas import use_one_thread
from ocmm_core.errors import FitError
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    HALF_ANGLE,
    MINIMUM_POINTS,
    POINT,
    RADIUS,
    SECOND,
    Fit,
    Shape,
    element,
)
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector
from ocmm_core.tolerances.uncertainty import FitUncertainty, Stated, fit_uncertainty

NOISE_MM = 0.003
SIZE, SECOND_SIZE, HALF_APEX, HEIGHT = 20.0, 8.0, 0.3, 40.0
LEAST_COVERED, MOST_COVERED = 0.94, 0.97
FEWEST = 0.2
NEIGHBOUR = 0.001
BEYOND_MINIMUM = (1, 2, 4, 8)
MANY = 50
ARCS_DEG = (20, 40, 60, 90, 180, 360)
_ARCED = (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER, Shape.CONE, Shape.TORUS, Shape.ELLIPSE)
_AXES = (Shape.LINE, Shape.CYLINDER, Shape.CONE)


@dataclass(frozen=True, slots=True)
class Cell:
    """One condition: shape, number of points, and their arc in degrees."""

    shape: Shape
    points: int
    arc_deg: int


def cells(shapes: Sequence[Shape] = tuple(Shape)) -> Iterator[Cell]:
    """Yield all cells."""
    for shape in shapes:
        least = MINIMUM_POINTS[shape]
        for n in (*(least + more for more in BEYOND_MINIMUM), MANY):
            for arc in ARCS_DEG if shape in _ARCED else (360,):
                yield Cell(shape, n, arc)


def run(cell: Cell, runs: int, seed: int) -> dict[str, Counter[str]]:
    """Return how often U of each number was "held", "missed" and "refused"."""
    rng = np.random.default_rng([seed, list(Shape).index(cell.shape), cell.points, cell.arc_deg])
    counts: dict[str, Counter[str]] = {}
    for _ in range(runs):
        motion = RigidTransform(
            rotation_from_vector(rng.normal(size=3)), rng.uniform(-300.0, 300.0, 3)
        )
        points = motion.apply(_on_element(cell, rng))
        points += rng.normal(0.0, NOISE_MM, points.shape)
        true = _true_geometry(cell.shape, motion)
        try:
            fit = fit_shape(cell.shape, points)
        except FitError:
            counts.setdefault("no fit", Counter())["refused"] += 1
            continue
        found = fit_uncertainty(fit, points)
        if found is None:
            raise RuntimeError(f"{cell} has no uncertainty")
        for name, error, stated in _errors(fit, true, found, points):
            count = counts.setdefault(name, Counter())
            if stated.expanded is None:
                count["refused"] += 1
            else:
                count["held" if error <= stated.expanded else "missed"] += 1
    return counts


def _on_element(cell: Cell, rng: np.random.Generator) -> Float:
    """Return exact points (n, 3) of the element at the origin, about z."""
    n, arc = cell.points, np.radians(cell.arc_deg)
    # Even, with a jitter, from one end of an arc to the other; round a full turn without the end.
    even = (np.arange(n) + rng.uniform(0.25, 0.75, n)) / n
    if cell.arc_deg < 360:
        even = np.clip((np.arange(n) + rng.uniform(-0.2, 0.2, n)) / (n - 1), 0.0, 1.0)
    turn = even * arc - 0.5 * arc + np.radians(30.0)
    height = rng.permutation((np.arange(n) + rng.uniform(0.2, 0.8, n)) / n - 0.5) * HEIGHT
    zero, r = np.zeros(n), SIZE
    match cell.shape:
        case Shape.POINT:
            return np.zeros((n, 3))
        case Shape.LINE:
            return np.stack([zero, zero, height], axis=1)
        case Shape.PLANE:
            radius = r * (0.5 + rng.uniform(0.0, 0.5, n))
            return np.stack([radius * np.cos(turn), radius * np.sin(turn), zero], axis=1)
        case Shape.CIRCLE:
            return np.stack([r * np.cos(turn), r * np.sin(turn), zero], axis=1)
        case Shape.SPHERE:
            lift = height / HEIGHT * min(arc, 0.9 * np.pi)
            return r * np.stack(
                [np.cos(lift) * np.cos(turn), np.cos(lift) * np.sin(turn), np.sin(lift)], axis=1
            )
        case Shape.CYLINDER:
            return np.stack([r * np.cos(turn), r * np.sin(turn), height], axis=1)
        case Shape.CONE:
            radius = r + np.tan(HALF_APEX) * height
            return np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
        case Shape.TORUS:
            tube = rng.permutation((np.arange(n) + rng.uniform(0.2, 0.8, n)) * 2.0 * np.pi / n)
            radius = r + SECOND_SIZE * np.cos(tube)
            return np.stack(
                [radius * np.cos(turn), radius * np.sin(turn), SECOND_SIZE * np.sin(tube)], axis=1
            )
        case Shape.ELLIPSE:
            return np.stack([r * np.cos(turn), SECOND_SIZE * np.sin(turn), zero], axis=1)
        case Shape.ROUND_SLOT:
            return _outline(even, round_ends=True, rng=rng)
        case Shape.SQUARE_SLOT | Shape.RECTANGLE:
            return _outline(even, round_ends=False, rng=rng)


def _outline(share: Float, *, round_ends: bool, rng: np.random.Generator) -> Float:
    """Return points on sides and ends: two on a side, one on the other, one on each end, others."""
    n = len(share)
    kinds = np.concatenate([[0, 0, 1, 2, 3], np.resize([1, 0, 2, 3], max(n - 5, 0))])[:n]
    straight = SIZE - SECOND_SIZE if round_ends else 0.9 * SIZE
    along = np.linspace(-0.9, 0.9, max(int(np.sum(kinds == 0)), 2))
    points = np.zeros((n, 3))
    for kind in range(4):
        rows = np.flatnonzero(kinds == kind)
        at = rng.uniform(-0.9, 0.9, len(rows))
        sign = 1.0 if kind % 2 == 0 else -1.0
        if kind == 0:
            at = along[: len(rows)]
        if kind < 2:
            points[rows, 0], points[rows, 1] = straight * at, sign * SECOND_SIZE
        elif round_ends:
            turn = 0.45 * np.pi * at
            points[rows, 0] = sign * (SIZE - SECOND_SIZE + SECOND_SIZE * np.cos(turn))
            points[rows, 1] = SECOND_SIZE * np.sin(turn)
        else:
            points[rows, 0], points[rows, 1] = sign * SIZE, 0.8 * SECOND_SIZE * at
    return points


def _true_geometry(shape: Shape, motion: RigidTransform) -> Float:
    sized = shape not in (Shape.POINT, Shape.LINE, Shape.PLANE)
    second = shape in (
        Shape.TORUS, Shape.ELLIPSE, Shape.ROUND_SLOT, Shape.SQUARE_SLOT, Shape.RECTANGLE
    )  # fmt: skip
    return element(
        motion.translation,
        motion.rotation[:, 2] if shape not in (Shape.POINT, Shape.SPHERE) else np.zeros(3),
        SIZE if sized else 0.0,
        second=SECOND_SIZE if second else 0.0,
        half_angle=HALF_APEX if shape is Shape.CONE else 0.0,
        across=motion.rotation[:, 0] if second and shape is not Shape.TORUS else np.zeros(3),
    )


def _errors(
    fit: Fit, true: Float, found: FitUncertainty, points: Float
) -> Iterator[tuple[str, float, Stated]]:
    """Yield name, error and statement of every number."""
    axis, radius = true[DIRECTION], float(true[RADIUS])
    if found.centre is not None:
        for word, one, error in zip(
            "xyz", found.centre, np.abs(fit.point - true[POINT]), strict=True
        ):
            yield f"centre {word}", float(error), one
    if found.foot is not None:
        middle = points.mean(axis=0) - true[POINT]
        if fit.shape is Shape.PLANE:
            yield "foot", abs(float((fit.point - true[POINT]) @ axis)), found.foot
        else:
            along = float(middle @ axis)
            off = fit.point - true[POINT]
            yield "foot", float(np.linalg.norm(off - (off @ axis) * axis)), found.foot
            radius += along * float(np.tan(true[HALF_ANGLE]))
    if found.direction is not None:
        sine = float(np.linalg.norm(np.cross(fit.direction, axis)))
        yield "direction", float(np.arcsin(min(sine, 1.0))), found.direction
    if found.turn is not None:
        sine = abs(float(fit.across @ np.cross(axis, true[ACROSS])))
        yield "turn", float(np.arcsin(min(sine, 1.0))), found.turn
    for word, value, truth, number in (
        ("radius", fit.radius, radius, found.radius),
        ("second", fit.second, float(true[SECOND]), found.second),
        ("half angle", fit.half_angle, float(true[HALF_ANGLE]), found.half_angle),
    ):
        if number is not None:
            yield word, abs(value - truth), number


def run_all(
    asked: Sequence[Cell], runs: int, seed: int, processes: int
) -> Iterator[tuple[Cell, dict[str, Counter[str]]]]:
    """Yield every cell with its counts as it comes."""
    if processes == 1:
        for cell in asked:
            yield cell, run(cell, runs, seed)
        return
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        yield from zip(asked, pool.map(run, asked, repeat(runs), repeat(seed)), strict=True)


@dataclass(frozen=True, slots=True)
class Row:
    """One number of a cell: runs with U, share of them that hold, share refused."""

    name: str
    stated: int
    covered: float
    refused: float

    @property
    def counted(self) -> bool:
        """Return whether enough have U to speak of them."""
        return self.refused <= 1.0 - FEWEST

    @property
    def fault(self) -> str:
        """Return the fault; empty without one."""
        if not self.counted:
            return ""
        low, high = (
            3.0 * np.sqrt(limit * (1.0 - limit) / max(self.stated, 1))
            for limit in (LEAST_COVERED, MOST_COVERED)
        )
        if self.covered < LEAST_COVERED - low:
            return "TOO FEW"
        if self.covered > MOST_COVERED + high and self.refused <= NEIGHBOUR:
            return "TOO MANY"
        return ""


def rows_of(counts: dict[str, Counter[str]], runs: int) -> list[Row]:
    """Return the numbers of a cell."""
    found = []
    for name, count in counts.items():
        stated = count["held"] + count["missed"]
        if name != "no fit":
            covered = count["held"] / max(stated, 1)
            found.append(Row(name, stated, covered, 1.0 - stated / runs))
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the cells and return 0, or 1 if one is beyond its limits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=None, help="a new one where none is given")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--shape", choices=[shape.value for shape in Shape], default=None)
    asked = parser.parse_args(arguments)
    use_one_thread()
    fresh = int(np.random.SeedSequence().generate_state(1)[0])
    seed = fresh if asked.seed is None else asked.seed
    shapes = tuple(Shape) if asked.shape is None else (Shape(asked.shape),)
    print(f"{asked.runs} runs a cell, seed {seed}; wanted: 94 to 97 %, or refused")
    faults = 0
    for cell, counts in run_all(list(cells(shapes)), asked.runs, seed, asked.processes):
        lines = rows_of(counts, asked.runs)
        print(f"{cell.shape.value}, {cell.points} points, {cell.arc_deg} deg", flush=True)
        for row in lines:
            share = f"{100.0 * row.covered:5.1f} %" if row.counted else "refused"
            print(f"    {row.name:<12}{share:>8} of N = {row.stated:<6}"
                  f"refused {100.0 * row.refused:5.1f} %  {row.fault}")  # fmt: skip
            faults += row.fault != ""
        if not lines:
            print("    no fit in any run: refused")
    print(f"{faults} numbers beyond their limits")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
