"""Constructions: exact geometry, every place in space, uncertainty, and refusals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from ocmm_core.errors import FitError, InputError
from ocmm_core.features.measured import (
    ActualFeature,
    Construction,
    FitThrough,
    Intersection,
    Midpoint,
    Offset,
    PartOf,
    actual_features,
    constructed_features,
    construction_fault,
    nominal_geometries,
    probed_features,
    shapes_with,
)
from ocmm_core.features.measured._construct import (
    Bisector,
    BoltCircle,
    ConeSection,
    HiddenPoint,
    Projection,
    Symmetry,
    in_order,
    needed_features,
)
from ocmm_core.features.measured._constructed import construct, fit_through_centres
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    POINT,
    RADIUS,
    Fit,
    NominalFeature,
    Shape,
    element,
)
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.measuring import DeviationRows, MeasuredPoint, Rows
from tests.core.features.exact_touches import nominal, nudged, round_touches
from tests.core.features.shape_samples import somewhere

pytestmark = pytest.mark.numerics

SLOPE = 0.25
PART: dict[str, tuple[Shape, Float]] = {
    "TOP": (Shape.PLANE, element((7.0, -5.0, 10.0), (0.0, 0.0, 1.0))),
    "LEFT": (Shape.PLANE, element((-40.0, 3.0, 2.0), (-1.0, 0.0, 0.0))),
    "RIGHT": (Shape.PLANE, element((60.0, -8.0, 1.0), (1.0, 0.0, 0.0))),
    "FRONT": (Shape.PLANE, element((0.0, -30.0, 4.0), (0.0, -1.0, 0.0))),
    "STEP": (Shape.PLANE, element((3.0, 3.0, 30.0), (0.0, 0.0, 1.0))),
    "A": (Shape.CIRCLE, element((50.0, 0.0, 10.0), (0.0, 0.0, 1.0), 5.0)),
    "B": (Shape.CIRCLE, element((0.0, 50.0, 10.0), (0.0, 0.0, 1.0), 5.0)),
    "C": (Shape.CIRCLE, element((-50.0, 0.0, 10.0), (0.0, 0.0, 1.0), 5.0)),
    "D": (Shape.CIRCLE, element((4.0, -50.0, 12.0), (0.0, 0.0, 1.0), 5.0)),
    "BALL": (Shape.SPHERE, element((20.0, 30.0, 40.0), radius=9.0)),
    "TIP": (Shape.SPHERE, element((20.0, 30.0, 90.0), radius=9.0)),
    "SHAFT": (Shape.CYLINDER, element((15.0, 20.0, 33.0), (0.0, 0.0, 1.0), 8.0)),
    "PIN": (Shape.CYLINDER, element((15.0, 70.0, 50.0), (0.0, 1.0, 0.0), 4.0)),
    "SEAT": (
        Shape.CONE,
        element((5.0, 6.0, 12.0), (0.0, 0.0, 1.0), 10.0, half_angle=float(np.arctan(SLOPE))),
    ),
}
EVERY: dict[str, tuple[Construction, Shape, Float]] = {
    "edge": (
        Intersection(name="edge", features=("TOP", "FRONT")),
        Shape.LINE,
        element((3.5, -30.0, 10.0), (1.0, 0.0, 0.0)),
    ),
    "pierce": (
        Intersection(name="pierce", features=("SHAFT", "TOP")),
        Shape.POINT,
        element((15.0, 20.0, 10.0)),
    ),
    "corner": (
        Intersection(name="corner", features=("TOP", "LEFT", "FRONT")),
        Shape.POINT,
        element((-40.0, -30.0, 10.0)),
    ),
    "crossing": (
        Intersection(name="crossing", features=("SHAFT", "PIN")),
        Shape.POINT,
        element((15.0, 20.0, 50.0)),
    ),
    "shadow": (
        Projection(name="shadow", features=("BALL", "TOP")),
        Shape.POINT,
        element((20.0, 30.0, 10.0)),
    ),
    "foot": (
        Projection(name="foot", features=("BALL", "SHAFT")),
        Shape.POINT,
        element((15.0, 20.0, 40.0)),
    ),
    "flat": (
        Projection(name="flat", features=("PIN", "TOP")),
        Shape.LINE,
        element((15.0, 70.0, 10.0), (0.0, 1.0, 0.0)),
    ),
    "ring": (
        Projection(name="ring", features=("A", "STEP")),
        Shape.CIRCLE,
        element((50.0, 0.0, 30.0), (0.0, 0.0, 1.0), 5.0),
    ),
    "middle": (
        Midpoint(name="middle", features=("A", "BALL")),
        Shape.POINT,
        element((35.0, 15.0, 25.0)),
    ),
    "halving": (
        Bisector(name="halving", features=("LEFT", "RIGHT")),
        Shape.PLANE,
        element((10.0, -2.5, 1.5), (-1.0, 0.0, 0.0)),
    ),
    "between steps": (
        Bisector(name="between steps", features=("TOP", "STEP"), which="across"),
        Shape.PLANE,
        element((5.0, -1.0, 20.0), (0.0, 0.0, 1.0)),
    ),
    "mitre": (
        Bisector(name="mitre", features=("TOP", "FRONT")),
        Shape.PLANE,
        element((3.5, -22.25, 2.25), (0.0, np.sqrt(0.5), np.sqrt(0.5))),
    ),
    "halfway": (
        Bisector(name="halfway", features=("SHAFT", "SEAT")),
        Shape.LINE,
        element((10.0, 13.0, 22.5), (0.0, 0.0, 1.0)),
    ),
    "mirror": (
        Symmetry(name="mirror", features=("A", "C")),
        Shape.PLANE,
        element((0.0, 0.0, 10.0), (-1.0, 0.0, 0.0)),
    ),
    "faces": (
        Symmetry(name="faces", features=("RIGHT", "LEFT")),
        Shape.PLANE,
        element((10.0, -2.5, 1.5), (1.0, 0.0, 0.0)),
    ),
    "raised": (
        Offset(name="raised", features=("TOP",), distance=2.5),
        Shape.PLANE,
        element((7.0, -5.0, 12.5), (0.0, 0.0, 1.0)),
    ),
    "grown": (
        Offset(name="grown", features=("SHAFT",), distance=-1.5),
        Shape.CYLINDER,
        element((15.0, 20.0, 33.0), (0.0, 0.0, 1.0), 6.5),
    ),
    "along": (
        Offset(name="along", features=("BALL", "PIN"), distance=7.0, towards="A"),
        Shape.SPHERE,
        element((20.0, 23.0, 40.0), radius=9.0),
    ),
    "through": (
        FitThrough(name="through", features=("A", "B", "C", "D"), shape=Shape.PLANE),
        Shape.PLANE,
        element((0.0, 0.0, 0.0)),
    ),
    "axis": (
        FitThrough(name="axis", features=("BALL", "TIP"), shape=Shape.LINE),
        Shape.LINE,
        element((20.0, 30.0, 65.0), (0.0, 0.0, 1.0)),
    ),
    "holes": (
        BoltCircle(name="holes", features=("A", "B", "C")),
        Shape.CIRCLE,
        element((0.0, 0.0, 10.0), (0.0, 0.0, 1.0), 50.0),
    ),
    "gauge": (
        ConeSection(name="gauge", features=("SEAT",), diameter=24.0),
        Shape.CIRCLE,
        element((5.0, 6.0, 20.0), (0.0, 0.0, 1.0), 12.0),
    ),
    "mouth": (
        ConeSection(name="mouth", features=("SEAT", "TOP"), distance=6.0),
        Shape.CIRCLE,
        element((5.0, 6.0, 16.0), (0.0, 0.0, 1.0), 11.0),
    ),
    "hidden": (
        HiddenPoint(name="hidden", features=("TIP", "BALL"), distance=30.0),
        Shape.POINT,
        element((20.0, 30.0, 10.0)),
    ),
    "line": (
        PartOf(name="line", features=("SHAFT",), part="axis"),
        Shape.LINE,
        element((15.0, 20.0, 33.0), (0.0, 0.0, 1.0)),
    ),
    "centre": (
        PartOf(name="centre", features=("BALL",), part="centre"),
        Shape.POINT,
        element((20.0, 30.0, 40.0)),
    ),
}
SIGMA = 0.01


def _nominal(name: str, shape: Shape, geometry: Float) -> NominalFeature:
    x, y, z = (float(value) for value in geometry[POINT])
    return NominalFeature(name=name, shape=shape, points=1, point=(x, y, z))


def _moved(geometry: Float, motion: RigidTransform) -> Float:
    moved = geometry.copy()
    moved[POINT] = motion.apply(geometry[POINT])
    for part in (DIRECTION, ACROSS):
        moved[part] = motion.rotation @ geometry[part]
    return moved


def _actual(
    part: Mapping[str, tuple[Shape, Float]], motion: RigidTransform
) -> dict[str, ActualFeature | FitError]:
    """Return features whose 12 numbers each are the coordinates of the job."""
    count = 12 * len(part) + 1
    found: dict[str, ActualFeature | FitError] = {}
    for index, (name, (shape, geometry)) in enumerate(part.items()):
        here = _moved(geometry, motion)
        jacobian = np.zeros((12, count))
        jacobian[:, 12 * index : 12 * index + 12] = np.eye(12)
        fit = Fit(shape, here, np.zeros((12, 0)), np.zeros(0), 0.0, 0.0)
        nominal = _nominal(name, shape, geometry)
        none = DeviationRows.of_rows(Rows.nothing(0))
        found[name] = ActualFeature(nominal, fit, (index,), Rows.of_dense(jacobian), none)
    return found


def _made(item: Construction, motion: RigidTransform) -> ActualFeature:
    feature = constructed_features([item], _actual(PART, motion), {})[item.name]
    assert isinstance(feature, ActualFeature), feature
    return feature


@pytest.mark.parametrize("name", [name for name in EVERY if name != "through"])
def test_known_geometry_wherever_the_part_lies(name: str) -> None:
    item, shape, expected = EVERY[name]
    shapes = {key: value for key, (value, _) in PART.items()}
    assert construction_fault(shapes, [item]) is None
    assert shapes_with(shapes, [item])[name] is shape
    for seed in range(3):
        motion = somewhere(np.random.default_rng(seed))
        feature = _made(item, motion)
        assert feature.fit.shape is shape
        # World coordinates are hundreds of mm: rounding, and the plane fit's own 1e-12.
        assert np.abs(feature.fit.geometry - _moved(expected, motion)).max() < 1e-9


def test_a_plane_through_four_centres_is_nearest_to_them() -> None:
    feature = _made(EVERY["through"][0], RigidTransform.identity())
    centres = np.array([PART[name][1][POINT] for name in ("A", "B", "C", "D")])
    arms = centres - centres.mean(axis=0)
    normal = np.linalg.svd(arms)[2][-1]
    assert abs(feature.fit.direction @ normal) == pytest.approx(1.0, abs=1e-12)
    assert feature.fit.residuals == pytest.approx(arms @ feature.fit.direction, abs=1e-9)
    # Anticlockwise from A over B to C, seen from above.
    assert feature.fit.direction[2] > 0.0


@pytest.mark.parametrize("name", list(EVERY))
def test_uncertainty_is_chained_as_a_monte_carlo_finds_it(name: str) -> None:
    """400 noisy parts: a standard deviation scatters by 3.5 %, the worst of twelve stays in 15 %.

    The noise of directions is a thousandth of a degree, so that the second order stays below it.
    """
    item = EVERY[name][0]
    motion = somewhere(np.random.default_rng(8))
    start = _made(item, motion)
    sigmas = np.zeros((len(PART), 12))
    for index, key in enumerate(PART):
        if key in item.features:
            sigmas[index, :3], sigmas[index, 3:6], sigmas[index, RADIUS] = SIGMA, 1e-5, SIGMA
    names = needed_features(item)
    places = [list(PART).index(key) for key in names]
    shapes = [PART[key][0] for key in names]
    centre = np.array([_moved(PART[key][1], motion) for key in names])
    rng = np.random.default_rng(5)
    samples = []
    for _ in range(400):
        noisy = centre + sigmas[places] * rng.normal(size=centre.shape)
        if isinstance(item, (FitThrough, BoltCircle)):
            geometry = fit_through_centres(start.fit.shape, noisy[:, POINT]).geometry
        else:
            geometry = construct(item, shapes, list(noisy))
        samples.append(geometry - start.fit.geometry)
    slopes = start.jacobian.dense(sigmas.size // 3)[:, :-1] * sigmas.ravel()
    linear = np.linalg.norm(slopes, axis=1)
    scatter = np.std(samples, axis=0)
    assert linear.max() > 1e-6
    assert np.all(np.abs(scatter - linear) < 0.15 * linear + 1e-9)


def test_what_two_constructions_share_counts_once() -> None:
    """The middle of A and B and B itself move together: their difference is half that of A, B."""
    middle = Midpoint(name="middle", features=("A", "B"))
    hidden = HiddenPoint(name="end", features=("A", "middle"), distance=0.0)
    shift = Midpoint(name="again", features=("middle", "B"))
    actual = _actual(PART, somewhere(np.random.default_rng(8)))
    found = constructed_features([shift, hidden, middle], actual, {})
    again, end, mid = found["again"], found["end"], found["middle"]
    assert isinstance(again, ActualFeature)
    assert isinstance(end, ActualFeature)
    assert isinstance(mid, ActualFeature)
    a, b = 12 * list(PART).index("A"), 12 * list(PART).index("B")
    by_all = again.jacobian.dense(4 * len(PART))
    assert by_all[0, a] == pytest.approx(0.25, abs=1e-9)
    assert by_all[0, b] == pytest.approx(0.75, abs=1e-9)
    assert (end.jacobian[POINT] - mid.jacobian[POINT]).greatest() < 1e-9
    assert again.numbers == (list(PART).index("A"), list(PART).index("B"))


def _tilted(degrees: float) -> dict[str, tuple[Shape, Float]]:
    turn = np.radians(degrees)
    axis = (np.sin(turn), 0.0, np.cos(turn))
    return {
        **PART,
        "TILTED": (Shape.PLANE, element((90.0, 0.0, 0.0), axis)),
        "LEANING": (Shape.CYLINDER, element((70.0, 0.0, 0.0), axis, 3.0)),
        "NEAR": (Shape.SPHERE, element((20.0, 30.0, 40.5), radius=9.0)),
    }


@pytest.mark.parametrize(
    ("item", "words"),
    [
        (Intersection(name="x", features=("TOP", "TILTED")), "planes are nearly parallel: 0.50"),
        (Intersection(name="x", features=("SHAFT", "LEANING")), "lines are nearly parallel"),
        (Intersection(name="x", features=("LEANING", "RIGHT")), "nearly lies along the plane"),
        (Intersection(name="x", features=("LEFT", "RIGHT", "TOP")), "nearly meet in one line"),
        (Projection(name="x", features=("LEANING", "TOP")), "nearly normal to the plane"),
        (Projection(name="x", features=("A", "LEFT")), "inclined 90 degrees"),
        (Bisector(name="x", features=("TOP", "STEP")), "nothing lies between them"),
        (Bisector(name="x", features=("LEFT", "RIGHT"), which="across"), "face each other"),
        (Bisector(name="x", features=("SHAFT", "PIN")), "neither angle is the smaller one"),
        (HiddenPoint(name="x", features=("NEAR", "BALL"), distance=10.0), "0.500 mm from each"),
        (Offset(name="x", features=("SHAFT",), distance=-8.5), "radius would be -0.500"),
        (Offset(name="x", features=("BALL", "PIN"), distance=1.0, towards="TIP"), "lies sideways"),
        (
            ConeSection(name="x", features=("SEAT", "TOP"), distance=-60.0),
            "does not extend that far",
        ),
        (Symmetry(name="x", features=("A", "C", "B", "D")), "do not define their plane"),
        (FitThrough(name="x", features=("A", "C", "B"), shape=Shape.SPHERE), "4"),
    ],
)
def test_what_does_not_determine_it_is_refused(item: Construction, words: str) -> None:
    actual = _actual(_tilted(0.5), somewhere(np.random.default_rng(8)))
    feature = constructed_features([item], actual, {})["x"]
    assert isinstance(feature, FitError)
    assert feature.what.startswith("x: ")
    assert words in feature.what
    assert feature.remedy


def test_a_missing_feature_is_named_through_all_constructions() -> None:
    actual = _actual(PART, RigidTransform.identity())
    actual["B"] = FitError("feature.too_few_points", "B has 1 of 3 points.", "Take them.")
    items = [
        Midpoint(name="second", features=("first", "A")),
        Midpoint(name="first", features=("A", "B")),
    ]
    found = constructed_features(items, actual, {})
    for name in ("first", "second"):
        error = found[name]
        assert isinstance(error, FitError)
        assert "B has 1 of 3 points." in error.what


def test_constructions_are_ordered_and_circles_refused() -> None:
    items = [
        Midpoint(name="c", features=("b", "A")),
        Midpoint(name="a", features=("A", "B")),
        Midpoint(name="b", features=("a", "C")),
    ]
    assert [item.name for item in in_order(items)] == ["a", "b", "c"]
    assert set(probed_features("c", items)) == {"A", "B", "C"}
    circle = [*items[:1], Midpoint(name="b", features=("c", "A"))]
    with pytest.raises(InputError, match="c, b depend on each other in a loop"):
        in_order(circle)


@pytest.mark.parametrize(
    ("item", "words"),
    [
        (Midpoint(name="A", features=("A", "B")), "repeats the name 'A'"),
        (Midpoint(name="x", features=("A", "Q")), "names 'Q', which is not a feature"),
        (Midpoint(name="x", features=("A", "A")), "names one feature twice"),
        (Midpoint(name="x", features=("A", "TOP")), "names a plane, but needs: point"),
        (Midpoint(name="x", features=("A",)), "names 1 feature(s), but needs 2"),
        (Intersection(name="x", features=("A", "BALL")), "names a sphere"),
        (
            Offset(name="x", features=("A", "SHAFT"), distance=1.0),
            "does not define a positive direction",
        ),
        (BoltCircle(name="x", features=("A", "B")), "a bolt circle needs at least 3"),
        (ConeSection(name="x", features=("SEAT",)), "must be greater than zero"),
        (FitThrough(name="x", features=("A", "B"), shape=Shape.PLANE), "a plane needs at least 3"),
        (Symmetry(name="x", features=("A", "B", "C")), "pairs are needed"),
        (Midpoint(name="x", features=("x", "A")), "in a loop"),
    ],
)
def test_constructions_that_cannot_be_are_refused_in_the_plan(
    item: Construction, words: str
) -> None:
    fault = construction_fault({key: shape for key, (shape, _) in PART.items()}, [item])
    assert fault is not None
    assert words in fault[1]


def test_nominals_of_constructions_follow_from_those_of_their_features() -> None:
    features = [
        NominalFeature(name="A", shape=Shape.SPHERE, points=4, point=(0.0, 0.0, 0.0), diameter=9.0),
        NominalFeature(name="B", shape=Shape.SPHERE, points=4, point=(0.0, 8.0, 2.0), diameter=9.0),
    ]
    items = [Midpoint(name="m", features=("A", "B"))]
    assert nominal_geometries(features, items)["m"][POINT] == pytest.approx([0.0, 4.0, 1.0])


def test_one_cylinder_through_the_points_of_two_bores() -> None:
    """Two coaxial bores probed one by one: together they are one long cylinder."""
    motion = somewhere(np.random.default_rng(3))
    points, features = [], []
    for index, (name, height) in enumerate((("low", 0.0), ("high", 60.0))):
        at = motion.compose(RigidTransform(np.eye(3), np.array([0.0, 0.0, height])))
        points += round_touches(name, Shape.CYLINDER, 30.0, "inner", at, first=1 + 12 * index)
        features.append(nominal(name, Shape.CYLINDER, 30.0, "inner"))
    item = FitThrough(name="both", features=("low", "high"), shape=Shape.CYLINDER, through="points")

    def both(touched: list[MeasuredPoint]) -> ActualFeature:
        found = constructed_features([item], actual_features(features, touched), {})["both"]
        assert isinstance(found, ActualFeature)
        return found

    feature = both(points)
    assert feature.fit.radius == pytest.approx(15.0, abs=1e-9)
    assert abs(feature.fit.direction @ motion.rotation[:, 2]) == pytest.approx(1.0, abs=1e-12)
    assert feature.numbers == tuple(range(1, 25))
    jacobian = feature.jacobian.dense(len(points))
    for coordinate in (0, 7, 40, 3 * len(points)):
        ends = [both(nudged(points, coordinate, by)).fit.geometry for by in (1e-4, -1e-4)]
        off = (ends[0] - ends[1]) / 2e-4 - jacobian[:, coordinate]
        # Turning normals slide points along the axis, which leaves the cylinder as it is.
        off[POINT] -= (off[POINT] @ feature.fit.direction) * feature.fit.direction
        assert np.abs(off).max() < 1e-6
