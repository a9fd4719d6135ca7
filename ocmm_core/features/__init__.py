"""Shapes, their fits, and features as nominal and as measured.

`__all__` is the public API (docs/integrator/python.md); the subpackages are internal. In: points
(mm), or ball centres with their joint covariance. Out: elements with their Jacobian.

Read `shapes` (terms and nominals), `search` (common part of the fits), `elements` (least squares,
one file a shape), `zones` (minimum zones and bounding elements), `measured` (features from points,
compensated for the ball, and constructions). Each imports only earlier ones. The package is
independent of tolerances, plans and the origin of points.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.features.measured import ZoneProof, certificate, fit, fit_shape
    from ocmm_core.features.shapes import (
        GEOMETRY_NAMES, Criterion, Fit, PointsFile, Shape, read_points_file,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "GEOMETRY_NAMES", "Criterion", "Fit", "PointsFile", "Shape", "ZoneProof", "certificate", "fit",
    "fit_shape", "read_points_file",
]  # fmt: skip
