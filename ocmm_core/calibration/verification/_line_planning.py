"""Plan bar placements with test lengths into all corners (VDI/VDE 2634 part 1).

First the fewest lines that reach all eight corners, then lines along the axes and two space
diagonals, if they fit, and the rest in the directions that differ most from all others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3, unit

N_LINES = 7
MIN_ANGLE = np.radians(10.0)
"""Lines at smaller angles are equivalent."""

MIN_OF_DIAGONAL = 2.0 / 3.0
"""Longest test length over the space diagonal of the volume."""

CORNER_SHARE = 0.10
"""An end of a test length reaches a corner within this share of each edge."""

_PLANNED_SHARE = 0.06
"""Planned closer, to leave some millimetres for manual placement."""

_INSIDE = 0.95
_LEAN = np.radians(18.0)
"""A line at a smaller angle from an axis counts as along it."""

_DIAGONALS_WANTED = 2
_BITS = np.array(list(np.ndindex(2, 2, 2)))
_AXES = ("X", "Y", "Z")
CORNER_NAMES = tuple(
    " ".join(f"{axis}{'+' if bit else '-'}" for axis, bit in zip(_AXES, bits, strict=True))
    for bits in _BITS.tolist()
)
"""Names of the corners, in the order of `corners_of`."""


@dataclass(frozen=True, slots=True)
class PlannedLine:
    """A planned placement of the bar."""

    name: str
    ends_world: Float
    """(2, 3), mm: first and last nest."""
    corners: tuple[int, ...] = ()
    """Indices of the corners that it must reach."""


@dataclass(frozen=True, slots=True)
class LinePlanning:
    lines: tuple[PlannedLine, ...]
    """In recording order."""
    notes: tuple[str, ...]
    """Guideline advice that could not be followed, and why; sentences."""


def corners_of(volume_world: Float) -> Points3:
    """Return the corners (8, 3), mm, of a volume (2, 3)."""
    corners: Points3 = np.where(_BITS, volume_world[1], volume_world[0])
    return corners


def corner_distances(points_world: Points3, volume_world: Float) -> Float:
    """Return the distances of corners from points, (n, 8), as the largest share of an edge."""
    apart = np.abs(points_world[:, None] - corners_of(volume_world)[None])
    shares: Float = (apart / np.ptp(volume_world, axis=0)).max(axis=2)
    return shares


def plan_lines(volume_world: Float, length: float) -> LinePlanning:
    """Return seven or more placements of a bar in a volume (2, 3), mm.

    CalibrationError if too short to test the volume, or too long for seven directions in it.
    """
    planning = _planned(volume_world, length)
    if planning is None:
        raise _unsuitable(volume_world, length)
    return planning


def _planned(volume_world: Float, length: float) -> LinePlanning | None:
    """Return the lines of a bar; None if it does not suit the volume."""
    extent = _INSIDE * np.ptp(volume_world, axis=0)
    if not shortest_of(volume_world) <= length <= float(np.linalg.norm(extent)):
        return None
    candidates = _corner_candidates(volume_world, length)
    chosen = _fewest(candidates) or _fewest([*candidates, *_leaning(volume_world, length)])
    if not chosen:
        return None
    notes = _corner_notes(chosen, extent, length)
    notes += _add_wanted(chosen, volume_world, length)
    free = _free_lines(volume_world, length)
    while len(chosen) < N_LINES:
        best = max(free, key=lambda one: _newness(one, chosen), default=None)
        if best is None or _newness(best, chosen) < MIN_ANGLE:
            return None
        chosen.append(best)
    return LinePlanning(tuple(_named(chosen)), tuple(notes))


def shortest_of(volume_world: Float) -> float:
    """Return the shortest bar suitable to test a volume (2, 3), mm."""
    diagonal = float(np.linalg.norm(np.ptp(volume_world, axis=0)))
    return _INSIDE**2 * MIN_OF_DIAGONAL * diagonal


def _fewest(candidates: Sequence[PlannedLine]) -> list[PlannedLine]:
    """Return the fewest lines to all corners, in diverse directions; empty if impossible."""
    most = max(len(one.corners) for one in candidates)
    best: list[PlannedLine] = []

    def search(chosen: list[PlannedLine], missing: frozenset[int]) -> None:
        nonlocal best
        if not missing:
            best = list(chosen)
            return
        if best and len(chosen) + -(-len(missing) // most) >= len(best):
            return
        # The corner reached by the fewest placements is decided first.
        able = {
            corner: [
                one
                for one in candidates
                if corner in one.corners and _newness(one, chosen) >= MIN_ANGLE
            ]
            for corner in missing
        }
        corner = min(able, key=lambda one: (len(able[one]), one))
        order = sorted(
            able[corner],
            key=lambda one: (-len(missing & set(one.corners)), -round(_newness(one, chosen), 6)),
        )
        for one in order:
            search([*chosen, one], missing - set(one.corners))
            if best and len(best) == -(-8 // most):
                return

    search([], frozenset(range(8)))
    return best


def _corner_candidates(volume_world: Float, length: float) -> list[PlannedLine]:
    middle, extent = volume_world.mean(axis=0), _INSIDE * np.ptp(volume_world, axis=0)
    inset = middle + (_BITS - 0.5) * extent
    found = []
    for a, b in combinations(range(8), 2):
        apart = inset[b] - inset[a]
        distance = float(np.linalg.norm(apart))
        if length > distance:
            continue
        name = _name_of(_BITS[b] - _BITS[a])
        centre, arm = 0.5 * (inset[a] + inset[b]), 0.5 * length * apart / distance
        both = np.stack([centre - arm, centre + arm])
        shares = corner_distances(both, volume_world)
        if max(shares[0, a], shares[1, b]) <= _PLANNED_SHARE:
            found.append(PlannedLine(name, both, (a, b)))
            continue
        for begin, along, corner in ((inset[a], arm, a), (inset[b], -arm, b)):
            found.append(PlannedLine(name, np.stack([begin, begin + 2.0 * along]), (corner,)))
    return found


def _leaning(volume_world: Float, length: float) -> Iterator[PlannedLine]:
    """Yield intermediate placements from one corner, for bars that fit in few directions."""
    middle, extent = volume_world.mean(axis=0), _INSIDE * np.ptp(volume_world, axis=0)
    for corner, bits in enumerate(_BITS):
        begin = middle + (bits - 0.5) * extent
        for direction in _half_sphere(60):
            along = length * np.abs(direction) * np.where(bits, -1.0, 1.0)
            if (np.abs(along) <= extent).all():
                ends = np.stack([begin, begin + along])
                yield PlannedLine("from corner", ends, (corner,))


def _half_sphere(count: int) -> Points3:
    """Return directions (count, 3) all over a half sphere (golden spiral)."""
    height = (np.arange(count) + 0.5) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    level = np.sqrt(1.0 - height**2)
    return np.column_stack([level * np.cos(turn), level * np.sin(turn), height])


def _add_wanted(chosen: list[PlannedLine], volume_world: Float, length: float) -> list[str]:
    """Add lines along axes and space diagonals if they fit; return notes on missing ones."""
    notes = []
    middle, extent = volume_world.mean(axis=0), _INSIDE * np.ptp(volume_world, axis=0)
    for axis, name in enumerate(_AXES):
        direction = np.eye(3)[axis]
        if any(_angle(_direction(one), direction) <= _LEAN for one in chosen):
            continue
        if length > extent[axis]:
            notes.append(
                f"No line lies along {name}: the bar ({length:.0f} mm) is longer than that edge of "
                f"the volume ({extent[axis]:.0f} mm inside)."
            )
        elif len(chosen) >= N_LINES:
            notes.append(f"No line lies along {name}: the corners need all lines.")
        else:
            arm = 0.5 * length * direction
            ends = np.stack([middle - arm, middle + arm])
            chosen.append(PlannedLine(f"along {name}", ends))
    for line in _space_diagonals(volume_world, length):
        have = sum(one.name == line.name for one in chosen)
        room = have < _DIAGONALS_WANTED and len(chosen) < N_LINES
        if room and _newness(line, chosen) > MIN_ANGLE:
            chosen.append(line)
    have = sum(one.name == "space diagonal" for one in chosen)
    if have < _DIAGONALS_WANTED:
        notes.append(
            f"{have} of {_DIAGONALS_WANTED} space diagonals: the corners and axes need the other "
            f"lines."
        )
    return notes


def _space_diagonals(volume_world: Float, length: float) -> list[PlannedLine]:
    """Return the four space diagonals, each from another corner."""
    return [
        PlannedLine("space diagonal", one.ends_world)
        for one in _corner_candidates(volume_world, length)
        if one.name == "space diagonal"
    ]


def _free_lines(volume_world: Float, length: float) -> list[PlannedLine]:
    """Return lines through the middle in directions over the half sphere that fit inside."""
    middle, extent = volume_world.mean(axis=0), _INSIDE * np.ptp(volume_world, axis=0)
    lines = _space_diagonals(volume_world, length)
    for direction in _half_sphere(400):
        if (length * np.abs(direction) <= extent).all():
            arm = 0.5 * length * direction
            lines.append(PlannedLine("across", np.stack([middle - arm, middle + arm])))
    return lines


def _corner_notes(chosen: Sequence[PlannedLine], extent: Float, length: float) -> list[str]:
    if len(chosen) <= N_LINES:
        return []
    diagonal = float(np.linalg.norm(extent))
    return [
        f"{len(chosen)} lines instead of {N_LINES}: a bar of {length:.0f} mm in a volume with a "
        f"space diagonal of {diagonal:.0f} mm reaches one corner with most placements, and all "
        f"8 corners must be reached."
    ]


def _newness(line: PlannedLine, others: Sequence[PlannedLine]) -> float:
    direction = _direction(line)
    return min((_angle(direction, _direction(one)) for one in others), default=0.5 * np.pi)


def _direction(line: PlannedLine) -> Float:
    return unit(line.ends_world[1] - line.ends_world[0])


def _angle(one: Float, other: Float) -> float:
    return float(np.arccos(min(abs(float(one @ other)), 1.0)))


def _name_of(steps: Float) -> str:
    axes = "".join(name for name, step in zip(_AXES, steps.tolist(), strict=True) if step)
    if len(axes) == 3:
        return "space diagonal"
    return f"face diagonal {axes}" if len(axes) == 2 else f"along {axes}"


def _named(lines: Sequence[PlannedLine]) -> Iterator[PlannedLine]:
    for index, line in enumerate(lines):
        kind = [one.name for one in lines]
        number = kind[: index + 1].count(line.name)
        name = f"{line.name} {number}" if kind.count(line.name) > 1 else line.name
        yield PlannedLine(name, line.ends_world, line.corners)


def _unsuitable(volume_world: Float, length: float) -> CalibrationError:
    diagonal = _INSIDE * float(np.linalg.norm(np.ptp(volume_world, axis=0)))
    shortest = shortest_of(volume_world)
    if length < shortest:
        why = "it is too short to represent the volume"
    elif length > diagonal:
        why = "it is longer than the space diagonal"
    else:
        reached = _greedily_reached(volume_world, length)
        missing = [name for i, name in enumerate(CORNER_NAMES) if i not in reached]
        why = f"it does not fit in {N_LINES} directions at least 10 degrees apart"
        if missing:
            why += f", and the corners {', '.join(missing)} stay out of reach"
    lengths = np.linspace(np.ceil(shortest), np.floor(diagonal), 12).round()
    tried = [one for one in lengths if _planned(volume_world, one)]
    return CalibrationError(
        "verification.bar",
        f"A bar of {length:.0f} mm does not suit a volume with a space diagonal of "
        f"{diagonal:.0f} mm: {why}.",
        f"Use a bar of {tried[0]:.0f} to {tried[-1]:.0f} mm."
        if tried
        else "No bar suits this volume: calibrate a volume that is less long for its width.",
    )


def _greedily_reached(volume_world: Float, length: float) -> set[int]:
    """Return the corners reached by lines in different directions, most useful first."""
    candidates = [*_corner_candidates(volume_world, length), *_leaning(volume_world, length)]
    chosen: list[PlannedLine] = []
    reached: set[int] = set()
    while True:
        able = [one for one in candidates if _newness(one, chosen) >= MIN_ANGLE]
        best = max(able, key=lambda one: len(set(one.corners) - reached), default=None)
        if best is None or not set(best.corners) - reached:
            return reached
        chosen.append(best)
        reached |= set(best.corners)
