"""What is known of one characteristic before anything is said about its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows


@dataclass(frozen=True, slots=True)
class FormNoise:
    """The deviations whose range a value is, and what the noise of the points does to them."""

    deviations: Float
    """(m,), mm: the value is the greatest less the smallest. Where the zone has a fixed middle they
    are the distances from it and their opposites."""
    by_coordinates: Rows
    """m rows: how they answer to the ball centres and the ball; what the least-squares element
    absorbs is left out."""
    free: Float
    """(m, k): how they answer to the k parameters over which the zone is made smallest; k is zero
    where the zone is not."""
    mirrored: bool = False
    """The second half of the rows is the opposite of the first."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """The deviations of touched places that a value is made of."""

    features: tuple[str, ...]
    numbers: tuple[int, ...]
    """`features`, `numbers`: (n,): name of the feature and number of the point of each."""
    points: Float
    """(n, 3), mm, world: on the touched surface."""
    outward: Float
    """(n, 3), unit, world: out of the material."""
    deviations: Float
    """(n,), mm, from the middle of the zone; positive where there is too much material."""


@dataclass(frozen=True, slots=True)
class Ranked:
    """The sizes among which a value is the greatest or the smallest."""

    sizes: Float
    """(m,), mm: the foremost of all, the value first."""
    gradients: Rows
    """m rows: how they answer to the ball centres and the ball."""
    greatest: bool
    """The value is the greatest of them; else the smallest."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Value of a characteristic and how it answers to every point."""

    value: float
    """mm, or deg for an angle."""
    gradient: Rows
    """One row: d(value) / d(ball centres, tip radius)."""
    components: Float | None = None
    component_gradients: Rows | None = None
    """`components`, `component_gradients`: (k,) and k rows, where the value is the length of a
    vector (position, coaxiality, the orientation of an axis): ``value`` is the norm of
    ``components``. Near zero that has no linear uncertainty: noise of u in each component gives a
    value like u even where the truth is zero. Its distribution follows from components + normal
    noise with the covariance of these rows. None where the value is linear."""
    association: str = ""
    """How the element was associated with the points, in the words of the report."""
    frame: str = ""
    """Which frame or datums the value refers to; empty where it refers to none."""
    bonus: float = 0.0
    bonus_gradient: Rows | None = None
    """`bonus`, `bonus_gradient`: mm: what a modifier of material adds to the upper limit, and how
    it answers to the points; what is decided about is ``value - bonus`` against the limit. None
    without a bonus."""
    noise: FormNoise | None = None
    """Where the value is the range of the deviations of many points, which is never below what
    noise alone shows (`tolerances.floor.noise_floor`); else None."""
    ranked: Ranked | None = None
    """Where the value is a size by its rank among others, which noise moves to one side."""
    note: str = ""
    """What to know about the value; may be empty."""
    seen: Seen | None = None
    """The deviations of the touched places, for pictures; None where there are none."""

    @property
    def places(self) -> list[int]:
        """Return the places of the points that the value answers to, in any way, ascending."""
        rows = (
            self.gradient,
            self.component_gradients,
            self.bonus_gradient,
            None if self.noise is None else self.noise.by_coordinates,
            None if self.ranked is None else self.ranked.gradients,
        )
        return sorted({place for row in rows if row is not None for place in row.places.tolist()})
