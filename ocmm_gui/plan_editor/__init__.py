"""Plan editor: features, characteristics, alignment, pictures.

In: a plan, keys, tables, STEP files, a job to teach from. Out: a plan that is checked and saved.

Read `_plan_sheet` (the editor), `_plan_checks` (the edited plan: changes, undo, errors),
`_plan_items` (the list, and parts of the editor). `_item_form` is the form of one item, a line per
field, made from the types of the core: `_form_lines` (also texts and their meaning),
`_field_labels`. `_from_models` imports from models and tables:
`_importing` reads, `_part_choice` selects.
Rules of plans are in `inspection.plan`. It must not know the other sheets.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.plan_editor._field_labels import words_of
    from ocmm_gui.plan_editor._plan_sheet import PlanSheet
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["PlanSheet", "words_of"]
