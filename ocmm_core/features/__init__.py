"""Shapes, their fits, and features as nominal and as measured.

What is named in `__all__` is the face for other programs (docs/python.md). It is loaded when it is
asked for: rooms that only need the words of a shape do not load the compiled fits.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ocmm_core.features.fit import Certificate, certificate, fit_shape
    from ocmm_core.features.points_file import PointsFile, read_points_file
    from ocmm_core.features.shapes import GEOMETRY_NAMES, Criterion, Fit, Shape

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

_HOMES = {
    "GEOMETRY_NAMES": "shapes",
    "Certificate": "fit",
    "Criterion": "shapes",
    "Fit": "shapes",
    "PointsFile": "points_file",
    "Shape": "shapes",
    "certificate": "fit",
    "fit_shape": "fit",
    "read_points_file": "points_file",
}


def __getattr__(name: str) -> object:
    """Return what `__all__` names, from the module that holds it."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found: object = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    return found
