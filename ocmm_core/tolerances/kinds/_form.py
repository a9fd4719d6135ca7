"""Straightness, flatness, roundness, cylindricity and form in general (ISO 1101, 17.2 to 17.6).

Ball centres lie on a surface parallel to that of the part, so that a zone of theirs is one of the
part. The smallest zone is the default; its contact points, with the shares that balance, give the
derivative by the envelope theorem. Least squares where the plan says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import nnls

from ocmm_core.errors import FitError
from ocmm_core.features.elements import distance_derivatives
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import (
    ACROSS,
    DIRECTION,
    MINIMUM_POINTS,
    POINT,
    Criterion,
    Fit,
    Shape,
    element,
)
from ocmm_core.geometry import Float, RigidTransform, perpendicular_pair
from ocmm_core.tolerances.zones import (
    BEST_FIT,
    Characteristic,
    Evaluation,
    FormNoise,
    Surface,
    ZoneFrame,
    associated,
    axis_sections,
    derived_zone,
    few_in_a_section,
    free_frame,
    kept_offset,
    least_squares,
    median_line,
    own_fit,
    section_circle,
    surface_points,
    surface_zone,
)

_FLAT = 1e-9
"""Effect of a parameter on the distances, against the strongest, below which it has none."""
_TOUCHING = 1e-6
"""Gap to the bound, against the width of the zone, that is none."""
_UNBALANCED = 1e-3
"""Shares of contacts that leave more of a force than this do not hold the zone."""


def form(characteristic: Characteristic, feature: ActualFeature) -> Evaluation:
    """Return the width of the zone of a feature's form.

    Straightness of an axis is that of the centres of its sections; roundness of a cylinder that of
    its worst section.

    Raises
    ------
    FitError
        There are as few points as the shape needs, no sections, or no zone was found.
    """
    shape = feature.fit.shape
    if len(feature.residual_jacobian) <= MINIMUM_POINTS[shape]:
        # The element passes through all of them; zero would look like a perfect part.
        raise FitError(
            "characteristic.no_form",
            f"{feature.nominal.name} has {len(feature.residual_jacobian)} points; a "
            f"{shape.value.lower()} shows a form from {MINIMUM_POINTS[shape] + 1} points on.",
            "Take more points.",
        )
    smallest = characteristic.association != "least squares"
    if shape is Shape.CYLINDER and characteristic.kind == "straightness":
        return _straight_axis(feature)
    if shape is Shape.LINE and feature.touches is not None:
        return _straight_line(feature, smallest=smallest)
    if shape is Shape.CYLINDER and characteristic.kind == "roundness":
        return _worst_section(feature, smallest=smallest)
    has_zone = Criterion.MINIMUM_ZONE in shape.spec.criteria
    if not smallest or not has_zone or feature.touches is None:
        return _least_squares(feature)
    touches = own_fit(feature)[0]
    try:
        zone = associated(
            least_squares(feature), touches.tips, Criterion.MINIMUM_ZONE, kept_offset(feature)
        )
    except FitError as error:
        # Never narrower than the smallest zone: what conforms, conforms all the more.
        squares = _even(feature) if shape.spec.has_across else _least_squares(feature)
        return replace(squares, note=f"Least squares instead of the minimum zone: {error.what}")
    return _zone(zone, feature, touches.tips, touches.places, feature.residual_jacobian)


def _least_squares(feature: ActualFeature) -> Evaluation:
    association = "least squares"
    if feature.fit.criterion is not Criterion.LEAST_SQUARES:
        association = feature.nominal.criterion
    return _range(feature.fit.residuals, feature.residual_jacobian, association)


def _even(feature: ActualFeature) -> Evaluation:
    """Return the zone about the least-squares outline that reaches as far to either side."""
    residuals, rows = feature.fit.residuals, feature.residual_jacobian
    both, by_both = np.concatenate([residuals, -residuals]), np.concatenate([rows, -rows])
    return _range(both, by_both, "least squares")


def _range(residuals: Float, rows: Float, association: str) -> Evaluation:
    """Return the range of residuals (n,) with their derivatives (n, 3 N + 1)."""
    high, low = int(np.argmax(residuals)), int(np.argmin(residuals))
    noise = FormNoise(residuals, rows, np.zeros((len(residuals), 0)))
    value = float(residuals[high] - residuals[low])
    return Evaluation(value, rows[high] - rows[low], association=association, noise=noise)


def _zone(
    zone: Fit, feature: ActualFeature, tips: Float, places: Sequence[int], rows: Float
) -> Evaluation:
    """Return form by a smallest zone; rows (n, 3 N + 1) are those of least-squares residuals."""
    by_geometry, normals = distance_derivatives(zone, tips)
    free = _free(zone, by_geometry)
    shares = _shares(zone, free)
    gradient = np.zeros(rows.shape[1])
    for row in np.flatnonzero(shares).tolist():
        place = places[row]
        gradient[3 * place : 3 * place + 3] += shares[row] * normals[row]
    if zone.shape is Shape.CIRCLE:
        # Its plane is not made for the zone; a turn of it shifts points by their heights.
        gradient += shares @ by_geometry[:, DIRECTION] @ feature.jacobian[DIRECTION]
    noise = FormNoise(zone.residuals, rows, free)
    if zone.shape.spec.has_across:
        # The direction of the length turns with the plane.
        along = np.outer(by_geometry[:, ACROSS] @ zone.direction, zone.across)
        by_plane = by_geometry[:, DIRECTION] - along
        gradient += shares @ by_plane @ feature.jacobian[DIRECTION]
        gradient[-1] -= float(np.sign(kept_offset(feature))) * float(shares.sum())
        noise = FormNoise(
            np.concatenate([zone.residuals, -zone.residuals]), np.concatenate([rows, -rows]),
            np.concatenate([free, -free]), mirrored=True,
        )  # fmt: skip
    return Evaluation(zone.form, gradient, association="minimum zone", noise=noise)


def _free(zone: Fit, by_geometry: Float) -> Float:
    """Return how distances answer to the parameters that make the zone smallest, (n, k)."""
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
    """Return the derivative (n,) of the width of a zone by the distance of every point.

    Those of the points at the outside are positive and add up to one, those at the inside are
    negative and add up to minus one; together no motion of the element changes them. About an
    outline the zone reaches as far to either side, and only all of them together add up to two.

    Raises
    ------
    FitError
        The contacts do not hold the zone.
    """
    shares = np.zeros(len(zone.residuals))
    if not zone.contacts:
        # All points lie on the element: any two say as little.
        shares[int(np.argmax(zone.residuals))] += 1.0
        shares[int(np.argmin(zone.residuals))] -= 1.0
        return shares
    rows = np.array(zone.contacts)
    if zone.shape.spec.has_across:
        # Others hold what the zone leaves free.
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
            "The points that touch the smallest zone do not hold it.",
            "Spread the points over more of the feature.",
        )
    shares[rows] = signs * found
    return shares


def _worst_section(feature: ActualFeature, *, smallest: bool) -> Evaluation:
    touches = own_fit(feature)[0]
    sections = axis_sections(feature)
    found = []
    for section in sections:
        circle, by_all = section_circle(feature, section)
        tips, places = touches.tips[section.rows], [touches.places[row] for row in section.rows]
        by_geometry, normals = distance_derivatives(circle, tips)
        rows = by_geometry @ by_all + by_geometry[:, DIRECTION] @ feature.jacobian[DIRECTION]
        for row, place in enumerate(places):
            rows[row, 3 * place : 3 * place + 3] += normals[row]
        found.append(
            _zone(associated(circle, tips, Criterion.MINIMUM_ZONE), feature, tips, places, rows)
            if smallest
            else _range(circle.residuals, rows, "least squares")
        )
    worst = max(range(len(found)), key=lambda i: found[i].value)
    note = few_in_a_section(sections)
    if len(sections) > 1:
        where = f"Worst of {len(sections)} sections, at height {sections[worst].at:.1f} mm."
        note = f"{where} {note}".strip()
    return replace(found[worst], note=note)


def _straight_axis(feature: ActualFeature) -> Evaluation:
    centres = median_line(feature)
    frame = free_frame(RigidTransform.identity(), feature.fit.point, feature.jacobian.shape[1])
    across = np.stack(perpendicular_pair(feature.fit.direction))
    found = derived_zone(centres, feature.fit.point, across, frame)
    # The middle line of a straight cylinder has no vector that could cross zero.
    return replace(
        found, components=None, component_gradients=None, association="minimum zone", frame="",
        note=f"Centres of {len(centres)} sections.",
    )  # fmt: skip


def _straight_line(feature: ActualFeature, *, smallest: bool) -> Evaluation:
    """Return straightness of a probed edge, seen along the face's normal."""
    surface = surface_points(feature)
    towards, direction = surface.normals[0], feature.fit.direction
    if not smallest:
        touches = own_fit(feature)[0]
        arms = touches.tips - least_squares(feature).point
        along = arms @ direction
        rows = -towards @ feature.jacobian[POINT] - np.outer(
            along, towards @ feature.jacobian[DIRECTION]
        )
        rows[:, -1] = 0.0
        for row, place in enumerate(touches.places):
            rows[row, 3 * place : 3 * place + 3] += towards
        return _range(arms @ towards, rows, "least squares")
    middle = feature.fit.point
    turn = np.cross(direction, towards)
    motions = np.zeros((6, 2))
    motions[3:, 0] = towards
    motions[:3, 1], motions[3:, 1] = turn, np.cross(middle, turn)
    nothing = np.zeros((6, feature.jacobian.shape[1]))
    frame = ZoneFrame(RigidTransform.identity(), nothing, motions, BEST_FIT)
    found = surface_zone([Surface(surface, Shape.LINE, element(middle, towards))], frame)
    return replace(found, association="minimum zone", frame="")
