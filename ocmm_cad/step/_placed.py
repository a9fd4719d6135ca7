"""Selection of targets on a surface: far apart, and all within reach."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ocmm_cad.reach import Reach, Reached, SurfaceTargets
from ocmm_cad.step import _place_kernel as kernel
from ocmm_cad.step.brep import StepFace, Triple, normals_of
from ocmm_core.geometry import Float


def triples(rows: Float) -> tuple[Triple, ...]:
    return tuple((x, y, z) for x, y, z in rows.tolist())


WANTED, LEAST = 20, 10
"""Places of a free form: independent of each other, so there are more of them."""
_TRIED, _GIVEN_UP = (1, 2, 5), 1
"""Multiples of the targets that are tried; after the second, a surface without any is given up."""
_WIDEST_GAP_DEG = 215.0
"""Gap of the targets about the axis above which a round surface would be measured from one side."""


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    points: Float
    """(n, 3), mm."""
    held: Float
    """(n, 3): rotation vector, rad, part from probe; (0, 3) if not computed."""
    ways: Float
    """(n,), mm: free along the normal; (0,) if not computed."""
    against: str = ""
    """Why these are not enough; empty if they are."""


@dataclass(slots=True, eq=False)
class Wish:
    """A surface that needs targets."""

    face: StepFace
    order: Float
    """(n, 3), mm: room for a ball, see `in_order`; n > 0."""
    wanted: int
    least: int
    """`wanted`, `least`: Number of targets, and minimum for a measurement."""
    own: Sequence[int]
    """Its faces in the mesh, from 0."""
    _found: list[tuple[Float, Reached]] = field(default_factory=list)
    _good: int = 0

    def asks(self, turn: int) -> SurfaceTargets | None:
        """Return the next places to try; None if it has enough, or gives up."""
        if self._good >= self.wanted:
            return None
        # If half of the turn is out of reach, the first places may all lie there.
        if turn > _GIVEN_UP and not 0 < self._good < self.least:
            return None
        tried = _TRIED[turn - 1] * self.wanted if turn else 0
        more = self.order[tried : _TRIED[turn] * self.wanted]
        if not len(more):
            return None
        return SurfaceTargets(more, normals_of(self.face, more), self.own, bore_axis(self.face))

    def note(self, places: SurfaceTargets, reached: Reached) -> None:
        self._found.append((places.points, reached))
        self._good += int(np.count_nonzero(reached.stage == 0))

    def placed(self, reach: Reach) -> Placed:
        """Return targets among all tried places."""
        points, every = self._found[0]
        if len(self._found) > 1:
            points = np.concatenate([one for one, _ in self._found])
            every = Reached(*(
                np.concatenate([getattr(one, name) for _, one in self._found])
                for name in ("stage", "face", "turns_part_from_probe", "ways_mm", "leds")
            ))  # fmt: skip
        return taken_of(
            self.face, points, every, self.wanted, self.least, lambda: reach.why_not(every)
        )


def placed_each(wishes: Sequence[Wish], reach: Reach | None) -> list[Placed]:
    """Return targets of surfaces, all in one query; without `reach`, unchecked."""
    if reach is None:
        nobody = np.empty((0, 3))
        return [Placed(one.order[: one.wanted], nobody, np.empty(0)) for one in wishes]
    for turn in range(len(_TRIED)):
        asking = [(one, places) for one in wishes if (places := one.asks(turn)) is not None]
        reached = reach.of_each([places for _, places in asking])
        for (one, places), found in zip(asking, reached, strict=True):
            one.note(places, found)
    return [one.placed(reach) for one in wishes]


def taken_of(
    face: StepFace,
    points: Float,
    reached: Reached,
    wanted: int,
    least: int,
    why_not: Callable[[], str],
) -> Placed:
    """Return up to ``wanted`` of the places that can be touched.

    `points`: (n, 3), mm. `least`: for a measurement. `why_not`: the most frequent obstacle.
    """
    nobody = np.empty((0, 3))
    can = np.flatnonzero(reached.stage == 0)
    if len(can) < least:
        return Placed(nobody, nobody, np.empty(0), why_not())
    gap = _gap_deg(face, points[can])
    if gap > _WIDEST_GAP_DEG:
        why = why_not()
        against = f"only {360.0 - gap:.0f} degrees of its turn can be reached"
        return Placed(nobody, nobody, np.empty(0), f"{against}; beyond, {why}" if why else against)
    taken = can[spread_rows(points[can], wanted)]
    held = reached.turns_part_from_probe[taken]
    vectors = nobody
    if np.isfinite(held).all():
        vectors = Rotation.from_matrix(held).as_rotvec()
    return Placed(points[taken], vectors, reached.ways_mm[taken])


def reached_places(points: Float, reached: Reached) -> tuple[NDArray[np.int64], Float]:
    """Return indices of a free form's targets, and `Placed.held` (n, 3); empty below `LEAST`."""
    can = np.flatnonzero(reached.stage == 0)
    nobody = np.empty((0, 3))
    if len(can) < LEAST:
        return can[:0], nobody
    can = can[spread_rows(points[can], WANTED)]
    held = reached.turns_part_from_probe[can]
    return can, Rotation.from_matrix(held).as_rotvec() if np.isfinite(held).all() else nobody


def bore_axis(face: StepFace) -> Float | None:
    """Return the axis of a bore, into which the probe is held along, (3,); None for others."""
    return np.array(face.direction) if face.inner and face.shape in ("Cylinder", "Cone") else None


def in_order(free: Float, wanted: int) -> Float:
    """Return the free places to try for a number of targets, in order."""
    return spread(free, _TRIED[-1] * wanted)


def spread(places: Float, count: int) -> Float:
    """Return some of the places, each as far as possible from the earlier ones."""
    return places[spread_rows(places, count)]


def spread_rows(places: Float, count: int) -> list[int]:
    """Return the indices of the places of `spread`, in order."""
    rows = np.zeros(count, dtype=np.int64)
    taken: list[int] = rows[: kernel.spread(np.ascontiguousarray(places), rows)].tolist()
    return taken


def _gap_deg(face: StepFace, points: Float) -> float:
    """Return the widest angular gap about the axis, degrees; 0 for shapes without axis."""
    if face.shape not in ("Cylinder", "Cone", "Torus"):
        return 0.0
    gaps = kernel.gaps_about(np.array(face.point), np.array(face.direction), points)
    return float(np.degrees(gaps.max()))
