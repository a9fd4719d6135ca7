"""Every kind of characteristic on a part with exact errors."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from ocmm_core.alignment import BoundAlignment, DatumAlignment
from ocmm_core.features.shapes import Shape, nominal_geometry
from ocmm_core.tolerances.kinds import KINDS, MonteCarlo, evaluate
from ocmm_core.tolerances.zones import Characteristic, Evaluation, surface_points
from tests.core.features.exact_touches import moved
from tests.core.tolerances.known_errors import (
    RULE,
    TILT,
    a_way,
    frames,
    measured,
    scattered_at,
    scattered_frames,
)
from tests.core.tolerances.known_part import KnownPart, asked, face, motion, ring

pytestmark = pytest.mark.numerics

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
    (asked("length", "window"), 50.0),
    (asked("width", "window"), 16.0),
    (asked("angle", "top,ramp", nominal=120.0), 120.0),
    (asked("angle", "top,ramp", nominal=60.0), 60.0),
    (asked("angle", "pin,ramp", nominal=30.0), 30.0),
    (asked("distance", "pin,hole"), float(np.hypot(60.03, 0.04))),
    (asked("distance", "edge,hole"), 230.04),
    (asked("distance", "ball,pin"), float(np.hypot(80.02, 0.01))),
    (asked("distance", "pin,left"), 50.0),
    (asked("distance", "ball,pin", axis="z"), 25.02),
    (asked("thickness", "lug plus,lug minus"), 20.02),
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


@lru_cache(maxsize=200)
def of_scattered(index: int, way: int = 0, by: float = 0.0) -> Evaluation:
    """Return the evaluation of one of `KNOWN` on the noisy part."""
    return evaluate(KNOWN[index][0], scattered_at(way, by), RULE, scattered_frames(way, by))


STEP = 1e-5
INDICES = range(len(KNOWN))


VECTORS = {name for name, spec in KINDS.items() if spec.monte_carlo is MonteCarlo.VECTOR}
"""Kinds whose value is the length of a vector for a centre or an axis."""


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
        off = along @ found.component_gradients - found.gradient
        assert off.greatest() < 1e-9
    if found.noise is not None:
        deviations = found.noise.deviations
        width = 2.0 * np.abs(deviations).max() if found.noise.mirrored else np.ptp(deviations)
        assert float(width) == pytest.approx(found.value, abs=1e-6)
        assert len(found.noise.by_coordinates) == len(found.noise.deviations)
    kind = KNOWN[index][0].kind
    assert (found.components is None) == (kind not in VECTORS or found.noise is not None)


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
    # The face turns, and with it the apparent places of touches at many depths.
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
    slope = float(values[2].gradient @ np.append(shift.ravel(), 0.0))
    assert abs(difference) > 1.0
    assert slope == pytest.approx(difference, rel=0.02)
