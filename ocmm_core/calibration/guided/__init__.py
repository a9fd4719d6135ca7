"""Common part of guided procedures: steps, sessions, collecting, seats, outcome.

In: frames during operation, commands (next, record, repeat), lines of a session file.
Out: snapshots of the procedure for any screen, averaged observations, a record to accept.

Read `_procedure` (steps, gates, durable events; of acceptance tests as well) and `_procedure_views`
(snapshots), `_session` and `_session_events` (state from a file), `_collecting` (from frames to
observations), `_shot_table` (also LEDs before cameras are calibrated), `_repeats`, `_articulation`,
`_session_drift` and `_session_events` (detection of motion, shocks), then `_conclusion` (the
record). It is independent of specific procedures and of Qt: a script runs a procedure as a window
does.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.calibration.guided._articulation import (
        ARTICULATION_CHANCE, Articulation, BallPlace, RestingTouch, articulate, handle_axis,
        joint_covariance, noise_covariance, place_of_ball, range_limit, shared_covariance, tips_of,
        touch_of,
    )  # fmt: skip
    from ocmm_core.calibration.guided._collecting import (
        AVERAGING, PLACE_DONE, STILL_FRAMES, STRANGE, Average, ProbeSpotAverager,
        StaticSpotAverager, sigma_of_mean, waved_frames,
    )  # fmt: skip
    from ocmm_core.calibration.guided._conclusion import (
        CalibrationContext, Findings, build_outcome, hash_of, hull_of, length_sigma, location_gains,
        random_lines, residuals_of,
    )  # fmt: skip
    from ocmm_core.calibration.guided._procedure import (
        LAST_OF_CALIBRATION, OPEN, CameraLive, Gate, Live, Procedure, ProcedureDecision,
        ProcedureKind, ProcedureView, SessionLog, Step, require_fresh_temperature,
    )  # fmt: skip
    from ocmm_core.calibration.guided._procedure_views import (
        CalibrationComparison, CalibrationOutcome, CameraChange, CameraResiduals, KnownPoint,
        KnownPointsView, LinePlan, RelocationView, Tilt, TrackerView, VerificationOutcome,
        VerificationView, VolumeCoverage, coverage, viewer_axes,
    )  # fmt: skip
    from ocmm_core.calibration.guided._repeats import (
        SEATS, SEAT_MM, JudgedRepeat, Repeat, RestingPosition, SeatVisited, again_gate,
        again_instruction, first_gate, first_instruction, judge_first_visit, judge_repeats,
        judge_visit_again, repeat_finding,
    )  # fmt: skip
    from ocmm_core.calibration.guided._session import (
        CameraProcedure, GuidedProcedure, ProbeProcedure,
    )  # fmt: skip
    from ocmm_core.calibration.guided._session_drift import (
        Rest, SessionChange, TimeCourse, change_findings, rest_of, session_changes,
    )  # fmt: skip
    from ocmm_core.calibration.guided._session_events import (
        CommonEvent, Decided, Entered, SessionEvent, SessionFormat, SessionHeader, SessionLine,
        SessionSetup, SessionSite, ShockDetector, Spots, TipSetup, from_spots, is_ended,
        record_shock, require_no_doubt_since, require_probe, sessions, to_spots, utc_text,
    )  # fmt: skip
    from ocmm_core.calibration.guided._shot_table import Shot, ShotKind, load_shots
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ARTICULATION_CHANCE", "AVERAGING", "LAST_OF_CALIBRATION", "OPEN", "PLACE_DONE", "SEATS",
    "SEAT_MM", "STILL_FRAMES", "STRANGE", "Articulation", "Average", "BallPlace",
    "CalibrationComparison", "CalibrationContext", "CalibrationOutcome", "CameraChange",
    "CameraLive", "CameraProcedure", "CameraResiduals", "CommonEvent", "Decided", "Entered",
    "Findings", "Gate", "GuidedProcedure", "JudgedRepeat", "KnownPoint", "KnownPointsView",
    "LinePlan", "Live", "ProbeProcedure", "ProbeSpotAverager", "Procedure", "ProcedureDecision",
    "ProcedureKind", "ProcedureView", "RelocationView", "Repeat", "Rest", "RestingPosition",
    "RestingTouch", "SeatVisited", "SessionChange", "SessionEvent", "SessionFormat",
    "SessionHeader", "SessionLine", "SessionLog", "SessionSetup", "SessionSite", "ShockDetector",
    "Shot", "ShotKind", "Spots", "StaticSpotAverager", "Step", "Tilt", "TimeCourse", "TipSetup",
    "TrackerView", "VerificationOutcome", "VerificationView", "VolumeCoverage", "again_gate",
    "again_instruction", "articulate", "build_outcome", "change_findings", "coverage", "first_gate",
    "first_instruction", "from_spots", "handle_axis", "hash_of", "hull_of", "is_ended",
    "joint_covariance", "judge_first_visit", "judge_repeats", "judge_visit_again", "length_sigma",
    "load_shots", "location_gains", "noise_covariance", "place_of_ball", "random_lines",
    "range_limit", "record_shock", "repeat_finding", "require_fresh_temperature",
    "require_no_doubt_since", "require_probe", "residuals_of", "rest_of", "session_changes",
    "sessions", "shared_covariance", "sigma_of_mean", "tips_of", "to_spots", "touch_of", "utc_text",
    "viewer_axes", "waved_frames",
]  # fmt: skip
