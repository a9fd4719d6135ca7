"""Shapes, their fits, and features as nominal and as measured.

What is named in `__all__` is the face for other programs (docs/python.md). The rooms behind it are
for the product: `shapes` (words), `search` (what every fit shares), `elements` (least squares, one
module a shape), `zones` (minimum zones and bounding elements), `measured` (features from points).
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
