"""Queries of an archive, one call each for window, terminal and scripts.

In: an archive, and parameters. Out: a table, charts, and remarks.

Read `_registry` (all queries), `_judge` (parameters, answers and their files, signers), `_lists`
and `_statistics` (the answers).
It must not know how jobs come, nor how an answer is shown. The views define what counts.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_shop.archive.questions._judge import (
        ArchiveAnswer, Query, csv_of, export_answer, parquet_of, parts, shown_cell,
    )  # fmt: skip
    from ocmm_shop.archive.questions._lists import passed, today, used
    from ocmm_shop.archive.questions._registry import QUESTIONS, Question
    from ocmm_shop.archive.questions._statistics import cpk_by_month, rr, trend
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "QUESTIONS", "ArchiveAnswer", "Query", "Question", "cpk_by_month", "csv_of", "export_answer",
    "parquet_of", "parts", "passed", "rr", "shown_cell", "today", "trend", "used",
]  # fmt: skip
