"""Features of a plan from the surfaces of a STEP file; needs the extra ``step``.

In: a STEP file, the ball, and optionally probe, cameras and placement. Out: features with targets
on the trimmed faces, and omitted surfaces with the reason; the part itself, as mesh and faces.

Read `_model` (query and result, probe and cameras), `_chosen_reach` (selection), `_asking` and
`_worker` (both sides of the reading process). In that process package `brep` turns the file into
numbers, `_joined` groups faces into surfaces and finds room for a ball, `_placed` selects targets
(`_place_kernel`). `_chosen_reach` also counts the result of each face. `_model_files` checks the
files, `_plugin` is the reader for plans (`ocmm.models`). `_worker` and `_profiled` are both
sides of free-form faces, `_profiled` also has the message of the process and names of features;
`_chosen_reach` completes large models later. It must not know plans.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cad.step._asking import READER_MODULES, STEP_SIZE_MB, has_step
    from ocmm_cad.step._chosen_reach import (
        FREE_FORM, Choice, ChosenReach, FacesAccount, Offer, ask_for_chosen, chosen, faces_account,
        offers_of,
    )  # fmt: skip
    from ocmm_cad.step._model import (
        USUAL_BALL_MM, LeftOut, ReachableTargets, StepModel, StepRequest, read_model, read_part,
        setting_for, setting_of, up_of, usual_request,
    )  # fmt: skip
    from ocmm_cad.step._model_files import ModelFiles, model_files
    from ocmm_cad.step._plugin import STEP
    from ocmm_cad.step._profiled import NOT_EXACT, FreeForm
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "FREE_FORM", "NOT_EXACT", "READER_MODULES", "STEP", "STEP_SIZE_MB", "USUAL_BALL_MM", "Choice",
    "ChosenReach", "FacesAccount", "FreeForm", "LeftOut", "ModelFiles", "Offer", "ReachableTargets",
    "StepModel", "StepRequest", "ask_for_chosen", "chosen", "faces_account", "has_step",
    "model_files", "offers_of", "read_model", "read_part", "setting_for", "setting_of", "up_of",
    "usual_request",
]  # fmt: skip
