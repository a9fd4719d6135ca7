"""Features of a plan from the surfaces of a STEP file; needs the extra ``step``.

In: a STEP file and the radius of the ball. Out: features with targets on the trimmed faces, and
what is none, with the reason; the part itself, as mesh and faces.

Read `_model` (what is asked for, and what comes back), `_asking` and `_worker` (the process that
reads, from both sides), `_library`, `_document` (the file as the library has it), `_raw_faces`
(faces as numbers), `_joined` (which faces are one surface, where a ball can touch it),
`_surface_splines`, `_part` (the part), `_face_order` (which faces tolerances are of), `_answer`
(what the process tells). It must not know what a
plan is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.step._asking import STEP_ENDINGS
    from ocmm_core.inspection.step._model import (
        USUAL_BALL_MM,
        LeftOut,
        StepModel,
        read_model,
        read_part,
    )
else:
    __getattr__ = door(
        __name__,
        _asking="STEP_ENDINGS",
        _model="LeftOut StepModel USUAL_BALL_MM read_model read_part",
    )

__all__ = [
    "STEP_ENDINGS",
    "USUAL_BALL_MM",
    "LeftOut",
    "StepModel",
    "read_model",
    "read_part",
]
