"""What is known of one characteristic before anything is said about its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows


@dataclass(frozen=True, slots=True)
class FormNoise:
    """The deviations whose range a value is, and what the noise of the points does to them.

    Attributes
    ----------
    deviations
        (m,), mm: the value is the greatest less the smallest. Where the zone has a fixed middle
        they are the distances from it and their opposites.
    by_coordinates
        m rows: how they answer to the ball centres and the ball; what the least-squares
        element absorbs is left out.
    free
        (m, k): how they answer to the k parameters over which the zone is made smallest; k is zero
        where the zone is not.
    mirrored
        The second half of the rows is the opposite of the first.
    """

    deviations: Float
    by_coordinates: Rows
    free: Float
    mirrored: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """The deviations of touched places that a value is made of.

    Attributes
    ----------
    features, numbers
        (n,): name of the feature and number of the point of each.
    points
        (n, 3), mm, world: on the touched surface.
    outward
        (n, 3), unit, world: out of the material.
    deviations
        (n,), mm, from the middle of the zone; positive where there is too much material.
    """

    features: tuple[str, ...]
    numbers: tuple[int, ...]
    points: Float
    outward: Float
    deviations: Float


@dataclass(frozen=True, slots=True)
class Ranked:
    """The sizes among which a value is the greatest or the smallest.

    Attributes
    ----------
    sizes
        (m,), mm: the foremost of all, the value first.
    gradients
        m rows: how they answer to the ball centres and the ball.
    greatest
        The value is the greatest of them; else the smallest.
    """

    sizes: Float
    gradients: Rows
    greatest: bool


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Value of a characteristic and how it answers to every point.

    Attributes
    ----------
    value
        mm, or deg for an angle.
    gradient
        One row: d(value) / d(ball centres, tip radius).
    components, component_gradients
        (k,) and k rows, where the value is the length of a vector (position, coaxiality,
        the orientation of an axis): ``value`` is the norm of ``components``. Near zero that has no
        linear uncertainty: noise of u in each component gives a value like u even where the truth
        is zero. Its distribution follows from components + normal noise with the covariance
        of these rows. None where the value is linear.
    association
        How the element was associated with the points, in the words of the report.
    frame
        Which frame or datums the value refers to; empty where it refers to none.
    bonus, bonus_gradient
        mm: what a modifier of material adds to the upper limit, and how it answers to the points;
        what is decided about is ``value - bonus`` against the limit. None without a bonus.
    noise
        Where the value is the range of the deviations of many points, which is never below what
        noise alone shows (`tolerances.floor.noise_floor`); else None.
    ranked
        Where the value is a size by its rank among others, which noise moves to one side.
    note
        What to know about the value; may be empty.
    seen
        The deviations of the touched places, for pictures; None where there are none.
    """

    value: float
    gradient: Rows
    components: Float | None = None
    component_gradients: Rows | None = None
    association: str = ""
    frame: str = ""
    bonus: float = 0.0
    bonus_gradient: Rows | None = None
    noise: FormNoise | None = None
    ranked: Ranked | None = None
    note: str = ""
    seen: Seen | None = None

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
