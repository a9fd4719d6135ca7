"""Recall: jobs recalculated after their calibration was found wrong, and which verdicts hold.

In: jobs, the current histories of calibrations and tips. Out: the outcome of every suspect job, and
who decided.

Read `_recall` (the whole, and suspect jobs), `_recall_job` (one job under two calibrations),
`_recall_judge` (which of both counts; artefacts) and `_recall_messages`. Package
`archive` stores decisions and reads them whenever a job is opened. It must not know an archive of a
shop or a running station.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.inspection.recall._recall import (
        Doubting, KeptPlaces, decide, recall, recall_doubted,
    )  # fmt: skip
    from ocmm_core.inspection.recall._recall_job import DoubtedJob
    from ocmm_core.inspection.recall._recall_judge import artefact_wrong
    from ocmm_core.inspection.recall._recall_messages import (
        COLUMNS, checked, decided, headline, job_line, not_judged, rests_on, row, totals,
        worst_first,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "COLUMNS", "DoubtedJob", "Doubting", "KeptPlaces", "artefact_wrong", "checked", "decide",
    "decided", "headline", "job_line", "not_judged", "recall", "recall_doubted", "rests_on", "row",
    "totals", "worst_first",
]  # fmt: skip
