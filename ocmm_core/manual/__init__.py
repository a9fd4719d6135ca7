"""The manual: the documents of `docs`, in sections that can be linked and searched.

In: a folder of Markdown documents, and a language. Out: chapters in reading order, sections by
their anchors, and search hits, best first.

Read `_document` first (documents, sections and anchors), then `_manual` (all documents, links,
and the ranking of a search). The window shows it.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.manual._document import (
        ENGLISH, Chapter, ManualPart, ManualSection, anchors_of, mark_of,
    )  # fmt: skip
    from ocmm_core.manual._manual import (
        Manual, ManualHit, Place, changes_since, load_manual, manual_folder, search_words,
        shipped_text, word_fits,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ENGLISH", "Chapter", "Manual", "ManualHit", "ManualPart", "ManualSection", "Place",
    "anchors_of", "changes_since", "load_manual", "manual_folder", "mark_of", "search_words",
    "shipped_text", "word_fits",
]  # fmt: skip
