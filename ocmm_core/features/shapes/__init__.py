"""Terms of shapes and of nominal features.

In: a feature of a plan.
Out: checked nominals, arrays in mm.

Read `_shapes` (shapes, geometry vector, form of every fit), `_nominal` (nominals and their
plausibility). It is the first package of features and independent of all fits.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.features.shapes._nominal import (
        CRITERIA, NominalFeature, nominal_geometry, nominal_of, shape_fault,
    )  # fmt: skip
    from ocmm_core.features.shapes._points_file import PointsFile, read_points_file
    from ocmm_core.features.shapes._shape import Shape
    from ocmm_core.features.shapes._shapes import (
        GEOMETRY_NAMES, MINIMUM_POINTS, MOST_POINTS, Fit, element, make_fit, shapes_where,
    )  # fmt: skip
    from ocmm_core.features.shapes._specs import (
        ACROSS, DIRECTION, GEOMETRY_SIZE, HALF_ANGLE, POINT, RADIUS, SECOND, BallWay, Criterion,
        QifShape, ShapeSpec, Size,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ACROSS", "CRITERIA", "DIRECTION", "GEOMETRY_NAMES", "GEOMETRY_SIZE", "HALF_ANGLE",
    "MINIMUM_POINTS", "MOST_POINTS", "POINT", "RADIUS", "SECOND", "BallWay", "Criterion", "Fit",
    "NominalFeature", "PointsFile", "QifShape", "Shape", "ShapeSpec", "Size", "element", "make_fit",
    "nominal_geometry", "nominal_of", "read_points_file", "shape_fault", "shapes_where",
]  # fmt: skip
