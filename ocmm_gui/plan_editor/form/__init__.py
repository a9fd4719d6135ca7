"""Form of one item of a plan: a line per field, derived from the types of the core.

In: an item as in its document. Out: the same, as filled in, or the error; `choice_word`, the
displayed word of a choice; `words_of`, label and explanation of a field.

Read `_item_form`, `_form_lines` (the lines, made from the types), `_field_text` (text of a field
and its meaning) and `_field_labels` (labels). It must not know the editor.
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
