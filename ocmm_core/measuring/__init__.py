"""Tips to measured points, or a refusal with its reason.

In: tracked frames, triggers, temperatures, and the covariance of rig and probe.
Out: a point with probe side and compensation, or a refusal; the joint uncertainty of all points as
factors.

Read `_trigger` (detection of a point, and the touched side), `_stable_point` (from a window of
frames to one ball centre), `_path` and `_path_points` (continuous probing), `_point` (its record),
`_temperature`, then `_contributions` (effect of each error on all points, also of cameras that do
not prove when they expose) with `_factors`, `_pattern_field` and `_rows` (its storage).
`_probe_report` predicts it before measuring. The package is independent of features and plans.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.measuring._contributions import (
        CAMERAS, FRAME, IMAGE_NOISE, TIP_RADIUS, UNKNOWN_SKEW, Contribution, FeatureUncertainty,
        FrameDoubt, ProbeState, contributions, with_skew,
    )  # fmt: skip
    from ocmm_core.measuring._day_check import DayCheck, NoiseRatio, check_noise, touches_checked
    from ocmm_core.measuring._factors import (
        COVERAGE_FACTOR, PointFactors, factors_of, factors_of_matrix, joined_factors, joint_factors,
        point_uncertainties, point_uncertainty, root_of, systematic_covariance,
    )  # fmt: skip
    from ocmm_core.measuring._path import Path, PathCollector
    from ocmm_core.measuring._path_points import (
        PathPoints, PathSurface, Thinning, points_along, spaced, thinned, transported,
    )  # fmt: skip
    from ocmm_core.measuring._point import PATH, MeasuredPoint, PathProgress, Refusal, RefusalCode
    from ocmm_core.measuring._probe_report import (
        BudgetTerm, Examination, Mechanics, ProbeReport, colour_at, examine, label_verdict,
        label_words, map_range, mechanics_words,
    )  # fmt: skip
    from ocmm_core.measuring._rows import DeviationRows, Rows
    from ocmm_core.measuring._stable_point import (
        PointOptions, StablePoint, TouchNoise, average, explain, explain_reference,
    )  # fmt: skip
    from ocmm_core.measuring._temperature import (
        CLIMATE_EVENT, Climate, PartTemperature, check_part, climate_of_text, record_text,
        reported_points,
    )  # fmt: skip
    from ocmm_core.measuring._trigger import (
        METHODS, Side, Touch, TouchCollector, approach_direction, side_of,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CAMERAS", "CLIMATE_EVENT", "COVERAGE_FACTOR", "FRAME", "IMAGE_NOISE", "METHODS", "PATH",
    "TIP_RADIUS", "UNKNOWN_SKEW", "BudgetTerm", "Climate", "Contribution", "DayCheck",
    "DeviationRows", "Examination", "FeatureUncertainty", "FrameDoubt", "MeasuredPoint",
    "Mechanics", "NoiseRatio", "PartTemperature", "Path", "PathCollector", "PathPoints",
    "PathProgress", "PathSurface", "PointFactors", "PointOptions", "ProbeReport", "ProbeState",
    "Refusal", "RefusalCode", "Rows", "Side", "StablePoint", "Thinning", "Touch", "TouchCollector",
    "TouchNoise", "approach_direction", "average", "check_noise", "check_part", "climate_of_text",
    "colour_at", "contributions", "examine", "explain", "explain_reference", "factors_of",
    "factors_of_matrix", "joined_factors", "joint_factors", "label_verdict", "label_words",
    "map_range", "mechanics_words", "point_uncertainties", "point_uncertainty", "points_along",
    "record_text", "reported_points", "root_of", "side_of", "spaced", "systematic_covariance",
    "thinned", "touches_checked", "transported", "with_skew",
]  # fmt: skip
