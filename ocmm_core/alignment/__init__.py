"""Part frame from measured features.

In: the rule of the plan, geometry and covariance of the measured datum features, saved frames.
Out: the frame of the part with its derivative by the points, residuals, and free motions.

Read `_rules` (all kinds of alignment) and `_checks`. `_datums` selects the method: 3-2-1,
`_datum_frame` and `_precedence` (ISO 5459), `_best_fit`, `_model_fit` (ball centres to faces of the
model). `_residuals` (with the derivatives of a frame), `_freedom` and `_checks` the preview;
`_frame_document` stores one. The package is independent of tolerances, plans and job files.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.alignment._best_fit import fit_points, fit_points_locked
    from ocmm_core.alignment._checks import (
        AlignmentReport, alignment_fault, preview_alignment, report_lines,
    )  # fmt: skip
    from ocmm_core.alignment._datum_frame import MOST_DATUMS, datum_frame, freedoms_left
    from ocmm_core.alignment._datums import frame_of, nominal_frame, settled
    from ocmm_core.alignment._frame_document import (
        content_hash, doubt_of, frame_document, is_covariance, load_frame, relocation, save_frame,
        saved_frame, saved_frame_in, unknown_frame,
    )  # fmt: skip
    from ocmm_core.alignment._model_fit import ModelFit, fit_to_faces
    from ocmm_core.alignment._precedence import (
        datums_in_precedence, datums_refit_by, in_precedence, may_be_refit, part_frame,
        refit_under_precedence,
    )  # fmt: skip
    from ocmm_core.alignment._residuals import Residual, frame_jacobian
    from ocmm_core.alignment._rules import (
        OLDEST, Alignment, AnyAlignment, BestFit, BoundAlignment, DatumAlignment,
        DatumReferenceFrame, LockedMotion, ModelBestFit, Relocation, SavedFrame, frame_name,
        simulated_frame,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "MOST_DATUMS", "OLDEST", "Alignment", "AlignmentReport", "AnyAlignment", "BestFit",
    "BoundAlignment", "DatumAlignment", "DatumReferenceFrame", "LockedMotion", "ModelBestFit",
    "ModelFit", "Relocation", "Residual", "SavedFrame", "alignment_fault", "content_hash",
    "datum_frame", "datums_in_precedence", "datums_refit_by", "doubt_of", "fit_points",
    "fit_points_locked", "fit_to_faces", "frame_document", "frame_jacobian", "frame_name",
    "frame_of", "freedoms_left", "in_precedence", "is_covariance", "load_frame", "may_be_refit",
    "nominal_frame", "part_frame", "preview_alignment", "refit_under_precedence", "relocation",
    "report_lines", "save_frame", "saved_frame", "saved_frame_in", "settled", "simulated_frame",
    "unknown_frame",
]  # fmt: skip
