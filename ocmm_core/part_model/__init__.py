"""The nominal part as its CAD model has it: trimmed faces, mesh, edges.

In: a `PartModel` as the reader of STEP files makes it, or its bytes. Out: bytes, a file, and the
same model from these, without the library that read it; or one sentence that says what is wrong.

Read `_part_model` (what there is of a part), `_checked_model` (whether it holds together),
`_model_file` (as bytes),
`_spline_points` (points of a face). It must not know plans, features or pictures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.part_model._checked_model import MOST_FACES, MOST_TRIANGLES
    from ocmm_core.part_model._model_file import (
        LARGEST_MODEL,
        MODEL_ENDING,
        model_from_bytes,
        model_to_bytes,
        read_model_file,
        write_model_file,
    )
    from ocmm_core.part_model._part_model import (
        NO_COLOUR,
        ModelFace,
        PartModel,
        PlacedPart,
        SplineSurface,
        Triangles,
    )
    from ocmm_core.part_model._spline_points import spline_frames, spline_points
else:
    __getattr__ = door(
        __name__,
        _checked_model="MOST_FACES MOST_TRIANGLES",
        _model_file=(
            "LARGEST_MODEL MODEL_ENDING model_from_bytes model_to_bytes read_model_file "
            "write_model_file"
        ),
        _part_model="ModelFace NO_COLOUR PartModel PlacedPart SplineSurface Triangles",
        _spline_points="spline_frames spline_points",
    )

__all__ = [
    "LARGEST_MODEL",
    "MODEL_ENDING",
    "MOST_FACES",
    "MOST_TRIANGLES",
    "NO_COLOUR",
    "ModelFace",
    "PartModel",
    "PlacedPart",
    "SplineSurface",
    "Triangles",
    "model_from_bytes",
    "model_to_bytes",
    "read_model_file",
    "spline_frames",
    "spline_points",
    "write_model_file",
]
