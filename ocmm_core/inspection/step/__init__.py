"""Features of a plan from the surfaces of a STEP file; needs the extra ``step``.

In: a STEP file and the radius of the ball. Out: features with targets on the trimmed faces, and
what is none, with the reason.

Read `_model` (what is asked for, and what comes back), `_worker` (the process that reads),
`_raw_faces` (faces as numbers; the only file that needs OCP), `_joined` (which faces are one
surface, where a ball can touch it), `_answer` (what the process tells). It must not know what a
plan is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.step._choice import Choice, Offer, chosen, offers_of
    from ocmm_core.inspection.step._model import (
        STEP_ENDINGS,
        USUAL_BALL_MM,
        LeftOut,
        StepModel,
        read_model,
    )
    from ocmm_core.inspection.step._request import StepRequest, setting_of, usual_request
else:
    __getattr__ = door(
        __name__,
        _choice="Choice Offer chosen offers_of",
        _model="LeftOut STEP_ENDINGS StepModel USUAL_BALL_MM read_model",
        _request="StepRequest setting_of usual_request",
    )

__all__ = [
    "STEP_ENDINGS",
    "USUAL_BALL_MM",
    "Choice",
    "LeftOut",
    "Offer",
    "StepModel",
    "StepRequest",
    "chosen",
    "offers_of",
    "read_model",
    "setting_of",
    "usual_request",
]
