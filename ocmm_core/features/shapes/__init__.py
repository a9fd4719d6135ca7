"""The words of shapes and of nominal features, and points of a text file.

In: what a plan says of a feature, or a text file of points. Out: checked nominals, arrays in mm.

Read `_shapes` (which shapes there are, what their geometry vector holds, the form of every fit),
`_nominal` and `_nominal_checks` (can what a plan says exist), `_points_file`.
It is the first room of features and must not know how anything is fitted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.features.shapes._nominal import CRITERIA, NominalFeature, nominal_geometry
    from ocmm_core.features.shapes._nominal_checks import OUTLINES, shape_fault
    from ocmm_core.features.shapes._points_file import (
        COMMENT,
        FIELDS,
        NUMBER,
        PointsFile,
        decoded,
        number_of,
        read_points_file,
    )
    from ocmm_core.features.shapes._shapes import (
        ACROSS,
        DIRECTION,
        GEOMETRY_NAMES,
        GEOMETRY_SIZE,
        HALF_ANGLE,
        MINIMUM_POINTS,
        POINT,
        RADIUS,
        SECOND,
        Criterion,
        Fit,
        Shape,
        element,
        make_fit,
    )
else:
    __getattr__ = door(
        __name__,
        _nominal="CRITERIA NominalFeature nominal_geometry",
        _nominal_checks="OUTLINES shape_fault",
        _points_file="COMMENT FIELDS NUMBER PointsFile decoded number_of read_points_file",
        _shapes=(
            "ACROSS Criterion DIRECTION Fit GEOMETRY_NAMES GEOMETRY_SIZE HALF_ANGLE "
            "MINIMUM_POINTS POINT RADIUS SECOND Shape element make_fit"
        ),
    )

__all__ = [
    "ACROSS",
    "COMMENT",
    "CRITERIA",
    "DIRECTION",
    "FIELDS",
    "GEOMETRY_NAMES",
    "GEOMETRY_SIZE",
    "HALF_ANGLE",
    "MINIMUM_POINTS",
    "NUMBER",
    "OUTLINES",
    "POINT",
    "RADIUS",
    "SECOND",
    "Criterion",
    "Fit",
    "NominalFeature",
    "PointsFile",
    "Shape",
    "decoded",
    "element",
    "make_fit",
    "nominal_geometry",
    "number_of",
    "read_points_file",
    "shape_fault",
]
