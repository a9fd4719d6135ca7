"""Second-order patch nearest to points: starts independent of trial axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.features.search._common import principal_axes
from ocmm_core.geometry import Float

RANK = 1e-10
"""Relative singular value below which a term is undetermined and set to zero."""


@dataclass(frozen=True, slots=True)
class Patch:
    """A bent patch."""

    foot: Float
    normal: Float
    """`foot`, `normal`: (3,) and (3,), unit: foot of the middle of the points, and normal there."""
    curvatures: Float
    """(2,): principal curvatures, positive towards the normal."""
    directions: Float
    """(2, 3), unit: of these."""


def curved_patch(points: Float) -> Patch:
    """Return the patch of centred and scaled points (n, 3), as a height above their plane."""
    _, axes = principal_axes(np.ascontiguousarray(points))
    x, y, height = (points @ axes.T).T
    columns = np.stack([np.ones_like(x), x, y, 0.5 * x * x, x * y, 0.5 * y * y], axis=1)
    c = np.linalg.lstsq(columns, height, rcond=RANK)[0]
    # First and second fundamental form of z(x, y) above the middle.
    steep = np.sqrt(1.0 + c[1] ** 2 + c[2] ** 2)
    first = np.array([[1.0 + c[1] ** 2, c[1] * c[2]], [c[1] * c[2], 1.0 + c[2] ** 2]])
    second = np.array([[c[3], c[4]], [c[4], c[5]]]) / steep
    half = np.linalg.inv(np.linalg.cholesky(first))
    curvatures, turned = np.linalg.eigh(half @ second @ half.T)
    flat = (half.T @ turned).T
    jacobian = np.column_stack([flat, flat @ c[1:3]])
    directions = jacobian @ axes
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    normal = np.array([-c[1], -c[2], 1.0]) / steep
    return Patch(c[0] * axes[2], normal @ axes, curvatures, directions)
