"""The ellipsoid of the present uncertainty of the ball, for the inspector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.coach._stance import Stance
from ocmm_core.geometry import Float
from ocmm_core.measuring import COVERAGE_FACTOR


@dataclass(frozen=True, slots=True, eq=False)
class Ellipsoid:
    """Uncertainty ellipsoid of the ball, k = 2 along every axis."""

    half_axes_mm: Float
    """(3,), the longest first: it is the U of the readout."""
    directions_world: Float
    """(3, 3), unit: the axes as rows."""
    outline_mm: Float
    """(3,): half axes of its view, mm, longer first; its angle from his right towards up, rad."""
    depth_mm: float
    """Half extent along the view."""

    @property
    def u_mm(self) -> float:
        """Return U, mm: the longest half axis."""
        return float(self.half_axes_mm[0])


def ellipsoid_of(covariance: Float, stance: Stance) -> Ellipsoid:
    """Return the ellipsoid of a covariance (3, 3), mm^2, world; its views are marginals."""
    values, vectors = np.linalg.eigh(covariance)
    half = COVERAGE_FACTOR * np.sqrt(np.maximum(values[::-1], 0.0))
    across = np.stack([stance.right, stance.up])
    flat, axes = np.linalg.eigh(across @ covariance @ across.T)
    longer, shorter = COVERAGE_FACTOR * np.sqrt(np.maximum(flat[::-1], 0.0))
    angle = float(np.arctan2(axes[1, 1], axes[0, 1]))
    depth = COVERAGE_FACTOR * float(
        np.sqrt(max(float(stance.away @ covariance @ stance.away), 0.0))
    )
    return Ellipsoid(half, vectors.T[::-1], np.array([longer, shorter, angle]), depth)
