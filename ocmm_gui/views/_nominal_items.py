"""Drawing of planned features before measurement."""

from __future__ import annotations

import numpy as np

from ocmm_core.features.shapes import GEOMETRY_SIZE, NominalFeature, make_fit, nominal_geometry
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import PlannedFeature
from ocmm_gui.kit import Theme
from ocmm_gui.scene import Dots, Face, Item, Lines, Tag
from ocmm_gui.views import _shapes as shapes

_PLAIN_MM = 20.0
"""Half size of a plane or line without nominal size."""


def nominal_items(
    nominal: NominalFeature, colour: str, arrow: str
) -> tuple[tuple[Item, ...], Float]:
    """Return a nominal feature as wires with direction, and all its places (n, 3)."""
    geometry = nominal_geometry(nominal)
    ends = _ends(nominal, geometry)
    fit = make_fit(nominal.shape, geometry, np.zeros((GEOMETRY_SIZE, 0)), np.zeros(1))
    lines, corners = shapes.fitted_shape(fit, ends)
    items: list[Item] = [Face(corners, colour, 50)] if len(corners) else []
    items += [Lines(lines, colour, 2.0), Dots(fit.point[None], arrow, 6.0)]
    reach = np.concatenate([lines.reshape(-1, 3), fit.point[None]])
    if nominal.shape.spec.planned_direction:
        size = max(0.5 * float(np.ptp(reach, axis=0).max()), 8.0)
        tip = fit.point + size * np.array(nominal.direction) / np.linalg.norm(nominal.direction)
        items.append(Lines(np.stack([fit.point, tip])[None], arrow, 1.5))
        reach = np.concatenate([reach, tip[None]])
    return tuple(items), reach


def _ends(nominal: NominalFeature, geometry: Float) -> Float:
    """Return the end places of a drawn plane, line or cylinder, (n, 3)."""
    point, direction = geometry[0:3], np.array(nominal.direction)
    direction = direction / np.linalg.norm(direction)
    half = 0.5 * nominal.length or (nominal.diameter or _PLAIN_MM)
    if nominal.shape.spec.spread != "plane":
        return np.stack([point - half * direction, point + half * direction])
    across = np.array(nominal.across) - (direction @ np.array(nominal.across)) * direction
    if np.linalg.norm(across) < 1e-9:
        across = np.roll(direction, 1) - (direction @ np.roll(direction, 1)) * direction
    across = across / np.linalg.norm(across)
    other = np.cross(direction, across)
    wide = 0.5 * nominal.width or half
    steps = ((half, wide), (-half, wide), (-half, -wide), (half, -wide))
    return np.stack([point + a * across + b * other for a, b in steps])


def planned_items(planned: PlannedFeature, theme: Theme) -> tuple[tuple[Item, ...], Float]:
    """Return a feature at its planned pose, with its name, and all its places (n, 3)."""
    nominal, place = planned.nominal, planned.T_world_from_nominal
    geometry = nominal_geometry(nominal)
    fit = make_fit(nominal.shape, geometry, np.zeros((GEOMETRY_SIZE, 0)), np.zeros(1))
    lines, corners = shapes.fitted_shape(fit, _ends(nominal, geometry))
    lines, middle = place.apply(lines.reshape(-1, 3)).reshape(-1, 2, 3), place.apply(fit.point)
    items: list[Item] = []
    if len(corners):
        items.append(Face(place.apply(corners), theme.accent, 50))
    items += [Lines(lines, theme.accent, 2.0), Tag(middle, nominal.name, theme.accent)]
    return tuple(items), np.concatenate([lines.reshape(-1, 3), middle[None]])
