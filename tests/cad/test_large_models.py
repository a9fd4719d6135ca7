"""What makes large models quick: each answer is that of the plain way, which is slow."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from ocmm_cad.step import _place_kernel as kernel
from ocmm_cad.step import read_model
from ocmm_cad.step._placed import spread_rows
from ocmm_cad.step.brep import _surface_kernel as surface_kernel
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.host import HOST
from tests.cad.step_models import block, hill, written
from tests.host import HANG_S, needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")

SEED = 77


def spread_slowly(places: Float, count: int) -> list[int]:
    """Return the rows of places, each as far as can be from those before it."""
    chosen = [int(np.argmax(np.linalg.norm(places - places.mean(axis=0), axis=1)))]
    while len(chosen) < min(count, len(places)):
        apart = np.linalg.norm(places[:, None] - places[chosen], axis=2).min(axis=1)
        chosen.append(int(np.argmax(apart)))
    return chosen


@pytest.mark.parametrize(("n", "count"), [(1, 5), (7, 7), (60, 12), (400, 60)])
def test_places_are_spread_as_the_plain_way_does(n: int, count: int) -> None:
    # Random places: no two distances are equal to the last bit.
    places = np.random.default_rng(SEED).uniform(-50.0, 50.0, (n, 3))
    assert spread_rows(places, count) == spread_slowly(places, count)


def test_an_edge_falls_away_where_the_normal_beyond_leans_out() -> None:
    rng = np.random.default_rng(SEED)
    for _ in range(50):
        middle, along, normal, beyond = rng.normal(size=(4, 3))
        places = rng.normal(size=(9, 3))
        inward = np.cross(normal, along)
        inward /= np.linalg.norm(inward)
        away = np.linalg.norm(places - middle, axis=1)
        # Within 60 degrees of the direction into the face: across the edge, not along it.
        beside = np.abs((places - middle) @ inward) >= 0.5 * away
        found = kernel.leans_inward(middle, along, normal, places, beyond)
        if not beside.any():
            assert found == 1.0
            continue
        nearest = places[int(np.argmin(np.where(beside, away, np.inf)))]
        inward *= np.sign(inward @ (nearest - middle))
        assert found == pytest.approx(float(beyond @ inward), abs=1e-12)
    nothing = np.empty((0, 3))
    assert kernel.leans_inward(middle, along, normal, nothing, beyond) == 1.0
    assert kernel.leans_inward(middle, np.zeros(3), normal, places, beyond) == 1.0


def test_places_on_surfaces_are_those_of_the_library() -> None:
    needs_package("OCP", "the extra 'step'")
    from OCP import gp
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_Transform
    from OCP.TopoDS import TopoDS

    from ocmm_cad.step.brep._edge_steps import surface_numbers

    axes = gp.gp_Ax3(gp.gp_Pnt(1.0, -2.0, 3.0), gp.gp_Dir(1.0, 2.0, 3.0), gp.gp_Dir(0.0, 1.0, 1.0))
    faces = [
        BRepBuilderAPI_MakeFace(gp.gp_Pln(axes), -5.0, 5.0, -4.0, 4.0).Face(),
        BRepBuilderAPI_MakeFace(gp.gp_Cylinder(axes, 7.0), 0.2, 5.0, -4.0, 9.0).Face(),
        BRepBuilderAPI_MakeFace(gp.gp_Cone(axes, 0.3, 20.0), 0.2, 5.0, -4.0, 9.0).Face(),
        BRepBuilderAPI_MakeFace(gp.gp_Sphere(axes, 12.0), 0.2, 5.0, -1.0, 1.2).Face(),
        BRepBuilderAPI_MakeFace(gp.gp_Torus(axes, 20.0, 5.0), 0.2, 5.0, 0.3, 4.0).Face(),
    ]
    # One that is mirrored has a left-handed frame.
    mirror = gp.gp_Trsf()
    mirror.SetMirror(gp.gp_Ax2(gp.gp_Pnt(4.0, 5.0, 6.0), gp.gp_Dir(1.0, 1.0, 0.2)))
    faces += [
        TopoDS.Face(BRepBuilderAPI_Transform(face, mirror, True).Shape())
        if not hasattr(TopoDS, "Face_s")
        else TopoDS.Face_s(BRepBuilderAPI_Transform(face, mirror, True).Shape())
        for face in list(faces)
    ]
    # Single points, each on a separate edge: the normal in the middle is the normal at the point.
    uv = np.random.default_rng(SEED).uniform([0.2, 0.3], [5.0, 1.2], (20, 2))
    starts, other = np.arange(21), np.full(20, surface_kernel.OTHER)
    for face in faces:
        surface = BRepAdaptor_Surface(face, True)
        places, normals = np.empty((20, 3)), np.empty((20, 3))
        surface_kernel.run_along(
            *surface_numbers(surface), -1.0, other, np.zeros((20, 6)), starts, np.zeros(20), uv,
            places, normals, np.empty(20),
        )  # fmt: skip
        point, by_u, by_v = gp.gp_Pnt(), gp.gp_Vec(), gp.gp_Vec()
        for (u, v), place, normal in zip(uv.tolist(), places, normals, strict=True):
            surface.D1(u, v, point, by_u, by_v)
            # Some 50 mm: their last bits.
            assert place == pytest.approx([point.X(), point.Y(), point.Z()], abs=1e-12 * 1e2)
            across = by_u.Crossed(by_v).Normalized().Reversed()
            assert normal == pytest.approx([across.X(), across.Y(), across.Z()], abs=1e-12)


def test_meshes_that_the_library_writes_are_those_it_tells(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    from OCP.BRepLib import BRepLib_ToolTriangulatedShape

    from benchmarks.large_models import _moved, _together
    from ocmm_cad.step.brep import _solid_mesh as mesh
    from ocmm_cad.step.brep._library import static
    from ocmm_cad.step.brep._raw_faces import faces_with_surface

    # One part placed twice in an assembly, and a second part.
    part = hill()
    shape = _together([_moved(part, 10.0, 0.0, 0.0), _moved(part, 0.0, 200.0, 0.0), block()])
    faces, _ = faces_with_surface(shape)
    assert mesh.make_mesh(shape, faces) > 0.0
    bare = mesh.raw_meshes(faces)
    for face in faces:
        held = mesh.mesh_of(face)
        assert held is not None
        static(BRepLib_ToolTriangulatedShape, "ComputeNormals")(face, held[0])
    found = mesh.raw_meshes(faces, with_normals=True)
    assert list(found) == list(bare) == list(range(len(faces)))
    for place, face in enumerate(faces):
        held = mesh.mesh_of(face)
        assert held is not None
        truth = mesh.asked_mesh(held[0], with_normals=True)
        nodes = truth.nodes
        if held[1] is not None:
            nodes = nodes @ held[1][:, :3].T + held[1][:, 3]
        np.testing.assert_array_equal(found[place].nodes, nodes)
        np.testing.assert_array_equal(found[place].rows, truth.rows)
        # The library stores normals in single precision and normalises them on output.
        told, normals = found[place].normals, truth.normals
        assert told is not None
        assert normals is not None
        np.testing.assert_allclose(told, normals, atol=1e-7)
        np.testing.assert_array_equal(bare[place].nodes, nodes)
        assert bare[place].normals is None
    # Truncated or foreign records are ignored: the library computes them again.
    stream = memoryview(b"\x02\x00\x00\x00\x01\x00\x00\x00")
    assert mesh.next_mesh(stream, 0)[0] is None
    held = mesh.mesh_of(faces[0])
    assert held is not None
    assert mesh.is_of(mesh.asked_mesh(held[0], with_normals=False), held[0])
    # Of another place in the assembly, and of another face.
    assert not mesh.is_of(bare[0], held[0])
    assert not mesh.is_of(found[len(faces) - 1], held[0])


def test_parameters_along_edges_are_those_of_the_library() -> None:
    needs_package("OCP", "the extra 'step'")
    from OCP.BRepAdaptor import BRepAdaptor_Curve2d
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    from ocmm_cad.step.brep._edge_steps import EdgeSteps, parameters_on
    from ocmm_cad.step.brep._library import explored

    axes = gp_Ax2(gp_Pnt(1.0, -2.0, 3.0), gp_Dir(1.0, 2.0, 3.0))
    kinds, asked = set(), EdgeSteps()
    for shape in (BRepPrimAPI_MakeCylinder(axes, 7.0, 20.0).Shape(), hill()):
        for face in explored(shape, "FACE"):
            for edge in explored(face, "EDGE"):
                curve = BRepAdaptor_Curve2d(edge, face)
                along, _ = asked.lookup(edge, curve.FirstParameter(), curve.LastParameter())
                truth = [(p.X(), p.Y()) for p in map(curve.Value, along.tolist())]
                # Some 100 mm: their last bits.
                assert parameters_on(curve, along) == pytest.approx(np.array(truth), abs=1e-11)
                kinds.add(str(curve.GetType()))
    assert len(kinds) >= 2


def test_a_face_with_very_many_holes_is_read_without_comparing_them(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    from benchmarks.large_models import holed_plate
    from ocmm_cad.step.brep._document import most_outlines

    path = written(tmp_path / "holes.stp", holed_plate(15, 16))
    assert most_outlines(path.read_bytes()) == 241
    assert most_outlines(written(tmp_path / "block.stp", block()).read_bytes()) < 20
    model = read_model(path)
    bores = [one for one in model.features if one.shape.value == "Cylinder"]
    assert len(bores) == 240
    assert {one.diameter for one in bores} == {8.0}
    # Both faces with the holes, and four sides.
    assert len(model.features) + len(model.left_out) == 246


def test_the_work_of_a_process_is_known_and_waiting_is_none() -> None:
    before = HOST.processor_seconds(os.getpid())
    assert before is not None
    until = time.process_time() + 0.1
    while time.process_time() < until:
        pass
    after = HOST.processor_seconds(os.getpid())
    # The system counts in hundredths.
    assert after is not None
    assert after - before >= 0.08
    assert HOST.processor_seconds(2**30) is None


def test_a_reader_that_has_worked_too_long_is_given_up(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    from benchmarks.large_models import holed_plate

    # A block is read within one tick of the clock of processes.
    model = written(tmp_path / "holes.stp", holed_plate(15, 16))
    with pytest.raises(InputError, match=r"reading took longer than 0 s \(at "):
        read_model(model, timeout_s=0.01)
    model = written(tmp_path / "block.stp", block())
    # The clock alone ends no process: this one waits for other work.
    assert read_model(model, timeout_s=HANG_S).features


def test_the_copy_of_the_reader_makes_what_the_reader_itself_makes(tmp_path: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    from ocmm_cad.step.brep._document import read_document
    from ocmm_cad.step.brep._mesh_aside import MeshAside
    from ocmm_cad.step.brep._raw_faces import faces_with_surface

    document = read_document(str(written(tmp_path / "hill.stp", hill())), lambda _: None)
    faces, _ = faces_with_surface(document.shape)
    made = []
    for is_ended in (False, True):
        aside = MeshAside(document, faces, ("hill.stp", "0" * 64), HANG_S)
        if is_ended:
            # As if the copy had been ended for lack of memory.
            aside.end()
        made.append((aside.mesh(), aside.part(lambda _: None)))
        aside.end()
    (one, part), (other, same) = made
    np.testing.assert_array_equal(one.triangles, other.triangles)
    np.testing.assert_array_equal(one.owners, other.owners)
    assert one.deflection_mm == other.deflection_mm
    assert part == same


def test_the_size_of_a_face_is_that_of_the_box_about_it() -> None:
    needs_package("OCP", "the extra 'step'")
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Dir, gp_Pln, gp_Pnt

    from ocmm_cad.step.brep import box_size

    plane = gp_Pln(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, 1.0))
    face = BRepBuilderAPI_MakeFace(plane, 0.0, 30.0, 0.0, 40.0).Face()
    # The box is larger by the tolerance of edges and corners, 1e-7 mm.
    assert box_size(face) == pytest.approx(50.0, abs=1e-5)
    # An infinite face belongs to no part.
    assert box_size(BRepBuilderAPI_MakeFace(plane).Face()) < 1e-3


def test_a_face_with_a_thousand_short_edges_is_one_with_targets(tmp_path: Path) -> None:
    """A contour that was exported as lines: on one side hardly longer than a gap, or shorter.

    The library compares each of them with each other one: of 10,000 it was not done after 120 s.
    """
    needs_package("OCP", "the extra 'step'")
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.gp import gp_Pnt

    from ocmm_cad.step.brep._document import most_edges

    # Half of a circle of 30 mm in steps of 0.08 mm, and its chord.
    outline = BRepBuilderAPI_MakePolygon()
    for angle in np.linspace(0.0, np.pi, 1200).tolist():
        outline.Add(gp_Pnt(30.0 * np.cos(angle), 30.0 * np.sin(angle), 0.0))
    outline.Close()
    face = BRepBuilderAPI_MakeFace(outline.Wire()).Face()
    path = written(tmp_path / "contour.stp", face)
    assert most_edges(path.read_bytes()) == 1200
    assert most_edges(written(tmp_path / "block.stp", block()).read_bytes()) == 4
    (plane,) = read_model(path).features
    places = np.array(plane.targets)
    # The ball of 6 mm and 1 mm keep off the outline; of the chords 0.02 mm are forgiven.
    assert np.hypot(places[:, 0], places[:, 1]).max() <= 26.0 + 0.02
    assert places[:, 1].min() >= 4.0 - 0.02


def test_a_mesh_of_flat_faces_is_kept_for_the_part(tmp_path: Path) -> None:
    """The deviation is zero; taken as "no solid", it led to a mesh too coarse to check."""
    needs_package("OCP", "the extra 'step'")
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    from ocmm_cad.step.brep._document import read_document
    from ocmm_cad.step.brep._part import _kept_deflection
    from ocmm_cad.step.brep._raw_faces import faces_with_surface
    from ocmm_cad.step.brep._solid_mesh import make_mesh

    path = written(tmp_path / "flat.stp", BRepPrimAPI_MakeBox(50.0, 40.0, 30.0).Shape())
    document = read_document(str(path), lambda _: None)
    faces, _ = faces_with_surface(document.shape)
    assert _kept_deflection(faces) == 0.0
    make_mesh(document.shape, faces)
    assert 0.0 < _kept_deflection(faces) <= 0.1
