"""Every kind of characteristic on a part with known errors."""

from __future__ import annotations

from dataclasses import replace as structs_replace
from functools import lru_cache

import msgspec
import numpy as np
import pytest

from ocmm_core.alignment.datums import DatumAlignment
from ocmm_core.alignment.rules import BoundAlignment
from ocmm_core.errors import FitError
from ocmm_core.features.actual import ActualFeature
from ocmm_core.features.nominal import nominal_geometry
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.tolerances.characteristic import COAXIAL, ORIENTATIONS, Characteristic
from ocmm_core.tolerances.evaluate import evaluate
from ocmm_core.tolerances.evaluation import Evaluation
from ocmm_core.tolerances.surface import surface_points
from ocmm_core.tolerances.zone_frame import Frames
from tests.core.features.exact_touches import moved
from tests.core.tolerances.known_part import PLACES, KnownPart, ball, edge, face, motion, ring

TILT = 1e-3
"""rad: of all that is tilted."""

RULE = DatumAlignment(primary="top", secondary=("pin", "hole"), origin="pin")


@lru_cache(maxsize=2)
def known(place: int = 0) -> KnownPart:
    """Return the part; its frame has the top as z and the pin as origin."""
    part = KnownPart(PLACES[place])
    h = 0.02
    add = part.add
    add("top", Shape.PLANE, face(motion(0, 0, 0)))
    # Square to the top, and turned about its normal, which a datum plane leaves open.
    left = motion(-50.0, 0, -20, 0, -np.pi / 2, 0)
    add("left", Shape.PLANE, face(left), point=(-50, 0, -20), direction=(-1, 0, 0))
    front = motion(0, -50.0, -20, np.pi / 2, 0, 0)
    add("front", Shape.PLANE, face(front), point=(0, -50, -20), direction=(0, -1, 0))
    add("pin", Shape.CYLINDER, ring(motion(0, 0, 0), 10.0, (5, 15, 25)), point=(0, 0, 15),
        diameter=20.0)  # fmt: skip
    off = motion(60.03, 0.04, 15)
    add("hole", Shape.CYLINDER, ring(off, 6.0, (-10, 0, 10), inner=True), point=(60, 0, 15),
        diameter=11.9, side="inner")  # fmt: skip
    add("leaning", Shape.CYLINDER, ring(motion(0, 60, 0, 0, TILT, 0), 8.0, (0, 10, 20, 30)),
        point=(0, 60, 15), diameter=16.0)  # fmt: skip
    add("wavy", Shape.PLANE, face(motion(0, 100, 5), 40.0, lambda x, y: h * x * y / 400.0),
        point=(0, 100, 5))  # fmt: skip
    add("steep", Shape.PLANE, face(motion(0, 140, 7, TILT, 0, 0)), point=(0, 140, 7))
    yaw = motion(80, 80, 0).compose(motion(0, 0, 0, 0, 0, 0.02)).compose(
        motion(0, 0, 0, 0, np.pi / 2 + TILT, 0))  # fmt: skip
    add("wall", Shape.PLANE, face(yaw), point=(80, 80, 0), direction=(1, 0, 0))
    add("ramp", Shape.PLANE, face(motion(150, 0, 0, 0, np.pi / 3, 0)), point=(150, 0, 0),
        direction=(0.75**0.5, 0, 0.5))  # fmt: skip
    three = ring(motion(0, -90, 3), 15.0, bulge=lambda t: h * np.cos(3 * t))
    add("lobed", Shape.CIRCLE, three, point=(0, -90, 3), diameter=30.0)
    oval = ring(motion(50, -90, 3), 15.0, bulge=lambda t: h * np.cos(2 * t), inner=True)
    add("oval", Shape.CIRCLE, oval, point=(50, -90, 3), diameter=30.0, side="inner")
    tube = ring(motion(0, -150, 0), 12.0, (0, 20, 40), bulge=lambda t: h * np.cos(3 * t))
    add("tube", Shape.CYLINDER, tube, point=(0, -150, 20), diameter=24.0)
    bent = [ring(motion(x, -200, z), 9.0) for x, z in ((0, 0), (0.03, 20), (0, 40))]
    add("bent", Shape.CYLINDER, (np.vstack([b[0] for b in bent]), np.vstack([b[1] for b in bent])),
        point=(0, -200, 20), diameter=18.0)  # fmt: skip
    add("edge", Shape.LINE, edge(motion(0, -230, 0), [h, -h, h, -h, h], 40.0),
        point=(0, -230, 0), direction=(1, 0, 0))  # fmt: skip
    add("ball", Shape.SPHERE, ball(motion(-80.02, 0.01, 40.02), 12.01), point=(-80, 0, 40),
        diameter=24.0)  # fmt: skip
    add("neck", Shape.CYLINDER, ring(motion(0.05, 0, 0), 7.0, (30, 40)), point=(0, 0, 35),
        diameter=14.0)  # fmt: skip
    add("collar", Shape.CIRCLE, ring(motion(0.05, 0, 45), 6.0), point=(0, 0, 45), diameter=12.0)
    swash = motion(0, 0, 50, TILT, 0, 0)
    radial = ring(swash, 16.0)
    add("disc", Shape.PLANE, (radial[0], np.tile(swash.rotation[:, 2], (12, 1))), point=(0, 0, 50))
    plus = motion(0, 10.04, -20, -np.pi / 2, 0, 0)
    minus = motion(0, -9.98, -20, np.pi / 2, 0, 0)
    add("lug plus", Shape.PLANE, face(plus), point=(0, 10, -20), direction=(0, 1, 0))
    add("lug minus", Shape.PLANE, face(minus), point=(0, -10, -20), direction=(0, -1, 0))
    middle = motion(0, 0, -20, np.pi / 2, 0, 0)
    add("middle", Shape.PLANE, face(middle), point=(0, 0, -20), direction=(0, -1, 0))
    return part


@lru_cache(maxsize=2)
def measured(place: int = 0) -> dict[str, ActualFeature]:
    """Return the features of the part."""
    return known(place).actual()


@lru_cache(maxsize=4)
def frames(place: int = 0) -> Frames:
    """Return the frames of the part."""
    return Frames(measured(place), RULE)


def asked(kind: str, features: str, datums: str = "", **more: object) -> Characteristic:
    """Return a characteristic of features and datums that are listed with commas."""
    listed = [[name for name in text.split(",") if name] for text in (features, datums)]
    said = {"name": "it", "kind": kind, "features": listed[0], "datums": listed[1], "upper": 0.1}
    return msgspec.convert({**said, **more}, Characteristic)


H2 = 0.04
"""Twice the amplitude of every wave of the part."""

KNOWN: list[tuple[Characteristic, float]] = [
    (asked("flatness", "wavy"), H2),
    (asked("form", "wavy"), H2),
    (asked("flatness", "wavy", association="least squares"), H2),
    (asked("roundness", "lobed"), H2),
    (asked("roundness", "tube"), H2),
    (asked("cylindricity", "tube"), H2),
    (asked("straightness", "edge"), H2),
    (asked("straightness", "bent"), 0.03),
    (asked("diameter", "oval"), 30.0),
    (asked("diameter", "oval", association="inscribed"), 30.0 - H2),
    (asked("diameter", "oval", association="circumscribed"), 30.0 + H2),
    (asked("diameter", "oval", association="minimum zone"), 30.0),
    (asked("diameter", "oval", association="two-point maximum"), 30.0 + H2),
    (asked("diameter", "oval", association="two-point minimum"), 30.0 - H2),
    (asked("radius", "oval", association="two-point mean"), 15.0),
    (asked("radius", "pin"), 10.0),
    (asked("angle", "top,ramp", nominal=120.0), 120.0),
    (asked("angle", "top,ramp", nominal=60.0), 60.0),
    (asked("angle", "pin,ramp", nominal=30.0), 30.0),
    (asked("distance", "pin,hole"), float(np.hypot(60.03, 0.04))),
    (asked("distance", "edge,hole"), 230.04),
    (asked("distance", "ball,pin"), float(np.hypot(80.02, 0.01))),
    (asked("distance", "pin,left"), 50.0),
    (asked("distance", "ball,pin", axis="z"), 25.02),
    (asked("parallelism", "steep", "top"), 40.0 * np.sin(TILT)),
    (asked("parallelism", "pin", "hole"), 0.0),
    (asked("parallelism", "left", "pin"), 0.0),
    (asked("parallelism", "edge", "top"), 0.0),
    (asked("perpendicularity", "wall", "top"), 40.0 * np.sin(TILT)),
    (asked("perpendicularity", "wall", "top,left"),
     40.0 * (np.sin(0.02) * np.cos(TILT) + np.sin(TILT))),
    (asked("perpendicularity", "leaning", "top"), 30.0 * np.sin(TILT)),
    (asked("perpendicularity", "leaning", "top", length=60.0), 60.0 * np.sin(TILT)),
    (asked("perpendicularity", "leaning", "top,left", zone="planes", axis="x"),
     30.0 * np.sin(TILT)),
    (asked("angularity", "ramp", "top"), 0.0),
    (asked("angularity", "ramp", "top,left"), 0.0),
    (asked("position", "hole", "top,left,front"), 0.1),
    (asked("position", "hole", "top,left,front", zone="planes", axis="x"), 0.06),
    (asked("position", "hole", "top,left,front", zone="planes", axis="y"), 0.08),
    (asked("position", "hole", "top,pin"), 0.06),
    (asked("position", "ball", "top,left,front"), 0.06),
    (asked("position", "ball", "top,left,front", zone="cylinder"), 2.0 * np.hypot(0.02, 0.01)),
    (asked("position", "collar", "top,left,front"), 0.1),
    (asked("position", "leaning", "top,left,front"), 2.0 * 30.0 * np.sin(TILT)),
    (asked("position", "steep", "top,left,front"), 40.0 * np.sin(TILT)),
    (asked("position", "wavy", "top"), H2),
    (asked("coaxiality", "neck", "pin"), 0.1),
    (asked("concentricity", "collar", "pin"), 0.1),
    (asked("symmetry", "lug plus,lug minus", "middle"), 0.06),
    (asked("surface profile", "ball"), 0.02),
    (asked("surface profile", "ball", offset=0.01), 0.0),
    (asked("surface profile", "wavy"), H2),
    (asked("surface profile", "wavy", "top"), H2),
    (asked("surface profile", "steep", "top,left,front"), 40.0 * np.sin(TILT)),
    (asked("line profile", "lobed"), H2),
    (asked("line profile", "oval", "top,left,front"), H2),
    (asked("circular runout", "neck", "pin"), 0.1),
    (asked("circular runout", "collar", "pin"), 0.1),
    (asked("circular runout", "disc", "pin"), 32.0 * np.sin(TILT)),
    (asked("total runout", "neck", "pin"), 0.1),
    (asked("total runout", "tube", "tube"), H2),
    (asked("total runout", "disc", "pin"), 32.0 * np.sin(TILT)),
]  # fmt: skip


def name_of(item: object) -> str:
    if not isinstance(item, Characteristic):
        return ""
    words = [item.kind, "+".join(item.features), "|".join(item.datums), item.association,
             item.zone, item.axis, str(item.nominal or ""), str(item.length or ""),
             str(item.offset or "")]  # fmt: skip
    return "-".join(word for word in words if word)


@pytest.mark.parametrize(("item", "truth"), KNOWN, ids=name_of)
def test_exact_touches_give_the_known_value(item: Characteristic, truth: float) -> None:
    # Tilts of 1e-3 and waves of 0.02 mm bend contact points by their squares over the size.
    found = evaluate(item, measured(), RULE, frames())
    assert found.value == pytest.approx(truth, abs=3e-5)


@pytest.mark.parametrize("item", [item for item, _ in KNOWN], ids=name_of)
def test_the_place_of_the_part_changes_nothing(item: Characteristic) -> None:
    here, there = (evaluate(item, measured(place), RULE, frames(place)) for place in (0, 1))
    # Contact points follow the fits, which know directions to some 1e-12 at 1 m.
    assert there.value == pytest.approx(here.value, abs=1e-8)


@lru_cache(maxsize=1)
def scattered() -> tuple[KnownPart, Float]:
    """Return the part with noise of 0.01 mm on every coordinate: no two points are alike."""
    part = known()
    noise = np.random.default_rng(11).normal(0.0, 0.01, (len(part.points), 3))
    return part, noise


@lru_cache(maxsize=16)
def scattered_at(way: int, by: float) -> dict[str, ActualFeature]:
    """Return the features of the noisy part, all coordinates moved ``by`` along one way."""
    part, noise = scattered()
    shift, ball_shift = a_way(way)
    points = moved(part.points, noise + by * shift)
    radius = points[0].tip_radius + by * ball_shift
    return part.actual([structs_replace(point, tip_radius=radius) for point in points])


@lru_cache(maxsize=16)
def scattered_frames(way: int, by: float) -> Frames:
    """Return their frames."""
    return Frames(scattered_at(way, by), RULE)


@lru_cache(maxsize=200)
def of_scattered(index: int, way: int = 0, by: float = 0.0) -> Evaluation:
    """Return the evaluation of one of `KNOWN` on the noisy part."""
    return evaluate(KNOWN[index][0], scattered_at(way, by), RULE, scattered_frames(way, by))


def a_way(way: int) -> tuple[Float, float]:
    """Return a direction in the space of all coordinates: of the ball centres, and the ball."""
    rng = np.random.default_rng(100 + way)
    return rng.normal(size=(len(known().points), 3)), float(rng.normal())


STEP = 1e-5
INDICES = range(len(KNOWN))


VECTORS = ORIENTATIONS | COAXIAL | {"position"}
"""Kinds whose value is the length of a vector where it is of a centre or an axis."""


def name_at(index: int) -> str:
    return name_of(KNOWN[index][0])


@pytest.mark.parametrize("index", INDICES, ids=name_at)
def test_the_gradient_is_that_of_the_whole_way(index: int) -> None:
    shift, ball_shift = a_way(0)
    ahead, behind = (of_scattered(index, 0, by).value for by in (STEP, -STEP))
    slope = float(of_scattered(index).gradient @ np.append(shift.ravel(), ball_shift))
    # Jacobians are first order in the residuals: 0.03 mm on 6 to 20 mm, of some ten coordinates
    # of size one each.
    assert slope == pytest.approx((ahead - behind) / (2.0 * STEP), abs=0.03)


@pytest.mark.parametrize("index", INDICES, ids=name_at)
def test_components_and_deviations_make_the_value(index: int) -> None:
    found = of_scattered(index)
    if found.components is not None and found.component_gradients is not None:
        assert float(np.linalg.norm(found.components)) == pytest.approx(found.value, rel=1e-9)
        along = found.components / found.value
        assert along @ found.component_gradients == pytest.approx(found.gradient, abs=1e-9)
    if found.noise is not None:
        assert float(np.ptp(found.noise.deviations)) == pytest.approx(found.value, abs=1e-6)
        size = (len(found.noise.deviations), found.gradient.size)
        assert found.noise.by_coordinates.shape == size
    kind = KNOWN[index][0].kind
    assert (found.components is None) == (kind not in VECTORS or found.noise is not None)


@pytest.mark.parametrize(
    ("side", "modifier", "limit", "size", "bonus"),
    [
        ("inner", "maximum material", 11.9, 12.0, 0.1),
        ("inner", "maximum material", 12.0, 12.0, 0.0),
        ("inner", "maximum material", 12.1, 12.0, 0.0),
        ("inner", "least material", 12.1, 12.0, 0.1),
        ("inner", "least material", 11.9, 12.0, 0.0),
        ("outer", "maximum material", 12.1, 12.0, 0.1),
        ("outer", "maximum material", 11.9, 12.0, 0.0),
        ("outer", "least material", 11.9, 12.0, 0.1),
        ("outer", "", 0.0, 12.0, 0.0),
    ],
)
def test_bonus_of_material(
    side: str, modifier: str, limit: float, size: float, bonus: float
) -> None:
    part = KnownPart()
    part.add("top", Shape.PLANE, face(motion(0, 0, 0)))
    part.add("left", Shape.PLANE, face(motion(-50, 0, -20, 0, -np.pi / 2, 0)),
             point=(-50, 0, -20), direction=(-1, 0, 0))  # fmt: skip
    part.add("front", Shape.PLANE, face(motion(0, -50, -20, np.pi / 2, 0, 0)),
             point=(0, -50, -20), direction=(0, -1, 0))  # fmt: skip
    probed = ring(motion(60.03, 0.04, 0), size / 2.0, inner=side == "inner")
    part.add("it", Shape.CIRCLE, probed, point=(60, 0, 0), diameter=size, side=side)
    item = asked("position", "it", "top,left,front", modifier=modifier, material_size=limit)
    found = evaluate(item, part.actual(), None)
    assert found.value == pytest.approx(0.1, abs=1e-6)
    assert found.bonus == pytest.approx(bonus, abs=1e-9)
    if bonus > 0.0:
        assert found.bonus_gradient is not None
        # The ball's radius counts twice in the size, and so in the bonus.
        assert abs(found.bonus_gradient[-1]) == pytest.approx(2.0, abs=1e-9)


def test_few_points_are_told_and_too_few_refused() -> None:
    part = KnownPart()
    surface, normals = face(motion(0, 0, 0))
    for count in (3, 6, 9):
        rows = [0, 2, 6, 8, 4, 1, 3, 5, 7][:count]
        part.add(f"plane {count}", Shape.PLANE, (surface[rows], normals[rows]))
    actual = part.actual()
    with pytest.raises(FitError, match="plane 3 has 3 points; a plane shows a form from 4"):
        evaluate(asked("flatness", "plane 3"), actual, None)
    few = evaluate(asked("flatness", "plane 6"), actual, None)
    assert "Few points: plane 6 has 6 of 9 recommended" in few.note
    part.add("ball", Shape.SPHERE, ball(motion(0, 0, 50), 10.0), diameter=20.0)
    height = evaluate(asked("distance", "ball,plane 6"), part.actual(), None)
    assert height.note == "Form not evaluated: plane 6 has 6 of 9 recommended."
    assert evaluate(asked("flatness", "plane 9"), actual, None).note == ""


def test_points_that_are_not_in_sections_show_no_circular_runout() -> None:
    part = KnownPart()
    part.add("pin", Shape.CYLINDER, ring(motion(0, 0, 0), 10.0, (0, 20)), diameter=20.0)
    surface, normals = ring(motion(0, 0, 30), 8.0)
    spiral = surface + np.linspace(0.0, 20.0, 12)[:, None] * [0.0, 0.0, 1.0]
    part.add("spiral", Shape.CYLINDER, (spiral, normals), diameter=16.0)
    with pytest.raises(FitError, match="spiral do not lie in sections"):
        evaluate(asked("circular runout", "spiral", "pin"), part.actual(), None)
    total = evaluate(asked("total runout", "spiral", "pin"), part.actual(), None)
    assert total.value == pytest.approx(0.0, abs=1e-9)


def test_values_without_a_sense_are_refused() -> None:
    with pytest.raises(FitError, match="in one place"):
        evaluate(asked("distance", "pin,bent", axis="z"), level(), RULE)
    with pytest.raises(FitError, match="has no sense at 90"):
        evaluate(asked("angle", "pin,edge", nominal=90.0), measured(), RULE)


def level() -> dict[str, ActualFeature]:
    """Return the features with the bent pin beside the straight one."""
    actual = dict(measured())
    actual["bent"] = actual["pin"]
    return actual


def test_the_part_frame_need_not_be_that_of_the_nominals() -> None:
    rule = DatumAlignment(primary="top", secondary=("pin", "hole"), origin="hole")
    item = asked("position", "collar")

    def of(way: int, by: float) -> Evaluation:
        actual = scattered_at(way, by)
        nominals = {name: nominal_geometry(found.nominal) for name, found in actual.items()}
        shapes = {name: found.fit.shape for name, found in actual.items()}
        return evaluate(item, actual, BoundAlignment(rule, shapes, nominals))

    exact = measured()
    nominals = {name: nominal_geometry(found.nominal) for name, found in exact.items()}
    shapes = {name: found.fit.shape for name, found in exact.items()}
    found = evaluate(item, exact, BoundAlignment(rule, shapes, nominals))
    # The hole, 60 mm from the pin in the plan, is 60.03 mm from it, and the collar 0.05 mm off.
    assert found.value == pytest.approx(0.04, abs=1e-4)
    shift, ball_shift = a_way(0)
    slope = float(of(0, 0.0).gradient @ np.append(shift.ravel(), ball_shift))
    ahead, behind = (of(0, by).value for by in (STEP, -STEP))
    assert slope == pytest.approx((ahead - behind) / (2.0 * STEP), abs=0.03)


@pytest.mark.parametrize("name", ["top", "pin", "hole", "ball", "oval", "edge"])
def test_surface_points_follow_everything_that_was_measured(name: str) -> None:
    weights = np.random.default_rng(3).normal(size=scattered_at(0, 0.0)[name].fit.residuals.shape)
    along = np.random.default_rng(4).normal(size=(len(weights), 3)) * weights[:, None]
    shift, ball_shift = a_way(0)

    def total(by: float) -> float:
        return float(np.sum(along * surface_points(scattered_at(0, by)[name]).points))

    slope = surface_points(scattered_at(0, 0.0)[name]).pull_back(along)
    found = float(slope @ np.append(shift.ravel(), ball_shift))
    assert found == pytest.approx((total(STEP) - total(-STEP)) / (2.0 * STEP), abs=0.02)


@pytest.mark.parametrize("association", ["minimum zone", "least squares"])
def test_roundness_in_the_plane_of_a_face_follows_that_face(association: str) -> None:
    part = KnownPart()
    part.add("top", Shape.PLANE, face(motion(0, 0, 0)))
    surface, normals = ring(motion(0, 0, 0), 12.0, inner=True)
    deep = surface - 8.0 * np.abs(np.sin(2.4 * np.arange(12.0)))[:, None] * [0.0, 0.0, 1.0]
    part.add("bore", Shape.CIRCLE, (deep, normals), diameter=24.0, side="inner", projection="top")
    rng = np.random.default_rng(8)
    noise = rng.normal(0.0, 0.01, (len(part.points), 3))
    # The face turns, and so does what is seen of touches at many depths.
    lever = np.array([point.tip_world for point in part.points[:9]])
    lever = lever - lever.mean(axis=0)
    shift = np.zeros_like(noise)
    shift[:9] = np.outer(lever @ part.place.rotation[:, 0], part.place.rotation[:, 2])
    item = asked("roundness", "bore", association=association)
    values = [
        evaluate(item, part.actual(moved(part.points, noise + by * shift)), None)
        for by in (1e-6, -1e-6, 0.0)
    ]
    difference = (values[0].value - values[1].value) / 2e-6
    slope = float(values[2].gradient[:-1] @ shift.ravel())
    assert abs(difference) > 1.0
    assert slope == pytest.approx(difference, rel=0.02)
