"""The form of one item of a plan: a line for each field that the types of the core have.

In: an item as its document has it. Out: the same, as it was filled in, or what is wrong with
it; `choice_word`, what a choice is called on the screen; `words_of`, label and explanation of a
field.

Read `_item_form`, `_form_lines` (the lines, made from the types), `_field_text` (what stands in a
field, and what it means) and `_field_labels` (what is beside it). It must not know the editor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.plan_editor.form._field_labels import choice_word, words_of
    from ocmm_gui.plan_editor.form._item_form import ItemForm
else:
    __getattr__ = door(__name__, _field_labels="choice_word words_of", _item_form="ItemForm")

__all__ = ["ItemForm", "choice_word", "words_of"]
