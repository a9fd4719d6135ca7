"""Which places on a surface become targets: far from each other, and all within reach."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ocmm_core.geometry import Float
from ocmm_core.inspection.reach import Places, Reach, Reached
from ocmm_core.inspection.step import _place_kernel as kernel
from ocmm_core.inspection.step.brep import StepFace, normals_of

WANTED, LEAST = 20, 10
"""Places of a free form: they tell nothing of each other, so there are more of them."""
_TRIED, _GIVEN_UP = (1, 2, 5), 1
"""So many times the targets are tried; after the second of them one without any is given up."""
_WIDEST_GAP_DEG = 215.0
"""A round surface whose targets leave more of the turn free would be measured from one side."""


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Targets of a surface."""

    points: Float
    """(n, 3), mm."""
    held: Float
    """(n, 3): rotation vector, rad, part from probe; (0, 3) where no attitude was asked for."""
    ways: Float
    """(n,), mm: free along the normal; (0,) where nothing was asked."""
    against: str = ""
    """Why these are not enough; empty where they are."""


@dataclass(slots=True, eq=False)
class Wish:
    """A surface that wants targets."""

    face: StepFace
    order: Float
    """(n, 3), mm: where a ball has room, see `in_order`; n > 0."""
    wanted: int
    least: int
    """`wanted`, `least`: So many targets, and with fewer it cannot be measured."""
    own: Sequence[int]
    """Its faces in the mesh, from 0."""
    _found: list[tuple[Float, Reached]] = field(default_factory=list)
    _good: int = 0

    def asks(self, turn: int) -> Places | None:
        """Return the places that are tried next; None where it has enough, or gives up."""
        if self._good >= self.wanted:
            return None
        # Where half of the turn is out of reach, none of the first may be in the other half.
        if turn > _GIVEN_UP and not 0 < self._good < self.least:
            return None
        tried = _TRIED[turn - 1] * self.wanted if turn else 0
        more = self.order[tried : _TRIED[turn] * self.wanted]
        if not len(more):
            return None
        return Places(more, normals_of(self.face, more), self.own, bore_axis(self.face))

    def note(self, places: Places, reached: Reached) -> None:
        """Take what became of the places that were tried."""
        self._found.append((places.points, reached))
        self._good += int(np.count_nonzero(reached.stage == 0))

    def placed(self, reach: Reach) -> Placed:
        """Return targets among all places that were tried."""
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
    """Return targets of surfaces, all asked for at once.

    Parameters
    ----------
    reach
        None where nothing is asked.
    """
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
    """Return up to ``wanted`` of the places that were asked for and can be touched.

    Parameters
    ----------
    points
        (n, 3), mm.
    reached
        What became of each.
    least
        With fewer a surface cannot be measured.
    why_not
        Says what most often stands against those that cannot.
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


def _gap_deg(face: StepFace, points: Float) -> float:
    """Return the widest part of the turn about the axis without a point, degrees; 0 for others."""
    if face.shape not in ("Cylinder", "Cone", "Torus"):
        return 0.0
    gaps = kernel.gaps_about(np.array(face.point), np.array(face.direction), points)
    return float(np.degrees(gaps.max()))
