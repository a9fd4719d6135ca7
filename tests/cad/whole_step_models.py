"""Seeded models as foreign programs write them: split holes, splines, seams, odd faces, parts.

Each model is written once and read by the import and, apart from it, by the library alone.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from ocmm_cad.step.brep._library import static
from tests.cad.odd_step_models import together
from tests.cad.step_models import _ball as ball
from tests.cad.step_models import _cone as cone
from tests.cad.step_models import _moved as moved
from tests.cad.step_models import _rod as rod
from tests.cad.step_models import _torus as torus
from tests.cad.step_models import _without as without
from tests.cad.step_models import block, written

Z = (0, 0, 1)
UNITS = ("MM", "INCH", "CM", "M", "FT")
Write = Callable[[Path, Generator], Path]


def turned(shape: Any, rng: Generator) -> Any:
    """Return a shape at a place and in an attitude without round numbers."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec

    motion, shift = gp_Trsf(), gp_Trsf()
    axis = gp_Ax1(gp_Pnt(*rng.uniform(-50, 50, 3).tolist()), gp_Dir(*rng.normal(size=3).tolist()))
    motion.SetRotation(axis, float(rng.uniform(0.1, 3.0)))
    shift.SetTranslation(gp_Vec(*rng.uniform(-200, 200, 3).tolist()))
    return BRepBuilderAPI_Transform(shape, shift.Multiplied(motion), True).Shape()


def _arcs(x: float, y: float, radius: float, cuts: Any) -> Any:
    """Return a ring of arcs between angles, their corners rounded apart by the library."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeWire
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt

    ring, wire = (
        gp_Circ(gp_Ax2(gp_Pnt(x, y, 0), gp_Dir(0, 0, 1)), radius),
        BRepBuilderAPI_MakeWire(),
    )
    for first, last in zip(cuts, [*cuts[1:], cuts[0] + 2.0 * np.pi], strict=True):
        wire.Add(BRepBuilderAPI_MakeEdge(ring, float(first), float(last)).Edge())
    return wire.Wire()


def split_plate(rng: Generator) -> Any:
    """Return a plate with holes that are two to four arcs each, one of them in the middle."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.TopoDS import TopoDS

    corners = BRepBuilderAPI_MakePolygon()
    for corner in ((-70, -50), (70, -50), (70, 50), (-70, 50)):
        corners.Add(gp_Pnt(*corner, 0))
    corners.Close()
    face = BRepBuilderAPI_MakeFace(corners.Wire())
    radius = float(rng.uniform(15, 40))
    holes = [(0.0, 0.0, radius), *((x, 0.0, float(rng.uniform(4.5, 8))) for x in (-56.0, 56.0))]
    for x, y, size in holes:
        start, count = float(rng.uniform(0, 6.28)), int(rng.integers(2, 5))
        cuts = start + 2.0 * np.pi * np.arange(count) / count
        wire = _arcs(x, y, size, cuts)
        face.Add(static(TopoDS, "Wire")(wire.Reversed()))
    return BRepPrimAPI_MakePrism(face.Face(), gp_Vec(0, 0, float(rng.uniform(14, 30)))).Shape()


def bored_plate(rng: Generator, count: int = 6) -> Any:
    """Return a block with bores of several sizes."""
    body = block(140, 60, 25)
    for place in range(count):
        body = without(body, rod((15 + 22 * place, 30, -1), Z, float(rng.uniform(4, 9)), 30))
    return body


def as_splines(shape: Any) -> Any:
    """Return a shape with all surfaces as B-splines."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert

    return BRepBuilderAPI_NurbsConvert(shape, True).Shape()


def windowed_tube(rng: Generator) -> Any:
    """Return a tube whose window lies on its seam, or near it."""
    tube = without(rod((0, 0, 0), Z, 40, 90), rod((0, 0, -1), Z, 28, 92))
    angle = float(rng.choice([0.0, rng.uniform(-0.4, 0.4)]))
    along = (np.cos(angle), np.sin(angle), 0.0)
    return without(tube, rod((0, 0, float(rng.uniform(35, 55))), along, 14, 60))


def flat_cone(rng: Generator) -> Any:
    """Return a cone with a full angle near 180, or near 0 degrees."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone

    if rng.random() < 0.7:
        rise = float(60.0 * np.tan(np.radians(rng.uniform(0.005, 0.9))))
        top = BRepPrimAPI_MakeCone(60.0, 0.0 if rng.random() < 0.5 else 20.0, rise).Shape()
        return together(block(), moved(top, 300.0, 0.0, 0.0))
    taper = float(rng.uniform(0.002, 0.1))
    return together(
        block(), moved(BRepPrimAPI_MakeCone(20.0, 20.0 - taper, 80.0).Shape(), 300, 0, 0)
    )


def tiny_edges(rng: Generator) -> Any:
    """Return a plate with a pocket whose outline is a thousand short edges."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec

    count = int(rng.integers(150, 400))
    outline = BRepBuilderAPI_MakePolygon()
    for angle in np.linspace(0.0, 2.0 * np.pi, count, endpoint=False):
        radius = 30.0 + 0.02 * rng.normal()
        outline.Add(gp_Pnt(70 + radius * np.cos(angle), 50 + radius * np.sin(angle), -1))
    outline.Close()
    tool = BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(outline.Wire()).Face(), gp_Vec(0, 0, 30))
    return without(block(140, 100, 20), tool.Shape())


def cut_sphere(rng: Generator) -> Any:
    """Return a ball with a hole through its pole, and a ring that was cut."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    whole = without(BRepPrimAPI_MakeSphere(30.0).Shape(), rod((0, 0, 0), Z, 10, 60))
    part = without(torus(), moved(block(80, 80, 80), 5, float(rng.uniform(-20, 5)), -40))
    return together(whole, moved(part, 200, 0, 0), moved(cone(), 400, 0, 0))


def turned_inside_out(rng: Generator) -> Any:
    return bored_plate(rng, 3).Reversed()


def filleted(rng: Generator) -> Any:
    """Return a block with a boss and a bore, all its edges rounded."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
    from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    boss = rod((70, 40, 20), Z, float(rng.uniform(12, 20)), 18)
    body = BRepAlgoAPI_Fuse(block(140, 80, 25), boss).Shape()
    body = without(body, rod((20, 40, -1), Z, float(rng.uniform(6, 11)), 40))
    rounded = BRepFilletAPI_MakeFillet(body)
    edges = TopExp_Explorer(body, TopAbs_EDGE)
    while edges.More():
        rounded.Add(float(rng.uniform(0.8, 2.5)), static(TopoDS, "Edge")(edges.Current()))
        edges.Next()
    return rounded.Shape()


def lofted(rng: Generator) -> Any:
    """Return a transition from a rectangle to a circle, with a bore through it."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakePolygon
    from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
    from OCP.gp import gp_Pnt

    wires = BRepOffsetAPI_ThruSections(True, bool(rng.random() < 0.5))
    for height, size, corners in ((0.0, 45.0, 4), (40.0, 34.0, 12), (90.0, 26.0, 12)):
        ring = BRepBuilderAPI_MakePolygon()
        for angle in np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False):
            radius = size * float(rng.uniform(0.97, 1.03))
            ring.Add(gp_Pnt(radius * np.cos(angle), radius * np.sin(angle), height))
        ring.Close()
        wires.AddWire(ring.Wire())
    return without(wires.Shape(), rod((0, 0, -1), Z, float(rng.uniform(8, 15)), 100))


def spline_bores(path: Path, rng: Generator, brackets: int) -> Path:
    """Write an assembly of brackets with five bores each, all surfaces as splines."""
    bracket = as_splines(bored_plate(rng, 5))
    parts = [moved(bracket, 160.0 * (k % 7), 80.0 * (k // 7), 0.0) for k in range(brackets)]
    return written(path, together(*parts))


def changed(path: Path, pattern: str, replace: Callable[[re.Match[str]], str], count: int) -> Path:
    """Change the first places of a text that fit a pattern."""
    text = path.read_text()
    more, made = re.subn(pattern, replace, text, count=count)
    assert made
    path.write_text(more)
    return path


def odd_radius(path: Path, rng: Generator) -> Path:
    """Write a model of which one bore has a radius that no part has."""
    radius = str(rng.choice(["1.E+300", "1.E+09", "0.", "-3.", "1.E-300"]))
    written(path, bored_plate(rng, 3))
    return changed(
        path, r"(CYLINDRICAL_SURFACE\('[^']*',#\d+,)[^)]*", lambda one: one[1] + radius, 1
    )


def odd_cone(path: Path, rng: Generator) -> Path:
    """Write a model of which one cone has an angle that no cone has."""
    angle = str(rng.choice(["0.", "1.5707963267949", "-0.3", "4.", "1.5706"]))
    written(path, together(block(), moved(cone(), 200, 0, 0)))
    return changed(
        path, r"(CONICAL_SURFACE\('[^']*',#\d+,[^,]*,)[^)]*", lambda one: one[1] + angle, 1
    )


def odd_torus(path: Path, rng: Generator) -> Path:
    sizes = str(rng.choice(["0.,0.", "5.,12.", "1.E+200,1.", "-4.,2."]))
    written(path, together(block(), moved(torus(), 200, 0, 0)))
    return changed(path, r"(TOROIDAL_SURFACE\('[^']*',#\d+,)[^)]*", lambda one: one[1] + sizes, 1)


def odd_spline(path: Path, rng: Generator) -> Path:
    """Write a model of which one spline has knots that do not rise, or that fall."""
    written(path, together(block(), moved(as_splines(rod((0, 0, 0), Z, 15, 40)), 200, 0, 0)))
    falls = rng.random() < 0.5

    def odd(found: re.Match[str]) -> str:
        knots = found[2].split(",")
        return found[1] + ",".join(knots[::-1] if falls else ["0."] * len(knots))

    return changed(
        path, r"(B_SPLINE_SURFACE_WITH_KNOTS\s*\((?:\s*\([0-9,\s]+\),){2}\s*\()([^)]*)", odd, 1
    )


def odd_direction(path: Path, rng: Generator) -> Path:
    """Write a model of which some directions have no length."""
    written(path, bored_plate(rng, 3))
    text = path.read_text()
    places = [one.span(1) for one in re.finditer(r"DIRECTION\('[^']*',\(([^)]*)\)\)", text)]
    start, end = places[int(rng.integers(len(places)))]
    path.write_text(text[:start] + "0.,0.,0." + text[end:])
    return path


def odd_point(path: Path, rng: Generator) -> Path:
    """Write a model with one point far outside any part."""
    written(path, bored_plate(rng, 3))
    text = path.read_text()
    places = [one.span(1) for one in re.finditer(r"CARTESIAN_POINT\('[^']*',\(([^)]*)\)\)", text)]
    start, end = places[int(rng.integers(len(places)))]
    path.write_text(text[:start] + "1.E+200,0.,0." + text[end:])
    return path


def in_unit(make: Callable[[Generator], Any]) -> Write:
    """Return what writes a model in one of the units, at any place."""

    def write(path: Path, rng: Generator) -> Path:
        return written(path, turned(make(rng), rng), str(rng.choice(UNITS)))

    return write


def assembly(path: Path, rng: Generator, prefix: str = "part_") -> Path:
    """Write an assembly of two parts, one of them twice; with a prefix each part is a file."""
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_AsIs
    from OCP.TCollection import TCollection_ExtendedString as Word
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopLoc import TopLoc_Location
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    path.parent.mkdir(parents=True, exist_ok=True)
    document = TDocStd_Document(Word("MDTV-XCAF"))
    shapes = static(XCAFDoc_DocumentTool, "ShapeTool")(document.Main())
    parts = []
    for name, shape in (("plate", split_plate(rng)), ("ball", ball())):
        parts.append(shapes.AddShape(shape, False))
        static(TDataStd_Name, "Set")(parts[-1], Word(name))
    whole = shapes.NewShape()
    for number, part in enumerate((*parts, parts[0])):
        motion = gp_Trsf()
        motion.SetTranslation(gp_Vec(300.0 * number, float(rng.uniform(-9, 9)), 0.0))
        shapes.AddComponent(whole, part, TopLoc_Location(motion))
    shapes.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    writer.SetNameMode(True)
    if prefix:
        writer.Transfer(document, STEPControl_AsIs, prefix)
    else:
        writer.Transfer(document, STEPControl_AsIs)
    writer.Write(str(path))
    return path


GOOD: dict[str, Write] = {
    "split plate": in_unit(split_plate),
    "bored plate": in_unit(bored_plate),
    "splines": in_unit(lambda rng: as_splines(bored_plate(rng))),
    "split splines": in_unit(lambda rng: as_splines(split_plate(rng))),
    "window": in_unit(windowed_tube),
    "spline window": in_unit(lambda rng: as_splines(windowed_tube(rng))),
    "flat cone": in_unit(flat_cone),
    "tiny edges": in_unit(tiny_edges),
    "cut sphere": in_unit(cut_sphere),
    "cut spline sphere": in_unit(lambda rng: as_splines(cut_sphere(rng))),
    "inside out": in_unit(turned_inside_out),
    "assembly": assembly,
}
MORE: dict[str, Write] = {
    "fillets": in_unit(filleted),
    "spline fillets": in_unit(lambda rng: as_splines(filleted(rng))),
    "loft": in_unit(lofted),
}
"""Kinds of the long form alone."""
ODD: dict[str, Write] = {
    "radius": odd_radius, "cone": odd_cone, "torus": odd_torus, "spline": odd_spline,
    "direction": odd_direction, "point": odd_point,
}  # fmt: skip
