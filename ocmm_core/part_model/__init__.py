"""The nominal part as its CAD model has it: trimmed faces, mesh, edges.

In: a `PartModel` as the reader of STEP files makes it. Out: the same from its file, without the
library that read the model.

Read `_part_model` (what there is of a part). It must not know plans, features or pictures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.part_model._part_model import (
        NO_COLOUR,
        ModelFace,
        PartModel,
        PlacedPart,
        SplineSurface,
        Triangles,
    )
else:
    __getattr__ = door(
        __name__, _part_model="ModelFace NO_COLOUR PartModel PlacedPart SplineSurface Triangles"
    )

__all__ = ["NO_COLOUR", "ModelFace", "PartModel", "PlacedPart", "SplineSurface", "Triangles"]
