"""Evaluation of one characteristic before its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows


@dataclass(frozen=True, slots=True)
class FormNoise:
    """Deviations whose range is the value, and their noise."""

    deviations: Float
    """(m,), mm: the value is their range; of a zone with fixed middle, distances and opposites."""
    by_coordinates: Rows
    """m rows: by ball centres and the ball, without the share of the least-squares element."""
    free: Float
    """(m, k): by the k parameters that minimise the zone; k = 0 without minimisation."""
    mirrored: bool = False
    """The second half of the rows is the opposite of the first."""


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Deviations of touched places that make up a value."""

    features: tuple[str, ...]
    numbers: tuple[int, ...]
    """`features`, `numbers`: (n,): feature name and point number of each."""
    points: Float
    """(n, 3), mm, world: on the touched surface."""
    outward: Float
    """(n, 3), unit, world: out of the material."""
    deviations: Float
    """(n,), mm, from the middle of the zone; positive for too much material."""


@dataclass(frozen=True, slots=True)
class Ranked:
    """Sizes among which a value is the greatest or the smallest."""

    sizes: Float
    """(m,), mm: the extreme ones, the value first."""
    gradients: Rows
    """m rows: derivatives by ball centres and the ball."""
    greatest: bool
    """The value is the greatest; else the smallest."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Value of a characteristic with its gradient by every point."""

    value: float
    gradient: Rows
    """One row: d(value) / d(ball centres, tip radius)."""
    components: Float | None = None
    component_gradients: Rows | None = None
    """`components`, `component_gradients`: (k,) and k rows, if the value is the length of a vector
    (position, coaxiality, orientation of an axis): ``value`` is the norm of ``components``. Near
    zero it has no linear uncertainty: noise of u in each component gives a value like u for a true
    zero. Its distribution follows from components + normal noise with the covariance of these rows.
    None for a linear value."""
    association: str = ""
    frame: str = ""
    bonus: float = 0.0
    bonus_gradient: Rows | None = None
    """`bonus`, `bonus_gradient`: mm: addition of a material modifier to the upper limit, with its
    gradient; the decision compares ``value - bonus`` with the limit. None without a bonus."""
    noise: FormNoise | None = None
    """If the value is a range of many deviations, bounded below by `noise_floor`; else None."""
    ranked: Ranked | None = None
    """If the value is a size by rank, which noise biases."""
    note: str = ""
    seen: Seen | None = None
    """Deviations of the touched places, for pictures, or None."""

    @property
    def places(self) -> list[int]:
        """Return the places of the points that the value depends on, ascending."""
        rows = (
            self.gradient,
            self.component_gradients,
            self.bonus_gradient,
            None if self.noise is None else self.noise.by_coordinates,
            None if self.ranked is None else self.ranked.gradients,
        )
        return sorted({place for row in rows if row is not None for place in row.places.tolist()})
