"""Results as files for other programs.

In: an evaluated job. Out: files of a report, verified by reading back.

Read `_registry` first: all formats, and the one function that writes them: it refuses reports of
unfinished jobs, writes files atomically and signs them. `template` has the letterhead, `report` the
data of a report and its text, JSON, workbook and PolyWorks files; `qif` QIF 3.0, `aqdef` Q-DAS;
`_batch_table` has the statistics of a batch. `certificate` makes certificates of the machine.
`audits` verifies every kind of file that this program writes. It must not know a station or a
screen. `ocmm_gui.reports` draws the PDF.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.export import _registry as registry
    from ocmm_core.export._batch_table import BATCH_COLUMNS, batch_table
    from ocmm_core.export._registry import (
        ALL, DEFAULT_FORMAT, ENDING, EXPORTERS, FORMATS, PDF, ReportSealFound, check_report_seal,
        chosen_formats, missing_of, missing_words, preview, preview_text, require_complete,
        write_report, write_together,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ALL", "BATCH_COLUMNS", "DEFAULT_FORMAT", "ENDING", "EXPORTERS", "FORMATS", "PDF",
    "ReportSealFound", "batch_table", "check_report_seal", "chosen_formats", "missing_of",
    "missing_words", "preview", "preview_text", "registry", "require_complete", "write_report",
    "write_together",
]  # fmt: skip
