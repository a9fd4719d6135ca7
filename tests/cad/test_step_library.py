"""Features with targets on models from the library and from other authors.

Needs the extra ``step``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ocmm_cad.step import faces_account, read_model
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import places_of
from tests.cad.nist_models import NIST, nist_model, path_of
from tests.cad.step_models import (
    MODELS,
    TESSELLATED,
    bent_outline,
    bent_pocket,
    block,
    off_mm,
    written,
)
from tests.host import needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")

OFF_MM = 0.05
"""The demand on a target; they come out below 1e-6, the rounding of a plan."""
BALL_MM = 6.0


def test_the_search_of_the_library_sees_a_target_inside_the_material(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "block.step", block())
    np.testing.assert_allclose(off_mm(path, [(50, 30, 10), (50, 30, 20), (50, 30, 25)]), [10, 0, 5])


def test_faces_of_no_solid_are_construction_geometry(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Dir, gp_Pln, gp_Pnt
    from OCP.TopoDS import TopoDS_Compound

    def beside(*shapes: Any) -> Any:
        compound, builder = TopoDS_Compound(), BRep_Builder()
        builder.MakeCompound(compound)
        for one in shapes:
            builder.Add(compound, one)
        return compound

    plane = gp_Pln(gp_Pnt(50, 30, 10), gp_Dir(0, 0, 1))
    middle = BRepBuilderAPI_MakeFace(plane, -80.0, 80.0, -80.0, 80.0).Face()
    model = read_model(written(tmp_path / "a.step", beside(block(), middle)))
    assert len(model.features) == 6
    assert ("its surface is of the kind construction geometry", 1) in faces_account(
        model, ()
    ).left_out
    # A model of faces alone is a part of sheet.
    model = read_model(written(tmp_path / "b.step", beside(middle)))
    assert len(model.features) == 1


@pytest.mark.parametrize("name", MODELS)
def test_surfaces_become_features_with_targets_on_them(
    name: str, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    needs_package("OCP", "the extra 'step'")
    make, expected = MODELS[name]
    path = written(tmp_path / "model.step", make())
    model = read_model(path, BALL_MM)
    counts = {kind: sum(one.shape.value == kind for one in model.features) for kind in expected}
    assert counts == expected, faces_account(model, ()).left_out
    targets = [target for one in model.features for target in one.targets]
    off = off_mm(path, targets)
    record_property(f"{name}: targets off", f"{np.sum(off > OFF_MM)} of {len(off)}")
    assert off.max() <= OFF_MM
    for one in model.features:
        assert len(one.targets) >= one.points
        # The guidance shows the places named by the plan.
        np.testing.assert_array_equal(places_of(one, one.points).points, one.targets[: one.points])


def test_normals_leave_the_material(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "a.p21", MODELS["bored"][0]())
    model = read_model(path)
    features = {feature.name: feature for feature in model.features}
    bore = features["BORE 12 X20 Y20"]
    assert (bore.point, bore.diameter, bore.length) == ((20.0, 20.0, 10.0), 12.0, 20.0)
    assert bore.side == "inner"
    middle = np.array([50.0, 30.0, 10.0])
    for plane in model.features:
        if plane.shape is Shape.PLANE:
            assert (np.array(plane.point) - middle) @ np.array(plane.direction) > 0.0


def test_a_model_in_inches_comes_in_millimetres(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "inch.stp", MODELS["bored"][0](), "INCH")
    assert "INCH" in path.read_text()
    (bore,) = [one for one in read_model(path).features if one.shape is Shape.CYLINDER]
    assert bore.diameter == pytest.approx(12.0, abs=1e-6)
    assert bore.length == pytest.approx(20.0, abs=1e-6)


def test_half_a_file_is_refused(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "half.step", MODELS["bored"][0]())
    path.write_text(path.read_text()[:2000])
    with pytest.raises(InputError):
        read_model(path)


@pytest.mark.parametrize("name", NIST)
def test_models_that_nobody_here_made(
    name: str,
    reference: Path,
    repeats: Callable[..., int],
    record_property: Callable[[str, object], None],
) -> None:
    model = nist_model(reference, name)
    targets = [target for one in model.features for target in one.targets]
    # Evenly over the whole model: its surfaces come one after the other.
    targets = targets[:: max(len(targets) // repeats(120, len(targets)), 1)]
    off = off_mm(path_of(reference, name), targets)
    record_property(f"{name}: targets off", f"{np.sum(off > OFF_MM)} of {len(off)}")
    assert off.max() <= OFF_MM
    if name.startswith("ftc_07"):
        # A quarter of an inch.
        assert 6.35 in {one.diameter for one in model.features if one.shape is Shape.CYLINDER}


def test_a_tessellated_model_is_told_as_one(reference: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    with pytest.raises(InputError, match="tessellated model: 273 faces") as refused:
        read_model(reference / "step" / TESSELLATED)
    assert "B-rep" in refused.value.remedy


def test_an_edge_is_followed_where_it_bends_in_a_small_part_of_its_parameter(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    needs_package("OCP", "the extra 'step'")
    from ocmm_cad.step.brep._document import read_document
    from ocmm_cad.step.brep._raw_faces import faces_of, faces_with_surface

    path = written(tmp_path / "pocket.step", bent_pocket())
    document = read_document(str(path), lambda _: None)
    faces = faces_of(faces_with_surface(document.shape)[0], lambda _: None, document.steps).faces
    curve = bent_outline()
    # Close in both parts of the parameter.
    steps = np.concatenate([np.linspace(0.0, 0.001, 500), np.linspace(0.001, 1.0, 500)])
    truth = np.array([(p.X(), p.Y()) for p in (curve.Value(float(t)) for t in steps)])
    tops = [one for one in faces if one.face.shape == "Plane" and one.face.direction[2] > 0.9]
    (rim,) = [rim for rim in tops[0].rims if len(rim.line) > 3]
    off = _from_line(truth, rim.line[:, :2])
    record_property("edge off by at most, mm", f"{off.max():.4f}")
    # The deflection requested from the library, doubled, because it is an estimate.
    assert off.max() < 0.04


def _from_line(points: Float, line: Float) -> Float:
    """Return the distances of points (n, 2) from a polyline (m, 2)."""
    start, along = line[:-1], np.diff(line, axis=0)
    arms = points[:, None] - start
    share = np.clip((arms * along).sum(-1) / (along * along).sum(-1), 0.0, 1.0)
    away: Float = np.linalg.norm(arms - share[..., None] * along, axis=-1).min(axis=1)
    return away
