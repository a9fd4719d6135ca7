"""Impossible requests of a plan: each refusal names the field."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from ocmm_core.features.shapes import Shape, element
from ocmm_core.tolerances.kinds import characteristic_fault
from ocmm_core.tolerances.zones import Characteristic

SHAPES = {
    "top": Shape.PLANE,
    "side": Shape.PLANE,
    "far side": Shape.PLANE,
    "bore": Shape.CYLINDER,
    "hole": Shape.CIRCLE,
    "ball": Shape.SPHERE,
    "cone": Shape.CONE,
    "slot": Shape.ROUND_SLOT,
    "edge": Shape.LINE,
    "dot": Shape.POINT,
    "ring": Shape.TORUS,
    "middle": Shape.PLANE,
    "lost": Shape.POINT,
}
DIRECTIONS = {
    "side": (1.0, 0.0, 0.0),
    "far side": (-1.0, 0.0, 0.0),
    "edge": (1.0, 0.0, 0.0),
    "middle": (1.0, 0.0, 0.0),
}
NOMINALS = {
    name: element(np.zeros(3), DIRECTIONS.get(name, (0.0, 0.0, 1.0)))
    for name in SHAPES
    if name != "lost"
}
PROBED = set(SHAPES) - {"middle", "lost"}


def fault(said: dict[str, object], *, aligned: bool = True) -> tuple[str, str] | None:
    """Return the fault of a characteristic."""
    item = msgspec.convert({"name": "it", "upper": 0.1, **said}, Characteristic)
    return characteristic_fault(item, SHAPES, NOMINALS, PROBED, aligned=aligned)


GOOD: list[dict[str, object]] = [
    {"kind": "diameter", "features": ["cone"], "datums": ["top"], "at": 5.0, "nominal": 20.0},
    {"kind": "diameter", "features": ["hole"], "association": "two-point maximum"},
    {"kind": "width", "features": ["ring"]},
    {"kind": "width", "features": ["slot"], "association": "two-point minimum"},
    {"kind": "distance", "features": ["side", "far side"], "association": "two-point maximum"},
    {"kind": "distance", "features": ["edge", "bore"], "axis": "y"},
    {"kind": "angle", "features": ["cone"]},
    {"kind": "straightness", "features": ["bore"]},
    {"kind": "parallelism", "features": ["edge"], "datums": ["top"]},
    {"kind": "perpendicularity", "features": ["side"], "datums": ["top", "edge"]},
    {"kind": "perpendicularity", "features": ["bore"], "datums": ["top"], "length": 20.0},
    {"kind": "angularity", "features": ["cone"], "datums": ["side"]},
    {"kind": "position", "features": ["slot"], "datums": ["top", "bore"],
     "modifier": "maximum material", "material_size": 7.9},
    {"kind": "position", "features": ["hole"], "zone": "planes", "axis": "x"},
    {"kind": "position", "features": ["middle"], "datums": ["top"]},
    {"kind": "coaxiality", "features": ["bore"], "datums": ["cone"]},
    {"kind": "symmetry", "features": ["side", "far side"], "datums": ["middle"]},
    {"kind": "symmetry", "features": ["slot"], "datums": ["bore"]},
    {"kind": "surface profile", "features": ["top", "side"], "offset": 0.02},
    {"kind": "circular runout", "features": ["cone"], "datums": ["bore"]},
]  # fmt: skip


@pytest.mark.parametrize("said", GOOD, ids=lambda said: f"{said['kind']}-{said['features']}")
def test_what_can_be_asked_for(said: dict[str, object]) -> None:
    assert fault(said) is None


BAD: list[tuple[dict[str, object], str, str]] = [
    ({"kind": "diameter", "features": ["top"]}, "features", "'top', but needs one of: circle"),
    ({"kind": "diameter", "features": ["gone"]}, "features", "not a feature of the plan"),
    ({"kind": "diameter", "features": ["cone"]}, "datums", "which needs the plane"),
    ({"kind": "diameter", "features": ["hole"], "datums": ["top"]}, "datums", "of a cone"),
    ({"kind": "diameter", "features": ["hole"], "at": 1.0}, "at", "of a cone only"),
    ({"kind": "diameter", "features": ["ring"], "association": "inscribed"}, "association",
     "only for circle, sphere and cylinder"),
    ({"kind": "width", "features": ["hole"]}, "features", "needs one of: ellipse"),
    ({"kind": "width", "features": ["ring"], "association": "two-point mean"}, "association",
     "only for slots and rectangles"),
    ({"kind": "width", "features": ["slot"], "association": "inscribed"}, "association",
     "is left out, or one of: 'two-point maximum'"),
    ({"kind": "length", "features": ["slot"], "association": "two-point mean"}, "association",
     "needs straight ends"),
    ({"kind": "distance", "features": ["side", "hole"], "association": "two-point mean"},
     "association", "needs two opposite planes"),
    ({"kind": "distance", "features": ["side", "far side"], "association": "two-point mean",
      "axis": "x"}, "association", "and no 'axis'"),
    ({"kind": "position", "features": ["hole"], "datums": ["top", "bore (M)"]}, "datums",
     "asks for 'bore' with a modifier of material; datums are taken regardless of their size"),
    ({"kind": "position", "features": ["hole"], "datums": ["top", "boreⓁ"]}, "datums",
     "asks for 'bore' with a modifier"),
    ({"kind": "position", "features": ["hole"], "datums": ["top", "pin (M)"]}, "datums",
     "'pin (M)', which is not a feature"),
    ({"kind": "distance", "features": ["hole"]}, "features", "a distance needs 2"),
    ({"kind": "distance", "features": ["hole", "hole"]}, "features", "names one feature twice"),
    ({"kind": "angle", "features": ["top"]}, "features", "needs two, or one cone"),
    ({"kind": "coordinate", "features": ["dot"]}, "axis", "is missing"),
    ({"kind": "flatness", "features": ["top"], "axis": "z"}, "axis", "goes with coordinates"),
    ({"kind": "flatness", "features": ["hole"]}, "features", "needs one of: plane"),
    ({"kind": "form", "features": ["dot"]}, "features", "needs one of: line"),
    ({"kind": "flatness", "features": ["top"], "association": "inscribed"}, "association",
     "'minimum zone' or 'least squares'"),
    ({"kind": "flatness", "features": ["top"], "nominal": 1.0}, "nominal", "has no nominal"),
    ({"kind": "flatness", "features": ["top"], "lower": -0.1}, "lower", "an upper limit only"),
    ({"kind": "flatness", "features": ["top"], "upper": 0.0}, "upper", "greater than zero"),
    ({"kind": "diameter", "features": ["hole"], "lower": 0.2}, "upper", "below 'lower'"),
    ({"kind": "flatness", "features": ["top"], "datums": ["side"]}, "datums", "needs 0"),
    ({"kind": "parallelism", "features": ["top"]}, "datums", "a parallelism needs 1 to 3"),
    ({"kind": "parallelism", "features": ["top"], "datums": ["top"]}, "datums",
     "toleranced itself"),
    ({"kind": "parallelism", "features": ["top"], "datums": ["ball"]}, "datums",
     "'ball', but needs one of"),
    ({"kind": "parallelism", "features": ["top"], "datums": ["side"]}, "features",
     "is not parallel to that of 'side'"),
    ({"kind": "perpendicularity", "features": ["bore"], "datums": ["side"]}, "features",
     "is not square to that of 'side'"),
    ({"kind": "parallelism", "features": ["middle"], "datums": ["side"]}, "features",
     "constructed and has no surface"),
    ({"kind": "parallelism", "features": ["top"], "datums": ["far side"], "zone": "cylinder"},
     "zone", "that of a plane is two planes"),
    ({"kind": "parallelism", "features": ["bore"], "datums": ["cone"], "zone": "sphere"}, "zone",
     "for the position of a centre"),
    ({"kind": "flatness", "features": ["top"], "zone": "planes"}, "zone", "position and"),
    ({"kind": "position", "features": ["hole"], "zone": "planes"}, "axis", "is missing"),
    ({"kind": "position", "features": ["lost"]}, "features", "nominal place is not known"),
    ({"kind": "position", "features": ["top"], "modifier": "maximum material",
      "material_size": 3.0}, "modifier", "feature that has a size"),
    ({"kind": "position", "features": ["hole"], "modifier": "maximum material"}, "material_size",
     "is 0"),
    ({"kind": "position", "features": ["hole"], "material_size": 3.0}, "material_size",
     "it is omitted"),
    ({"kind": "position", "features": ["hole"], "length": 3.0}, "length", "of an axis only"),
    ({"kind": "position", "features": ["bore"], "length": -3.0}, "length", "is -3"),
    ({"kind": "coaxiality", "features": ["bore"], "datums": ["top"]}, "datums", "'top', but"),
    ({"kind": "symmetry", "features": ["side"], "datums": ["middle"]}, "features",
     "one slot or rectangle, or two"),
    ({"kind": "symmetry", "features": ["side", "slot"], "datums": ["middle"]}, "features",
     "two opposite planes"),
    ({"kind": "symmetry", "features": ["side", "far side"], "datums": ["bore"]}, "datums",
     "needs a plane"),
    ({"kind": "surface profile", "features": ["middle"]}, "features", "has no surface"),
    ({"kind": "flatness", "features": ["top"], "offset": 0.1}, "offset", "profiles only"),
    ({"kind": "total runout", "features": ["bore"], "datums": ["top"]}, "datums", "'top', but"),
]  # fmt: skip


@pytest.mark.parametrize(("said", "field", "words"), BAD)
def test_what_cannot_be(said: dict[str, object], field: str, words: str) -> None:
    found = fault(said)
    assert found is not None
    assert found[0] == field
    assert words in found[1]


@pytest.mark.parametrize(
    ("said", "field"),
    [
        ({"kind": "coordinate", "features": ["dot"], "axis": "x"}, "axis"),
        ({"kind": "distance", "features": ["dot", "ball"], "axis": "x"}, "axis"),
        ({"kind": "position", "features": ["dot"]}, "datums"),
    ],
)
def test_what_needs_an_alignment(said: dict[str, object], field: str) -> None:
    assert fault(said) is None
    found = fault(said, aligned=False)
    assert found is not None
    assert found[0] == field
    assert "alignment" in found[1]
