"""Which face of the file a face of the library is: by identity, and checked; needs OCP."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from ocmm_core.inspection.pmi import FaceText, Pmi, may_say_tolerances, read_pmi
from ocmm_core.inspection.step.brep._raw_faces import RawFace

_FINAL = 1
"""Mode of the library: look among the final results, also those of parts of them."""
_SAME = 1e-6


def tolerances_of(
    text: str,
    reader: Any,
    with_surface: Sequence[Any],
    faces: Sequence[RawFace],
    doing: Callable[[str], None],
) -> tuple[Pmi, dict[int, int], dict[int, str]]:
    """Return what a file says of tolerances, and which face of it each face is.

    Where it is in doubt which face is which, nothing is said of them, and why stands in the first.

    Parameters
    ----------
    reader
        That has read it.
    with_surface
        Faces of the library, of which `RawFace` has the numbers, from 1.

    Returns
    -------
    Pmi
        Of the text.
    dict
        Number in the file by the number of the face.
    dict
        Kind of surface of every face of the file, by its number there.
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

    What the text says of each must be what the library found: its kind of surface, and its radius
    in one unit for all.

    Parameters
    ----------
    order
        Which face of the text, from 0, by the number of a face.
    texts
        Faces of the text, in its order.
    """
    scales: list[float] = []
    for raw in faces:
        place = order.get(raw.number)
        if place is None or raw.face.deviation_mm is not None:
            # The text has a spline where a surface was recognised.
            continue
        if place >= len(texts) or texts[place].shape != raw.face.shape:
            return "its faces do not stand in the text as the reader found them"
        if texts[place].radius > 0.0 and raw.face.radius > 0.0:
            scales.append(raw.face.radius / texts[place].radius)
    if scales and np.ptp(scales) > _SAME * float(np.max(scales)):
        return "the radii of its faces are not those that the reader found"
    return ""


def _order_of(reader: Any, with_surface: Sequence[Any]) -> dict[int, int]:
    """Return which face of the file, from 0, each face is, by its number from 1.

    The library's numbers of entities are not those of the file, but it keeps them in the order of
    the file.
    """
    from OCP.Standard import Standard_Failure
    from OCP.StepShape import StepShape_FaceSurface
    from OCP.TopLoc import TopLoc_Location

    session = reader.WS()
    results, model = session.TransferReader(), session.Model()
    entities = (model.Value(index) for index in range(1, model.NbEntities() + 1))
    # They are kept, so that each stays the same object.
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
