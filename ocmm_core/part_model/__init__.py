"""Nominal part of its CAD model: trimmed faces, mesh, edges, and the distance of points from them.

In: a `PartModel` from the reader of STEP files, or its bytes. Out: its bytes or file, the model
read back without a CAD library, an error sentence for an invalid one, and the nearest points of its
faces.

Read `_part_model` (the parts of a model, their consistency) and `_model_file` (as bytes);
`_spline` computes with one surface, `_trimming` with its outline and the bounds of its distance,
`_nearest` finds the nearest point of trimmed faces. `_nominal_face` is a face as a plan holds it,
with its touch points, `_part_model` places the part before the cameras; `_model_file` finds the
reader of a model that a package adds (`ocmm.models`).
It must not know plans, features or pictures.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.part_model._model_file import (
        LARGEST_MODEL, MODEL_ENDING, STEP_ENDINGS, FilesOfModel, ModelReader, model_endings,
        model_from_bytes, model_reader, model_to_bytes, read_model_file, write_model_file,
    )  # fmt: skip
    from ocmm_core.part_model._nearest import (
        Feet, SearchedFace, followed_feet, nearest_feet, searched_face,
    )  # fmt: skip
    from ocmm_core.part_model._nominal_face import (
        NominalFace, face_fault, nominal_face, searched, spread_places,
    )  # fmt: skip
    from ocmm_core.part_model._part_model import (
        FARTHEST_MM, MOST_FACES, MOST_TRIANGLES, ModelFace, PartModel, PlacedPart, Placement,
        SplineSurface, Triangles,
    )  # fmt: skip
    from ocmm_core.part_model._spline import bezier_surface, derivatives_at, normals_at, places_at
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "FARTHEST_MM", "LARGEST_MODEL", "MODEL_ENDING", "MOST_FACES", "MOST_TRIANGLES", "STEP_ENDINGS",
    "Feet", "FilesOfModel", "ModelFace", "ModelReader", "NominalFace", "PartModel", "PlacedPart",
    "Placement", "SearchedFace", "SplineSurface", "Triangles", "bezier_surface", "derivatives_at",
    "face_fault", "followed_feet", "model_endings", "model_from_bytes", "model_reader",
    "model_to_bytes", "nearest_feet", "nominal_face", "normals_at", "places_at", "read_model_file",
    "searched", "searched_face", "spread_places", "write_model_file",
]  # fmt: skip
