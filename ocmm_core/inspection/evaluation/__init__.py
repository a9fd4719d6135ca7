"""Evaluation: from the points of a job to features, results, guidance and views.

In: the plan, the points that count, options and temperatures of the session.
Out: frozen views: features, frame, results with U, progress, next target.

Read `_evaluation` (points to results) with `_options`, `_job_graph`, recomputed
when their inputs change (`_cache`), `_uncertainty` (budgets, and a job with all intermediate
quantities), `_view` (read by screens and scripts), then `_progress`, `_guidance`, `_coverage`.
Blocked results: `_quarantine`.
It changes no job and must not know how touches come: that is `session`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.inspection.evaluation._cache import EvaluationCache
    from ocmm_core.inspection.evaluation._coverage import coverage_of
    from ocmm_core.inspection.evaluation._evaluation import (
        JobResults, JobStatus, alignment_of_points, checked_features, evaluate_job, frame_of,
        measured_frame,
    )  # fmt: skip
    from ocmm_core.inspection.evaluation._guidance import (
        FAR_MM, Whereabouts, cue, nearness, place_of_nominals, places_of, targets_of, whereabouts,
    )  # fmt: skip
    from ocmm_core.inspection.evaluation._job_messages import (
        INCOMPLETE, NOISY_LINE, NO_REAL_PART, PARTIAL_PLAN, SIMULATED, SIMULATED_LINE, job_states,
        limit_words, part_line, state_lines,
    )  # fmt: skip
    from ocmm_core.inspection.evaluation._options import (
        FOR_COMPARISON, LIMITS_EVENT, SessionOptions, limits_text, methods_used, with_stored_limits,
    )  # fmt: skip
    from ocmm_core.inspection.evaluation._progress import (
        PAUSED, RESUMED, STANDING_EVENT, Progress, WrittenProgress, open_plan, progress_from,
        progress_of,
    )  # fmt: skip
    from ocmm_core.inspection.evaluation._quarantine import (
        REMOVE, HoldReason, commanding, event_text, held_back, held_below, notes_of, notes_on,
        outliers, withdrawn,
    )  # fmt: skip
    from ocmm_core.inspection.evaluation._uncertainty import (
        EvaluatedJob, JobUncertainty, evaluated_job, frame_covariance, job_uncertainty, probe_state,
        surface_covariances, uncertainty_of,
    )  # fmt: skip
    from ocmm_core.inspection.evaluation._view import (
        Coverage, DeletedPoint, FeatureState, FeatureView, JobHeader, JobView, LiveView,
        PlannedFeature, Probing, ReferenceView, StatusWord, Target,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "FAR_MM", "FOR_COMPARISON", "INCOMPLETE", "LIMITS_EVENT", "NOISY_LINE", "NO_REAL_PART",
    "PARTIAL_PLAN", "PAUSED", "REMOVE", "RESUMED", "SIMULATED", "SIMULATED_LINE", "STANDING_EVENT",
    "Coverage", "DeletedPoint", "EvaluatedJob", "EvaluationCache", "FeatureState", "FeatureView",
    "HoldReason", "JobHeader", "JobResults", "JobStatus", "JobUncertainty", "JobView", "LiveView",
    "PlannedFeature", "Probing", "Progress", "ReferenceView", "SessionOptions", "StatusWord",
    "Target", "Whereabouts", "WrittenProgress", "alignment_of_points", "checked_features",
    "commanding", "coverage_of", "cue", "evaluate_job", "evaluated_job", "event_text",
    "frame_covariance", "frame_of", "held_back", "held_below", "job_states", "job_uncertainty",
    "limit_words", "limits_text", "measured_frame", "methods_used", "nearness", "notes_of",
    "notes_on", "open_plan", "outliers", "part_line", "place_of_nominals", "places_of",
    "probe_state", "progress_from", "progress_of", "state_lines", "surface_covariances",
    "targets_of", "uncertainty_of", "whereabouts", "with_stored_limits", "withdrawn",
]  # fmt: skip
