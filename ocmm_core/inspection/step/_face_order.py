"""Which face of the file a face of the library is: by identity, and checked; needs OCP."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ocmm_core.inspection.pmi import FaceText

if TYPE_CHECKING:
    from ocmm_core.inspection.step._raw_faces import RawFace

_FINAL = 1
"""Mode of the library: look among the final results, also those of parts of them."""
_SAME = 1e-6


class FaceOrder:
    """The faces of a file in its order, as the library holds them.

    Its numbers of entities are not those of the file, but it keeps them in the order of the file.
    """

    def __init__(self, reader: Any) -> None:
        from OCP.StepShape import StepShape_FaceSurface

        # Its end would empty the results.
        self._reader = reader
        session = reader.WS()
        self._results = session.TransferReader()
        model = session.Model()
        entities = (model.Value(index) for index in range(1, model.NbEntities() + 1))
        # They are kept, so that each stays the same object.
        self._faces = [one for one in entities if isinstance(one, StepShape_FaceSurface)]
        self._order = {id(one): place for place, one in enumerate(self._faces)}

    def of(self, face: Any) -> int:
        """Return which face of the file, from 0; -1 where the library does not know."""
        from OCP.Standard import Standard_Failure
        from OCP.TopLoc import TopLoc_Location

        for shape in (face, face.Located(TopLoc_Location())):
            try:
                entity = self._results.EntityFromShapeResult(shape, _FINAL)
            except Standard_Failure:
                continue
            if entity is not None:
                return self._order.get(id(entity), -1)
        return -1


def order_fault(faces: Iterable[RawFace], texts: Sequence[FaceText]) -> str:
    """Return why faces cannot be those of the text, as a part of a sentence; empty if they can.

    What the text says of each must be what the library found: its kind of surface, and its radius
    in one unit for all.

    Parameters
    ----------
    texts
        Faces of the text, in its order.
    """
    scales: list[float] = []
    for raw in faces:
        if raw.order < 0:
            continue
        if raw.order >= len(texts) or texts[raw.order].shape != raw.face.shape:
            return "its faces do not stand in the text as the reader found them"
        if texts[raw.order].radius > 0.0 and raw.face.radius > 0.0:
            scales.append(raw.face.radius / texts[raw.order].radius)
    if scales and np.ptp(scales) > _SAME * float(np.max(scales)):
        return "the radii of its faces are not those that the reader found"
    return ""
