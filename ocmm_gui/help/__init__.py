"""Help: coach next to the readout, What to do if, and the support bundle.

In: the coach's state, refusals, the sentences of the core, a support site. Out: a picture of the
probe with an arrow, a searchable page, a preview of the support bundle.

Start with `_coach_panel`; then `_what_to_do` with its table, `_support_sheet` (bundle, all keys on
one page, about OCMM, address of the second screen as QR code). Hints and remedies come from
`ocmm_core.coach`, bundle contents from `ocmm_core.support`. It must not import operator, Maintain
or wizards.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.help._coach_panel import CoachPanel
    from ocmm_gui.help._support_sheet import AboutSheet, KeysSheet, SecondScreenSheet, SupportSheet
    from ocmm_gui.help._what_to_do import WhatToDoSheet, answers
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "AboutSheet", "CoachPanel", "KeysSheet", "SecondScreenSheet", "SupportSheet", "WhatToDoSheet",
    "answers",
]  # fmt: skip
