"""A STEP file as a document of the library: its shape, and what the file says of single faces."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.inspection.step.brep._edge_steps import EdgeSteps
from ocmm_core.inspection.step.brep._library import SameShape, explored, static, without_place

_LONGEST = 200
_OPERATOR = b"CARTESIAN_TRANSFORMATION_OPERATOR"
"""What may scale and mirror; placements of the usual kind cannot."""
_SAME_SCALE = 1e-9
_LARGE_BYTES = 8_000_000
_OUTLINES = re.compile(rb"FACE(?:_SURFACE)?\s*\(\s*'[^']*'\s*,\s*\(([#0-9,\s]*)\)")
_EDGES = re.compile(rb"EDGE_LOOP\s*\(\s*'[^']*'\s*,\s*\(([#0-9,\s]*)\)")
_MANY_OUTLINES, _MANY_EDGES = 200, 1000
"""Of one face, and of one outline; of so many the library is soon done with all pairs."""
_NO_NAME = frozenset(("", "none", "face", "advanced_face", "shell", "solid", "compound"))
"""What exporters write where they have nothing to say."""


@dataclass(frozen=True, slots=True)
class Said:
    """What a file says of a face; empty where it says nothing.

    Attributes
    ----------
    name, layer
        Words.
    """

    name: str = ""
    colour: str = ""
    """``#rrggbb``."""
    layer: str = ""


@dataclass(frozen=True, slots=True)
class StepDocument:
    """A STEP file as the library reads it."""

    shape: Any
    """All of it, components of assemblies in their places, in mm."""
    document: Any
    """`TDocStd_Document`."""
    said: dict[SameShape, Said]
    """By the face without its place."""
    reader: Any = None
    """`STEPControl_Reader`, which knows the entities that shapes were made of."""
    steps: EdgeSteps = field(default_factory=EdgeSteps)
    """Along its edges, as far as somebody asked."""

    def about(self, face: Any) -> Said:
        """Return what the file says of a face of ``shape``."""
        return self.said.get(without_place(face), Said()) if self.said else Said()


def read_document(path: str, doing: Callable[[str], None]) -> StepDocument:
    """Return the document of a STEP file.

    Raises
    ------
    ImportError
        The extra is not installed.
    ValueError
        The file is not complete, or contains no shape.
    InputError
        It scales or mirrors bodies.
    """
    import OCP.collections as held
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    doing("the text of the file")
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    reader = STEPCAFControl_Reader()
    # Of a large file only what is said of bodies is asked: labels of faces take half of its time.
    with_faces = int(Path(path).stat().st_size <= _LARGE_BYTES)
    static(Interface_Static, "SetIVal")("read.stepcaf.subshapes.name", with_faces)
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.SetLayerMode(True)
    reader.SetGDTMode(True)
    if reader.ReadFile(path) != IFSelect_RetDone:
        msg = "not a complete STEP file"
        raise ValueError(msg)
    # Only now: to read a file sets back what is to be mended.
    content = Path(path).read_bytes()
    if most_outlines(content) > _MANY_OUTLINES or most_edges(content) > _MANY_EDGES:
        _without_crossings(reader)
    if _OPERATOR in content.upper():
        _refuse_scaled_and_mirrored(reader.Reader().Model())
    del content
    doing("the shapes of the file")
    if not reader.Transfer(document):
        msg = "contains no shape"
        raise ValueError(msg)
    shapes = static(XCAFDoc_DocumentTool, "ShapeTool")(document.Main())
    free = held.Sequence_TDF_Label()
    shapes.GetFreeShapes(free)
    whole = _together([static(shapes, "GetShape")(label) for label in _items(free)])
    doing("names, colours and layers")
    return StepDocument(whole, document, _all_said(document, shapes), reader)


def _refuse_scaled_and_mirrored(model: Any) -> None:
    """Refuse a model that puts bodies at another scale, or mirrored, where it places them.

    The library divides by the scale where it should multiply, and turns what should be mirrored.
    """
    for index in range(1, model.NbEntities() + 1):
        entity = model.Value(index)
        if type(entity).__name__ != "StepGeom_CartesianTransformationOperator3d":
            continue
        axes = [
            [given.DirectionRatiosValue(k) for k in (1, 2, 3)] if given is not None else usual
            for given, usual in zip(
                (entity.Axis1(), entity.Axis2(), entity.Axis3()), np.eye(3).tolist(), strict=True
            )
        ]
        scale = entity.Scale() if entity.HasScale() else 1.0
        is_right_handed = float(np.linalg.det(np.array(axes))) > 0.0
        if not (abs(scale - 1.0) <= _SAME_SCALE and is_right_handed):
            how = "mirrors" if abs(scale - 1.0) <= _SAME_SCALE else f"scales (by {scale:g})"
            raise InputError(
                "plan.step",
                f"it {how} bodies where it places them, which the library gets wrong.",
                "Export each body as it is, not as a mirrored or scaled copy of another.",
            )


def most_outlines(content: bytes) -> int:
    """Return how many outlines and holes the face with most of them has, by the text of a file."""
    return max((found[1].count(b"#") for found in _OUTLINES.finditer(content)), default=0)


def most_edges(content: bytes) -> int:
    """Return how many edges the longest outline has, by the text of a file."""
    return max((found[1].count(b"#") for found in _EDGES.finditer(content)), default=0)


def _without_crossings(reader: Any) -> None:
    """Let the library not look for outlines that cross themselves or each other.

    It compares each hole of a face with each other one, and copies the face for each, and each edge
    of an outline with each other one: with thousands of them that takes minutes. All else that it
    mends is mended as ever.
    """
    from OCP.DE import DE_ShapeFixParameters
    from OCP.TCollection import TCollection_AsciiString

    reader.SetShapeFixParameters(DE_ShapeFixParameters())
    mends = reader.GetShapeFixParameters()
    for mode in ("FixSelfIntersectionMode", "FixIntersectingWiresMode"):
        mends.Bind(TCollection_AsciiString(f"FixShape.{mode}"), TCollection_AsciiString("0"))
    reader.SetShapeFixParameters(mends)


def _together(shapes: list[Any]) -> Any:
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    shapes = [one for one in shapes if one is not None and not one.IsNull()]
    if not shapes:
        msg = "contains no shape"
        raise ValueError(msg)
    if len(shapes) == 1:
        return shapes[0]
    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    for one in shapes:
        builder.Add(compound, one)
    return compound


def _all_said(document: Any, shapes: Any) -> dict[SameShape, Said]:
    """Return what the file says of faces; what it says of a body goes for faces without words."""
    import OCP.collections as held
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    colours = static(XCAFDoc_DocumentTool, "ColorTool")(document.Main())
    layers = static(XCAFDoc_DocumentTool, "LayerTool")(document.Main())
    said: dict[SameShape, Said] = {}
    every = held.Sequence_TDF_Label()
    shapes.GetShapes(every)
    for label in _items(every):
        if not static(shapes, "IsSimpleShape")(label):
            continue
        within = held.Sequence_TDF_Label()
        static(shapes, "GetSubShapes")(label, within)
        of_faces = []
        for part in (label, *_items(within)):
            shape = static(shapes, "GetShape")(part)
            if shape is None or shape.IsNull():
                continue
            words = _said_of(part, colours, layers)
            if "FACE" in str(shape.ShapeType()):
                of_faces.append((shape, words))
            elif words.colour or words.layer:
                for face in explored(shape, "FACE"):
                    said[without_place(face)] = Said("", words.colour, words.layer)
        for shape, words in of_faces:
            key = without_place(shape)
            body = said.get(key, Said())
            said[key] = Said(words.name, words.colour or body.colour, words.layer or body.layer)
    return said


def _said_of(label: Any, colours: Any, layers: Any) -> Said:
    import OCP.XCAFDoc as XCAFDoc
    from OCP.Quantity import Quantity_Color

    name = _name_of(label)
    colour, found = Quantity_Color(), ""
    for kind in (XCAFDoc.XCAFDoc_ColorSurf, XCAFDoc.XCAFDoc_ColorGen):
        if static(colours, "GetColor")(label, kind, colour):
            found = str(static(Quantity_Color, "ColorToHex")(colour).ToCString()).lower()
            break
    of_label = layers.GetLayers(label)
    layer = ""
    if of_label is not None and of_label.Length():
        layer = _word(of_label.Value(1).ToExtString())
    return Said("" if name.lower() in _NO_NAME else name, found, layer)


def _name_of(label: Any) -> str:
    """Return the name of a label. To ask for one attribute by its kind ends the process."""
    from OCP.TDF import TDF_AttributeIterator

    attributes = TDF_AttributeIterator(label)
    while attributes.More():
        attribute = attributes.Value()
        if type(attribute).__name__ == "TDataStd_Name":
            return _word(attribute.Get().ToExtString())
        attributes.Next()
    return ""


def _word(text: str) -> str:
    """Return a word of the file without what no line of text can hold."""
    return " ".join("".join(sign if sign.isprintable() else " " for sign in text).split())[
        :_LONGEST
    ]


def _items(sequence: Any) -> list[Any]:
    return [sequence.Value(index) for index in range(1, sequence.Length() + 1)]
