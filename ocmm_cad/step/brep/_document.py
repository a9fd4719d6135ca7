"""A STEP file as a document of the library: its shape, and attributes of faces."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ocmm_cad.pmi import units_fault
from ocmm_cad.step.brep._edge_steps import EdgeSteps
from ocmm_cad.step.brep._library import SameShape, compound_of, explored, static, without_place
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError

_LONGEST = 200
_OPERATOR = b"CARTESIAN_TRANSFORMATION_OPERATOR"
"""May scale and mirror; the usual placements cannot."""
_SAME_SCALE = 1e-9
_LARGE_BYTES = 8_000_000
_OUTLINES = re.compile(rb"FACE(?:_SURFACE)?\s*\(\s*'[^']*'\s*,\s*\(([#0-9,\s]*)\)")
_EDGES = re.compile(rb"EDGE_LOOP\s*\(\s*'[^']*'\s*,\s*\(([#0-9,\s]*)\)")
_MANY_OUTLINES, _MANY_EDGES = 200, 1000
"""Of one face, and of one outline; up to here comparing all pairs is fast."""
_NO_NAME = frozenset(("", "none", "face", "advanced_face", "shell", "solid", "compound"))
"""Meaningless names written by exporters."""


@dataclass(frozen=True, slots=True)
class Said:
    """Words of a face in the file; may be empty."""

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
    """`STEPControl_Reader`, which maps shapes to entities."""
    empty: tuple[str, ...] = ()
    """Names of components without a face."""
    steps: EdgeSteps = field(default_factory=EdgeSteps)

    def of_faces(self, faces: Sequence[Any]) -> StepDocument:
        """Return the document with some of its faces as its shape."""
        return replace(self, shape=_together(list(faces)))

    def about(self, face: Any) -> Said:
        return self.said.get(without_place(face), Said()) if self.said else Said()


def read_document(
    path: str, doing: Callable[[str], None], parts: Sequence[str] = ()
) -> StepDocument:
    """Return the document of a STEP file.

    ``parts``: files that it names, relative to its folder: all must be read. ImportError without
    the extra; ValueError if it is not complete, or contains no shape; InputError if it scales or
    mirrors bodies, or its units are missing or contradictory.
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
    # For a large file only attributes of bodies are read: labels of faces take half of the time.
    with_faces = int(Path(path).stat().st_size <= _LARGE_BYTES)
    static(Interface_Static, "SetIVal")("read.stepcaf.subshapes.name", with_faces)
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.SetLayerMode(True)
    reader.SetGDTMode(True)
    if reader.ReadFile(path) != IFSelect_RetDone:
        msg = "not a complete STEP file"
        raise ValueError(msg)
    # After reading, which resets the repair parameters.
    folder = Path(path).parent
    contents = [read_bytes(Path(path)), *(read_bytes(folder / name) for name in parts)]
    for name, one in zip(("", *parts), contents, strict=True):
        _refuse_units(name, one)
    content = b"".join(contents)
    del contents
    if most_outlines(content) > _MANY_OUTLINES or most_edges(content) > _MANY_EDGES:
        _without_crossings(reader)
    if _OPERATOR in content.upper():
        _refuse_scaled_and_mirrored(reader.Reader().Model())
        for name in parts:
            _refuse_scaled_and_mirrored(_model_of(str(folder / name)))
    del content
    doing("the shapes of the file")
    if not reader.Transfer(document):
        msg = "contains no shape"
        raise ValueError(msg)
    _refuse_unread(reader, parts)
    shapes = static(XCAFDoc_DocumentTool, "ShapeTool")(document.Main())
    free = held.Sequence_TDF_Label()
    shapes.GetFreeShapes(free)
    whole = _together([static(shapes, "GetShape")(label) for label in _items(free)])
    doing("names, colours and layers")
    said = _all_said(document, shapes)
    return StepDocument(whole, document, said, reader, _empty_components(shapes))


def _refuse_units(name: str, content: bytes) -> None:
    """Refuse a file without units, which the library would read as millimetres and radians."""
    if fault := units_fault(content):
        raise InputError(
            "plan.step",
            f"in its part file {name}, {fault}." if name else f"{fault}.",
            "Export the model again with units of length and angle for all geometry.",
        )


def _model_of(path: str) -> Any:
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(path)
    return reader.Model()


def _refuse_unread(reader: Any, parts: Sequence[str]) -> None:
    from OCP.IFSelect import IFSelect_RetDone

    files = reader.ExternFiles()
    # The map of the library counts as false even with entries.
    read = [
        one.GetName().ToCString()
        for one in (() if files is None else files)
        if one.GetLoadStatus() == IFSelect_RetDone and one.GetTransferStatus()
    ]
    missing = sorted({Path(name).name for name in parts} - {Path(name).name for name in read})
    if missing or len(read) < len(parts):
        raise InputError(
            "plan.step",
            f"the geometry library does not read its part files {', '.join(missing or parts)}.",
            "Export the assembly as one file.",
        )


def _refuse_scaled_and_mirrored(model: Any) -> None:
    """Refuse scaled and mirrored bodies: the library divides by the scale, and rotates."""
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
    """Return the largest number of outlines and holes of a face, from the text of a file."""
    return max((found[1].count(b"#") for found in _OUTLINES.finditer(content)), default=0)


def most_edges(content: bytes) -> int:
    """Return the largest number of edges of an outline, from the text of a file."""
    return max((found[1].count(b"#") for found in _EDGES.finditer(content)), default=0)


def _without_crossings(reader: Any) -> None:
    """Disable the library's search for outlines that cross themselves or each other.

    It compares all pairs of holes and of edges: thousands take minutes. Other repairs remain.
    """
    from OCP.DE import DE_ShapeFixParameters
    from OCP.TCollection import TCollection_AsciiString

    reader.SetShapeFixParameters(DE_ShapeFixParameters())
    mends = reader.GetShapeFixParameters()
    for mode in ("FixSelfIntersectionMode", "FixIntersectingWiresMode"):
        mends.Bind(TCollection_AsciiString(f"FixShape.{mode}"), TCollection_AsciiString("0"))
    reader.SetShapeFixParameters(mends)


def _together(shapes: list[Any]) -> Any:
    shapes = [one for one in shapes if one is not None and not one.IsNull()]
    if not shapes:
        msg = "contains no shape"
        raise ValueError(msg)
    return shapes[0] if len(shapes) == 1 else compound_of(shapes)


def _all_said(document: Any, shapes: Any) -> dict[SameShape, Said]:
    """Return the attributes of faces; those of a body apply to its faces without any."""
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


def _empty_components(shapes: Any) -> tuple[str, ...]:
    import OCP.collections as held

    every = held.Sequence_TDF_Label()
    shapes.GetShapes(every)
    return tuple(
        _name_of(label) or "without a name"
        for label in _items(every)
        if not static(shapes, "IsAssembly")(label)
        and not static(shapes, "IsReference")(label)
        and next(explored(static(shapes, "GetShape")(label), "FACE"), None) is None
    )


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
    """Return the name of a label. Requesting one attribute by its kind crashes the process."""
    from OCP.TDF import TDF_AttributeIterator

    attributes = TDF_AttributeIterator(label)
    while attributes.More():
        attribute = attributes.Value()
        if type(attribute).__name__ == "TDataStd_Name":
            return _word(attribute.Get().ToExtString())
        attributes.Next()
    return ""


def _word(text: str) -> str:
    return " ".join("".join(sign if sign.isprintable() else " " for sign in text).split())[
        :_LONGEST
    ]


def _items(sequence: Any) -> list[Any]:
    return [sequence.Value(index) for index in range(1, sequence.Length() + 1)]
