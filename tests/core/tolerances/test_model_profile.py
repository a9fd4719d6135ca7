"""Profile of a surface against faces of the model: value, gradient, U, and what gives no number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.model_profile import run
from ocmm_core.alignment import BoundAlignment, DatumReferenceFrame
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Shape, nominal_geometry
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.part_model import nominal_face, normals_at, places_at, searched_face
from ocmm_core.tolerances.kinds import characteristic_fault, evaluate
from ocmm_core.tolerances.zones import Characteristic
from tests.core.features.exact_touches import TIP_RADIUS, moved
from tests.core.part_model.model_faces import FREE_FORMS, cylinder, face_of
from tests.core.tolerances.known_part import PLACES, KnownPart, asked, face, motion

DATUMS = ("base", "left", "front")
COUNT = 16


def places(name: str, count: int = COUNT, seed: int = 1) -> tuple[Float, Float]:
    """Return places (count, 3) well inside a free form, and outward normals."""
    made = searched_face(face_of(FREE_FORMS[name]()))
    rng = np.random.default_rng(seed)
    side = int(np.sqrt(count))
    u, v = np.meshgrid(*[(np.arange(side) + 0.5) / side] * 2)
    at = np.stack([u.ravel(), v.ravel()], axis=1) + rng.uniform(-0.05, 0.05, (side * side, 2))
    return places_at(made.surface, at), normals_at(made.surface, at)


def part_of(name: str, form: Float, *, place: int = 0, datums: bool = True) -> KnownPart:
    """Return a part with a free form whose places are off by ``form`` (n,), mm, to the outside."""
    part = KnownPart(PLACES[place])
    if datums:
        part.add("base", Shape.PLANE, face(motion(20, 20, -40, np.pi, 0, 0), 60.0),
                 point=(20, 20, -40), direction=(0, 0, -1))  # fmt: skip
        part.add("left", Shape.PLANE, face(motion(-60, 0, -20, 0, -np.pi / 2, 0), 30.0),
                 point=(-60, 0, -20), direction=(-1, 0, 0))  # fmt: skip
        part.add("front", Shape.PLANE, face(motion(0, -60, -20, np.pi / 2, 0, 0), 30.0),
                 point=(0, -60, -20), direction=(0, -1, 0))  # fmt: skip
    points, normals = places(name)
    for i, (point, normal) in enumerate(zip(points, normals, strict=True)):
        part.add(f"P{i}", Shape.POINT, ((point + form[i] * normal)[None], normal[None]),
                 point=tuple(point.tolist()), direction=tuple(normal.tolist()))  # fmt: skip
    return part


def profile(name: str, datums: str = ",".join(DATUMS), **more: object) -> Characteristic:
    """Return the profile of a free form against its own face."""
    made = asked("surface profile", ",".join(f"P{i}" for i in range(COUNT)), datums, **more)
    return _with_faces(made, (nominal_face(face_of(FREE_FORMS[name]())),))


def _with_faces(made: Characteristic, faces: tuple[object, ...]) -> Characteristic:
    fields = {field: getattr(made, field) for field in made.__struct_fields__}
    return Characteristic(**{**fields, "faces": faces})


def rule(part: KnownPart) -> BoundAlignment:
    """Return the alignment of the three planes."""
    nominals = {item.name: nominal_geometry(item) for item in part.nominals}
    shapes = {item.name: item.shape for item in part.nominals}
    return BoundAlignment(DatumReferenceFrame(datums=DATUMS), shapes, nominals)


def form_of(seed: int, size: float = 0.02) -> Float:
    return np.asarray(np.random.default_rng(seed).uniform(-size, size, COUNT))


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize("name", FREE_FORMS)
def test_it_is_twice_the_greatest_deviation_from_the_model(name: str, place: int) -> None:
    form = form_of(2)
    part = part_of(name, form, place=place)
    found = evaluate(profile(name), part.actual(), None)
    # The datums are touched at their true places.
    assert found.value == pytest.approx(2.0 * np.abs(form).max(), abs=1e-8)
    assert found.association == "all points"
    assert found.frame == "base|left|front"
    assert "face 1 of the model" in found.note
    assert found.noise is not None
    assert found.noise.deviations[:COUNT] == pytest.approx(form, abs=1e-8)


def test_an_offset_zone_lies_outside_the_material() -> None:
    form = form_of(2) + 0.1
    found = evaluate(profile("waves", offset=0.1), part_of("waves", form).actual(), None)
    assert found.value == pytest.approx(2.0 * np.abs(form - 0.1).max(), abs=1e-8)
    assert "+0.1000 mm (UZ)" in found.note


@pytest.mark.parametrize("name", FREE_FORMS)
def test_without_datums_it_is_the_smallest_zone(name: str) -> None:
    """A part that lies off its frame shows its form alone, and less than in any frame near."""
    form = form_of(3)
    part = part_of(name, form)
    base = rule(part)
    shifted = RigidTransform(motion(0, 0, 0, 0.001, -0.002, 0.001).rotation, np.array([0.1, 0, 0]))
    part.points[27:] = moved_rigidly(part.points[27:], part.place, shifted)
    free = evaluate(profile(name, ""), part.actual(), base)
    assert free.value <= 2.0 * np.abs(form).max() + 1e-6
    assert free.value > 0.2 * np.abs(form).max()
    held = evaluate(profile(name), part.actual(), base)
    assert held.value > 0.1
    assert free.frame == "best fit"


def moved_rigidly(
    points: list[MeasuredPoint], place: RigidTransform, motion_: RigidTransform
) -> list[MeasuredPoint]:
    world = place.compose(motion_).compose(place.inverse())
    return [
        replace(
            point,
            tip_world=world.apply(point.tip_world),
            direction=world.rotation @ point.direction,
        )
        for point in points
    ]


@pytest.mark.parametrize("datums", [",".join(DATUMS), "base", ""])
def test_the_gradient_is_that_of_differences(datums: str) -> None:
    part = part_of("waves", form_of(5))
    base = rule(part)
    item = profile("waves", datums)
    found = evaluate(item, part.actual(), base)
    rng = np.random.default_rng(6)
    for _ in range(4):
        way = rng.normal(size=(len(part.points), 3))
        step = 1e-5
        ahead, behind = (
            evaluate(item, part.actual(moved(part.points, s * step * way)), base).value
            for s in (1.0, -1.0)
        )
        slope = float(found.gradient.dense(len(part.points))[:-1] @ way.ravel())
        # The smallest zone comes to rest within some nanometres.
        assert (ahead - behind) / (2.0 * step) == pytest.approx(slope, abs=1e-3)
    larger = [replace(point, tip_radius=point.tip_radius + 1e-4) for point in part.points]
    more = (evaluate(item, part.actual(larger), base).value - found.value) / 1e-4
    assert more == pytest.approx(float(found.gradient.by_radius), abs=1e-3)


def test_what_gives_no_number_is_named() -> None:
    part = part_of("waves", form_of(7))
    nominal = part.nominals[3]
    assert nominal.name == "P0"

    def with_first(tip: Float, direction: Float) -> dict[str, ActualFeature]:
        points = list(part.points)
        points[27] = replace(
            points[27], tip_world=part.place.apply(tip), direction=part.place.rotation @ direction
        )
        return part.actual(points)

    up = np.array([0.0, 0.0, 1.0])
    outside = with_first(np.array([-42.0, 3.0, 2.0]), up)
    with pytest.raises(FitError, match=r"Point 28 of P0 gives no deviation.*on an edge"):
        evaluate(profile("waves"), outside, None)
    far = with_first(np.array([1.0, 3.0, 20.0]), up)
    with pytest.raises(FitError, match=r"it lies \+1\d.\d mm off the faces"):
        evaluate(profile("waves"), far, None)
    point, normal = places("waves")[0][0], places("waves")[1][0]
    wrong = with_first(point + TIP_RADIUS * normal, -normal)
    with pytest.raises(FitError, match="approached 180° off the normal"):
        evaluate(profile("waves"), wrong, None)


def test_a_ball_that_does_not_fit_into_a_hollow_gives_no_number() -> None:
    part = KnownPart(PLACES[0])
    turn = np.linspace(0.3, 5.5, COUNT)
    radius = 1.55
    out = np.stack([np.cos(turn), np.sin(turn), np.zeros(COUNT)], axis=1)
    surface = radius * out + np.array([0, 0, 1.0]) * np.linspace(3, 27, COUNT)[:, None]
    part.add("bore", Shape.CYLINDER, (surface, -out), point=(0, 0, 15), diameter=2 * radius,
             side="inner")  # fmt: skip
    part.add("base", Shape.PLANE, face(motion(0, 0, 0)))
    narrow = nominal_face(face_of(cylinder(radius), outward=False))
    item = _with_faces(asked("surface profile", "bore", "base"), (narrow,))
    with pytest.raises(FitError, match=r"two places|centre of curvature"):
        evaluate(item, part.actual(), None)


def test_too_few_points_for_what_is_open_are_refused() -> None:
    part = part_of("waves", form_of(8))
    few = asked("surface profile", "P0,P1,P2,P3,P4,P5")
    item = _with_faces(few, (nominal_face(face_of(FREE_FORMS["waves"]())),))
    with pytest.raises(FitError, match="6 points, which any surface fits"):
        evaluate(item, part.actual(), rule(part))


def test_a_plan_can_ask_for_it_only_where_it_can_be() -> None:
    part = part_of("waves", form_of(9))
    shapes = {item.name: item.shape for item in part.nominals}
    nominals = {item.name: nominal_geometry(item) for item in part.nominals}

    def fault(item: Characteristic, *, aligned: bool = True) -> tuple[str, str] | None:
        return characteristic_fault(item, shapes, nominals, shapes, aligned=aligned)

    assert fault(profile("waves")) is None
    assert fault(profile("waves", "")) is None
    assert fault(profile("waves"), aligned=False) is None
    lost = fault(profile("waves", ""), aligned=False)
    assert lost is not None
    assert lost == ("faces", "need datums or an alignment, which say where the model is")
    held = nominal_face(face_of(FREE_FORMS["waves"]()))
    flat = fault(_with_faces(asked("flatness", "base"), (held,)))
    assert flat == ("faces", "go with profiles only")
    fields = {field: getattr(held, field) for field in held.__struct_fields__}
    broken = type(held)(**{**fields, "degree_u": 0})
    wrong = fault(_with_faces(profile("waves"), (held, broken)))
    assert wrong is not None
    assert wrong[0] == "faces[1]"


@pytest.mark.slow
@pytest.mark.statistics
def test_u_holds_its_word() -> None:
    """The full table, 2,100 values, is that of `benchmarks.model_profile`."""
    count = run(seed=5, jobs=20)
    assert count.values == 60
    # Three standard errors of 60: 8.5 % at 95 %.
    assert count.covered / count.values > 0.94 - 0.085
