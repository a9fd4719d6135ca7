"""Local sizes between opposite points: slots, rectangles, and two faces."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from functools import lru_cache
from typing import Literal

import numpy as np
import pytest

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, actual_features
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.measuring import Rows, factors_of_matrix
from ocmm_core.tolerances.kinds import evaluate
from ocmm_core.tolerances.monte_carlo import Task
from ocmm_core.tolerances.monte_carlo._trials import quick_model, slow_trials
from ocmm_core.tolerances.zones import around
from tests.core.features.exact_touches import moved, nominal, touches
from tests.core.tolerances.known_part import KnownPart, asked, face, motion

pytestmark = pytest.mark.numerics

PLACES = np.array([-12.0, -6.0, 0.0, 6.0, 12.0])
BARREL = np.array([0.0, 0.01, 0.02, 0.01, 0.0])
"""mm: excess width of the slots at these places, on each side."""

SLOT = {"length": 50.0, "width": 16.0, "side": "inner", "point": (0.0, 0.0, 0.0)}


def slot(shape: Shape) -> tuple[Float, Float]:
    """Return points of a slot with bulging sides, and normals away from the material."""
    sides = [np.column_stack([PLACES, s * (8.0 + BARREL), 0.0 * PLACES]) for s in (1.0, -1.0)]
    normals = [np.tile([0.0, -s, 0.0], (5, 1)) for s in (1.0, -1.0)]
    if shape is Shape.ROUND_SLOT:
        turn = np.deg2rad([-60.0, -20.0, 20.0, 60.0])
        for s in (1.0, -1.0):
            out = np.column_stack([s * np.cos(turn), np.sin(turn), 0.0 * turn])
            sides.append(out * 8.0 + [s * 17.0, 0.0, 0.0])
            normals.append(-out)
    else:
        for s in (1.0, -1.0):
            y = np.array([-5.0, 0.0, 5.0])
            sides.append(np.column_stack([np.full(3, s * 25.0) + 0.004 * y, y, 0.0 * y]))
            normals.append(np.tile([-s, 0.0, 0.0], (3, 1)))
    return np.vstack(sides), np.vstack(normals)


@lru_cache(maxsize=4)
def part() -> KnownPart:
    made = KnownPart()
    for shape in (Shape.ROUND_SLOT, Shape.SQUARE_SLOT, Shape.RECTANGLE):
        made.add(shape.value, shape, slot(shape), **SLOT)
    made.add("upper", Shape.PLANE, face(motion(0, 0, 10.0, 5e-4, 0, 0), 40.0,
             lambda x, y: 0.01 * (x / 20.0) ** 2))  # fmt: skip
    under = RigidTransform(np.diag([1.0, -1.0, -1.0]), np.array([1.0, -1.0, -5.0]))
    made.add("under", Shape.PLANE, face(under), direction=(0, 0, -1))
    made.add("level", Shape.PLANE, face(motion(0, 100, 0)))
    made.add("far", Shape.PLANE, face(RigidTransform(np.diag([1.0, -1.0, -1.0]),
             np.array([500.0, 0.0, -5.0]))), direction=(0, 0, -1))  # fmt: skip
    return made


Rank = Literal["maximum", "minimum", "mean"]


@pytest.mark.parametrize("shape", ["RoundSlot", "SquareSlot", "Rectangle"])
@pytest.mark.parametrize(("rank", "wider"), [("maximum", 0.04), ("minimum", 0.0), ("mean", 0.016)])
def test_width_across_opposite_sides(shape: str, rank: Rank, wider: float) -> None:
    actual = part().actual()
    item = asked("width", shape, association=f"two-point {rank}")
    found = evaluate(item, actual, None)
    # The sides bulge: the slot turns nowhere, but its ends of least squares follow by some 1e-4.
    assert found.value == pytest.approx(16.0 + wider, abs=1e-5)
    assert found.association.startswith(f"two-point {rank} (LP")


def test_length_between_straight_ends() -> None:
    found = evaluate(
        asked("length", "SquareSlot", association="two-point maximum"), part().actual(), None
    )
    # One end leans one way, the other alike: every length across is the same.
    assert found.value == pytest.approx(50.0, abs=1e-4)


@pytest.mark.parametrize(("rank", "height"), [("maximum", 15.02), ("minimum", 14.99)])
def test_distance_of_two_opposite_faces(rank: Rank, height: float) -> None:
    item = asked("distance", "upper,under", association=f"two-point {rank}")
    found = evaluate(item, part().actual(), None)
    # The upper face bulges by 0.01 mm at both ends of x and rises by 0.01 mm at 20 mm of y;
    # opposite points are 1 mm aside: 0.0005 mm.
    assert found.value == pytest.approx(height, abs=1e-3)
    turned = asked("distance", "under,upper", association=f"two-point {rank}")
    assert evaluate(turned, part().actual(), None).value == pytest.approx(found.value, abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "features"),
    [("width", "RoundSlot"), ("width", "Rectangle"), ("length", "Rectangle"),
     ("distance", "upper,under")],
)  # fmt: skip
@pytest.mark.parametrize("rank", ["maximum", "mean"])
def test_the_gradient_is_that_of_the_whole_way(kind: str, features: str, rank: Rank) -> None:
    made = part()
    rng = np.random.default_rng(2)
    noise, way = (rng.normal(size=(len(made.points), 3)) for _ in range(2))
    item = asked(kind, features, association=f"two-point {rank}")

    def of(by: float) -> tuple[float, Rows]:
        points = moved(made.points, 0.004 * noise + by * way)
        actual = made.actual([replace(p, tip_radius=p.tip_radius + by) for p in points])
        found = evaluate(item, actual, None)
        return found.value, found.gradient

    step = 1e-6
    slope = float(of(0.0)[1] @ np.append(way.ravel(), 1.0))
    # First order in residuals of 0.02 mm on 8 mm.
    assert slope == pytest.approx((of(step)[0] - of(-step)[0]) / (2.0 * step), abs=0.01)


def test_what_has_no_opposite_points_is_refused() -> None:
    actual = part().actual()
    for features, said in (
        ("upper,level", "upper and level are not opposite"),
        ("upper,far", "No two points of upper and far"),
    ):
        with pytest.raises(FitError, match=said):
            evaluate(asked("distance", features, association="two-point mean"), actual, None)
    made = KnownPart()
    surface, normals = slot(Shape.ROUND_SLOT)
    # One side at 12 mm to either side of the middle, the other at 6 mm.
    rows = np.r_[0, 4, 6, 8, 10:18]
    made.add("it", Shape.ROUND_SLOT, (surface[rows], normals[rows]), **SLOT)
    with pytest.raises(FitError, match="No two points of it are opposite"):
        evaluate(asked("width", "it", association="two-point mean"), made.actual(), None)


def test_every_trial_of_a_two_point_distance_takes_the_points_that_are_opposite() -> None:
    points, actual = part().points, part().actual()
    item = asked("distance", "upper,under", association="two-point maximum")
    size = 3 * len(points) + 1
    task = Task(
        (item,),
        None,
        tuple(points),
        actual,
        factors_of_matrix(1e-6 * np.eye(size)),
        np.zeros((len(points), 3, 3)),
    )
    # A model of the two elements would simulate the distance of the planes.
    assert quick_model(task).values == {}
    values, failed = slow_trials(task, [item.name], np.zeros((1, size)))
    assert failed == 0
    assert values[0, 0] == pytest.approx(evaluate(item, actual, None).value, abs=1e-9)
    planes = evaluate(asked("distance", "upper,under"), actual, None).value
    assert abs(values[0, 0] - planes) > 5e-3


def test_the_mean_over_many_pairs_needs_no_row_for_each() -> None:
    rng = np.random.default_rng(9)
    count = 1500
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    normals = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    deviations = rng.normal(0.0, 0.002, count)
    own = touches("ring", (10.0 + deviations)[:, None] * normals, normals)
    found = actual_features([nominal("ring", Shape.CIRCLE, 20.0, "outer")], own)
    ring = found["ring"]
    assert isinstance(ring, ActualFeature)
    tracemalloc.start()
    halves, rows = around(ring, "two-point mean")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # 125,000 pairs: their rows would be 4.5 GB.
    assert peak < 150e6, peak
    assert len(halves) == len(rows) == 1
    # All deviations of a full circle have the same weight.
    assert float(halves[0]) == pytest.approx(10.0 + deviations.mean(), abs=1e-6)
    gradient = rows.dense(count)[0, :-1].reshape(count, 3)
    assert np.sum(gradient * normals, axis=1) == pytest.approx(1.0 / count, rel=1e-3)
