"""Straightness, flatness, roundness, cylindricity and form (ISO 1101, 17.2 to 17.6).

Zones of ball centres are parallel to those of the part. Minimum zone; least squares if the plan
says so. Includes straightness of an axis and of a probed edge.

Balanced contact points give the gradient of a zone's width (envelope theorem).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from ocmm_core.alignment import AnyAlignment
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
    shapes_where,
)
from ocmm_core.geometry import Float, RigidTransform, perpendicular_pair
from ocmm_core.measuring import DeviationRows, Rows
from ocmm_core.tolerances import zones
from ocmm_core.tolerances.kinds._spec import (
    ALL,
    Fault,
    KindSpec,
    MonteCarlo,
    PlannedCharacteristic,
    QifWords,
    Symbol,
)

_FLAT = 1e-9
"""Relative effect of a parameter on the distances that counts as zero."""
_TOUCHING = 1e-6
"""Gap to the bound, relative to the width of the zone, that counts as zero."""
_UNBALANCED = 1e-3
"""Largest unbalanced force of contacts that hold the zone."""


def form_range(residuals: Float, rows: DeviationRows, association: str) -> zones.Evaluation:
    """Return the range of residuals (n,) with their derivatives."""
    high, low = int(np.argmax(residuals)), int(np.argmin(residuals))
    noise = zones.FormNoise(residuals, rows, np.zeros((len(residuals), 0)))
    value = float(residuals[high] - residuals[low])
    ends = rows[[high, low]].rows
    return zones.Evaluation(value, ends[0] - ends[1], association=association, noise=noise)


def form_zone(
    zone: Fit, feature: ActualFeature, tips: Float, places: Sequence[int], rows: DeviationRows
) -> zones.Evaluation:
    """Return form by a minimum zone; the rows are those of least-squares residuals."""
    by_geometry, normals = distance_derivatives(zone, tips)
    free = _free(zone, by_geometry)
    shares = _shares(zone, free)
    held = np.flatnonzero(shares)
    own = shares[held, None] * normals[held]
    gradient = Rows.of_points(np.asarray(places)[held], own.ravel())
    if zone.shape is Shape.CIRCLE:
        # Its plane is not optimised for the zone; a rotation of it shifts points by their heights.
        gradient += shares @ by_geometry[:, DIRECTION] @ feature.jacobian[DIRECTION]
    noise = zones.FormNoise(zone.residuals, rows, free)
    if zone.shape.spec.has_across:
        # The direction of the length turns with the plane.
        along = np.outer(by_geometry[:, ACROSS] @ zone.direction, zone.across)
        by_plane = by_geometry[:, DIRECTION] - along
        gradient += shares @ by_plane @ feature.jacobian[DIRECTION]
        of_ball = float(np.sign(zones.kept_offset(feature))) * float(shares.sum())
        gradient = gradient.with_radius(-of_ball)
        noise = zones.FormNoise(zone.residuals, rows, free, mirrored=True)
    return zones.Evaluation(zone.form, gradient, association="minimum zone", noise=noise)


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
    return u[:, strengths > _FLAT * strengths[0]]


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
    found, left = scipy.optimize.nnls(system, wanted)
    if left > _UNBALANCED:
        raise FitError(
            "characteristic.zone",
            "The contact points do not constrain the minimum zone.",
            "Spread the points over more of the feature.",
        )
    shares[rows] = signs * found
    return shares


def straight_axis(feature: ActualFeature) -> zones.Evaluation:
    centres = zones.median_line(feature)
    frame = zones.free_frame(RigidTransform.identity(), feature.fit.point)
    across = np.stack(perpendicular_pair(feature.fit.direction))
    found = zones.derived_zone(centres, feature.fit.point, across, frame)
    # The middle line of a straight cylinder has no vector that could cross zero.
    return replace(
        found, components=None, component_gradients=None, association="minimum zone", frame="",
        note=f"Centres of {len(centres)} sections.",
    )  # fmt: skip


def straight_line(feature: ActualFeature, *, smallest: bool) -> zones.Evaluation:
    """Return straightness of a probed edge, seen along the face's normal."""
    surface = zones.surface_points(feature)
    towards, direction = surface.normals[0], feature.fit.direction
    if not smallest:
        touches = zones.own_fit(feature)[0]
        arms = touches.tips - zones.least_squares(feature).point
        along = arms @ direction
        by_place = towards @ feature.jacobian[POINT]
        by_turn = towards @ feature.jacobian[DIRECTION]
        own = DeviationRows.of_own(touches.places, np.tile(towards, (len(arms), 1)))
        followed = Rows.stacked([by_place[None], by_turn[None]])
        alone = followed.with_radius(-followed.by_radius)
        rows = own.with_shared(-np.column_stack([np.ones(len(arms)), along]), alone)
        return form_range(arms @ towards, rows, "least squares")
    middle = feature.fit.point
    turn = np.cross(direction, towards)
    motions = np.zeros((6, 2))
    motions[3:, 0] = towards
    motions[:3, 1], motions[3:, 1] = turn, np.cross(middle, turn)
    frame = zones.ZoneFrame(RigidTransform.identity(), Rows.nothing(6), motions, zones.BEST_FIT)
    found = zones.surface_zone(
        [zones.Surface(surface, Shape.LINE, element(middle, towards))], frame
    )
    return replace(found, association="minimum zone", frame="")


_FORMS_OF_SHAPES = ("straightness", "flatness", "roundness", "cylindricity")
"""Kinds that are the form of one shape under its own name (ISO 1101)."""


def form(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return the width of the zone of a feature's form.

    Straightness of an axis is that of the centres of its sections; roundness of a cylinder that of
    its worst section. FitError: the minimum number of points, no sections, or no zone.
    """
    feature = actual[characteristic.features[0]]
    shape = feature.fit.shape
    count = len(feature.by_residuals)
    if count <= MINIMUM_POINTS[shape]:
        # The element passes through all of them; zero would look like a perfect part.
        raise FitError(
            "characteristic.no_form",
            f"{feature.nominal.name} has {count} points; form of a "
            f"{shape.value.lower()} needs at least {MINIMUM_POINTS[shape] + 1}.",
            "Take more points.",
        )
    smallest = characteristic.association != "least squares"
    if shape is Shape.CYLINDER and characteristic.kind == "straightness":
        return straight_axis(feature)
    if shape is Shape.LINE and feature.touches is not None:
        return straight_line(feature, smallest=smallest)
    if shape is Shape.CYLINDER and characteristic.kind == "roundness":
        return _worst_section(feature, smallest=smallest)
    has_zone = Criterion.MINIMUM_ZONE in shape.spec.criteria
    if not smallest or not has_zone or feature.touches is None:
        return _least_squares(feature)
    touches = zones.own_fit(feature)[0]
    try:
        zone = zones.associated(
            zones.least_squares(feature),
            touches.tips,
            Criterion.MINIMUM_ZONE,
            zones.kept_offset(feature),
        )
    except FitError as error:
        # Never narrower than the minimum zone: conformity with it implies conformity.
        squares = _even(feature) if shape.spec.has_across else _least_squares(feature)
        return replace(squares, note=f"Least squares instead of the minimum zone: {error.what}")
    return form_zone(zone, feature, touches.tips, touches.places, feature.by_residuals)


def _least_squares(feature: ActualFeature) -> zones.Evaluation:
    association = "least squares"
    if feature.fit.criterion is not Criterion.LEAST_SQUARES:
        association = feature.nominal.criterion
    return form_range(feature.fit.residuals, feature.by_residuals, association)


def _even(feature: ActualFeature) -> zones.Evaluation:
    """Return the symmetric zone about the least-squares outline."""
    residuals, rows = feature.fit.residuals, feature.by_residuals
    free = np.zeros((len(residuals), 0))
    worst = int(np.argmax(np.abs(residuals)))
    side = 2.0 * np.sign(residuals[worst])
    return zones.Evaluation(
        2.0 * float(np.abs(residuals[worst])), side * rows[[worst]].rows[0],
        association="least squares", noise=zones.FormNoise(residuals, rows, free, mirrored=True),
    )  # fmt: skip


def _worst_section(feature: ActualFeature, *, smallest: bool) -> zones.Evaluation:
    touches = zones.own_fit(feature)[0]
    sections = zones.axis_sections(feature)
    found = []
    for section in sections:
        circle, by_all = zones.section_circle(feature, section)
        tips, places = touches.tips[section.rows], [touches.places[row] for row in section.rows]
        by_geometry, normals = distance_derivatives(circle, tips)
        rows = DeviationRows.of_own(places, normals).with_shared(by_geometry, by_all)
        rows = rows.with_shared(by_geometry[:, DIRECTION], feature.jacobian[DIRECTION])
        found.append(
            form_zone(
                zones.associated(circle, tips, Criterion.MINIMUM_ZONE), feature, tips, places, rows
            )
            if smallest
            else form_range(circle.residuals, rows, "least squares")
        )
    worst = max(range(len(found)), key=lambda i: found[i].value)
    note = zones.few_in_a_section(sections)
    if len(sections) > 1:
        where = f"Worst of {len(sections)} sections, at height {sections[worst].at:.1f} mm."
        note = " ".join(filter(None, (where, note)))
    return replace(found[worst], note=note)


def _form_fault(asked: PlannedCharacteristic) -> Fault | None:
    if asked.item.association in ("minimum zone", "least squares"):
        return None
    return "association", "of form is 'minimum zone' or 'least squares'"


_of_form = partial(
    KindSpec, one_sided=True, evaluate=form, monte_carlo=MonteCarlo.RANGE,
    association_fault=_form_fault, own_form=True, form_alone=True,
)  # fmt: skip

KINDS = (
    _of_form(
        name="form",
        title="form deviation",
        qif=QifWords("OtherForm", of_shape={shape: shape.spec.qif.form for shape in ALL}),
        symbol=Symbol(bow="closed"),
        symbol_of_shape=dict.fromkeys(
            shapes_where(lambda spec: spec.form_kind == "line profile"), Symbol(bow="open")
        ),
        shapes=tuple(shape for shape in ALL if shape is not Shape.POINT),
        stands_for={
            shape: shape.spec.form_kind for shape in ALL if shape.spec.form_kind in _FORMS_OF_SHAPES
        },
    ),
    _of_form(
        name="straightness",
        qif=QifWords("Straightness"),
        symbol=Symbol(lines=(((0.05, 0.5), (0.95, 0.5)),)),
        shapes=(Shape.LINE, Shape.CYLINDER),
        # Of the axis of a cylinder, or of an edge.
        zone_of=lambda item, shape, datums: "cylinder" if shape is Shape.CYLINDER else "planes",
    ),
    _of_form(
        name="flatness",
        qif=QifWords("Flatness"),
        symbol=Symbol(
            lines=(((0.05, 0.75), (0.3, 0.25), (0.95, 0.25), (0.7, 0.75), (0.05, 0.75)),)
        ),
        shapes=(Shape.PLANE,),
    ),
    _of_form(
        name="roundness",
        qif=QifWords("Circularity"),
        symbol=Symbol(circles=((0.5, 0.5, 0.38),)),
        shapes=(Shape.CIRCLE, Shape.CYLINDER),
    ),
    _of_form(
        name="cylindricity",
        qif=QifWords("Cylindricity"),
        symbol=Symbol(
            lines=(((0.05, 0.92), (0.38, 0.12)), ((0.62, 0.88), (0.95, 0.08))),
            circles=((0.5, 0.5, 0.27),),
        ),
        shapes=(Shape.CYLINDER,),
    ),
)
