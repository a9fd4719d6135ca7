"""The manual in the window: reading, search, and context help.

In: documents of `ocmm_core.manual`, and the current page. Out: a sheet.

Read `_manual_sheet` (contents, search, text) and `_reading` (page to section; one document,
painted by Qt).
It must not know the pages that it explains; they are named by their classes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.manual._manual_sheet import ManualSheet
    from ocmm_gui.manual._reading import PLACES, place_of
else:
    __getattr__ = door(__name__, _manual_sheet="ManualSheet", _reading="PLACES place_of")

__all__ = ["PLACES", "ManualSheet", "place_of"]
