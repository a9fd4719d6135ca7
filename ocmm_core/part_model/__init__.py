"""The nominal part as its CAD model has it: trimmed faces, mesh, edges, and how near they are.

In: a `PartModel` as the reader of STEP files makes it. Out: the same from its file, without the
library that read the model, and the nearest places of its faces to points.

Read `_part_model` (what there is of a part). `_spline` computes with one surface, `_trimming` with
its outline, `_patches` bounds how near it can be, and `_nearest` finds the nearest place of
trimmed faces. `_nominal_face` is a face as a plan holds it.
It must not know plans, features or pictures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.part_model._nearest import (
        EDGE_MM,
        RIVAL_MM,
        STRETCH,
        Feet,
        SearchedFace,
        followed_feet,
        nearest_feet,
        searched_face,
    )
    from ocmm_core.part_model._nominal_face import NominalFace, face_fault, nominal_face, searched
    from ocmm_core.part_model._part_model import (
        NO_COLOUR,
        ModelFace,
        PartModel,
        PlacedPart,
        SplineSurface,
        Triangles,
    )
    from ocmm_core.part_model._spline import bezier_surface, normals_at, places_at
else:
    __getattr__ = door(
        __name__,
        _nearest=(
            "EDGE_MM Feet RIVAL_MM STRETCH SearchedFace followed_feet nearest_feet searched_face"
        ),
        _nominal_face="NominalFace face_fault nominal_face searched",
        _part_model="ModelFace NO_COLOUR PartModel PlacedPart SplineSurface Triangles",
        _spline="bezier_surface normals_at places_at",
    )

__all__ = [
    "EDGE_MM",
    "NO_COLOUR",
    "RIVAL_MM",
    "STRETCH",
    "Feet",
    "ModelFace",
    "NominalFace",
    "PartModel",
    "PlacedPart",
    "SearchedFace",
    "SplineSurface",
    "Triangles",
    "bezier_surface",
    "face_fault",
    "followed_feet",
    "nearest_feet",
    "nominal_face",
    "normals_at",
    "places_at",
    "searched",
    "searched_face",
]
