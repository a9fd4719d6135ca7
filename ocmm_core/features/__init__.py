"""Shapes, their fits, and features as nominal and as measured.

What is named in `__all__` is the face for other programs (docs/python.md). The rooms behind it are
for the product.
In: points (mm), or ball centres with their joint covariance. Out: elements with their Jacobian.

Read `shapes` (words and nominals), `search` (what every fit shares), `elements` (least squares,
one file a shape), `zones` (minimum zones and bounding elements), `measured` (features from points,
with the ball taken off, and constructions). None imports a later one.
It must not know tolerances, plans or where a point came from.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.features.measured import Certificate, certificate, fit_shape
    from ocmm_core.features.shapes import (
        GEOMETRY_NAMES,
        Criterion,
        Fit,
        PointsFile,
        Shape,
        read_points_file,
    )
else:
    __getattr__ = door(
        __name__,
        measured="Certificate certificate fit_shape",
        shapes="Criterion Fit GEOMETRY_NAMES PointsFile Shape read_points_file",
    )

__all__ = [
    "GEOMETRY_NAMES",
    "Certificate",
    "Criterion",
    "Fit",
    "PointsFile",
    "Shape",
    "certificate",
    "fit_shape",
    "read_points_file",
]
