"""Solids of a virtual part, derived from the surfaces of its document.

A document lists touched surfaces, not bodies. A plane is the top of a slab that reaches down to the
plane below it, with holes cut out whose mouth lies in it; balls have a stem. Every surface of the
document is exactly a surface of a solid, so touches are true.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ocmm_core.geometry import Float, perpendicular_pair, unit
from ocmm_sim.hand import _kernel as kernel
from ocmm_sim.scene import Part, surfaces

_RIM_MM = 3.0
"""Margin of a slab beyond its touchable areas, and round a hole in no plane."""
_THICK_MM = 12.0
_NEAR_MM = 0.6
_LEVEL = 1e-3
_FACE_MM = (6.0, 6.0)
"""Half the height and the thickness of the strip that a line lies on."""


@dataclass(frozen=True, slots=True)
class Solid:
    """One solid; columns as in `_kernel`."""

    feature: str
    """Feature with its surface; empty for a stem."""
    kind: int
    origin: Float
    axes: Float
    sizes: tuple[float, float, float]
    """`kind`, `origin`, `axes`, `sizes`: ``axes`` (3, 3): rows x, y, z in the part frame."""
    holes: tuple[tuple[str, Float], ...] = ()
    """Name and columns of each."""


@dataclass(frozen=True, slots=True)
class Solids:
    """All solids of a part, also as arrays for the compiled loops."""

    items: tuple[Solid, ...]
    rows: Float
    holes: Float


def solids_of(part: Part) -> Solids | None:
    """Return the solids of a part; None if a surface has touch points but no shape."""
    if any(isinstance(entry, surfaces.TouchedEntry) for entry in part.artefacts):
        return None
    entries = part.artefacts
    planes = [entry for entry in entries if isinstance(entry, surfaces.PlaneEntry)]
    lines = [entry for entry in entries if isinstance(entry, surfaces.LineEntry)]
    slabs = [_slab(entry, lines, planes) for entry in planes]
    holes = [entry for entry in entries if isinstance(entry, surfaces.HOLES)]
    items: list[Solid] = []
    used: set[str] = set()
    for entry, slab in zip(planes, slabs, strict=True):
        cut = [hole for hole in holes if _is_on(slab, np.array(hole.point))]
        used |= {hole.name for hole in cut}
        own = tuple((hole.name, _hole(hole, slab)) for hole in cut)
        items.append(Solid(entry.name, slab.kind, slab.origin, slab.axes, slab.sizes, own))
    for hole in holes:
        if hole.name not in used:
            items.append(_collar(hole))
    for each in entries:
        items += _body(each, items)
    return Solids(tuple(items), *_packed(items))


def _slab(
    entry: surfaces.PlaneEntry, lines: list[surfaces.LineEntry], planes: list[surfaces.PlaneEntry]
) -> Solid:
    normal, along = unit(np.array(entry.direction)), unit(np.array(entry.along))
    across = np.cross(normal, along)
    areas = np.array(entry.areas)
    point = np.array(entry.point)
    ends = np.array([
        [areas[:, 0].min() - _RIM_MM, areas[:, 2].max() + _RIM_MM],
        [areas[:, 1].min() - _RIM_MM, areas[:, 3].max() + _RIM_MM],
    ])  # fmt: skip
    for line in lines:
        # A line on a side face defines that side.
        facing, start = unit(np.array(line.normal)), np.array(line.point) - point
        for axis, direction in enumerate((along, across)):
            for end, sign in ((0, -1.0), (1, 1.0)):
                place = float(start @ direction)
                below = -60.0 < float(start @ normal) < 0.0
                near = abs(place - ends[axis, end]) < 2.0 * _RIM_MM
                if facing @ (sign * direction) > 1.0 - _LEVEL and below and near:
                    ends[axis, end] = place
    middle = ends.mean(axis=1)
    half = 0.5 * (ends[:, 1] - ends[:, 0])
    origin = point + middle[0] * along + middle[1] * across
    drops = [drop for other in planes if (drop := _drop(origin, normal, other)) > _NEAR_MM]
    thick = min(drops, default=_THICK_MM)
    axes = np.stack([along, across, normal])
    return Solid(entry.name, kernel.BOX, origin, axes, (float(half[0]), float(half[1]), thick))


def _drop(point: Float, normal: Float, below: surfaces.PlaneEntry) -> float:
    """Return the height above a parallel plane; zero outside its areas."""
    facing, along = unit(np.array(below.direction)), unit(np.array(below.along))
    away = point - np.array(below.point)
    areas = np.array(below.areas)
    flat = np.array([away @ along, away @ np.cross(facing, along)])
    over = bool((flat > areas[:, :2].min(axis=0)).all() and (flat < areas[:, 2:].max(axis=0)).all())
    return float(away @ normal) if over and facing @ normal > 1.0 - _LEVEL else 0.0


def _is_on(slab: Solid, point: Float) -> bool:
    x, y, z = slab.axes @ (point - slab.origin)
    return bool(abs(x) < slab.sizes[0] and abs(y) < slab.sizes[1] and abs(z) < _NEAR_MM)


def _hole(entry: surfaces.BoreEntry | surfaces.SlotEntry | surfaces.EllipseEntry, slab: Solid) -> (
    Float
):  # fmt: skip
    row = np.zeros(kernel.N_HOLE)
    x, y, z = slab.axes @ (np.array(entry.point) - slab.origin)
    row[[kernel.X, kernel.Y]] = x, y
    row[kernel.DEPTH] = entry.depth - z
    row[kernel.COSINE] = 1.0
    if isinstance(entry, surfaces.BoreEntry):
        row[kernel.HALF_B] = 0.5 * entry.diameter
        return row
    row[[kernel.COSINE, kernel.SINE]] = slab.axes[:2] @ unit(np.array(entry.along))
    a, b = 0.5 * entry.length, 0.5 * entry.width
    if isinstance(entry, surfaces.EllipseEntry):
        row[kernel.OUTLINE] = kernel.OVAL
    elif entry.ends == "square":
        row[kernel.OUTLINE] = kernel.SQUARE
    else:
        a -= b
    row[[kernel.HALF_A, kernel.HALF_B]] = a, b
    return row


def _collar(entry: surfaces.BoreEntry | surfaces.SlotEntry | surfaces.EllipseEntry) -> Solid:
    """Return the material round a hole that lies in no plane."""
    axis = unit(np.array(entry.direction))
    if isinstance(entry, surfaces.BoreEntry):
        axes, long, wide = (
            np.stack([*perpendicular_pair(axis), axis]),
            entry.diameter,
            entry.diameter,
        )
    else:
        along = unit(np.array(entry.along))
        axes = np.stack([along, np.cross(axis, along), axis])
        long, wide = entry.length, entry.width
    sizes = (0.5 * long + _RIM_MM, 0.5 * wide + _RIM_MM, entry.depth + _RIM_MM)
    slab = Solid("", kernel.BOX, np.array(entry.point), axes, sizes)
    return Solid(
        "", slab.kind, slab.origin, slab.axes, slab.sizes, ((entry.name, _hole(entry, slab)),)
    )


def _body(entry: surfaces.Artefact, there: list[Solid]) -> list[Solid]:
    """Return the solids of a surface other than planes and holes."""
    point, axis = np.array(entry.point), unit(np.array(entry.direction))
    axes = np.stack([*perpendicular_pair(axis), axis])
    if isinstance(entry, surfaces.SphereEntry):
        radius = 0.5 * entry.diameter
        ball = Solid(entry.name, kernel.BALL, point, axes, (radius, 0.0, 0.0))
        free = [
            float(axis @ (point - slab.origin)) - radius
            for slab in there
            if slab.kind == kernel.BOX and axis @ slab.axes[2] > 1.0 - _LEVEL
        ]
        length = min((one for one in free if one > 0.0), default=0.0)
        if not length:
            return [ball]
        stem = min(4.0, 0.3 * radius)
        foot = point - (radius + length) * axis
        return [ball, Solid("", kernel.ROUND, foot, axes, (stem, stem, length + 0.1 * radius))]
    if isinstance(entry, surfaces.CylinderEntry):
        radius = 0.5 * entry.diameter
        return [Solid(entry.name, kernel.ROUND, point, axes, (radius, radius, entry.height))]
    if isinstance(entry, surfaces.ConeEntry):
        sizes = (0.5 * entry.diameter, 0.5 * entry.top_diameter, entry.height)
        return [Solid(entry.name, kernel.ROUND, point, axes, sizes)]
    if isinstance(entry, surfaces.TorusEntry):
        sizes = (0.5 * entry.diameter, 0.5 * entry.tube_diameter, 0.0)
        return [Solid(entry.name, kernel.RING, point, axes, sizes)]
    if isinstance(entry, surfaces.LineEntry):
        facing, half = unit(np.array(entry.normal)), 0.5 * entry.length
        middle = point + half * axis
        if any(_has_face(slab, middle, facing) for slab in there):
            return []
        frame = np.stack([axis, np.cross(facing, axis), facing])
        return [Solid(entry.name, kernel.BOX, middle, frame, (half, *_FACE_MM))]
    if isinstance(entry, surfaces.PointEntry):
        if any(_has_face(slab, point, axis) for slab in there):
            return []
        return [Solid(entry.name, kernel.BOX, point, axes, (*_FACE_MM, _FACE_MM[1]))]
    return []


def _has_face(slab: Solid, point: Float, normal: Float) -> bool:
    """Return whether a point lies on a face of a slab, up to rounding."""
    if slab.kind != kernel.BOX:
        return False
    local, facing = slab.axes @ (point - slab.origin), slab.axes @ normal
    half = np.array([slab.sizes[0], slab.sizes[1], 0.5 * slab.sizes[2]])
    local = local + np.array([0.0, 0.0, half[2]])
    axis = int(np.argmax(np.abs(facing)))
    on_it = abs(float(local[axis]) * np.sign(facing[axis]) - half[axis]) < 1e-6
    others = [other for other in range(3) if other != axis]
    within = bool((np.abs(local[others]) < half[others]).all())
    return on_it and within and abs(float(facing[axis])) > 1.0 - _LEVEL


def _packed(items: list[Solid]) -> tuple[Float, Float]:
    rows = np.zeros((len(items), kernel.N_SOLID))
    holes: list[Float] = []
    for row, item in zip(rows, items, strict=True):
        row[kernel.KIND] = item.kind
        row[kernel.ORIGIN : kernel.ORIGIN + 3] = item.origin
        row[kernel.AXES : kernel.AXES + 9] = item.axes.ravel()
        row[kernel.SIZES : kernel.SIZES + 3] = item.sizes
        row[kernel.HOLE0] = len(holes)
        holes += [hole for _, hole in item.holes]
        row[kernel.HOLE1] = len(holes)
        a, b, c = item.sizes
        height = {kernel.BOX: -0.5 * c, kernel.ROUND: 0.5 * c}.get(item.kind, 0.0)
        reach = {
            kernel.BOX: float(np.sqrt(a * a + b * b + 0.25 * c * c)),
            kernel.ROUND: float(np.hypot(max(a, b), 0.5 * c)),
            kernel.BALL: a,
            kernel.RING: a + b,
        }[item.kind]
        row[kernel.MIDDLE : kernel.MIDDLE + 3] = item.origin + height * item.axes[2]
        row[kernel.REACH] = reach
    return rows, np.array(holes).reshape(-1, kernel.N_HOLE)
