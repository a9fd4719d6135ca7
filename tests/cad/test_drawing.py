"""Tolerances of a model become characteristics of a plan, or are refused by name.

Without the library: the model is a block of 100 by 60 by 20 mm with two bores and a shaft, written
down here with the numbers of its faces.
"""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from ocmm_cad.drawing import Account, AccountItem, general_of, plan_with_tolerances
from ocmm_cad.pmi import Annotation, Datum, DatumReference, DatumTarget, Dimension, Pmi, Tolerance
from ocmm_cad.step import LeftOut, StepModel
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan import EDITED, Plan, check_plan, new_plan
from tests.cad.pmi_texts import items_of


def plane(
    name: str, point: tuple[float, float, float], direction: tuple[float, float, float]
) -> Any:
    return NominalFeature(
        name=name, shape=Shape.PLANE, points=9, point=point, direction=direction,
        targets=((point[0], point[1], point[2]),) * 9,
    )  # fmt: skip


def bore(name: str, x: float, y: float, diameter: float = 12.0, side: Any = "inner") -> Any:
    return NominalFeature(
        name=name, shape=Shape.CYLINDER, points=12, point=(x, y, 10.0), direction=(0.0, 0.0, 1.0),
        diameter=diameter, length=20.0, side=side,
    )  # fmt: skip


FEATURES = (
    plane("TOP", (50, 30, 20), (0, 0, 1)),
    plane("BOTTOM", (50, 30, 0), (0, 0, -1)),
    plane("LEFT", (0, 30, 10), (-1, 0, 0)),
    plane("RIGHT", (100, 30, 10), (1, 0, 0)),
    plane("FRONT", (50, 0, 10), (0, -1, 0)),
    plane("STEP", (20, 30, 20), (0, 0, 1)),
    bore("BORE_1", 20, 20),
    bore("BORE_2", 80, 20),
    bore("SHAFT", 50, 40, 8.0, "outer"),
)
FILLET = LeftOut(bore("FILLET", 1, 1, 2.0), "it spans less than half a turn, as a fillet does")
FACES = {number: (feature.name,) for number, feature in enumerate(FEATURES, start=1)}
TOP, BOTTOM, LEFT, RIGHT, FRONT, STEP, BORE_1, BORE_2, SHAFT = range(1, 10)
ROUNDED, FREE, TWICE = 20, 21, 22
A, B, C = (
    Datum(entity=900 + face, name=letter, faces=(face,))
    for letter, face in (("A", BOTTOM), ("B", LEFT), ("C", FRONT))
)
DATUMS = (A, B, C)
ABC = tuple(DatumReference(labels=(letter,)) for letter in "ABC")
ONLY_A = ABC[:1]


def model(**pmi: Any) -> StepModel:
    words = {**dict.fromkeys(FACES, "Plane"), ROUNDED: "Cylinder", FREE: "b spline surface"}
    faces = {**FACES, ROUNDED: ("FILLET",), TWICE: ("PIN_1", "PIN_2")}
    said = Pmi(**{"datums": DATUMS, **pmi})
    return StepModel(FEATURES, (FILLET,), {}, None, said, faces, words)


def made(general: str = "", plan: Plan | None = None, **pmi: Any) -> tuple[Plan, Account]:
    plan = plan or msgspec.structs.replace(new_plan("P", "P"), features=list(FEATURES))
    done, account = plan_with_tolerances(plan, model(**pmi), general)
    check_plan(EDITED, done)
    return done, account


def size(*faces: int, **more: Any) -> Dimension:
    usual = {"entity": 30, "name": "S", "word": "diameter", "is_location": False, "of": "length",
             "nominal": 12.0, "lower": -0.2, "upper": 0.1, "faces": faces}  # fmt: skip
    return Dimension(**{**usual, **more})


def between(one: int, other: int, nominal: float | None, **more: Any) -> Dimension:
    usual = {"word": "linear distance", "is_location": True, "nominal": nominal, **more}
    return size(one, other_faces=(other,), **usual)


def zone(word: str, *faces: int, **more: Any) -> Tolerance:
    return Tolerance(
        **{"entity": 40, "name": "Z", "word": word, "size": 0.1, "faces": faces, **more}
    )


def of_size(item: Dimension, general: str = "") -> tuple[Plan, AccountItem]:
    plan, account = made(general, dimensions=(item,))
    return plan, items_of(account, "dimension")[0]


def of_zone(item: Tolerance, *others: Tolerance, **pmi: Any) -> tuple[Plan, AccountItem]:
    plan, account = made(tolerances=(item, *others), **pmi)
    return plan, items_of(account, "tolerance")[0]


def test_a_size_of_several_bores_is_one_characteristic_each() -> None:
    plan, said = of_size(size(BORE_1, BORE_2))
    assert said.status == "taken"
    assert said.became == ("S BORE_1", "S BORE_2")
    first = plan.characteristics[0]
    assert (first.kind, first.features, first.nominal) == ("diameter", ["BORE_1"], 12.0)
    assert (first.lower, first.upper) == (-0.2, 0.1)


def test_a_fit_gets_the_limits_of_the_tables() -> None:
    plan, said = of_size(size(BORE_1, fit="H7", lower=None, upper=None))
    assert said.status == "taken"
    assert "H7 by ISO 286-1: +18 +0" in said.remark
    (item,) = plan.characteristics
    assert (item.nominal, item.lower, item.upper) == (12.0, 0.0, 0.018)


def test_distances_and_angles_are_taken_between_two_features() -> None:
    plan, said = of_size(between(BOTTOM, TOP, 20.0))
    assert (said.status, plan.characteristics[0].features) == ("taken", ["BOTTOM", "TOP"])
    plan, said = of_size(between(LEFT, BORE_1, 20.0))
    assert plan.characteristics[0].kind == "distance"
    angle = between(BOTTOM, LEFT, 90.0)
    _, said = of_size(msgspec.structs.replace(angle, word="angle", of="angle"))
    assert said.status == "taken"
    _, said = of_size(msgspec.structs.replace(angle, word="angle", of="angle", nominal=60.0))
    assert "says 60 degrees" in said.why
    plan, said = of_size(size(BOTTOM, TOP, word="thickness", nominal=20.0))
    assert plan.characteristics[0].kind == "distance"


@pytest.mark.parametrize(
    ("item", "why"),
    [
        (size(BORE_1, nominal=12.7), "says 12.7 mm, but the diameter of BORE_1"),
        (size(BORE_1, nominal=0.4724), "says 0.4724 mm"),
        (size(BORE_1, word="radius"), "says 12 mm, but the radius of BORE_1"),
        (between(BOTTOM, TOP, 25.4), "says 25.4 mm, but the distance"),
        (between(BOTTOM, LEFT, 20.0), "but the distance"),
        (between(BOTTOM, BOTTOM, 20.0), "both of its ends are BOTTOM"),
        (between(BOTTOM, TOP, None), "gives it no value"),
        (between(BOTTOM, TOP, 20.0, word="x"), "the kind 'x' is not supported"),
        (size(BORE_1, fault="its value is absurd"), "its value is absurd"),
        (size(TOP), "TOP is a plane, which has no diameter"),
        (size(BORE_1, word="curve length"), "'curve length' is not supported"),
        (size(BORE_1, notes=("statistical",)), "its note 'statistical' is not supported"),
        (size(BORE_1, notes=("auxiliary",), lower=None, upper=None), "reference dimension"),
        (size(BORE_1, notes=("theoretical",)), "exact and has limits at once"),
        (size(BORE_1, fit="H12", lower=None, upper=None), "the fit H12; known are"),
        (size(BORE_1, fit="g6", lower=None, upper=None), "the fit g6 of a shaft, and BORE_1"),
        (size(BORE_1, fit="H7", lower=-0.1, upper=0.1), "the fit H7, which is taken for"),
        (size(BORE_1, lower=None, upper=None), "no general tolerance was asked for"),
        (size(), "names no faces"),
        (size(BORE_1, odd=("EDGE_CURVE",)), "not probed (edge curve)"),
        (size(ROUNDED), "as a fillet does"),
        (size(FREE), "of the kind b spline surface"),
        (size(TWICE), "stands 2 times in the assembly"),
        (size(777), "not found by the reader"),
        (size(BORE_1, of="angle", word="angle"), "BORE_1 is no cone"),
        (size(TOP, BOTTOM, LEFT, word="width", nominal=20.0), "two opposite faces only"),
    ],
)
def test_a_dimension_that_cannot_be_is_refused_by_name(item: Dimension, why: str) -> None:
    plan, said = of_size(item)
    assert why in said.why
    assert said.status == "refused"
    assert plan.characteristics == []


def test_of_several_surfaces_those_that_can_be_are_taken_and_the_rest_is_named() -> None:
    plan, said = of_size(size(BORE_1, ROUNDED, FREE))
    assert (said.status, len(plan.characteristics)) == ("partly", 1)
    assert "fillet" in said.why
    assert "b spline surface" in said.why
    # Between two features nothing is left over.
    assert of_size(between(LEFT, ROUNDED, 20.0))[1].status == "refused"


def test_a_basic_dimension_is_the_nominal_of_the_model_or_contradicts_it() -> None:
    basic = {"notes": ("theoretical",), "lower": None, "upper": None}
    plan, said = of_size(size(BORE_1, **basic))
    assert (said.became, plan.characteristics) == (("nominal of BORE_1",), [])
    assert "says 12.5 mm" in of_size(size(BORE_1, nominal=12.5, **basic))[1].why


def test_general_tolerances_stand_for_what_has_none_and_only_if_asked() -> None:
    open_size = size(BORE_1, lower=None, upper=None)
    plan, said = of_size(open_size, "iso2768-m")
    assert (plan.characteristics[0].lower, plan.characteristics[0].upper) == (-0.2, 0.2)
    assert "ISO 2768-m: ±0.2 mm" in said.remark
    plan, said = of_size(size(BORE_1), "iso2768-m")
    assert (plan.characteristics[0].upper, said.remark) == (0.1, "")
    with pytest.raises(InputError, match="iso2768-z"):
        of_size(open_size, "iso2768-z")


@pytest.mark.parametrize(
    ("letter", "sizes"),
    [
        # ISO 2768-1:1989, table 1, on both sides of every step; None outside the table.
        ("f", {0.4: None, 0.5: 0.05, 3: 0.05, 6: 0.05, 6.1: 0.1, 30: 0.1, 30.1: 0.15, 120: 0.15,
               400: 0.2, 1000: 0.3, 2000: 0.5, 2001: None}),
        ("m", {0.4: None, 3: 0.1, 6: 0.1, 6.1: 0.2, 30: 0.2, 120: 0.3, 400: 0.5, 1000: 0.8,
               2000: 1.2, 4000: 2.0, 4001: None}),
        ("c", {3: 0.2, 3.1: 0.3, 6: 0.3, 30: 0.5, 120: 0.8, 400: 1.2, 1000: 2.0, 2000: 3.0,
               4000: 4.0}),
        ("v", {3: None, 3.1: 0.5, 6: 0.5, 30: 1.0, 120: 1.5, 400: 2.5, 1000: 4.0, 2000: 6.0,
               4000: 8.0}),
    ],
)  # fmt: skip
def test_the_table_of_general_tolerances(letter: str, sizes: dict[float, float | None]) -> None:
    table = general_of(f"iso2768-{letter}")
    assert table is not None
    assert {nominal: table.deviation(nominal) for nominal in sizes} == sizes


def test_datums_align_the_plan_and_stand_with_the_tolerances() -> None:
    plan, said = of_zone(
        zone("position", BORE_1, zone="cylindrical or circular", datums=ABC, size=0.3)
    )
    assert said.status == "taken"
    assert plan.alignment is not None
    assert plan.alignment.features == ("BOTTOM", "LEFT", "FRONT")
    found = plan.characteristics[0]
    assert (found.datums, found.zone, found.upper) == (["BOTTOM", "LEFT", "FRONT"], "cylinder", 0.3)


def test_an_alignment_that_a_plan_has_stays() -> None:
    before, _ = made(tolerances=(zone("surface profile", TOP, datums=ABC),))
    other = tuple(DatumReference(labels=(letter,)) for letter in "CBA")
    before = msgspec.structs.replace(before, characteristics=[])
    plan, account = made(plan=before, tolerances=(zone("surface profile", TOP, datums=other),))
    assert plan.alignment == before.alignment
    assert plan.characteristics[0].datums == ["FRONT", "LEFT", "BOTTOM"]
    assert "keeps its alignment" in account.remarks[0]


def test_the_bonus_needs_the_limits_of_the_size_at_its_side() -> None:
    at_most = ("maximum material requirement",)
    least = ("least material requirement",)
    sizes = (size(BORE_1), size(SHAFT, entity=31, nominal=8.0))
    for face, modifiers, limit in (
        (BORE_1, at_most, 11.8), (BORE_1, least, 12.1), (SHAFT, at_most, 8.1), (SHAFT, least, 7.8),
    ):  # fmt: skip
        place = zone(
            "position", face, zone="cylindrical or circular", datums=ABC, modifiers=modifiers
        )
        plan, said = of_zone(place, dimensions=sizes)
        assert said.status == "taken"
        assert plan.characteristics[-1].material_size == limit
        # Without a size, or with two sizes, the limit is ambiguous.
        assert "no toleranced sizes" in of_zone(place)[1].why
        twice = (*sizes, *(msgspec.structs.replace(one, entity=50) for one in sizes))
        assert "2 toleranced sizes" in of_zone(place, dimensions=twice)[1].why


def test_a_lower_segment_is_form_and_orientation_alone() -> None:
    round_zone = "cylindrical or circular"
    for item, kind, datums, tube in (
        (zone("position", BORE_1, zone=round_zone, datums=ONLY_A, segment="lower"),
         "perpendicularity", ["BOTTOM"], "cylinder"),
        (zone("surface profile", TOP, datums=ABC, segment="lower"),
         "parallelism", ["BOTTOM", "LEFT", "FRONT"], ""),
        (zone("surface profile", LEFT, datums=ONLY_A, segment="lower"),
         "perpendicularity", ["BOTTOM"], ""),
        (zone("surface profile", TOP, LEFT, datums=(), segment="lower"), "surface profile", [], ""),
    ):  # fmt: skip
        plan, said = of_zone(item)
        assert said.status == "taken", said.why
        assert "form and orientation alone" in said.remark
        assert "open" not in said.remark
        (found,) = plan.characteristics
        assert (found.kind, found.datums, found.zone) == (kind, datums, tube)
        assert found.upper == item.size


@pytest.mark.parametrize(
    ("item", "why"),
    [
        (zone("position", BORE_1, datums=ABC), "which way the zone of BORE_1 lies"),
        (zone("position", TOP, BOTTOM, datums=ABC), "middle plane"),
        (zone("position", TOP, datums=ABC, zone="cylindrical or circular"), "TOP is a plane"),
        (zone("position", BORE_1, zone="spherical", datums=ABC), "not offered so"),
        (zone("position", BORE_1, zone="a cube", datums=ABC), "the form 'a cube'"),
        (zone("position", BORE_1, zone="cylindrical or circular", datums=ABC,
              modifiers=("free state",)), "'free state' is not supported"),
        (zone("perpendicularity", BORE_1, zone="cylindrical or circular", datums=ONLY_A,
              modifiers=("maximum material requirement",)), "perpendicularity with 'maximum"),
        (zone("perpendicularity", LEFT, RIGHT, datums=ONLY_A), "middle plane"),
        (zone("perpendicularity", BORE_1, datums=ONLY_A), "which way the zone"),
        (zone("parallelism", LEFT, datums=ONLY_A), "not parallel"),
        (zone("flatness", BORE_1), "not offered so"),
        (zone("flatness", TOP, datums=ONLY_A), "has no datums"),
        (zone("flatness", TOP, extras=("per unit of area",)), "per unit of area"),
        (zone("flatness", TOP, size=0.0), "tolerance of zero"),
        (zone("flatness", TOP, size=None), "tolerance of zero"),
        (zone("flatness", TOP, fault="its unit is unknown"), "its unit is unknown"),
        (zone("flatness"), "names no faces"),
        (zone("straightness", BORE_1), "straightness of lines"),
        (zone("concentricity", BORE_1, datums=ONLY_A), "median points"),
        (zone("line profile", BORE_1, datums=ABC), "not offered so"),
        (zone("surface profile", TOP, LEFT, datums=ABC, segment="lower"), "to each other"),
        (zone("position", BORE_1, datums=(), zone="cylindrical or circular", segment="lower"),
         "to each other"),
        (zone("position", BORE_1, datums=ONLY_A, zone="cylindrical or circular", segment="lower",
              modifiers=("maximum material requirement",)), "on the safe side"),
        (zone("surface profile", TOP, datums=(
            DatumReference(labels=("A",), modifiers=("maximum material requirement",)),)),
         "by hand without it, which is on the safe side"),
        (zone("surface profile", TOP, datums=(
            DatumReference(labels=("A",), modifiers=("translation",)),)),
         "by hand as the drawing means it"),
        (zone("surface profile", TOP, datums=(DatumReference(labels=("A", "B")),)), "A-B is a"),
        (zone("surface profile", TOP, datums=(DatumReference(labels=("Q",)),)), "datum Q is not"),
        (zone("surface profile", BOTTOM, datums=ONLY_A), "toleranced itself"),
        (zone("circular runout", BORE_1, datums=ABC), "not offered so"),
    ],
)  # fmt: skip
def test_a_tolerance_that_cannot_be_is_refused_by_name(item: Tolerance, why: str) -> None:
    plan, said = of_zone(item)
    assert why in said.why
    assert said.status == "refused"
    assert plan.characteristics == []


def test_zones_that_share_an_open_datum_system_are_refused() -> None:
    one = zone("position", BORE_1, zone="cylindrical or circular", datums=ONLY_A)
    assert of_zone(one)[1].status == "taken"
    assert "open" in of_zone(one)[1].remark
    pattern = msgspec.structs.replace(one, faces=(BORE_1, BORE_2))
    assert "must be met at once" in of_zone(pattern)[1].why
    other = msgspec.structs.replace(one, entity=41, faces=(BORE_2,))
    assert "must be met at once" in of_zone(one, other)[1].why
    # Held by three independent datums.
    held = msgspec.structs.replace(pattern, datums=ABC)
    assert len(of_zone(held)[0].characteristics) == 2


def test_datums_of_faces_in_one_plane_and_of_opposite_faces() -> None:
    whole = Datum(entity=1, name="D", faces=(TOP, STEP))
    middle = Datum(entity=2, name="M", faces=(LEFT, RIGHT))
    flat = zone("parallelism", BOTTOM, datums=(DatumReference(labels=("D",)),))
    plan, said = of_zone(flat, datums=(whole, middle, C))
    assert said.status == "taken"
    (datum,) = [one for one in plan.features if one.name == "DATUM_D"]
    assert datum.targets[:2] == (FEATURES[0].targets[0], FEATURES[5].targets[0])
    square = zone("perpendicularity", FRONT, datums=(DatumReference(labels=("M",)),))
    plan, said = of_zone(square, datums=(whole, middle, C))
    assert [one.name for one in plan.constructions] == ["DATUM_M"]
    assert plan.characteristics[0].datums == ["DATUM_M"]


@pytest.mark.parametrize(
    ("datum", "why"),
    [
        (Datum(entity=1, name="D", faces=(TOP, LEFT)), "made of 2 surfaces"),
        (Datum(entity=1, name="D", faces=(BORE_1, BORE_2)), "made of 2 surfaces"),
        (Datum(entity=1, name="D", faces=(ROUNDED,)), "fillet"),
        (Datum(entity=1, name="D", faces=(TOP,), targets=("D1",)), "datum targets"),
        (Datum(entity=1, name="D", fault="it has no letter"), "no letter"),
        (Datum(entity=1, name="D"), "names no faces"),
    ],
)
def test_a_datum_that_cannot_be_takes_its_tolerances_with_it(datum: Datum, why: str) -> None:
    flat = zone("parallelism", TOP, datums=(DatumReference(labels=("D",)),))
    _, account = made(tolerances=(flat,), datums=(datum,))
    for item in items_of(account, "datum", "tolerance", "datum reference"):
        assert item.status == "refused"
        assert why in item.why


def test_everything_stands_in_the_account_once() -> None:
    targets = (DatumTarget(entity=60, name="J1", word="line", datum="J"),)
    notes = (
        Annotation(entity=70, name="Text", text="2X INDIVIDUALLY", faces=(BORE_1,)),
        Annotation(entity=71, name="label", shows=(30,)),
        Annotation(entity=72, name="lost", shows=(9999,)),
    )
    tolerances = (zone("surface profile", TOP, datums=ABC), zone("flatness", TOP, entity=41))
    _, account = made(
        dimensions=(size(BORE_1),), tolerances=tolerances, targets=targets, annotations=notes
    )
    counts = {group: sum(found.values()) for group, found in account.counts().items()}
    assert counts == {
        "dimension": 1, "tolerance": 2, "datum reference": 3, "datum": 3, "datum target": 1,
        "annotation": 3,
    }  # fmt: skip
    assert all(bool(item.became) == (item.status != "refused") for item in account.items)
    assert all(bool(item.why) == (item.status != "taken") for item in account.items)
    assert "2X INDIVIDUALLY" in items_of(account, "dimension")[0].remark
    label, lost = items_of(account, "annotation")[1:]
    assert (label.became, lost.status) == (("S",), "refused")
    assert not account.is_complete


def test_a_model_in_doubt_gives_nothing_and_says_so() -> None:
    before = msgspec.structs.replace(new_plan("P", "P"), features=list(FEATURES))
    plan, account = made(dimensions=(size(BORE_1),), fault="its faces do not stand in the text")
    assert plan == before
    assert {item.status for item in account.items} == {"refused"}
    assert "do not stand in the text" in account.items[0].why
    plan, account = plan_with_tolerances(before, StepModel(FEATURES, (), {}))
    assert (plan, account.items) == (before, ())
    assert account.is_complete


def test_names_are_those_of_the_model_as_a_plan_can_have_them() -> None:
    names = [
        ("Maß Ø12; #1", "Maß Ø12 1"),
        ("=cmd|' /C'", "cmd /C"),
        ("", "item"),
        ("x" * 99, "x" * 60),
    ]
    for label, name in names:
        plan, _ = of_size(size(BORE_1, name=label))
        assert plan.characteristics[0].name == name
    twice = (size(BORE_1), size(SHAFT, entity=31, nominal=8.0))
    plan, _ = made(dimensions=twice)
    assert [one.name for one in plan.characteristics] == ["S", "S-2"]
