"""Width of a form zone; balanced contact points give its gradient (envelope theorem)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import nnls

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import ACROSS, DIRECTION, POINT, Fit, Shape
from ocmm_core.geometry import Float, perpendicular_pair
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.zones import Evaluation, FormNoise, kept_offset

_FLAT = 1e-9
"""Relative effect of a parameter on the distances that counts as zero."""
_TOUCHING = 1e-6
"""Gap to the bound, relative to the width of the zone, that counts as zero."""
_UNBALANCED = 1e-3
"""Largest unbalanced force of contacts that hold the zone."""


def form_range(residuals: Float, rows: Rows, association: str) -> Evaluation:
    """Return the range of residuals (n,) with their derivatives, n rows."""
    high, low = int(np.argmax(residuals)), int(np.argmin(residuals))
    noise = FormNoise(residuals, rows, np.zeros((len(residuals), 0)))
    value = float(residuals[high] - residuals[low])
    return Evaluation(value, rows[high] - rows[low], association=association, noise=noise)


def form_zone(
    zone: Fit, feature: ActualFeature, tips: Float, places: Sequence[int], rows: Rows
) -> Evaluation:
    """Return form by a minimum zone; the n rows are those of least-squares residuals."""
    by_geometry, normals = distance_derivatives(zone, tips)
    free = _free(zone, by_geometry)
    shares = _shares(zone, free)
    held = np.flatnonzero(shares)
    own = shares[held, None] * normals[held]
    gradient = Rows.of_points(np.asarray(places)[held], own.ravel())
    if zone.shape is Shape.CIRCLE:
        # Its plane is not optimised for the zone; a rotation of it shifts points by their heights.
        gradient += shares @ by_geometry[:, DIRECTION] @ feature.jacobian[DIRECTION]
    noise = FormNoise(zone.residuals, rows, free)
    if zone.shape.spec.has_across:
        # The direction of the length turns with the plane.
        along = np.outer(by_geometry[:, ACROSS] @ zone.direction, zone.across)
        by_plane = by_geometry[:, DIRECTION] - along
        gradient += shares @ by_plane @ feature.jacobian[DIRECTION]
        of_ball = float(np.sign(kept_offset(feature))) * float(shares.sum())
        gradient = gradient.with_radius(-of_ball)
        noise = FormNoise(
            np.concatenate([zone.residuals, -zone.residuals]), Rows.stacked([rows, -rows]),
            np.concatenate([free, -free]), mirrored=True,
        )  # fmt: skip
    return Evaluation(zone.form, gradient, association="minimum zone", noise=noise)


def _free(zone: Fit, by_geometry: Float) -> Float:
    """Return derivatives of distances by the free parameters of the zone, (n, k)."""
    columns = [by_geometry[:, POINT], by_geometry[:, 6:9]]
    if zone.shape.spec.has_across:
        beside = np.cross(zone.direction, zone.across)
        columns.append((by_geometry[:, ACROSS] @ beside)[:, None])
    else:
        columns.append(np.ones((len(by_geometry), 1)))
        if np.any(zone.direction) and not zone.shape.spec.is_flat:
            across = np.stack(perpendicular_pair(zone.direction))
            columns.append(by_geometry[:, DIRECTION] @ across.T)
    free = np.hstack(columns)
    scales = np.linalg.norm(free, axis=0)
    free = free[:, scales > 0.0] / scales[scales > 0.0]
    u, strengths, _ = np.linalg.svd(free, full_matrices=False)
    independent: Float = u[:, strengths > _FLAT * strengths[0]]
    return independent


def _shares(zone: Fit, free: Float) -> Float:
    """Return the derivative (n,) of the width: outer weights add to one, inner to minus one."""
    shares = np.zeros(len(zone.residuals))
    if not zone.contacts:
        # All points are on the element: any two are equivalent.
        shares[int(np.argmax(zone.residuals))] += 1.0
        shares[int(np.argmin(zone.residuals))] -= 1.0
        return shares
    rows = np.array(zone.contacts)
    if zone.shape.spec.has_across:
        # Other contacts determine the directions left free by the zone.
        off = np.abs(zone.residuals[rows])
        rows = rows[off > off.max() - _TOUCHING * zone.form]
    middle = 0.5 * float(zone.residuals.max() + zone.residuals.min())
    signs = np.where(zone.residuals[rows] > middle, 1.0, -1.0)
    sides = [signs > 0.0, signs < 0.0]
    sums = [1.0, 1.0]
    if zone.shape.spec.has_across:
        sides, sums = [np.ones(len(rows), dtype=bool)], [2.0]
    system = np.vstack([(free[rows] * signs[:, None]).T, *sides])
    wanted = np.concatenate([np.zeros(free.shape[1]), sums])
    found, left = nnls(system, wanted)
    if left > _UNBALANCED:
        raise FitError(
            "characteristic.zone",
            "The contact points do not constrain the minimum zone.",
            "Spread the points over more of the feature.",
        )
    shares[rows] = signs * found
    return shares
