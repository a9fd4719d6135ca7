"""The manual in the window: reading, search, and context help.

In: documents of `ocmm_core.manual`, and the current page. Out: a sheet.

Read `_manual_sheet` (contents, search, text) and `_reading` (page to section; one document,
painted by Qt).
It must not know the pages that it explains; they are named by their classes.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.manual._manual_sheet import ManualSheet
    from ocmm_gui.manual._reading import PLACES, place_of
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["PLACES", "ManualSheet", "place_of"]
