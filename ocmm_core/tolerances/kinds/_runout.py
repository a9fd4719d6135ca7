"""Circular and total run-out about a datum axis (ISO 1101, 17.15 and 17.16)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import DIRECTION, POINT, Shape
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring import Rows
from ocmm_core.tolerances import zones
from ocmm_core.tolerances.kinds import _spec as spec


def runout(
    characteristic: zones.Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    frames: zones.Frames,
) -> zones.Evaluation:
    """Return the run-out of a surface about the datum axis.

    Radially for round surfaces, square to the surface for a cone, axially for a face. Circular
    run-out is that of the worst section; sections are found from the positions of the points.
    FitError: the feature has no points of its own, or they do not lie in sections.
    """
    feature, datum = actual[characteristic.features[0]], actual[characteristic.datums[0]]
    surface = zones.surface_points(feature)
    axis = datum.fit.direction
    arms = surface.points - datum.fit.point
    along = arms @ axis
    across = arms - np.outer(along, axis)
    radii = np.linalg.norm(across, axis=1)
    radial = across / np.maximum(radii, 1e-12)[:, None]
    shape = feature.fit.shape
    # Radial and axial components of the direction of measurement, square to the surface: points of
    # a section of a cone need not be at one height.
    radially, axially = 0.0, 1.0
    if shape is not Shape.PLANE:
        towards = float(np.copysign(1.0, axis @ feature.fit.direction))
        radially = float(np.cos(feature.fit.half_angle))
        axially = -towards * float(np.sin(feature.fit.half_angle))
    places = radii if shape is Shape.PLANE else along
    values = radially * radii + axially * along
    directions = radially * radial + axially * axis
    by_axis = axially * arms - radially * along[:, None] * radial
    by_datum = -directions @ datum.jacobian[POINT] + by_axis @ datum.jacobian[DIRECTION]

    found: tuple[zones.Section, ...] = (zones.Section(np.arange(len(values)), 0.0),)
    note = ""
    if characteristic.kind == "circular runout" and shape is not Shape.CIRCLE:
        found = zones.sections(feature.nominal.name, places)
    if characteristic.kind == "circular runout":
        note = zones.few_in_a_section(found)
    worst = max(found, key=lambda section: float(np.ptp(values[section.rows])))
    if len(found) > 1:
        where = "radius" if shape is Shape.PLANE else "height"
        said = f"Worst of {len(found)} sections, at {where} {worst.at:.1f} mm."
        note = " ".join(filter(None, (said, note)))
    gradient = _extremes(surface, values, directions, by_datum, worst.rows)
    rows = by_datum[worst.rows] + _of_own_points(surface, directions, worst.rows)
    return zones.Evaluation(
        float(np.ptp(values[worst.rows])),
        gradient,
        frame=characteristic.datums[0],
        noise=zones.FormNoise(values[worst.rows], rows, np.zeros((len(rows), 0))),
        note=note,
    )


def _extremes(
    surface: zones.SurfacePoints, values: Float, directions: Float, by_datum: Rows, rows: Int
) -> Rows:
    """Return the gradient of the greatest less the smallest value."""
    high, low = int(rows[np.argmax(values[rows])]), int(rows[np.argmin(values[rows])])
    weights = np.zeros_like(directions)
    weights[high] += directions[high]
    weights[low] -= directions[low]
    return by_datum[high] - by_datum[low] + surface.pull_back(weights)


def _of_own_points(surface: zones.SurfacePoints, directions: Float, chosen: Int) -> Rows:
    """Return the derivatives of m chosen points by their ball centres and the ball."""
    places = np.asarray(zones.own_fit(surface.feature)[0].places)[chosen]
    own, normals = directions[chosen], surface.normals[chosen]
    return Rows.of_own_points(places, own).with_radius(-np.sum(own * normals, axis=1))


def _arrow(shift: float) -> tuple[spec.Polygon, ...]:
    return (
        ((0.1 + shift, 0.9), (0.55 + shift, 0.12)),
        ((0.37 + shift, 0.24), (0.55 + shift, 0.12), (0.55 + shift, 0.34)),
    )


def _kind(name: str, qif: str, shapes: tuple[Shape, ...], symbol: spec.Symbol) -> spec.KindSpec:
    return spec.KindSpec(
        name=name,
        words=name,
        unit="mm",
        one_sided=True,
        evaluate=runout,
        monte_carlo=spec.MonteCarlo.EVALUATED,
        qif=spec.QifWords(qif),
        symbol=symbol,
        shapes=shapes,
        datums=(1, 1),
        datum_shapes=spec.ROUND_AXES,
        own_form=True,
        probed="all",
    )


KINDS = (
    _kind(
        "circular runout",
        "CircularRunout",
        (Shape.CIRCLE, Shape.CYLINDER, Shape.CONE, Shape.PLANE),
        spec.Symbol(lines=_arrow(0.15)),
    ),
    _kind(
        "total runout",
        "TotalRunout",
        (Shape.CYLINDER, Shape.PLANE),
        spec.Symbol(lines=(*_arrow(-0.05), *_arrow(0.35), ((0.05, 0.9), (0.45, 0.9)))),
    ),
)
