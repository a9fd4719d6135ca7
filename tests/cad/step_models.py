"""Models made with the library of the extra ``step``, and distances of points from them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocmm_core.geometry import Float

TESSELLATED = "nist_ftc_08_asme1_ap242-e1-tg.stp"
"""In the folder ``step`` of the reference data."""
Make = Callable[[], Any]


def block(length: float = 100.0, width: float = 60.0, height: float = 20.0) -> Any:
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
    part = _without(block(), _rod((50, 30, -1), (0, 0, 1), 12, 30))
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

    return _with(block(), _moved(BRepPrimAPI_MakeSphere(25.0).Shape(), 50.0, 30.0, 30.0))


def bent_outline() -> Any:
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


def bent_pocket() -> Any:
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeEdge,
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakeWire,
    )
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec

    bent = BRepBuilderAPI_MakeEdge(bent_outline()).Edge()
    shut = BRepBuilderAPI_MakeEdge(gp_Pnt(80, 10, 0), gp_Pnt(20, 10, 0)).Edge()
    outline = BRepBuilderAPI_MakeFace(BRepBuilderAPI_MakeWire(bent, shut).Wire()).Face()
    tool = BRepPrimAPI_MakePrism(outline, gp_Vec(0, 0, 30)).Shape()
    return _without(block(), _moved(tool, 0, 0, -5))


def _spline_curve(places: Sequence[Sequence[float]]) -> Any:
    """Return a curve of degree 3 (lower for fewer poles) by its poles."""
    import OCP.collections as held
    from OCP.Geom import Geom_BSplineCurve
    from OCP.gp import gp_Pnt

    degree = min(3, len(places) - 1)
    spans = len(places) - degree
    poles = held.Array1_gp_Pnt(1, len(places))
    for index, place in enumerate(places, start=1):
        poles.SetValue(index, gp_Pnt(*map(float, place)))
    knots, often = held.Array1_double(1, spans + 1), held.Array1_int(1, spans + 1)
    for index in range(spans + 1):
        knots.SetValue(index + 1, float(index))
        often.SetValue(index + 1, degree + 1 if index in (0, spans) else 1)
    return Geom_BSplineCurve(poles, knots, often, degree)


def _outlined(*curves: Any) -> Any:
    """Return a face in a plane whose outline the curves are."""
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeEdge,
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakeWire,
    )

    wire = BRepBuilderAPI_MakeWire()
    for curve in curves:
        wire.Add(BRepBuilderAPI_MakeEdge(curve).Edge())
    return BRepBuilderAPI_MakeFace(wire.Wire()).Face()


def _straight(start: Sequence[float], end: Sequence[float]) -> Any:
    return _spline_curve([start, end])


def vase() -> Any:
    """Return a body that a spline makes which is turned about z."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeRevol
    from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt

    bent = _spline_curve([(20, 0, 0), (35, 0, 15), (15, 0, 35), (25, 0, 60), (22, 0, 80)])
    outline = _outlined(
        bent, _straight((22, 0, 80), (0, 0, 80)), _straight((0, 0, 80), (0, 0, 0)),
        _straight((0, 0, 0), (20, 0, 0)),
    )  # fmt: skip
    return BRepPrimAPI_MakeRevol(outline, gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1))).Shape()


def rail() -> Any:
    """Return a body that a spline makes which is drawn along y."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Vec

    bent = _spline_curve([(0, 0, 20), (20, 0, 45), (50, 0, 5), (80, 0, 40), (100, 0, 20)])
    outline = _outlined(
        bent, _straight((100, 0, 20), (100, 0, 0)), _straight((100, 0, 0), (0, 0, 0)),
        _straight((0, 0, 0), (0, 0, 20)),
    )  # fmt: skip
    return BRepPrimAPI_MakePrism(outline, gp_Vec(0, 60, 0)).Shape()


def hill(rational: bool = False, rise: float = 8.0) -> Any:
    """Return a block of 100 by 60 whose top is a free surface some 30 mm high, with a bore."""
    import OCP.collections as held
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Splitter
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.Geom import Geom_BSplineSurface
    from OCP.gp import gp_Pnt

    count = 7
    poles, weights = held.Array2_gp_Pnt(1, count, 1, count), held.Array2_double(1, count, 1, count)
    for i in range(count):
        for j in range(count):
            x, y = -20.0 + 140.0 * i / (count - 1), -20.0 + 100.0 * j / (count - 1)
            z = 30.0 + rise * np.sin(0.05 * x) * np.cos(0.06 * y)
            poles.SetValue(i + 1, j + 1, gp_Pnt(x, y, z))
            weights.SetValue(i + 1, j + 1, 1.0 + (0.3 * ((i + j) % 2) if rational else 0.0))
    knots, often = held.Array1_double(1, 5), held.Array1_int(1, 5)
    for index in range(5):
        knots.SetValue(index + 1, float(index))
        often.SetValue(index + 1, 4 if index in (0, 4) else 1)
    top = Geom_BSplineSurface(poles, weights, knots, knots, often, often, 3, 3)
    body = block(100, 60, 60)
    bodies, tools = held.List_TopoDS_Shape(), held.List_TopoDS_Shape()
    bodies.Append(body)
    tools.Append(BRepBuilderAPI_MakeFace(top, 1e-6).Face())
    split = BRepAlgoAPI_Splitter()
    split.SetArguments(bodies)
    split.SetTools(tools)
    split.Build()
    return _without(_lowest(split.Shape()), _rod((50, 30, -1), (0, 0, 1), 8, 80))


def _lowest(shape: Any) -> Any:
    """Return that of some solids whose middle lies lowest."""
    import OCP.TopAbs as TopAbs
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.TopExp import TopExp_Explorer

    measure = getattr(BRepGProp, "VolumeProperties_s", None) or BRepGProp.VolumeProperties
    found = []
    solids = TopExp_Explorer(shape, TopAbs.TopAbs_SOLID)
    while solids.More():
        volume = GProp_GProps()
        measure(solids.Current(), volume)
        found.append((volume.CentreOfMass().Z(), solids.Current()))
        solids.Next()
    return min(found, key=lambda one: one[0])[1]


def elliptic() -> Any:
    """Return a block with a pocket whose wall is drawn from an ellipse, and one from an arc."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.Geom import Geom_Ellipse
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec

    oval = Geom_Ellipse(gp_Ax2(gp_Pnt(50, 30, -5), gp_Dir(0, 0, 1), gp_Dir(1, 1, 0)), 25.0, 12.0)
    return _without(block(), BRepPrimAPI_MakePrism(_outlined(oval), gp_Vec(0, 0, 40)).Shape())


def labelled(path: Path) -> Path:
    """Write an assembly of two bored blocks: a face has a name, the body and a face a colour."""
    from OCP.Interface import Interface_Static
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer
    from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool

    def static(owner: Any, name: str) -> Any:
        return getattr(owner, f"{name}_s", None) or getattr(owner, name)

    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    shapes = static(XCAFDoc_DocumentTool, "ShapeTool")(document.Main())
    colours = static(XCAFDoc_DocumentTool, "ColorTool")(document.Main())
    layers = static(XCAFDoc_DocumentTool, "LayerTool")(document.Main())
    part = MODELS["bored"][0]()
    body = shapes.AddShape(part, False)
    whole = shapes.NewShape()
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    for x in (0.0, 300.0):
        motion = gp_Trsf()
        motion.SetTranslation(gp_Vec(x, 0.0, 0.0))
        shapes.AddComponent(whole, body, TopLoc_Location(motion))
    colours.SetColor(body, Quantity_Color(0.0, 0.0, 1.0, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
    layers.SetLayer(body, TCollection_ExtendedString("7"))
    face = TopExp_Explorer(part, TopAbs_FACE).Current()
    label = shapes.AddSubShape(body, face)
    static(TDataStd_Name, "Set")(label, TCollection_ExtendedString("DATUM FACE"))
    colours.SetColor(label, Quantity_Color(1.0, 0.0, 0.0, Quantity_TOC_sRGB), XCAFDoc_ColorSurf)
    shapes.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    static(Interface_Static, "SetIVal")("write.stepcaf.subshapes.name", 1)
    writer.SetNameMode(True)
    writer.SetColorMode(True)
    writer.SetLayerMode(True)
    writer.Transfer(document)
    writer.Write(str(path))
    return path


X = (1, 0, 0)
FREE_FORM: dict[str, Make] = {
    "vase": vase,
    "rail": rail,
    "hill": hill,
    "rational hill": lambda: hill(True),
    "elliptic": elliptic,
    "bent pocket": bent_pocket,
}
MODELS: dict[str, tuple[Make, dict[str, int]]] = {
    # Plane counts the faces with room for nine points of a ball of 6 mm.
    "block": (block, {"Plane": 6}),
    "bored": (lambda: _without(block(), _rod((20, 20, -1), (0, 0, 1), 6, 30)),
              {"Plane": 6, "Cylinder": 1}),
    "large hole": (lambda: _without(block(100, 100, 20), _rod((50, 50, -1), (0, 0, 1), 40, 30)),
                   {"Plane": 6, "Cylinder": 1}),
    "clevis": (lambda: _without(block(100, 60, 60), _moved(block(80, 60, 60), 10, 0, 20),
                                _rod((-1, 30, 40), X, 10, 102)), {"Cylinder": 2}),
    "three lugs": (lambda: _without(block(160, 60, 60), _moved(block(40, 60, 60), 20, 0, 20),
                                    _moved(block(40, 60, 60), 90, 0, 20),
                                    _rod((-1, 30, 40), X, 10, 162)), {"Cylinder": 3}),
    "stepped shaft": (lambda: _with(_rod((0, 0, 0), X, 20, 40), _rod((40, 0, 0), X, 15, 40),
                                    _rod((80, 0, 0), X, 20, 40)), {"Cylinder": 3}),
    "crossed bores": (lambda: _without(block(), _rod((50, 30, -1), (0, 0, 1), 8, 30),
                                       _rod((50, -1, 10), (0, 1, 0), 5, 62)), {"Cylinder": 3}),
    "slotted bore": (lambda: _without(block(100, 60, 40), _rod((50, 30, -1), (0, 0, 1), 20, 50),
                                      _moved(block(100, 8, 40), 0, 26, 0)), {"Cylinder": 1}),
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
    """Return the distances of points from the faces of the solids, by the library's search.

    The distance from a solid is 0 for every point inside the material. Without solids all faces
    count.
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
    wholes = []
    solids = TopExp_Explorer(reader.OneShape(), TopAbs.TopAbs_SOLID)
    while solids.More():
        wholes.append(solids.Current())
        solids.Next()
    for whole in wholes or [reader.OneShape()]:
        of_whole = TopExp_Explorer(whole, TopAbs.TopAbs_FACE)
        while of_whole.More():
            builder.Add(faces, of_whole.Current())
            of_whole.Next()
    vertices = [BRepBuilderAPI_MakeVertex(gp_Pnt(*point)).Vertex() for point in points]
    return np.array([BRepExtrema_DistShapeShape(vertex, faces).Value() for vertex in vertices])
