"""Support bundle: diagnostic data without secrets.

In: settings, logs, records, the doctor, the last raw frames. Out: facts about this program; a draft
that shows exactly what would be packed, and a ZIP file of it; nothing is sent.

Read `_parts` (table of the contents) and `_bundle` (collect, remove secrets always and names on
request, show, write; also build, licences, folders).
It must not know a station or a screen: callers pass in what exists only at run time.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.support._bundle import (
        DOCUMENTS, MASKED, AboutDocument, AboutLine, BundleDraft, BundleItem, Cleaner, about_lines,
        draft_bundle, write_bundle,
    )  # fmt: skip
    from ocmm_core.support._parts import PARTS, PartSpec, SupportSite, site_of_this_user
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "DOCUMENTS", "MASKED", "PARTS", "AboutDocument", "AboutLine", "BundleDraft", "BundleItem",
    "Cleaner", "PartSpec", "SupportSite", "about_lines", "draft_bundle", "site_of_this_user",
    "write_bundle",
]  # fmt: skip
