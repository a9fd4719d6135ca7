"""Jobs after they were measured: reopened, compared, doubted, and recalled.

In: job files, and the histories of calibrations and tips as they are today.
Out: jobs computed anew from raw observations, points in doubt, batches side by side, a recall.

Read `_reopen` with `_reopen_copy` and `_stored_documents`, `_batch`, `_last_jobs`, `_compare`.
What became of the calibration: `_camera_history` and `_camera_doubts`, `_tip_history` and
`_tip_doubts`; `_known` sends it to a worker.
Then `_recall`: `_recall_job` (one job under two calibrations), `_recall_fit`, `_recall_judge`,
`_recall_artefact`, `_recall_record`. Jobs are looked at through a copy of their file.
It must not know a running station.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.archive import _reopen as reopen
    from ocmm_core.inspection.archive._batch import (
        SUFFIX,
        BatchPart,
        next_serial,
        parts_of_batch,
        require_new_serial,
    )
    from ocmm_core.inspection.archive._camera_history import is_known, settle_cameras
    from ocmm_core.inspection.archive._compare import (
        Comparison,
        PartValue,
        Trend,
        compare_files,
        compare_folder,
        compare_jobs,
        why_not_counted,
    )
    from ocmm_core.inspection.archive._last_jobs import LastJob, last_jobs, previous_part_pose
    from ocmm_core.inspection.archive._points_in_doubt import first_taken
    from ocmm_core.inspection.archive._recall import (
        Doubting,
        KeptPlaces,
        decide,
        recall,
        recall_doubted,
    )
    from ocmm_core.inspection.archive._recall_artefact import artefact_wrong
    from ocmm_core.inspection.archive._recall_job import DoubtedJob
    from ocmm_core.inspection.archive._recall_messages import (
        COLUMNS,
        checked,
        decided,
        headline,
        job_line,
        not_judged,
        rests_on,
        row,
        totals,
        worst_first,
    )
    from ocmm_core.inspection.archive._recall_record import (
        SCHEMA,
        Outcome,
        RecalledCharacteristic,
        RecalledJob,
        RecalledValue,
        RecallRecord,
    )
    from ocmm_core.inspection.archive._reopen import ReopenedJob, Tell, reopen_alone, reopen_job
    from ocmm_core.inspection.archive._reopen_copy import (
        content_of_job,
        content_to_look_at,
        copy_of_content,
        copy_of_job,
    )
    from ocmm_core.inspection.archive._stored_documents import StoredDocuments
    from ocmm_core.inspection.archive._tip_doubts import last_good_utc
    from ocmm_core.inspection.archive._tip_history import settle_tip
else:
    __getattr__ = door(
        __name__,
        _batch="BatchPart SUFFIX next_serial parts_of_batch require_new_serial",
        _camera_history="is_known settle_cameras",
        _compare=(
            "Comparison PartValue Trend compare_files compare_folder compare_jobs why_not_counted"
        ),
        _last_jobs="LastJob last_jobs previous_part_pose",
        _points_in_doubt="first_taken",
        _recall="Doubting KeptPlaces decide recall recall_doubted",
        _recall_artefact="artefact_wrong",
        _recall_job="DoubtedJob",
        _recall_messages=(
            "COLUMNS checked decided headline job_line not_judged rests_on row totals worst_first"
        ),
        _recall_record=(
            "Outcome RecallRecord RecalledCharacteristic RecalledJob RecalledValue SCHEMA"
        ),
        _reopen="ReopenedJob Tell reopen reopen_alone reopen_job",
        _reopen_copy="content_of_job content_to_look_at copy_of_content copy_of_job",
        _stored_documents="StoredDocuments",
        _tip_doubts="last_good_utc",
        _tip_history="settle_tip",
    )

__all__ = [
    "COLUMNS",
    "SCHEMA",
    "SUFFIX",
    "BatchPart",
    "Comparison",
    "DoubtedJob",
    "Doubting",
    "KeptPlaces",
    "LastJob",
    "Outcome",
    "PartValue",
    "RecallRecord",
    "RecalledCharacteristic",
    "RecalledJob",
    "RecalledValue",
    "ReopenedJob",
    "StoredDocuments",
    "Tell",
    "Trend",
    "artefact_wrong",
    "checked",
    "compare_files",
    "compare_folder",
    "compare_jobs",
    "content_of_job",
    "content_to_look_at",
    "copy_of_content",
    "copy_of_job",
    "decide",
    "decided",
    "first_taken",
    "headline",
    "is_known",
    "job_line",
    "last_good_utc",
    "last_jobs",
    "next_serial",
    "not_judged",
    "parts_of_batch",
    "previous_part_pose",
    "recall",
    "recall_doubted",
    "reopen",
    "reopen_alone",
    "reopen_job",
    "require_new_serial",
    "rests_on",
    "row",
    "settle_cameras",
    "settle_tip",
    "totals",
    "why_not_counted",
    "worst_first",
]
