"""From the points of a job to features, results, guidance and what is seen of them.

In: the plan, the points that count, options and temperatures of the session.
Out: frozen views: features, frame, results with U, progress, where the next point is wanted.

Read `_evaluation` (points to results) with `_options` and `_limits`, `_evaluated` (a job with all
that its results rest on), `_uncertainty` (budgets), `_view` (what screens and scripts read), then
`_progress`, `_guidance`, `_surfaces`, `_coverage`, `_alignment_preview`. What stops a result:
`_outliers`, `_quarantine`, `_withdrawn`.
It changes no job and must not know how touches come: that is `session`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.inspection.evaluation._alignment_preview import alignment_of_points
    from ocmm_core.inspection.evaluation._coverage import coverage_of
    from ocmm_core.inspection.evaluation._evaluated import EvaluatedJob, evaluated_job
    from ocmm_core.inspection.evaluation._evaluation import (
        JobResults,
        JobStatus,
        checked_features,
        evaluate_job,
        frame_of,
    )
    from ocmm_core.inspection.evaluation._guidance import (
        FAR_MM,
        Whereabouts,
        aligned_nominals,
        cue,
        targets_of,
        whereabouts,
    )
    from ocmm_core.inspection.evaluation._job_messages import (
        INCOMPLETE,
        NO_REAL_PART,
        SIMULATED,
        job_states,
        part_line,
        state_lines,
    )
    from ocmm_core.inspection.evaluation._limits import (
        FOR_COMPARISON,
        LIMITS_EVENT,
        limits_text,
        methods_used,
        with_stored_limits,
    )
    from ocmm_core.inspection.evaluation._options import SessionOptions
    from ocmm_core.inspection.evaluation._outliers import outliers
    from ocmm_core.inspection.evaluation._progress import (
        PAUSED,
        RESUMED,
        STANDING_EVENT,
        Progress,
        WrittenProgress,
        open_plan,
        progress_from,
        progress_of,
    )
    from ocmm_core.inspection.evaluation._quarantine import (
        HoldReason,
        event_text,
        feature_note,
        held_back,
        held_below,
        notes_of,
    )
    from ocmm_core.inspection.evaluation._surfaces import nearness, places_of
    from ocmm_core.inspection.evaluation._uncertainty import (
        JobUncertainty,
        frame_covariance,
        job_uncertainty,
        probe_state,
        uncertainty_of,
    )
    from ocmm_core.inspection.evaluation._view import (
        DeletedPoint,
        FeatureState,
        FeatureView,
        JobHeader,
        JobView,
        LiveView,
        Probing,
        ReferenceView,
        StatusWord,
        Target,
    )
    from ocmm_core.inspection.evaluation._withdrawn import withdrawn
else:
    __getattr__ = door(
        __name__,
        _alignment_preview="alignment_of_points",
        _coverage="coverage_of",
        _evaluated="EvaluatedJob evaluated_job",
        _evaluation="JobResults JobStatus checked_features evaluate_job frame_of",
        _guidance="FAR_MM Whereabouts aligned_nominals cue targets_of whereabouts",
        _job_messages="INCOMPLETE NO_REAL_PART SIMULATED job_states part_line state_lines",
        _limits="FOR_COMPARISON LIMITS_EVENT limits_text methods_used with_stored_limits",
        _options="SessionOptions",
        _outliers="outliers",
        _progress=(
            "PAUSED Progress RESUMED STANDING_EVENT WrittenProgress open_plan progress_from "
            "progress_of"
        ),
        _quarantine="HoldReason event_text feature_note held_back held_below notes_of",
        _surfaces="nearness places_of",
        _uncertainty="JobUncertainty frame_covariance job_uncertainty probe_state uncertainty_of",
        _view=(
            "DeletedPoint FeatureState FeatureView JobHeader JobView LiveView Probing "
            "ReferenceView StatusWord Target"
        ),
        _withdrawn="withdrawn",
    )

__all__ = [
    "FAR_MM",
    "FOR_COMPARISON",
    "INCOMPLETE",
    "LIMITS_EVENT",
    "NO_REAL_PART",
    "PAUSED",
    "RESUMED",
    "SIMULATED",
    "STANDING_EVENT",
    "DeletedPoint",
    "EvaluatedJob",
    "FeatureState",
    "FeatureView",
    "HoldReason",
    "JobHeader",
    "JobResults",
    "JobStatus",
    "JobUncertainty",
    "JobView",
    "LiveView",
    "Probing",
    "Progress",
    "ReferenceView",
    "SessionOptions",
    "StatusWord",
    "Target",
    "Whereabouts",
    "WrittenProgress",
    "aligned_nominals",
    "alignment_of_points",
    "checked_features",
    "coverage_of",
    "cue",
    "evaluate_job",
    "evaluated_job",
    "event_text",
    "feature_note",
    "frame_covariance",
    "frame_of",
    "held_back",
    "held_below",
    "job_states",
    "job_uncertainty",
    "limits_text",
    "methods_used",
    "nearness",
    "notes_of",
    "open_plan",
    "outliers",
    "part_line",
    "places_of",
    "probe_state",
    "progress_from",
    "progress_of",
    "state_lines",
    "targets_of",
    "uncertainty_of",
    "whereabouts",
    "with_stored_limits",
    "withdrawn",
]
