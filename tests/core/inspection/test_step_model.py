"""Models of CAD systems: which features they become, and where these are touched."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import places_of
from ocmm_core.inspection.plan import add_feature, load_plan, new_plan, save_plan
from ocmm_core.inspection.step import read_model
from ocmm_core.inspection.step._answer import StepFace
from ocmm_core.inspection.step._joined import EDGE_MM, surfaces_of
from ocmm_core.inspection.step._raw_faces import RawFace, Rim
from tests.host import needs_package

OFF_MM = 0.05
"""The demand on a target; they come out below 1e-6, the rounding of a plan."""
NIST = (
    "ctc_01_asme1_ap203", "ctc_01_asme1_ap242-e1", "ctc_03_asme1_ap242-e2", "ftc_06_asme1_ap242-e2",
    "ftc_07_asme1_ap242-e2",
)  # fmt: skip
TESSELLATED = "nist_ftc_08_asme1_ap242-e1-tg.stp"
BALL_MM = 6.0


def round_face(low: float, high: float, first_deg: float, last_deg: float) -> RawFace:
    """Return a part of a bore of 20 mm about z, with its four edges."""
    angles = np.radians(np.linspace(first_deg, last_deg, 41))
    ring = np.stack([10.0 * np.cos(angles), 10.0 * np.sin(angles), np.zeros(41)], axis=1)
    ups = np.linspace(low, high, 21)
    up = np.array([0.0, 0.0, 1.0])
    inside = ring[1:-1, None] + ups[None, 1:-1, None] * up
    sides = [Rim(start + ups[:, None] * up, -start / 10.0) for start in (ring[0], ring[-1])]
    ends = [Rim(ring + height * up, -ring[20] / 10.0) for height in (low, high)]
    face = StepFace(
        shape="Cylinder", point=(0.0, 0.0, 0.0), direction=(0.0, 0.0, 1.0), radius=10.0, low=low,
        high=high, inner=True,
    )  # fmt: skip
    return RawFace(face, inside.reshape(-1, 3), (*sides, *ends))


def found(*faces: RawFace) -> list[tuple[float, float, bool]]:
    """Return from where to where the surfaces of faces reach, and whether they can be probed."""
    surfaces = surfaces_of(faces, 0.5 * BALL_MM)
    return [(one.face.low, one.face.high, not one.against) for one in surfaces]


def test_two_bores_on_one_axis_stay_two() -> None:
    assert found(round_face(0, 10, 0, 360), round_face(90, 100, 0, 360)) == [
        (0, 10, True), (90, 100, True),
    ]  # fmt: skip


def test_two_halves_of_a_bore_are_one() -> None:
    assert found(round_face(0, 30, 0, 180), round_face(0, 30, 180, 360)) == [(0, 30, True)]


def test_two_lengths_of_a_bore_with_one_edge_are_one() -> None:
    assert found(round_face(0, 20, 0, 360), round_face(20, 40, 0, 360)) == [(0, 40, True)]


def test_arcs_that_share_no_edge_but_their_place_on_the_axis_are_one() -> None:
    assert found(round_face(0, 30, 0, 120), round_face(5, 30, 200, 330)) == [(0, 30, True)]


def test_fillets_are_left_out_also_where_several_lie_on_one_axis() -> None:
    assert found(round_face(0, 30, 0, 90), round_face(30, 60, 0, 90)) == [(0, 60, False)]


def test_a_ball_needs_room() -> None:
    # 8 mm from edge to edge: a ball of 6 mm keeps 4 mm from each, so nothing is left.
    narrow = round_face(0, 7.9, 0, 360)
    (surface,) = surfaces_of([narrow], 3.0)
    assert "a ball of 6 mm has no room" in surface.against
    assert surface.targets == ()
    (surface,) = surfaces_of([round_face(0, 40, 0, 360)], 10.5)
    assert "does not fit" in surface.against


def drilled_end(half_deg: float, radius: float) -> RawFace:
    """Return the end of a drilled hole about z, opening upwards, without its outer edge."""
    half = np.radians(half_deg)
    angles = np.radians(np.arange(0.0, 360.0, 9.0))
    round_it = np.stack([np.cos(angles), np.sin(angles), np.full(40, 1.0 / np.tan(half))], axis=1)
    radii = np.linspace(0.1, radius, 60)
    face = StepFace(
        shape="Cone", point=(0.0, 0.0, 0.0), direction=(0.0, 0.0, 1.0), half_angle=half, low=0.0,
        high=radius / np.tan(half), inner=True,
    )  # fmt: skip
    return RawFace(face, (radii[:, None, None] * round_it).reshape(-1, 3), ())


@pytest.mark.parametrize("half_deg", [45.0, 59.0])
def test_no_target_is_so_near_to_the_tip_of_a_drilled_hole_that_the_ball_touches_opposite(
    half_deg: float,
) -> None:
    half = np.radians(half_deg)
    (surface,) = surfaces_of([drilled_end(half_deg, 15.0)], 3.0)
    points = np.array(surface.targets)
    from_axis = np.linalg.norm(points[:, :2], axis=1)
    assert len(points) == 2 * Shape.CONE.spec.usual_points
    # Centre of the ball: along the normal, which leads to the axis.
    assert (from_axis - 3.0 * np.cos(half)).min() >= EDGE_MM - 1e-9
    # The whole end is narrower: the ball would touch all round its rim.
    (surface,) = surfaces_of([drilled_end(half_deg, 3.0 * np.cos(half) + 0.9)], 3.0)
    assert "no room for" in surface.against


def test_targets_are_far_from_edges_and_from_each_other() -> None:
    (surface,) = surfaces_of([round_face(0, 60, 0, 180), round_face(0, 60, 180, 360)], 3.0)
    points = np.array(surface.targets)
    assert len(points) == 2 * Shape.CYLINDER.spec.usual_points
    assert points[:, 2].min() >= 3.0 + EDGE_MM
    assert points[:, 2].max() <= 60.0 - 3.0 - EDGE_MM
    apart = np.linalg.norm(points[:, None] - points[None], axis=2) + 1e9 * np.eye(len(points))
    assert apart.min() > 5.0
    # Where the halves meet there is no edge.
    angles = np.degrees(np.arctan2(points[:, 1], points[:, 0])) % 180.0
    assert np.minimum(angles, 180.0 - angles).min() < np.degrees(4.0 / 10.0)


def with_targets(*targets: tuple[float, float, float]) -> NominalFeature:
    return NominalFeature(
        name="BORE", shape=Shape.CYLINDER, points=5, point=(0.0, 0.0, 5.0), diameter=20.0,
        length=10.0, side="inner", targets=targets,
    )  # fmt: skip


ON_IT = ((10.0, 0.0, 1.0), (0.0, 10.0, 9.0), (-10.0, 0.0, 2.0), (0.0, -10.0, 8.0))


def test_a_plan_says_where_to_touch(tmp_path: Path) -> None:
    feature = with_targets(*ON_IT)
    places = places_of(feature, 3)
    np.testing.assert_array_equal(places.points, ON_IT[:3])
    np.testing.assert_allclose(places.normals, -np.array(ON_IT)[:3] * [0.1, 0.1, 0.0], atol=1e-12)
    plan = add_feature(new_plan("P", "PART"), feature)
    save_plan(plan, tmp_path / "p.toml")
    assert load_plan(tmp_path / "p.toml").features == [feature]
    # The surface was changed since: what was named lies in the air, and is not used.
    moved = msgspec.structs.replace(feature, diameter=20.2)
    assert len(places_of(moved, 8).points) == 8
    assert np.linalg.norm(places_of(moved, 8).points[:, :2], axis=1) == pytest.approx(10.1)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"shape": Shape.CIRCLE, "length": 0.0}, "is only for: plane, cylinder"),
        ({"targets": ((float("nan"), 0.0, 0.0),)}, "farther away"),
        ({"targets": (*ON_IT[:1],) * 1001}, "at most 1000"),
    ],
)
def test_targets_that_cannot_be_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        add_feature(new_plan("P", "PART"), msgspec.structs.replace(with_targets(*ON_IT), **changes))


def test_a_file_that_is_no_model_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.step"
    path.write_text("no model")
    with pytest.raises(InputError, match="not a STEP file"):
        read_model(path)


def test_without_the_extra_a_model_is_refused_with_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # As if it were missing, also where it is installed; the reading process has the same path.
    (tmp_path / "OCP.py").write_text("raise ImportError\n")
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\n")
    with pytest.raises(InputError, match="extra"):
        read_model(path)


def test_reading_a_model_can_be_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # A reader that never comes back; the reading process has the same path.
    (tmp_path / "OCP.py").write_text("import time\ntime.sleep(600)\n")
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\n")
    asked: list[int] = []

    def given_up() -> bool:
        asked.append(1)
        return len(asked) > 3

    with pytest.raises(InputError, match="cancelled"):
        read_model(path, given_up=given_up)
    assert multiprocessing.active_children() == []


@pytest.mark.parametrize(
    ("reader", "words"),
    [
        (
            "import os\nprint('noise', flush=True)\nos.kill(os.getpid(), 11)\n",
            r"failed on it \(SIGSEGV\)",
        ),
        ("import os\nos._exit(1)\n", "failed on it"),
        ("held = bytearray(2_000_000_000)\n", "more than 1.5 GB of memory"),
        ("raise ValueError('contains no shape')\n", "contains no shape"),
        (
            "raise OSError('nobody foresaw this')\n",
            r"Reading the STEP file \(at the start of the library\) failed",
        ),
    ],
)
def test_a_reader_that_fails_is_told_by_its_own_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    reader: str,
    words: str,
) -> None:
    # In the place of the extra; the reading process has the same path.
    (tmp_path / "OCP.py").write_text(reader)
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\n")
    with pytest.raises(OcmmError, match=words):
        read_model(path)
    assert multiprocessing.active_children() == []
    assert capfd.readouterr() == ("", "")


# What follows needs the library itself: it makes the models, and says how far a target is off.

Make = Callable[[], Any]


def _block(length: float = 100.0, width: float = 60.0, height: float = 20.0) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Pnt

    return BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), length, width, height).Shape()


def _rod(at: Sequence[float], along: Sequence[float], radius: float, length: float) -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(*at), gp_Dir(*along)), radius, length).Shape()


def _without(body: Any, *tools: Any) -> Any:
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    for tool in tools:
        body = BRepAlgoAPI_Cut(body, tool).Shape()
    return body


def _with(body: Any, *more: Any) -> Any:
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse

    for one in more:
        body = BRepAlgoAPI_Fuse(body, one).Shape()
    return body


def _moved(body: Any, x: float, y: float, z: float) -> Any:
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    motion = gp_Trsf()
    motion.SetTranslation(gp_Vec(x, y, z))
    return body.Moved(TopLoc_Location(motion))


def _assembly() -> Any:
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    part = _without(_block(), _rod((50, 30, -1), (0, 0, 1), 12, 30))
    builder.Add(compound, part)
    builder.Add(compound, _moved(part, 300.0, 0.0, 50.0))
    return compound


def _cone() -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone

    return BRepPrimAPI_MakeCone(40.0, 15.0, 60.0).Shape()


def _torus() -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus

    return BRepPrimAPI_MakeTorus(50.0, 12.0).Shape()


def _ball() -> Any:
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    return _with(_block(), _moved(BRepPrimAPI_MakeSphere(25.0).Shape(), 50.0, 30.0, 30.0))


def _bent_outline() -> Any:
    """Return a curve in a plane that makes its turn in a thousandth of its parameter."""
    import OCP.collections as held
    from OCP.Geom import Geom_BSplineCurve
    from OCP.gp import gp_Pnt

    places = ((20, 10, 0), (20, 45, 0), (60, 45, 0), (80, 10, 0))
    poles = held.Array1_gp_Pnt(1, 4)
    for index, place in enumerate(places, start=1):
        poles.SetValue(index, gp_Pnt(*map(float, place)))
    knots, often = held.Array1_double(1, 3), held.Array1_int(1, 3)
    for index, (knot, times) in enumerate(((0.0, 3), (0.001, 1), (1.0, 3)), start=1):
        knots.SetValue(index, knot)
        often.SetValue(index, times)
    return Geom_BSplineCurve(poles, knots, often, 2)


def _bent_pocket() -> Any:
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeEdge,
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakeWire,
    )
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec

    bent = BRepBuilderAPI_MakeEdge(_bent_outline()).Edge()
    shut = BRepBuilderAPI_MakeEdge(gp_Pnt(80, 10, 0), gp_Pnt(20, 10, 0)).Edge()
    outline = BRepBuilderAPI_MakeFace(BRepBuilderAPI_MakeWire(bent, shut).Wire()).Face()
    tool = BRepPrimAPI_MakePrism(outline, gp_Vec(0, 0, 30)).Shape()
    return _without(_block(), _moved(tool, 0, 0, -5))


X = (1, 0, 0)
MODELS: dict[str, tuple[Make, dict[str, int]]] = {
    # Plane counts the faces with room for nine points of a ball of 6 mm.
    "block": (_block, {"Plane": 6}),
    "bored": (lambda: _without(_block(), _rod((20, 20, -1), (0, 0, 1), 6, 30)),
              {"Plane": 6, "Cylinder": 1}),
    "large hole": (lambda: _without(_block(100, 100, 20), _rod((50, 50, -1), (0, 0, 1), 40, 30)),
                   {"Plane": 6, "Cylinder": 1}),
    "clevis": (lambda: _without(_block(100, 60, 60), _moved(_block(80, 60, 60), 10, 0, 20),
                                _rod((-1, 30, 40), X, 10, 102)), {"Cylinder": 2}),
    "three lugs": (lambda: _without(_block(160, 60, 60), _moved(_block(40, 60, 60), 20, 0, 20),
                                    _moved(_block(40, 60, 60), 90, 0, 20),
                                    _rod((-1, 30, 40), X, 10, 162)), {"Cylinder": 3}),
    "stepped shaft": (lambda: _with(_rod((0, 0, 0), X, 20, 40), _rod((40, 0, 0), X, 15, 40),
                                    _rod((80, 0, 0), X, 20, 40)), {"Cylinder": 3}),
    "crossed bores": (lambda: _without(_block(), _rod((50, 30, -1), (0, 0, 1), 8, 30),
                                       _rod((50, -1, 10), (0, 1, 0), 5, 62)), {"Cylinder": 3}),
    "slotted bore": (lambda: _without(_block(100, 60, 40), _rod((50, 30, -1), (0, 0, 1), 20, 50),
                                      _moved(_block(100, 8, 40), 0, 26, 0)), {"Cylinder": 1}),
    "cone": (_cone, {"Cone": 1, "Plane": 2}),
    "torus": (_torus, {"Torus": 1}),
    "ball on a block": (_ball, {"Sphere": 1}),
    "assembly": (_assembly, {"Cylinder": 2, "Plane": 12}),
}  # fmt: skip


def written(path: Path, shape: Any, unit: str = "MM") -> Path:
    """Write a model; Interface_Static speaks for the whole process."""
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

    set_word = getattr(Interface_Static, "SetCVal_s", None) or Interface_Static.SetCVal
    writer = STEPControl_Writer()
    set_word("write.step.unit", unit)
    writer.Transfer(shape, STEPControl_AsIs)
    writer.Write(str(path))
    set_word("write.step.unit", "MM")
    return path


def off_mm(path: Path, points: Sequence[tuple[float, float, float]]) -> Float:
    """Return how far points are from the faces of the solids, by the library's own search.

    A solid itself would say 0 for every point inside the material.
    """
    import OCP.TopAbs as TopAbs
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
    from OCP.BRepExtrema import BRepExtrema_DistShapeShape
    from OCP.gp import gp_Pnt
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS_Compound

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    faces, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(faces)
    solids = TopExp_Explorer(reader.OneShape(), TopAbs.TopAbs_SOLID)
    while solids.More():
        of_solid = TopExp_Explorer(solids.Current(), TopAbs.TopAbs_FACE)
        while of_solid.More():
            builder.Add(faces, of_solid.Current())
            of_solid.Next()
        solids.Next()
    vertices = [BRepBuilderAPI_MakeVertex(gp_Pnt(*point)).Vertex() for point in points]
    return np.array([BRepExtrema_DistShapeShape(vertex, faces).Value() for vertex in vertices])


def test_the_search_of_the_library_sees_a_target_inside_the_material(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "block.step", _block())
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
    model = read_model(written(tmp_path / "a.step", beside(_block(), middle)))
    assert len(model.features) == 6
    assert ("its surface is of the kind construction geometry", 1) in model.why_not()
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
    assert counts == expected, model.why_not()
    targets = [target for one in model.features for target in one.targets]
    off = off_mm(path, targets)
    record_property(f"{name}: targets off", f"{np.sum(off > OFF_MM)} of {len(off)}")
    assert off.max() <= OFF_MM
    for one in model.features:
        assert len(one.targets) >= one.points
        # What the plan names is what the guidance shows.
        np.testing.assert_array_equal(places_of(one, one.points).points, one.targets[: one.points])


def test_normals_leave_the_material(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "a.p21", MODELS["bored"][0]())
    model = read_model(path)
    features = {feature.name: feature for feature in model.features}
    bore = features["CYLINDER_1"]
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
    name: str, reference: Path, record_property: Callable[[str, object], None]
) -> None:
    needs_package("OCP", "the extra 'step'")
    path = reference / "step" / f"nist_{name}.stp"
    model = read_model(path)
    targets = [target for one in model.features for target in one.targets]
    off = off_mm(path, targets)
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
    from ocmm_core.inspection.step._raw_faces import read_faces

    path = written(tmp_path / "pocket.step", _bent_pocket())
    faces, _ = read_faces(str(path), lambda _: None)
    curve = _bent_outline()
    # Close in both parts of the parameter.
    steps = np.concatenate([np.linspace(0.0, 0.001, 500), np.linspace(0.001, 1.0, 500)])
    truth = np.array([(p.X(), p.Y()) for p in (curve.Value(float(t)) for t in steps)])
    tops = [one for one in faces if one.face.shape == "Plane" and one.face.direction[2] > 0.9]
    (rim,) = [rim for rim in tops[0].rims if len(rim.line) > 3]
    off = _from_line(truth, rim.line[:, :2])
    record_property("edge off by at most, mm", f"{off.max():.4f}")
    # As is asked of the library, and as much again, because its deflection is an estimate.
    assert off.max() < 0.04


def _from_line(points: Float, line: Float) -> Float:
    """Return how far points (n, 2) are from a line (m, 2)."""
    start, along = line[:-1], np.diff(line, axis=0)
    arms = points[:, None] - start
    share = np.clip((arms * along).sum(-1) / (along * along).sum(-1), 0.0, 1.0)
    away: Float = np.linalg.norm(arms - share[..., None] * along, axis=-1).min(axis=1)
    return away
