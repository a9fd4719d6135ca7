"""Frame of datums in their precedence (ISO 5459).

Each datum is satisfied as far as the preceding ones allow: first its direction, then its place,
then the direction across it. Nominal geometry decides the constraints of a datum; measured geometry
the pose of the part. A secondary plane not quite square to the primary one therefore turns the part
about the primary's normal and does not tilt it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from ocmm_core.alignment import _freedom as freedom
from ocmm_core.errors import FitError
from ocmm_core.features.measured import gauge_point
from ocmm_core.features.shapes import ACROSS, DIRECTION, POINT, RADIUS, Shape
from ocmm_core.geometry import Float, RigidTransform, crossed, unit

MOST_DATUMS = 3

_CLEARLY = 1e-6
"""Relative, and mm^2 at least, margin by which a choice of senses must be better than another."""


@dataclass(frozen=True, slots=True)
class DatumMisfit:
    """Deviation of a datum from its nominal in the frame."""

    name: str
    offset: float
    """mm: of its place, in its located directions."""
    angle: float
    """rad: of its direction; zero for points."""


@dataclass(frozen=True, slots=True)
class DatumFrame:
    """A frame defined by datums."""

    T_frame_from_world: RigidTransform
    """Brings the datums to their nominals."""
    free: freedom.Freedom
    """Freedom left by the datums; the motion is an arbitrary one within it."""
    misfits: tuple[DatumMisfit, ...]
    """Of every datum, in order; zero for the first."""
    choice: int = 0
    """Chosen senses of directions without one; `datum_frame` with it reproduces the choice."""


def datum_frame(
    datums: Sequence[str],
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
    choice: int | None = None,
) -> DatumFrame:
    """Return the frame of one to three datums in order of precedence.

    Points and spheres constrain as points; lines, cylinders and circles as axes; cones and tori as
    axes with a point; ellipses, slots and rectangles as axes with a direction across; planes as
    planes. A cone's point is at its nominal radius. The depth of a circle or slot is that of
    probing, hence unconstrained; its centre alone (`features.measured.PartOf`) also constrains it.
    Senses of measured axes are chosen so that the datums, or if undecided all features with a
    nominal, are as close to their nominals as possible; so pass all available features.

    Parameters
    ----------
    datums
        Names, primary first.
    geometries
        Geometry vectors (12,) as measured, mm, world frame, by name.
    nominals
        Geometry vectors (12,), mm, in the frame, by name.
    choice
        That of an earlier frame of the same datums, so that small changes of the geometries do not
        reverse an axis; then only the datums are used.

    Raises
    ------
    FitError
        A datum is not measured, has no nominal, or does not determine the frame.
    """
    if not 1 <= len(datums) <= MOST_DATUMS or len(set(datums)) < len(datums):
        raise FitError(
            "alignment.datums",
            f"A datum frame needs one to {MOST_DATUMS} different datums, not "
            f"{', '.join(datums) or 'none'}.",
            "Name each datum once, the primary first.",
        )
    elements = [_element(name, geometries, shapes, nominals) for name in datums]
    if choice is not None:
        held = next(islice(_ways(freedom.AlignedMotion.free(), elements), choice, None))
        return _frame_of(held, elements, choice)
    return _likeliest(_frames(elements), geometries, shapes, nominals)


def frames_of_datums(
    datums: Sequence[str],
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
) -> list[DatumFrame]:
    """Return the frames for both senses of every direction without one; see `datum_frame`."""
    return _frames([_element(name, geometries, shapes, nominals) for name in datums])


def freedoms_left(
    datums: Sequence[str], shapes: Mapping[str, Shape], nominals: Mapping[str, Float]
) -> tuple[int, ...]:
    """Return freedoms before the first and after each datum; FitError: no nominal, weak datum."""
    elements = [_element(name, nominals, shapes, nominals) for name in datums]
    cuts = (elements[:count] for count in range(len(elements) + 1))
    return tuple(next(_ways(freedom.AlignedMotion.free(), cut)).freedom.count for cut in cuts)


def _frames(elements: Sequence[_Element]) -> list[DatumFrame]:
    ways = _ways(freedom.AlignedMotion.free(), elements)
    return [_frame_of(held, elements, place) for place, held in enumerate(ways)]


@dataclass(frozen=True, slots=True)
class _Element:
    """A datum as measured (world) and nominal (frame)."""

    name: str
    shape: Shape
    measured: Float
    nominal: Float
    rows: Float


def _element(
    name: str,
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
) -> _Element:
    if name not in geometries:
        raise FitError(
            "alignment.datum",
            f"The part frame needs {name}, which is not measured.",
            f"Measure {name}.",
        )
    if name not in nominals:
        raise FitError(
            "alignment.no_nominal",
            f"The part frame needs the nominal geometry of {name}, which is unknown.",
            f"Give {name} a nominal point and direction.",
        )
    measured, nominal = geometries[name].copy(), nominals[name].copy()
    shape = shapes[name]
    if shape is Shape.CONE:
        measured[POINT] = gauge_point(measured, float(nominal[RADIUS]))
    if shape.spec.has_direction:
        for geometry in (measured, nominal):
            geometry[DIRECTION] = unit(geometry[DIRECTION])
    return _Element(name, shape, measured, nominal, _rows(shape, nominal))


def _ways(
    held: freedom.AlignedMotion, elements: Sequence[_Element]
) -> Iterator[freedom.AlignedMotion]:
    """Yield the poses for both senses of every direction without one."""
    if not elements:
        yield held
        return
    element = elements[0]
    both = (1.0,) if element.shape.spec.has_sense else (1.0, -1.0)
    senses = both if element.shape.spec.has_direction else ()
    for turned in _turns(held, element, DIRECTION, senses):
        measured, nominal = element.measured[POINT], element.nominal[POINT]
        placed = freedom.move_to(turned, measured, nominal, element.rows, element.name)
        ends = (1.0, -1.0) if element.shape.spec.has_across else ()
        for met in _turns(placed, element, ACROSS, ends):
            yield from _ways(met, elements[1:])


def _turns(
    held: freedom.AlignedMotion, element: _Element, part: slice, senses: Sequence[float]
) -> Iterator[freedom.AlignedMotion]:
    """Yield ``held`` turned to a datum's direction in each sense, or unchanged if none turns."""
    for sense in senses:
        measured, nominal = element.measured[part], element.nominal[part]
        turned = freedom.turn_to(held, measured, nominal, sense, element.name)
        if turned is held:
            break
        yield turned
    else:
        if senses:
            return
    yield held


def _frame_of(held: freedom.AlignedMotion, elements: Sequence[_Element], choice: int) -> DatumFrame:
    misfits = tuple(_misfit(element, held.T_frame_from_world) for element in elements)
    return DatumFrame(held.T_frame_from_world, held.freedom, misfits, choice)


def _likeliest(
    frames: Sequence[DatumFrame],
    geometries: Mapping[str, Float],
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
) -> DatumFrame:
    """Return the frame with the best match of the datums, or if undecided of all features."""
    squares = [
        sum(item.offset**2 + (freedom.LEVER_MM * item.angle) ** 2 for item in frame.misfits)
        for frame in frames
    ]
    limit = min(squares) + _CLEARLY * (1.0 + min(squares))
    level = [frame for frame, square in zip(frames, squares, strict=True) if square <= limit]
    best = level[0]
    for frame in level[1:]:
        least, here = (
            freedom.misfit_of_all(item.T_frame_from_world, item.free, geometries, shapes, nominals)
            for item in (best, frame)
        )
        if here < least - _CLEARLY * (1.0 + least):
            best = frame
    return best


def _rows(shape: Shape, nominal: Float) -> Float:
    """Return the located directions of a datum, (m, 3), frame."""
    direction = nominal[DIRECTION]
    match shape.spec.located:
        case "along":
            return direction[None]
        case "everywhere":
            return np.eye(3)
        case "across":
            return freedom.square_pair(direction)


def _misfit(element: _Element, T_frame_from_world: RigidTransform) -> DatumMisfit:
    off = T_frame_from_world.apply(element.measured[POINT]) - element.nominal[POINT]
    angle = 0.0
    if element.shape.spec.has_direction:
        direction = T_frame_from_world.rotation @ element.measured[DIRECTION]
        angle = _angle(direction, element.nominal[DIRECTION], element.shape)
    return DatumMisfit(element.name, float(np.linalg.norm(element.rows @ off)), angle)


def _angle(direction: Float, nominal: Float, shape: Shape) -> float:
    cosine = float(direction @ nominal)
    if not shape.spec.has_sense:
        cosine = abs(cosine)
    return float(np.arctan2(np.linalg.norm(crossed(direction, nominal)), cosine))
