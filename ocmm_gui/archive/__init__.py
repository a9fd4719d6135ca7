"""The archive in the window: a query, its table and chart, and waiting jobs.

In: an archive and an outbox by the settings. Out: answers as a table and a chart, exported files.

Read `_archive_sheet` (the page), `_asking` (the side process); then `_recall_panel` (a recall of
all archived jobs), `_recall_result` (its findings), `_labelled` and `_sheet_texts` (fields and
words). Queries are those of `ocmm_shop.archive`, recalls those of `ocmm_shop.recalls`. It must not
know results, operator or Maintain.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.archive._archive_sheet import ArchiveSheet
    from ocmm_gui.archive._asking import Asking
    from ocmm_gui.archive._recall_result import RecallResult, WritingRecall
else:
    __getattr__ = door(
        __name__,
        _archive_sheet="ArchiveSheet",
        _asking="Asking",
        _recall_result="RecallResult WritingRecall",
    )

__all__ = ["ArchiveSheet", "Asking", "RecallResult", "WritingRecall"]
