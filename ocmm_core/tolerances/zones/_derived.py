"""Derived elements: centres, axes and sections of surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.elements import fit_circle_projected
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Fit, shapes_where
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.zones._surface import own_fit
from ocmm_core.tolerances.zones._zones import DerivedPoint

AXES = shapes_where(lambda spec: spec.is_long)
"""Shapes with an axis, or axes themselves."""

CENTRES = shapes_where(lambda spec: spec.centred)

SECTION_POINTS = 4
"""Minimum number of points of a section; `SECTION_RECOMMENDED` are recommended."""
SECTION_RECOMMENDED = 8

_GAP = 0.15
"""Part of the whole length between neighbouring points that separates two sections, and..."""
_GAP_MM = 2.0
"""... the least such gap: accuracy of manual probing at one height."""
_THICKEST = 0.35
"""Largest part of the whole length within one of several sections."""


def derived_points(feature: ActualFeature, length: float = 0.0) -> tuple[DerivedPoint, ...]:
    """Return centre or ends of axis, ``length`` mm long (0: as probed); FitError: no length."""
    geometry, jacobian = feature.fit.geometry, feature.jacobian
    if not feature.fit.shape.spec.is_long:
        return (DerivedPoint(geometry[0:3], jacobian[0:3]),)
    low, high = _extent(feature)
    if length > 0.0:
        middle = 0.5 * (low + high)
        low, high = middle - 0.5 * length, middle + 0.5 * length
    if high - low <= 0.0:
        raise FitError(
            "characteristic.no_length",
            f"The axis of {feature.nominal.name} has no length.",
            "Give the characteristic a 'length', or probe the feature at two heights.",
        )
    return tuple(
        DerivedPoint(geometry[0:3] + t * geometry[3:6], jacobian[0:3] + t * jacobian[3:6])
        for t in (low, high)
    )


def _extent(feature: ActualFeature) -> tuple[float, float]:
    """Return the extent of a feature along its axis, mm from its point."""
    if feature.touches is None:
        half = 0.5 * feature.nominal.length
        return -half, half
    along = (feature.touches.tips - feature.fit.point) @ feature.fit.direction
    return float(along.min()), float(along.max())


@dataclass(frozen=True, slots=True)
class Section:
    """Points of a surface of revolution in one plane across an axis, or at one radius."""

    rows: Int
    at: float
    """mm: position."""


def sections(name: str, places: Float) -> tuple[Section, ...]:
    """Return sections by heights or radii (n,), mm; FitError: no sections, or too few points."""
    order = np.argsort(places, kind="stable")
    whole = float(np.ptp(places))
    gaps = np.diff(places[order])
    breaks = np.flatnonzero(gaps > max(_GAP_MM, _GAP * whole)) + 1
    found = [Section(rows, float(places[rows].mean())) for rows in np.split(order, breaks)]
    for section in found:
        scattered = float(np.ptp(places[section.rows]))
        if scattered > max(_GAP_MM, _THICKEST * whole) and whole > 2.0 * _GAP_MM:
            raise FitError(
                "characteristic.no_sections",
                f"The points of {name} are not in sections: {len(section.rows)} of them spread "
                f"over {scattered:.1f} mm.",
                f"Take at least {SECTION_RECOMMENDED} points around one section, then the next.",
            )
        if len(section.rows) < SECTION_POINTS:
            raise FitError(
                "characteristic.short_section",
                f"A section of {name} needs at least {SECTION_POINTS} points ({len(section.rows)} "
                "taken).",
                f"Take {SECTION_RECOMMENDED} points in every section.",
            )
    return tuple(found)


def few_in_a_section(found: tuple[Section, ...]) -> str:
    """Return a note if a section has fewer points than recommended."""
    least = min(len(section.rows) for section in found)
    if least >= SECTION_RECOMMENDED:
        return ""
    return f"Few points: a section has {least} of {SECTION_RECOMMENDED} recommended."


def axis_sections(feature: ActualFeature) -> tuple[Section, ...]:
    """Return the sections across the axis of a feature; FitError as `sections`."""
    touches, raw = own_fit(feature)
    return sections(feature.nominal.name, (touches.tips - raw.point) @ raw.direction)


def section_circle(feature: ActualFeature, section: Section) -> tuple[Fit, Rows]:
    """Return the least-squares circle of a section's centres, with its jacobian, 12 rows.

    The axis direction counts as constant: its tilt of the section is of second order.
    """
    touches, raw = own_fit(feature)
    fit, _ = fit_circle_projected(touches.tips[section.rows], raw.direction)
    places = np.asarray(touches.places)[section.rows]
    return fit, Rows.of_points(places, fit.jacobian)


def median_line(feature: ActualFeature) -> tuple[DerivedPoint, ...]:
    """Return the centres of all sections (extracted axis); FitError for fewer than three."""
    found = axis_sections(feature)
    if len(found) < 3:
        raise FitError(
            "characteristic.no_axis",
            f"{feature.nominal.name} was probed in {len(found)} section(s); straightness of an "
            "axis needs at least three.",
            "Probe around at three heights or more.",
        )
    centres = [section_circle(feature, section) for section in found]
    return tuple(DerivedPoint(fit.point, by_all[0:3]) for fit, by_all in centres)
