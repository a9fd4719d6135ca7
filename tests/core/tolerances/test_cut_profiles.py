"""Sections: profile of a line cut out by a plane, and elements through these points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from ocmm_core.alignment import BoundAlignment, DatumReferenceFrame
from ocmm_core.errors import FitError
from ocmm_core.features.measured import (
    ActualFeature,
    Construction,
    actual_features,
    constructed_features,
    construction_fault,
)
from ocmm_core.features.shapes import POINT, Shape, nominal_geometry
from ocmm_core.geometry import Float
from ocmm_core.measuring import MeasuredPoint, PointFactors
from ocmm_core.tolerances.decisions import evaluate_all
from ocmm_core.tolerances.kinds import characteristic_fault, evaluate
from ocmm_core.tolerances.zones import Characteristic
from tests.core.features.exact_touches import nudged
from tests.core.tolerances.known_part import PLACES, KnownPart, asked, face, motion, ring
from tests.host import looser

pytestmark = pytest.mark.numerics

HEIGHTS = (-12.0, 0.0, 12.0)
LOBES = (0.01, 0.03, 0.02)
"""mm: amplitude of the waves of the shaft at each height."""
RADIUS = 15.0
DATUMS = "TOP,LEFT,FRONT"
RING: Construction = msgspec.convert(
    {
        "name": "RING", "kind": "best fit", "features": ("SHAFT",), "shape": "Circle",
        "through": "points", "plane": "CUT", "within": 0.5,
    },
    Construction,
)  # fmt: skip
RUNS = 500


def part(skew: float = 0.0, lobes: tuple[float, ...] = LOBES) -> KnownPart:
    """Return a shaft along z with another form at each height, and three datums.

    ``skew``, mm/rad: of the waves, so that one point is the farthest.
    """

    def waved(height: float, by: float) -> tuple[Float, Float]:
        return ring(
            motion(0.0, 0.0, height), RADIUS,
            bulge=lambda turn: by * np.cos(3.0 * turn) + skew * turn,
        )  # fmt: skip

    rings = [waved(*one) for one in zip(HEIGHTS, lobes, strict=True)]
    surface, normals = (np.vstack(rows) for rows in zip(*rings, strict=True))
    made = KnownPart(PLACES[0])
    made.add("TOP", Shape.PLANE, face(motion(0, 0, 30)), point=(0, 0, 30))
    left = motion(-40, 0, 0, 0, -np.pi / 2, 0)
    made.add("LEFT", Shape.PLANE, face(left), point=(-40, 0, 0), direction=(-1, 0, 0))
    front = motion(0, -40, 0, np.pi / 2, 0, 0)
    made.add("FRONT", Shape.PLANE, face(front), point=(0, -40, 0), direction=(0, -1, 0))
    made.add("CUT", Shape.PLANE, face(motion(0, 0, HEIGHTS[2])), point=(0, 0, HEIGHTS[2]))
    return made.add("SHAFT", Shape.CYLINDER, (surface, normals), diameter=2.0 * RADIUS)


def rule() -> BoundAlignment:
    nominals = part().nominals
    datums = DatumReferenceFrame(datums=tuple(DATUMS.split(",")))
    shapes = {one.name: one.shape for one in nominals}
    return BoundAlignment(datums, shapes, {one.name: nominal_geometry(one) for one in nominals})


def profile(height: float, **more: object) -> Characteristic:
    said = {"cut": (0.0, 0.0, 1.0), "cut_at": (5.0, 0.0, height), **more}
    return asked("line profile", "SHAFT", DATUMS, **said)


@pytest.mark.parametrize(("height", "wave"), list(zip(HEIGHTS, LOBES, strict=True)))
def test_each_section_has_its_own_profile(height: float, wave: float) -> None:
    found = evaluate(profile(height), part().actual(), rule())
    # The associated cylinder turns by some 1e-4 with the waves.
    assert found.value == pytest.approx(2.0 * wave, abs=5e-6)
    assert "12 points within 0.5 mm" in found.note
    assert found.seen is not None
    assert set(found.seen.features) == {"SHAFT"}
    assert len(found.seen.deviations) == 12
    assert abs(found.seen.deviations).max() == pytest.approx(wave, abs=5e-6)


def test_a_wide_section_is_the_surface_and_a_missed_one_nothing() -> None:
    actual = part().actual()
    whole = evaluate(asked("surface profile", "SHAFT", DATUMS), actual, rule())
    assert evaluate(profile(0.0, within=13.0), actual, rule()).value == whole.value
    with pytest.raises(FitError, match="0 points are within"):
        evaluate(profile(6.0), actual, rule())
    with pytest.raises(FitError, match="37° off the normal of SHAFT"):
        evaluate(profile(0.0, cut=(0.6, 0.0, 0.8), within=15.0), actual, rule())


def test_a_section_moves_with_every_touch() -> None:
    made = part(skew=0.001)
    found = evaluate(profile(0.0), made.actual(), rule())
    count = len(made.points)
    gradient = found.gradient.dense(count)
    for i in range(0, 3 * count + 1, 5):
        ends = [
            evaluate(profile(0.0), made.actual(nudged(made.points, i, by)), rule()).value
            for by in (1e-5, -1e-5)
        ]
        assert gradient[i] == pytest.approx((ends[0] - ends[1]) / 2e-5, abs=2e-3), i


def circles(made: KnownPart, points: list[MeasuredPoint]) -> dict[str, ActualFeature]:
    found = actual_features(made.nominals, points)
    found |= constructed_features([RING], found, {})
    return {k: v for k, v in found.items() if isinstance(v, ActualFeature)}


def test_a_circle_through_a_section_has_its_radius_and_place() -> None:
    made = part()
    found = circles(made, made.points)["RING"]
    # 12 places hold each wave with its opposite.
    assert found.fit.radius == pytest.approx(RADIUS, abs=1e-6)
    there = made.place.inverse().apply(found.fit.geometry[POINT])
    assert there == pytest.approx([0.0, 0.0, HEIGHTS[2]], abs=1e-6)
    assert len({*found.fit.residuals.round(6).tolist()}) > 1


def test_u_of_a_section_holds_the_truth(repeats: Callable[..., int]) -> None:
    """Own errors of 5 um, shared ones of 2 um, form of 4 um at each touched place."""
    runs = repeats(80, RUNS, 40)
    made = part(lobes=(0.0, 0.0, 0.0))
    count = len(made.points)
    shared = np.zeros((3 * count + 1, 4))
    shared[:-1, :3] = np.tile(0.002 * np.eye(3), (count, 1))
    shared[-1, 3] = 0.002
    factors = PointFactors(shared, np.tile(0.005**2 * np.eye(3), (count, 1, 1)))
    draw, rng = factors.draws(), np.random.default_rng(47)
    item = asked("radius", "RING", nominal=RADIUS, lower=-0.1)
    held = 0
    for _ in range(runs):
        (moves,) = draw(rng, 1)
        points = [
            replace(one, tip_world=one.tip_world + shift + (moves[-1] + by) * one.direction)
            for one, shift, by in zip(
                made.points, moves[:-1].reshape(-1, 3), 0.004 * rng.normal(size=count), strict=True
            )
        ]
        (result,) = evaluate_all([item], None, circles(made, points), factors, "simple")
        assert result.measured is not None, result.note
        assert result.uncertainty is not None
        held += abs(result.measured - RADIUS) <= result.uncertainty
    # Three standard errors of the runs about 95.5 %.
    assert held / runs == pytest.approx(0.955, abs=looser(0.028, runs, RUNS))


@pytest.mark.parametrize(
    ("item", "field"),
    [
        (asked("line profile", "SHAFT", DATUMS), "cut"),
        (asked("surface profile", "SHAFT", DATUMS, cut=(0, 0, 1)), "cut"),
        (profile(0.0, within=0.0), "within"),
        (profile(0.0), ""),
    ],
)
def test_a_section_without_a_place_is_refused(item: Characteristic, field: str) -> None:
    nominals = part().nominals
    shapes = {one.name: one.shape for one in nominals}
    geometries = {one.name: nominal_geometry(one) for one in nominals}
    fault = characteristic_fault(item, shapes, geometries, list(shapes), aligned=True)
    assert (fault[0] if fault else "") == field
    lost = characteristic_fault(item, shapes, geometries, list(shapes), aligned=False)
    assert lost is not None
    assert field or lost[0] == "cut"


@pytest.mark.parametrize(
    ("more", "field"), [({"through": "centres"}, "plane"), ({"plane": "SHAFT"}, "plane"), ({}, "")]
)
def test_a_circle_needs_points_and_a_plane(more: dict[str, object], field: str) -> None:
    made = msgspec.convert({**msgspec.to_builtins(RING), **more}, Construction)
    fault = construction_fault({one.name: one.shape for one in part().nominals}, [made])
    assert (fault[0].rpartition(".")[2] if fault else "") == field
