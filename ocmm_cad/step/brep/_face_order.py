"""Faces of library and file identified and verified, and a check of targets; needs OCP.

Targets are checked by the library's own classifier.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_cad.pmi import FaceText, Pmi, may_say_tolerances, read_pmi
from ocmm_cad.step.brep._library import static
from ocmm_cad.step.brep._raw_faces import RawFace
from ocmm_core.geometry import Float

_OFF_MM = 0.02
"""A target farther from its face is wrong: more than the deviation of a recognised spline."""
_ON_EDGE = 1e-7


class FaceCheck:
    """Whether places lie on faces, numbered from 1, inside edges, by surface and classifier."""

    def __init__(self, faces: Sequence[Any]) -> None:
        self._faces = faces

    def inside(self, numbers: Sequence[int], points: Float) -> NDArray[np.bool_]:
        """Return which of the points (n, 3), mm, lie on any of the faces and inside its edges."""
        found = np.zeros(len(points), dtype=np.bool_)
        for number in numbers:
            left = np.flatnonzero(~found)
            if not len(left):
                break
            found[left] = _inside(self._faces[number - 1], points[left])
        return found


def _inside(face: Any, points: Float) -> NDArray[np.bool_]:
    from OCP.BRep import BRep_Tool
    from OCP.BRepClass import BRepClass_FaceClassifier
    from OCP.BRepTools import BRepTools
    from OCP.gp import gp_Pnt, gp_Pnt2d
    from OCP.ShapeAnalysis import ShapeAnalysis_Surface
    from OCP.TopAbs import TopAbs_IN

    plain = static(BRep_Tool, "Surface")(face)
    surface = ShapeAnalysis_Surface(plain)
    u0, _, v0, _ = static(BRepTools, "UVBounds")(face)
    u_period = plain.UPeriod() if plain.IsUPeriodic() else 0.0
    v_period = plain.VPeriod() if plain.IsVPeriodic() else 0.0
    found = np.zeros(len(points), dtype=np.bool_)
    for row, (x, y, z) in enumerate(points.tolist()):
        at = surface.ValueOfUV(gp_Pnt(x, y, z), _ON_EDGE)
        if surface.Gap() > _OFF_MM:
            continue
        u, v = _from(at.X(), u0, u_period), _from(at.Y(), v0, v_period)
        found[row] = BRepClass_FaceClassifier(face, gp_Pnt2d(u, v), _ON_EDGE).State() == TopAbs_IN
    return found


def _from(value: float, start: float, period: float) -> float:
    """Return a parameter in the period that begins where the face does."""
    if period <= 0.0:
        return value
    return start + (value - start + _ON_EDGE) % period - _ON_EDGE


_FINAL = 1
"""Mode of the library: search the final results, also those of their parts."""
_SAME = 1e-6


def tolerances_of(
    text: str,
    reader: Any,
    with_surface: Sequence[Any],
    faces: Sequence[RawFace],
    doing: Callable[[str], None],
) -> tuple[Pmi, dict[int, int], dict[int, str]]:
    """Return the tolerances of a file, and the face of the file for each face.

    ``reader`` has read the file; ``with_surface``: faces of the library, of which `RawFace` has the
    numbers, from 1. Returns tolerances; number in the file by face number; kind of surface by
    number in the file. If ambiguous, no faces are returned, and the first has the reason.
    """
    doing("the tolerances of the model")
    if not may_say_tolerances(text):
        return Pmi(), {}, {}
    pmi, texts = read_pmi(text)
    if pmi.is_empty or pmi.fault:
        return pmi, {}, {}
    doing("which faces the tolerances are of")
    order = _order_of(reader, with_surface)
    fault = order_fault(faces, order, texts)
    if fault:
        return msgspec.structs.replace(pmi, fault=fault), {}, {}
    entities = {number: texts[place].number for number, place in order.items()}
    return pmi, entities, {one.number: one.shape for one in texts}


def order_fault(
    faces: Sequence[RawFace], order: Mapping[int, int], texts: Sequence[FaceText]
) -> str:
    """Return why faces cannot be those of the text, as a part of a sentence; empty if they can.

    Kinds must match, and radii in one unit for all. `order`: index in the text by face number.
    """
    scales: list[float] = []
    for raw in faces:
        place = order.get(raw.number)
        if place is None or raw.face.deviation_mm is not None:
            # A recognised surface is a spline in the text.
            continue
        if place >= len(texts) or texts[place].shape != raw.face.shape:
            return "its faces do not stand in the text as the reader found them"
        if texts[place].radius > 0.0 and raw.face.radius > 0.0:
            scales.append(raw.face.radius / texts[place].radius)
    if scales and np.ptp(scales) > _SAME * float(np.max(scales)):
        return "the radii of its faces are not those that the reader found"
    return ""


def _order_of(reader: Any, with_surface: Sequence[Any]) -> dict[int, int]:
    """Return the index of the face of the file for each face, by its number from 1.

    The library's numbers of entities differ from those of the file, but keep its order.
    """
    from OCP.Standard import Standard_Failure
    from OCP.StepShape import StepShape_FaceSurface
    from OCP.TopLoc import TopLoc_Location

    session = reader.WS()
    results, model = session.TransferReader(), session.Model()
    entities = (model.Value(index) for index in range(1, model.NbEntities() + 1))
    # Keep references, so that each stays the same object.
    faces = [one for one in entities if isinstance(one, StepShape_FaceSurface)]
    place_of = {id(one): place for place, one in enumerate(faces)}
    found: dict[int, int] = {}
    for number, face in enumerate(with_surface, start=1):
        for shape in (face, face.Located(TopLoc_Location())):
            try:
                entity = results.EntityFromShapeResult(shape, _FINAL)
            except Standard_Failure:
                continue
            if entity is not None and id(entity) in place_of:
                found[number] = place_of[id(entity)]
                break
    return found
