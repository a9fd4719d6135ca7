"""Numbers in a model that are written out: any size, mirrored, or missing."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from ocmm_cad.step.brep import _solid_mesh as mesh
from ocmm_cad.step.brep import _surface_kernel as kernel
from ocmm_cad.step.brep._document import read_document
from ocmm_cad.step.brep._edge_steps import BEND_RAD, DEFLECTION_MM, EdgeSteps, chords_of
from ocmm_cad.step.brep._library import explored, is_turned
from ocmm_cad.step.brep._raw_faces import faces_of, faces_with_surface, rims_of
from ocmm_cad.step.brep._surface_splines import surface_of
from ocmm_core.errors import InputError
from ocmm_core.part_model import bezier_surface, places_at
from tests.cad.odd_step_models import bored, put_by_operator
from tests.host import needs_package


@pytest.mark.parametrize("radius", [0.0, 1e-300, 0.01, 6.0, 1e5, 1e12, 1e15, 1e300, math.inf])
@pytest.mark.parametrize("turn", [0.0, 1e-9, -1.0, 2.0 * math.pi])
def test_an_arc_of_any_size_is_parted_into_few_chords(radius: float, turn: float) -> None:
    chords = chords_of(radius, turn)
    assert 1 <= chords <= 20_000
    if radius <= 1e5:
        assert radius * (1.0 - math.cos(0.5 * turn / chords)) <= 0.02 * (1.0 + 1e-9)


def test_an_arc_is_parted_as_the_library_parts_it() -> None:
    needs_package("OCP", "the extra 'step'")
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
    from OCP.GCPnts import GCPnts_TangentialDeflection
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt

    axes = gp_Ax2(gp_Pnt(1.0, 2.0, 3.0), gp_Dir(1.0, 2.0, 3.0))
    for radius in (0.03, 1.0, 6.0, 250.0, 3e4):
        for first, last in ((0.0, 2.0 * math.pi), (0.3, 2.1), (-4.0, -3.99)):
            edge = BRepBuilderAPI_MakeEdge(gp_Circ(axes, radius), first, last).Edge()
            bent = GCPnts_TangentialDeflection(BRepAdaptor_Curve(edge), BEND_RAD, DEFLECTION_MM)
            assert chords_of(radius, last - first) + 1 == bent.NbPoints()


def test_a_part_whose_place_mirrors_it_has_its_material_inside() -> None:
    needs_package("OCP", "the extra 'step'")
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf
    from OCP.TopLoc import TopLoc_Location

    mirror, motion = gp_Trsf(), gp_Trsf()
    mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)))
    motion.SetTranslation(gp_Pnt(0, 0, 0), gp_Pnt(-7.0, 40.0, 3.0))
    # One in the place of another, as in an assembly of assemblies; twice mirrored is not mirrored.
    nested = TopLoc_Location(motion).Multiplied(TopLoc_Location(mirror))
    twice = nested.Multiplied(TopLoc_Location(mirror))
    for place, is_mirrored in ((nested, True), (twice, False)):
        moved = bored().Moved(place, False)
        faces, _ = faces_with_surface(moved)
        found = faces_of(faces, lambda _: None, EdgeSteps()).faces
        assert any(is_turned(face) for face in explored(moved, "FACE"))
        middle = np.array([-57.0, 70.0, 13.0] if is_mirrored else [43.0, 70.0, 13.0])
        for one in found:
            if one.face.shape == "Plane":
                outwards = np.array(one.face.point) - middle
                assert outwards @ np.array(one.face.direction) > 9.0
                for rim in one.rims:
                    assert outwards @ rim.normal > 9.0
            else:
                assert (one.face.shape, one.face.inner) == ("Cylinder", True)


@pytest.mark.parametrize(
    ("nodes", "triangles"),
    [(-1, 1), (1, -1), (0, 1), (2**31 - 1, 1), (4, 2**31 - 1), (-(2**31), -(2**31)), (5, 1)],
)
def test_a_mesh_that_says_it_is_larger_than_what_is_there_is_none(
    nodes: int, triangles: int
) -> None:
    head = np.array([nodes, triangles], dtype="<i4").tobytes() + b"\x01\x01" + bytes(8)
    # Room for four nodes with all they have, and one triangle.
    body = bytes(4 * (24 + 16 + 12) + 12)
    assert mesh.next_mesh(memoryview(head + body), 0)[0] is None


def test_a_mesh_ends_where_the_next_one_begins() -> None:
    one = np.array([3, 1], dtype="<i4").tobytes() + b"\x01\x00" + bytes(8)
    one += np.arange(9.0).tobytes() + bytes(3 * 16) + np.array([1, 2, 3], dtype="<i4").tobytes()
    content = memoryview(one + one)
    raw, at = mesh.next_mesh(content, 0)
    assert raw is not None
    assert at == len(one)
    np.testing.assert_array_equal(raw.nodes, np.arange(9.0).reshape(3, 3))
    assert raw.rows.tolist() == [[0, 1, 2]]
    assert mesh.next_mesh(content, at)[1] == 2 * len(one)
    assert mesh.next_mesh(content[:-1], at)[0] is None


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_an_edge_that_lies_nowhere_is_told_and_not_left_out(number: float) -> None:
    uv, lines = np.zeros((3, 2)), np.empty((3, 3))
    uv[1, 0] = number
    normals, lengths = np.empty((1, 3)), np.empty(1)
    frame = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    starts = np.array([0, 3])
    kernel.run_along(
        kernel.PLANE, frame, np.zeros(2), 1.0, np.array([kernel.OTHER]), np.zeros((1, 6)), starts,
        np.zeros(3), uv, lines, normals, lengths,
    )  # fmt: skip
    with pytest.raises(ValueError, match="edge is not a number"):
        rims_of(starts, lines, normals, lengths)


@pytest.mark.parametrize("is_clamped", [True, False])
def test_a_spline_is_that_of_the_library_also_where_its_knots_go_beyond_it(
    is_clamped: bool,
) -> None:
    needs_package("OCP", "the extra 'step'")
    import OCP.collections as held
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.Geom import Geom_BSplineSurface
    from OCP.gp import gp_Pnt

    rng = np.random.default_rng(77)
    poles = held.Array2_gp_Pnt(1, 7, 1, 7)
    for i in range(7):
        for j in range(7):
            poles.SetValue(i + 1, j + 1, gp_Pnt(10.0 * i, 10.0 * j, rng.uniform(0.0, 9.0)))
    # A cubic with seven poles: eleven knots, of which the four at each end may be one.
    count = 5 if is_clamped else 11
    knots, often = held.Array1_double(1, count), held.Array1_int(1, count)
    for index in range(count):
        knots.SetValue(index + 1, float(index))
        often.SetValue(index + 1, 4 if is_clamped and index in (0, 4) else 1)
    spline = Geom_BSplineSurface(poles, knots, knots, often, often, 3, 3)
    surface = BRepAdaptor_Surface(BRepBuilderAPI_MakeFace(spline, 1e-6).Face(), True)
    low, high = (0.0, 4.0) if is_clamped else (3.0, 7.0)
    made = surface_of(surface, (low, high, low, high))
    assert made is not None
    assert made.is_exact == is_clamped
    bezier = bezier_surface(made.spline)
    assert (made.spline.knots_u[:4] == low).all()
    assert (made.spline.knots_v[-4:] == high).all()
    uv = rng.uniform(low, high, (50, 2))
    found = places_at(bezier, np.stack([made.map_u(uv[:, 0]), made.map_v(uv[:, 1])], axis=1))
    for (u, v), place in zip(uv.tolist(), found, strict=True):
        truth = surface.Value(u, v)
        # Some 60 mm: their last bits.
        assert place == pytest.approx([truth.X(), truth.Y(), truth.Z()], abs=1e-11)


@pytest.mark.parametrize(
    ("scale", "axis3", "says"),
    [
        ("2.", "0.,0.,1.", r"scales \(by 2\)"),
        ("25.4", "0.,0.,1.", r"scales \(by 25.4\)"),
        ("-1.", "0.,0.,1.", r"scales \(by -1\)"),
        ("1.", "0.,0.,-1.", "mirrors"),
        ("$", "0.,0.,-1.", "mirrors"),
    ],
)
def test_bodies_that_are_scaled_or_mirrored_where_they_are_put_are_refused(
    scale: str, axis3: str, says: str, tmp_path: Path
) -> None:
    """The library halves bodies scaled by two, and turns mirrored ones."""
    needs_package("OCP", "the extra 'step'")
    path = put_by_operator(tmp_path / "put.step", bored(), scale, axis3)
    with pytest.raises(InputError, match=says) as refused:
        read_document(str(path), lambda _: None)
    assert "not as a mirrored or scaled copy" in refused.value.remedy


@pytest.mark.parametrize("scale", ["1.", "$"])
def test_bodies_that_are_put_elsewhere_are_there(scale: str, tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = put_by_operator(tmp_path / "put.step", bored(), scale, "0.,0.,1.", 1000.0)
    faces, _ = faces_with_surface(read_document(str(path), lambda _: None).shape)
    found = faces_of(faces, lambda _: None, EdgeSteps()).faces
    (bore,) = [one.face for one in found if one.face.shape == "Cylinder"]
    assert bore.inner
    assert bore.point == pytest.approx((1020.0, 20.0, 0.0), abs=1e-9)
