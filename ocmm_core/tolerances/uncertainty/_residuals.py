"""What the noise of the points does to the residuals of a fit, summed up over them.

The derivative of n residuals by n points has n squared blocks, but it is a part of few rows: a
residual answers to the element, which is a dozen of numbers, and to its own point. With the element
J, the derivatives A by it and the own part D, the trace of (A J + D) C (A J + D)' is

    trace(A (J C J') A') + 2 sum_i A_i (J C)_i D_i' + sum_i D_i C_ii D_i'

and costs as much as there are points.
"""

from __future__ import annotations

import numpy as np

from ocmm_core.features.measured import ResidualSlopes
from ocmm_core.geometry import Float
from ocmm_core.measuring import PointFactors


def of_residuals(slopes: ResidualSlopes, factors: PointFactors) -> tuple[float, Float]:
    """Return the sum of the variances of n residuals, mm^2, and how each answers to its own point.

    Parameters
    ----------
    slopes
        Of the residuals.
    factors
        Of the points.

    Returns
    -------
    The sum of the variances, and (n, 3).
    """
    by_geometry, element, places = slopes.by_geometry, slopes.geometry, slopes.places
    of_points = element.at(places)
    # Points that the element does not rest on, as those of a plane, are in its own covariance only.
    moved = factors.moved(element)
    blocks, with_radius, radius = factors.blocks(places)
    normals, by_radius = slopes.normals, slopes.by_radius
    of_element = np.tensordot(element.by_points, moved.by_points, axes=((1, 2), (1, 2)))
    of_element += np.outer(element.by_radius, moved.by_radius)
    total = float(np.einsum("na,ab,nb->", by_geometry, of_element, by_geometry))
    shared = np.einsum("ani,ni->na", moved.at(places), normals) + by_radius * moved.by_radius
    total += 2.0 * float(np.sum(by_geometry * shared))
    total += float(np.einsum("ni,nij,nj->", normals, blocks, normals))
    total += float(
        np.sum(by_radius * (2.0 * np.sum(normals * with_radius, axis=1) + by_radius * radius))
    )
    return total, np.einsum("na,ani->ni", by_geometry, of_points) + normals
