"""Help in trouble: the coach beside the readout, What to do if, and the support bundle.

In: what the coach says, refusals, the sentences of the core, a support site. Out: a picture of the
probe with an arrow, a page that is searched, a page that shows what is packed.

Read `_coach_panel` with `_probe_painter`; `_what_to_do` with its table `_symptoms`;
`_support_sheet`. The window decides nothing: hints and remedies are those of `ocmm_core.coach`,
what is packed that of `ocmm_core.support`. It must not know operator, Maintain or wizards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.help._coach_panel import CoachPanel, hint_words
    from ocmm_gui.help._support_sheet import SupportSheet
    from ocmm_gui.help._what_to_do import WhatToDoSheet, answers
else:
    __getattr__ = door(
        __name__,
        _coach_panel="CoachPanel hint_words",
        _support_sheet="SupportSheet",
        _what_to_do="WhatToDoSheet answers",
    )

__all__ = ["CoachPanel", "SupportSheet", "WhatToDoSheet", "answers", "hint_words"]
