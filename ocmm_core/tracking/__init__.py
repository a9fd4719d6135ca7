"""Tracking: from spots to labelled targets, pose and tip.

In: blocks of frames, the rig, the documents of probe and reference body.
Out: for every frame labels, pose, tip in mm with covariance and chi-square, or a status why not.

Read `_body` (LEDs and ball of a probe), `_identify` (assignment of slots to LEDs), `_body_tracker`
(one body through blocks of frames), `_pipeline` (probe and reference body), `_result` (result of
each frame), `_pose` (poses and their derivatives). Then `_sensitivity`, `_stillness` with
`_spot_spectrum`, `_ambiguity`, `_strobe`, `_skew`, and the reference body: `_reference_body`,
`_reference`. `kernels` is the compiled hot path. The package is independent of calibration records,
touches and points.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.tracking._ambiguity import AMBIGUITY_LIMIT_MM, Ambiguity
    from ocmm_core.tracking._body import (
        SCHEMA, LedBody, LedEntry, OrientationRule, ProbeBody, ProbeDocument, body_of, check_labels,
        load_probe, nearest_ambiguity, read_probe, satisfies_rules,
    )  # fmt: skip
    from ocmm_core.tracking._body_tracker import TrackingOptions, spot_sigma_px
    from ocmm_core.tracking._identify import IdentifyOptions, identify, identify_many, ordered_spots
    from ocmm_core.tracking._pipeline import TrackingPipeline
    from ocmm_core.tracking._pose import (
        Method, PoseBatch, reprojection, require_spots, solve, solve_leds, triangulate,
    )  # fmt: skip
    from ocmm_core.tracking._reference import (
        home_of, motion_to_world, relative_sensitivities, relative_sensitivity, simultaneous,
    )  # fmt: skip
    from ocmm_core.tracking._reference_body import ReferenceBody, check_together, load_reference
    from ocmm_core.tracking._result import (
        ARRAYS, FrameStatus, ReferenceHome, ReferenceTrack, TrackBlock, cut, in_rig, interruptions,
        join, pick,
    )  # fmt: skip
    from ocmm_core.tracking._sensitivity import (
        TipDerivatives, TipSensitivity, tip_derivatives, tip_sensitivities, tip_sensitivity,
    )  # fmt: skip
    from ocmm_core.tracking._skew import CameraSkew, SkewMeter
    from ocmm_core.tracking._spot_spectrum import SpotSpectrum, spot_course
    from ocmm_core.tracking._stillness import (
        BallMotion, HandDrift, Stillness, batch_labels, judge_stillness, wildness,
    )  # fmt: skip
    from ocmm_core.tracking._strobe import StrobeEntry, dark_bits
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "AMBIGUITY_LIMIT_MM", "ARRAYS", "SCHEMA", "Ambiguity", "BallMotion", "CameraSkew",
    "FrameStatus", "HandDrift", "IdentifyOptions", "LedBody", "LedEntry", "Method",
    "OrientationRule", "PoseBatch", "ProbeBody", "ProbeDocument", "ReferenceBody", "ReferenceHome",
    "ReferenceTrack", "SkewMeter", "SpotSpectrum", "Stillness", "StrobeEntry", "TipDerivatives",
    "TipSensitivity", "TrackBlock", "TrackingOptions", "TrackingPipeline", "batch_labels",
    "body_of", "check_labels", "check_together", "cut", "dark_bits", "home_of", "identify",
    "identify_many", "in_rig", "interruptions", "join", "judge_stillness", "load_probe",
    "load_reference", "motion_to_world", "nearest_ambiguity", "ordered_spots", "pick", "read_probe",
    "relative_sensitivities", "relative_sensitivity", "reprojection", "require_spots",
    "satisfies_rules", "simultaneous", "solve", "solve_leds", "spot_course", "spot_sigma_px",
    "tip_derivatives", "tip_sensitivities", "tip_sensitivity", "triangulate", "wildness",
]  # fmt: skip
