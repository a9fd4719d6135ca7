"""The archive in the window: a query, its table and chart, and waiting jobs.

In: an archive and an outbox by the settings. Out: answers as a table and a chart, exported files.

Read `_archive_sheet` (the page), `_archive_words` (the side process, fields and words); then
`_recall_panel` (a recall of all archived jobs, and its findings). Queries are those of
`ocmm_shop.archive`, recalls those of `ocmm_shop.recalls`. It must not know results, operator or
Maintain.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.archive._archive_sheet import ArchiveSheet
    from ocmm_gui.archive._recall_panel import RecallResult, write_recall
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["ArchiveSheet", "RecallResult", "write_recall"]
