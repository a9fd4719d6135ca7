"""Finished jobs: reopened, compared, checked against later findings.

In: job files, and the current histories of calibrations and tips.
Out: jobs recalculated from raw observations, suspect points, comparisons of batches.

Read `_reopen` (also what a worker must know) with `_stored_documents`, `_batch`, `_compare`.
`_later_findings` has those on the calibration and the tip, `_recall_record` the decisions of a
recall. Jobs are read in memory (`storage.read_job`). It must not know a running station.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.inspection.finished import _reopen as reopen
    from ocmm_core.inspection.finished._batch import (
        SUFFIX, BatchPart, LastJob, last_jobs, next_serial, parts_of_batch, previous_part_pose,
        require_new_serial,
    )  # fmt: skip
    from ocmm_core.inspection.finished._compare import (
        Comparison, PartValue, Trend, compare_files, compare_folder, why_not_counted,
    )  # fmt: skip
    from ocmm_core.inspection.finished._later_findings import (
        CameraHistory, ask_tip, is_known, last_good_utc, points_in_doubt, settle_cameras,
        settle_tip,
    )  # fmt: skip
    from ocmm_core.inspection.finished._points_in_doubt import first_stored, first_taken
    from ocmm_core.inspection.finished._recall_record import (
        SCHEMA, Outcome, RecallRecord, RecalledCharacteristic, RecalledJob, RecalledValue,
        points_digest,
    )  # fmt: skip
    from ocmm_core.inspection.finished._reopen import (
        KnownOfJob, ReopenedJob, Tell, known_alone, known_here, reopen_alone, reopen_content,
        reopen_job,
    )  # fmt: skip
    from ocmm_core.inspection.finished._stored_documents import StoredDocuments
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "SCHEMA", "SUFFIX", "BatchPart", "CameraHistory", "Comparison", "KnownOfJob", "LastJob",
    "Outcome", "PartValue", "RecallRecord", "RecalledCharacteristic", "RecalledJob",
    "RecalledValue", "ReopenedJob", "StoredDocuments", "Tell", "Trend", "ask_tip", "compare_files",
    "compare_folder", "first_stored", "first_taken", "is_known", "known_alone", "known_here",
    "last_good_utc", "last_jobs", "next_serial", "parts_of_batch", "points_digest",
    "points_in_doubt", "previous_part_pose", "reopen", "reopen_alone", "reopen_content",
    "reopen_job", "require_new_serial", "settle_cameras", "settle_tip", "why_not_counted",
]  # fmt: skip
