"""Certified reference pairs of NIST, cold start; geometry is compared, never parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.features.fit import fit_shape
from ocmm_core.features.shapes import Fit, Shape
from ocmm_core.geometry import Float

# What the project promises; the fits reach 1e-12 mm, so that a loss of accuracy shows long before.
LENGTH = 1e-9  # mm
ANGLE = 1e-10  # rad

FOLDERS = {
    "Line3d": Shape.LINE,
    "Plane": Shape.PLANE,
    "Circle2d": Shape.CIRCLE,
    "Circle3d": Shape.CIRCLE,
    "Sphere": Shape.SPHERE,
    "Cylinder": Shape.CYLINDER,
}


def _offset(fit: Fit, certified_point: Float) -> float:
    arm = certified_point - fit.point
    match fit.shape:
        case Shape.LINE | Shape.CYLINDER:
            return float(np.linalg.norm(arm - (arm @ fit.direction) * fit.direction))
        case Shape.PLANE:
            return abs(float(arm @ fit.direction))
        case _:
            return float(np.linalg.norm(arm))


@pytest.mark.parametrize("folder", FOLDERS)
def test_certified_results(reference: Path, folder: str) -> None:
    files = sorted((reference / "nist_l2" / folder).glob("*.ds"))
    assert files, f"no pairs in {folder}"
    for file in files:
        points = np.loadtxt(file, skiprows=1)
        certified = np.loadtxt(file.with_suffix(".fit"))
        fit = fit_shape(FOLDERS[folder], points)

        assert _offset(fit, certified[:3]) < LENGTH, file.name
        if folder != "Sphere":
            direction = certified[3:6] / np.linalg.norm(certified[3:6])
            assert np.linalg.norm(np.cross(direction, fit.direction)) < ANGLE, file.name
        if FOLDERS[folder] in (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER):
            assert abs(2.0 * fit.radius - certified[-1]) < LENGTH, file.name
