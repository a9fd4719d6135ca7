"""Features from points: fits, ball compensation, constructions, certified checks.

In: ball centres with their joint covariance, the nominal, the probe side, other features.
Out: measured features: geometry, Jacobian by every point of the job, outliers.

Read `_fit` (a fit by the name of its shape, outliers), `_actual` (a feature from ball centres),
`_each` (many, cached), `_influence` and `_second_order` (does first order hold). Constructions:
`_construct`, `_construct_geometry`, `_constructed`. `_verify` runs certified
reference pairs.

It must not know alignment or tolerances.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.features.measured._actual import (
        SAME_RADIUS, ActualFeature, Touches, actual_features, features_of_touches,
    )  # fmt: skip
    from ocmm_core.features.measured._construct import (
        AXIAL, CENTRED, LONG, Bisector, Construction, FitThrough, Intersection, Midpoint, Offset,
        PartOf, TappedHole, construction_fault, in_order, needed_features, probed_features,
        shapes_with,
    )  # fmt: skip
    from ocmm_core.features.measured._construct_geometry import gauge_point
    from ocmm_core.features.measured._constructed import constructed_features, nominal_geometries
    from ocmm_core.features.measured._each import (
        Each, Instead, Orientation, can_be_oriented, geometries_of, measured_of, oriented_feature,
    )  # fmt: skip
    from ocmm_core.features.measured._fit import ZoneProof, certificate, fit, fit_shape, outliers
    from ocmm_core.features.measured._influence import (
        CommandingPoints, commanding_points, commanding_rows, commanding_touches,
    )  # fmt: skip
    from ocmm_core.features.measured._second_order import beyond_first_order, solver_start
    from ocmm_core.features.measured._verify import (
        APEX_LIMIT, DIRECTION_LIMIT, POSITION_LIMIT, SIZE_LIMIT, Convention, PairResult, SetReport,
        verify_folder,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "APEX_LIMIT", "AXIAL", "CENTRED", "DIRECTION_LIMIT", "LONG", "POSITION_LIMIT", "SAME_RADIUS",
    "SIZE_LIMIT", "ActualFeature", "Bisector", "CommandingPoints", "Construction", "Convention",
    "Each", "FitThrough", "Instead", "Intersection", "Midpoint", "Offset", "Orientation",
    "PairResult", "PartOf", "SetReport", "TappedHole", "Touches", "ZoneProof", "actual_features",
    "beyond_first_order", "can_be_oriented", "certificate", "commanding_points", "commanding_rows",
    "commanding_touches", "constructed_features", "construction_fault", "features_of_touches",
    "fit", "fit_shape", "gauge_point", "geometries_of", "in_order", "measured_of",
    "needed_features", "nominal_geometries", "oriented_feature", "outliers", "probed_features",
    "shapes_with", "solver_start", "verify_folder",
]  # fmt: skip
