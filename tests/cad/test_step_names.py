"""Names of features of a model: from the model, otherwise from kind and place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ocmm_cad.step import read_model
from ocmm_cad.step._profiled import feature_names
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.names import name_fault
from tests.cad.step_models import labelled
from tests.host import needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")


def nominal(shape: Shape, **fields: Any) -> NominalFeature:
    return NominalFeature(name="", shape=shape, points=9, **fields)


BORE = nominal(Shape.CYLINDER, point=(40.0, 20.04, 7.0), diameter=12.5, side="inner")
SHAFT = nominal(Shape.CYLINDER, point=(0.0, -0.04, 7.0), diameter=30.0, side="outer",
                direction=(1.0, 0.0, 0.0))  # fmt: skip
TOP = nominal(Shape.PLANE, point=(50.0, 30.0, 20.0))
BOTTOM = nominal(Shape.PLANE, point=(50.0, 30.0, 0.0), direction=(0.0, 0.0, -1.0))
SLOPE = nominal(Shape.PLANE, point=(1.0, 2.0, 3.25), direction=(0.0, 0.6, 0.8))


@pytest.mark.parametrize(
    ("features", "said", "names"),
    [
        ([BORE, SHAFT], ["", ""], ["BORE 12.5 X40 Y20", "SHAFT 30 Y0 Z7"]),
        ([TOP, BOTTOM, SLOPE], ["", "", ""], ["PLANE Z20", "PLANE Z0", "PLANE X1 Y2 Z3.2"]),
        ([BORE, TOP], ["DATUM A", "Dichtfl\u00e4che; oben"], ["DATUM A", "Dichtfl\u00e4che oben"]),
        # The same place along z: all three coordinates, or a number, distinguish them.
        (
            [TOP, nominal(Shape.PLANE, point=(10.0, 30.0, 20.0)), BORE, BORE],
            ["", "", "", ""],
            ["PLANE X50 Y30 Z20", "PLANE X10 Y30 Z20", "BORE 12.5 X40 Y20 Z7",
             "BORE 12.5 X40 Y20 Z7 2"],
        ),
        ([BORE, TOP], ["n" * 300, "n" * 300], ["n" * 55, "n" * 55 + " 2"]),
        ([TOP, TOP], ["\u4e2d", "=cmd()"], ["\u4e2d", "cmd"]),
    ],
)  # fmt: skip
def test_names_say_what_and_where(
    features: list[NominalFeature], said: list[str], names: list[str]
) -> None:
    found = feature_names(features, said)
    assert found == names
    assert len(set(found)) == len(found)
    assert not any(name_fault(name) for name in found)


def test_a_face_that_has_a_name_gives_it_to_its_feature(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    model = read_model(labelled(tmp_path / "a.step"), with_part=True)
    names = [one.name for one in model.features]
    assert "DATUM FACE" in names
    assert "DATUM FACE 2" in names
    assert "BORE 12 X320 Y20" in names
    assert model.part is not None
    assert {face.feature for face in model.part.faces} == set(names)
