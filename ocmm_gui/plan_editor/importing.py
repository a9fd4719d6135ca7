"""What other files bring into a plan: features of a table or a model, the frame of a document."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ocmm_core.alignment.frame_document import load_frame, relocation, saved_frame
from ocmm_core.alignment.rules import Relocation
from ocmm_core.inspection.plan import Plan
from ocmm_core.inspection.plan_csv import features_from_csv
from ocmm_core.inspection.plan_edit import add_feature, with_alignment
from ocmm_core.inspection.plan_step import features_from_step
from ocmm_gui.plan_editor.plan_items import ALIGNMENT, ItemKey

_MODELS = (".step", ".stp")
_FRAME = ".toml"
_LIMIT_MM = 0.1


@dataclass(frozen=True, slots=True)
class Imported:
    """The plan with what was imported, which item of it is new, and a sentence about it."""

    plan: Plan
    chosen: ItemKey
    words: str


def with_file(plan: Plan, path: Path, *, relocate: bool) -> Imported:
    """Return the plan with what is in a file.

    Parameters
    ----------
    relocate
        A frame is to be found again at its control points, and not taken as it was saved.

    Raises
    ------
    InputError
        The file cannot be used, or the plan could not be measured with it.
    """
    if path.suffix.lower() == _FRAME:
        return _with_frame(plan, path, relocate=relocate)
    read = features_from_step if path.suffix.lower() in _MODELS else features_from_csv
    found = read(path)
    for feature in found:
        plan = add_feature(plan, feature)
    return Imported(
        plan,
        ItemKey("features", found[0].name),
        f"{len(found)} features were added from {path.name}.",
    )


def _with_frame(plan: Plan, path: Path, *, relocate: bool) -> Imported:
    document = load_frame(path)
    before = plan.alignment
    limit = before.limit if isinstance(before, Relocation) else _LIMIT_MM
    rule = relocation(document, limit) if relocate else saved_frame(document)
    how = "is found again at its control points" if relocate else "is taken as it was saved"
    return Imported(
        with_alignment(plan, rule), ALIGNMENT, f"The frame {document.name} {how}."
    )
