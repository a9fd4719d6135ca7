"""Positions of artefacts and points, all of one kind before the first point."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations, product

import msgspec
import numpy as np

from ocmm_core.acceptance import _procedure as procedure
from ocmm_core.acceptance._result import PlannedPosition
from ocmm_core.acceptance._situation import Stage, stand_at
from ocmm_core.calibration.verification import plan_lines
from ocmm_core.camera import Vector3
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3, perpendicular_pair, triple, unit

_UP = np.array([0.0, 0.0, 1.0])
_INSIDE = 0.98
_CLEAR_MM = 25.0
"""Clearance of objects from the faces of the volume."""

Planned = tuple[list[PlannedPosition], list[str]]


def vectors(values: Iterable[Float]) -> tuple[Vector3, ...]:
    """Return points in record form."""
    return tuple(triple(one) for one in values)


def plan_length(stage: Stage, numbers: procedure.LengthTest) -> Planned:
    """Plan the lines of a bar by set cover; CalibrationError: too few nests, unsuitable length."""
    bar = stage.only("bar")
    if len(bar.sizes) < numbers.lengths + 1:
        raise CalibrationError(
            "acceptance.nests",
            f"'{bar.use.name}' has {len(bar.sizes)} nests; {numbers.lengths + 1} are needed for "
            f"{numbers.lengths} test lengths on a line.",
            "Use a bar with more nests.",
        )
    length = bar.sizes[-1] - bar.sizes[0]
    diagonal = float(np.linalg.norm(np.ptp(stage.volume, axis=0)))
    if length < 0.95 * numbers.diagonal_share * diagonal:
        raise CalibrationError(
            "acceptance.bar_short",
            f"'{bar.use.name}' is {length:.0f} mm long; {numbers.diagonal_share * diagonal:.0f} mm "
            "are needed in this volume.",
            "Use a longer bar, or calibrate a smaller volume.",
        )
    planning = plan_lines(stage.volume, length)
    positions = [
        _bar(one.name, one.ends_world, bar.sizes, corners=one.corners) for one in planning.lines
    ]
    return positions, list(planning.notes)


def _bar(
    name: str,
    ends: Float,
    nests: Sequence[float],
    *,
    corners: tuple[int, ...] = (),
    repeats: int = 1,
    items: tuple[int, ...] = (),
) -> PlannedPosition:
    along, first = unit(ends[1] - ends[0]), np.asarray(ends[0])
    points = [first + (nest - nests[0]) * along for nest in nests]
    return PlannedPosition(
        name=name, role="bar", points_world=vectors(points), corners=corners, repeats=repeats,
        items=items or tuple(range(1, len(nests))),
    )  # fmt: skip


def plan_sphere(stage: Stage, numbers: procedure.SphereTest) -> Planned:
    """Plan rings of points on a sphere at every place."""
    return [_sphere(stage, place, place, numbers.rings) for place in numbers.places], []


def plan_diameter(stage: Stage, numbers: procedure.DiameterTest) -> Planned:
    """Plan nine points on a sphere in the middle, repeated."""
    return [
        _sphere(stage, "middle third", f"repeat {one + 1}", numbers.rings)
        for one in range(numbers.repeats)
    ], []


def plan_ball(stage: Stage, numbers: procedure.BallTest) -> Planned:
    """Plan repeated measurements of a ball in the middle."""
    rings = ((0.0, 1, 0.0), (45.0, 3, 0.0), (90.0, max(numbers.points - 4, 3), 20.0))
    return [
        _sphere(stage, "middle third", f"measurement {one + 1}", rings)
        for one in range(numbers.repeats)
    ], []


def _sphere(
    stage: Stage, place: str, name: str, rings: Sequence[tuple[float, int, float]]
) -> PlannedPosition:
    reach = 0.5 * stage.only("sphere").sizes[0] + stage.instrument.ball_radius
    centre = stand_at(place, stage, reach + _CLEAR_MM)
    normals = ring_directions(rings, _UP)
    return PlannedPosition(
        name=name, role="sphere", points_world=vectors(centre + reach * normals),
        normals=vectors(normals), place=place,
    )  # fmt: skip


def ring_directions(rings: Sequence[tuple[float, int, float]], pole: Float) -> Points3:
    """Return the directions (n, 3) of rings of points about a pole (3,)."""
    first, second = perpendicular_pair(pole)
    found = []
    for polar, count, turn in rings:
        p = np.radians(polar)
        for azimuth in np.radians(turn + 360.0 * np.arange(count) / count):
            across = np.cos(azimuth) * first + np.sin(azimuth) * second
            found.append(np.sin(p) * across + np.cos(p) * pole)
    return np.array(found)


def plan_location(stage: Stage, numbers: procedure.LocationTest) -> Planned:
    """Plan five probe attitudes on a sphere, each with the pole and four points."""
    reach = 0.5 * stage.only("sphere").sizes[0] + stage.instrument.ball_radius
    positions = []
    lean = np.radians(numbers.lean_deg)
    back = unit(np.array(stage.instrument.away))
    right = unit(np.cross(back, _UP)) if abs(back @ _UP) < 0.9 else np.array([1.0, 0.0, 0.0])
    back = np.cross(_UP, right)
    for place in numbers.places:
        centre = stand_at(place, stage, reach + _CLEAR_MM)
        for name, side in (
            ("upright", 0.0 * right), ("leaning right", right), ("leaning left", -right),
            ("leaning away", back), ("leaning near", -back),
        ):  # fmt: skip
            handle = unit(np.cos(lean) * _UP + np.sin(lean) * side)
            normals = ring_directions(((0.0, 1, 0.0), (90.0, 4, 0.0)), handle)
            positions.append(
                PlannedPosition(
                    name=f"{place}, {name}",
                    role="sphere",
                    place=place,
                    handle=triple(handle),
                    points_world=vectors(centre + reach * normals),
                    normals=vectors(normals),
                )
            )
    return positions, []


def plan_spat(stage: Stage, numbers: procedure.SpatTest) -> Planned:
    """Plan a cone in three places; the same point with the probe turned."""
    return [
        PlannedPosition(
            name=place,
            role="cone",
            place=place,
            points_world=vectors([stand_at(place, stage, _CLEAR_MM)] * numbers.points),
        )
        for place in numbers.places
    ], []


def plan_e0(stage: Stage, numbers: procedure.E0Test) -> Planned:
    """Plan four space diagonals and three more directions; CalibrationError: unsuitable bar."""
    bar, volume = stage.only("bar"), stage.volume
    length, extent = bar.sizes[-1] - bar.sizes[0], np.ptp(volume, axis=0)
    if len(bar.sizes) < numbers.lengths + 1:
        raise CalibrationError(
            "acceptance.nests",
            f"'{bar.use.name}' has {len(bar.sizes)} nests; {numbers.lengths + 1} are needed.",
            "Use a bar with more nests.",
        )
    diagonal = float(np.linalg.norm(extent))
    if not numbers.line_share * diagonal <= length <= _INSIDE * diagonal:
        raise CalibrationError(
            "acceptance.bar_short",
            f"'{bar.use.name}' is {length:.0f} mm long; a space diagonal of {diagonal:.0f} mm "
            f"needs {numbers.line_share * diagonal:.0f} to {_INSIDE * diagonal:.0f} mm.",
            "Use another bar.",
        )
    chosen = [
        (f"space diagonal {number + 1}", unit(extent * np.array([1.0, *signs])))
        for number, signs in enumerate(product((1.0, -1.0), repeat=2))
    ]
    notes = []
    for axis, name in zip(np.eye(3), "XYZ", strict=True):
        if length <= _INSIDE * extent[int(np.argmax(axis))]:
            chosen.append((f"along {name}", axis))
        else:
            notes.append(f"A bar of {length:.0f} mm does not fit along {name}.")
    others = [(f"leaning {number + 1}", one) for number, one in enumerate(_leaning(extent, length))]
    while len(chosen) < numbers.positions:
        best = max(others, key=lambda one: newness(one[1], [d for _, d in chosen]), default=None)
        if best is None or newness(best[1], [d for _, d in chosen]) < np.radians(numbers.angle_deg):
            raise CalibrationError(
                "acceptance.directions",
                f"'{bar.use.name}' lies in {len(chosen)} directions only; {numbers.positions} are "
                "needed.",
                "Use a shorter bar.",
            )
        chosen.append(best)
    middle = volume.mean(axis=0)
    positions = [
        _bar(
            name,
            np.stack([middle - 0.5 * length * d, middle + 0.5 * length * d]),
            bar.sizes[: numbers.lengths] + bar.sizes[-1:],
            repeats=numbers.repeats,
        )
        for name, d in chosen[: numbers.positions]
    ]
    return positions, notes


def plan_e0_blocks(stage: Stage, numbers: procedure.E0BlockTest) -> Planned:
    """Plan E0 and upright gauge blocks; CalibrationError as `plan_e0` or if too long."""
    positions, notes = plan_e0(stage, numbers)
    middle, across = stage.volume.mean(axis=0), np.array([1.0, 0.0, 0.0])
    grid = ring_directions(((90.0, max(numbers.block_points - 1, 3), 45.0),), across)
    # Points on an ellipse within the face, and its middle; the face is seen along X.
    half = 0.5 * np.array([0.0, *numbers.block_face]) * 0.7
    pattern = np.concatenate([grid * half, np.zeros((1, 3))])
    for block in stage.of_role("gauge block"):
        length = block.sizes[0]
        if length > numbers.block_largest:
            raise CalibrationError(
                "acceptance.block_long",
                f"'{block.use.name}' is {length:g} mm long; {numbers.block_largest:g} mm are "
                "allowed.",
                "Use a shorter gauge block.",
            )
        reach = (0.5 * length + stage.instrument.ball_radius) * across
        points = np.concatenate([middle - reach + pattern, middle + reach + pattern])
        positions.append(
            PlannedPosition(
                name=f"gauge block {length:g} mm",
                role="gauge block",
                points_world=vectors(points),
                items=(1,),
                repeats=numbers.block_repeats,
            )
        )
    notes.append(f"Gauge blocks: {len(pattern)} points on either face, averaged, by agreement.")
    return positions, notes


def plan_long_stylus(stage: Stage, numbers: procedure.LongStylusTest) -> Planned:
    """Plan the first diagonals with a long stylus; CalibrationError if unsuitable."""
    said = stage.instrument.stylus
    stylus = 0.0 if isinstance(said, msgspec.UnsetType) else said
    if stylus < numbers.stylus:
        raise CalibrationError(
            "acceptance.stylus_short",
            f"Tip '{stage.instrument.tip}' is {stylus:.0f} mm from the nearest LED; "
            f"'{stage.procedure.id}' is about a stylus of {numbers.stylus:g} mm or more.",
            "Mount and qualify the longest stylus that is offered.",
        )
    positions, notes = plan_e0(stage, numbers)
    return positions, [*notes, f"Stylus: {stylus:.1f} mm from the ball to the nearest LED."]


def newness(direction: Float, others: Sequence[Float]) -> float:
    """Return the smallest angle of a line to others, rad."""
    return min(float(np.arccos(min(abs(float(direction @ one)), 1.0))) for one in others)


def _leaning(extent: Float, length: float) -> Iterator[Float]:
    """Yield directions leaning from an axis in a plane, in which a bar fits."""
    for first, second in combinations(range(3), 2):
        for angle in np.radians(np.arange(5.0, 90.0, 5.0)):
            for sign in (1.0, -1.0):
                direction = np.zeros(3)
                direction[first], direction[second] = np.cos(angle), sign * np.sin(angle)
                if np.all(length * np.abs(direction) <= _INSIDE * extent):
                    yield direction


def plan_volumetric(stage: Stage, numbers: procedure.VolumetricTest) -> Planned:
    """Plan a length in every octant, level, upright, 45 degrees; CalibrationError: does not fit."""
    bar, volume = stage.only("bar"), stage.volume
    rng = np.random.default_rng([stage.seed, 11])
    extent, middle = np.ptp(volume, axis=0), volume.mean(axis=0)
    places: list[PlannedPosition] = []
    tries = 0
    while len(places) < numbers.placements:
        tries += 1
        if tries > 20_000:
            raise CalibrationError(
                "acceptance.octants",
                f"No length of '{bar.use.name}' fits into all octants of the volume.",
                "Use a bar with a shorter nest distance.",
            )
        octant = len(places) % 8
        signs = np.array([1.0 if octant & bit else -1.0 for bit in (1, 2, 4)])
        turn = rng.uniform(0.0, 2.0 * np.pi)
        word, rise = (("level", 0.0), ("upright", np.pi / 2), ("at 45°", np.pi / 4))[
            (len(places) + tries) % 3
        ]
        direction = np.array(
            [np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)]
        )
        # Alternate short and long; if too long, use a shorter length.
        order = range(1, len(bar.sizes)) if len(places) % 2 else range(len(bar.sizes) - 1, 0, -1)
        centre = middle + signs * rng.uniform(0.1, 0.25, 3) * extent
        for nest in order:
            length = bar.sizes[nest] - bar.sizes[0]
            ends = np.stack([centre - 0.5 * length * direction, centre + 0.5 * length * direction])
            if np.all(ends >= volume[0]) and np.all(ends <= volume[1]):
                name = f"placement {len(places) + 1}, {word}, {length:.0f} mm"
                nests = (bar.sizes[0], bar.sizes[nest])
                places.append(_bar(name, ends, nests, items=(nest,)))
                break
    return places, []


def plan_plate(stage: Stage, numbers: procedure.PlateTest) -> Planned:
    """Plan points on both faces of a plate in the middle of the volume."""
    plate = stage.only("plate")
    middle, half = stage.volume.mean(axis=0), 0.5 * np.array([*numbers.size, 0.0])
    across = max(int(np.ceil(np.sqrt(numbers.points))), 2)
    grid = np.array(list(product(np.linspace(-1.0, 1.0, across), repeat=2)))[: numbers.points]
    flat = np.column_stack([grid, np.zeros(len(grid))]) * half
    radius = stage.instrument.ball_radius
    top = middle + flat + np.array([0.0, 0.0, plate.sizes[0] + radius])
    bottom = middle + 1.5 * flat + np.array([0.0, 0.0, radius])
    return [
        PlannedPosition(name="bed", role="plate", points_world=vectors(bottom)),
        PlannedPosition(name="top of the block", role="plate", points_world=vectors(top)),
    ], []


def plan_interim(stage: Stage, numbers: procedure.InterimTest) -> Planned:
    """Plan five points on each sphere of a short bar."""
    first, second, distance = stage.only("dumbbell").sizes
    middle = stage.volume.mean(axis=0)
    positions = []
    for name, diameter, side in (("sphere 1", first, -0.5), ("sphere 2", second, 0.5)):
        reach = 0.5 * diameter + stage.instrument.ball_radius
        normals = ring_directions(((0.0, 1, 0.0), (90.0, numbers.points - 1, 0.0)), _UP)
        centre = middle + np.array([side * distance, 0.0, 0.0])
        positions.append(
            PlannedPosition(
                name=name,
                role="dumbbell",
                points_world=vectors(centre + reach * normals),
                normals=vectors(normals),
            )
        )
    return positions, []
