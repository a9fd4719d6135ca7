"""Which places on a surface become targets: far from each other, and all within reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ocmm_core.geometry import Float
from ocmm_core.inspection.reach import Reach, Reached
from ocmm_core.inspection.step import _place_kernel as kernel
from ocmm_core.inspection.step._answer import StepFace

WANTED, LEAST = 20, 10
"""Places of a free form: they tell nothing of each other, so there are more of them."""
_TRIED = 1, 2, 5
"""So many times the targets are tried before a surface is given up."""
_WIDEST_GAP_DEG = 215.0
"""A round surface whose targets leave more of the turn free would be measured from one side."""


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Targets of a surface.

    Attributes
    ----------
    points
        (n, 3), mm.
    held
        (n, 3): rotation vector, rad, part from probe; (0, 3) where no attitude was asked for.
    ways
        (n,), mm: free along the normal; (0,) where nothing was asked.
    against
        Why these are not enough; empty where they are.
    """

    points: Float
    held: Float
    ways: Float
    against: str = ""


def placed(
    face: StepFace, order: Float, wanted: int, least: int, own: Sequence[int], reach: Reach | None
) -> Placed:
    """Return up to ``wanted`` of the free places of a surface as targets.

    Parameters
    ----------
    order
        (n, 3), mm: where a ball has room, see `in_order`.
    least
        With fewer a surface cannot be measured.
    own
        Its faces in the mesh, from 0.
    reach
        None where nothing is asked.
    """
    nobody = np.empty((0, 3))
    if reach is None:
        return Placed(order[:wanted], nobody, np.empty(0))
    axis = bore_axis(face)
    tried = 0
    found: list[tuple[Float, Reached]] = []
    good = 0
    for times in _TRIED:
        until = times * wanted
        more = order[tried:until]
        tried = until
        if len(more):
            found.append((more, reach.of(more, normals_of(face, more), list(own), axis)))
            good += int((found[-1][1].stage == 0).sum())
        # Where half of the turn is out of reach, none of the first may be in the other half.
        if good >= wanted or (times == _TRIED[1] and not 0 < good < least):
            break
    points = np.concatenate([one for one, _ in found])
    every = Reached(*(
        np.concatenate([getattr(one, name) for _, one in found])
        for name in ("stage", "face", "turns_part_from_probe", "ways_mm", "leds")
    ))  # fmt: skip
    return taken_of(face, points, every, wanted, least, reach.why_not(every))


def taken_of(
    face: StepFace, points: Float, reached: Reached, wanted: int, least: int, why: str
) -> Placed:
    """Return up to ``wanted`` of the places that were asked for and can be touched.

    Parameters
    ----------
    points
        (n, 3), mm.
    reached
        What became of each.
    least
        With fewer a surface cannot be measured.
    why
        What most often stands against those that cannot.
    """
    nobody = np.empty((0, 3))
    can = np.flatnonzero(reached.stage == 0)
    if len(can) < least:
        return Placed(nobody, nobody, np.empty(0), why)
    gap = _gap_deg(face, points[can])
    if gap > _WIDEST_GAP_DEG:
        against = f"only {360.0 - gap:.0f} degrees of its turn can be reached"
        return Placed(nobody, nobody, np.empty(0), f"{against}; beyond, {why}" if why else against)
    taken = can[spread_rows(points[can], wanted)]
    held = reached.turns_part_from_probe[taken]
    vectors = nobody
    if np.isfinite(held).all():
        vectors = Rotation.from_matrix(held).as_rotvec()
    return Placed(points[taken], vectors, reached.ways_mm[taken])


def reached_places(points: Float, reached: Reached) -> tuple[NDArray[np.int64], Float]:
    """Return which places of a free form become targets, and how the probe is held there.

    None do where fewer than `LEAST` can be touched. The second is (n, 3) as `Placed.held`.
    """
    can = np.flatnonzero(reached.stage == 0)
    nobody = np.empty((0, 3))
    if len(can) < LEAST:
        return can[:0], nobody
    can = can[spread_rows(points[can], WANTED)]
    held = reached.turns_part_from_probe[can]
    return can, Rotation.from_matrix(held).as_rotvec() if np.isfinite(held).all() else nobody


def bore_axis(face: StepFace) -> Float | None:
    """Return the axis of a surface into which the probe is held along, (3,); None for others."""
    is_bore = face.inner and face.shape in ("Cylinder", "Cone")
    return np.array(face.direction) if is_bore else None


def in_order(free: Float, wanted: int) -> Float:
    """Return as many of the free places as are tried for so many targets, the first ones first."""
    return spread(free, _TRIED[-1] * wanted)


def spread(places: Float, count: int) -> Float:
    """Return some of the places, each as far as can be from those before it."""
    return places[spread_rows(places, count)]


def spread_rows(places: Float, count: int) -> list[int]:
    """Return which of the places `spread` takes, in its order."""
    rows = np.zeros(count, dtype=np.int64)
    taken: list[int] = rows[: kernel.spread(np.ascontiguousarray(places), rows)].tolist()
    return taken


def normals_of(face: StepFace, points: Float) -> Float:
    """Return the normals out of the material (n, 3) of a surface at points on it (n, 3), mm."""
    direction = np.array(face.direction)
    if face.shape == "Plane":
        return np.tile(direction, (len(points), 1))
    arms = points - np.array(face.point)
    across = arms - (arms @ direction)[:, None] * direction
    if face.shape == "Cone":
        # The axis leads from the tip into the cone: outwards is across, and back by the angle.
        round_it = across / _lengths(across)
        arms = np.cos(face.half_angle) * round_it - np.sin(face.half_angle) * direction
    elif face.shape == "Cylinder":
        arms = across
    elif face.shape == "Torus":
        arms = arms - face.radius * across / _lengths(across)
    normals: Float = arms / _lengths(arms)
    return -normals if face.inner else normals


def _lengths(rows: Float) -> Float:
    found: Float = np.sqrt((rows * rows).sum(axis=1))[:, None]
    return found


def _gap_deg(face: StepFace, points: Float) -> float:
    """Return the widest part of the turn about the axis without a point, degrees; 0 for others."""
    if face.shape not in ("Cylinder", "Cone", "Torus"):
        return 0.0
    gaps = kernel.gaps_about(np.array(face.point), np.array(face.direction), points)
    return float(np.degrees(gaps.max()))
