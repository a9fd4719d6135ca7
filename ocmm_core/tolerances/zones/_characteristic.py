"""Toleranced characteristics of a plan, and their values before the uncertainty.

Recommended numbers of points for form: BS 7172, NPL guide 41.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import msgspec

from ocmm_core.camera import Vector3
from ocmm_core.geometry import Float
from ocmm_core.measuring import DeviationRows, Rows
from ocmm_core.part_model import NominalFace

if TYPE_CHECKING:
    # Loads what computes; the Start page reads the words of this file.
    from ocmm_core.features.measured import ActualFeature

Association = Literal[
    "",
    "least squares",
    "minimum zone",
    "inscribed",
    "circumscribed",
    "two-point maximum",
    "two-point minimum",
    "two-point mean",
]

TWO_POINT: tuple[Association, ...] = ("two-point maximum", "two-point minimum", "two-point mean")
"""Associations of local sizes between opposite points, by rank."""


class Characteristic(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One toleranced quantity."""

    name: str
    kind: str
    """One of `kinds.KINDS`; see docs/quality/characteristics.md."""
    features: list[str]
    upper: float
    nominal: float = 0.0
    lower: float = 0.0
    """`nominal`, `lower`, `upper`: mm or deg; a geometrical tolerance t has only ``upper`` = t."""
    limits: Literal["set", "proposed"] = "set"
    """``"proposed"``: the program chose the limits; not valid until a person sets them."""
    axis: Literal["", "x", "y", "z"] = ""
    """In the part frame: of a coordinate or distance; across a zone of two planes."""
    datums: list[str] = msgspec.field(default_factory=list)
    """Datum features in order of precedence."""
    association: Association = ""
    """Association of size or form with the points; empty is the feature's own criterion for sizes,
    minimum zone for form (ISO 1101). Letters of ISO 14405-1: GG least squares, GC minimum zone, GX
    inscribed, GN circumscribed, LP two-point. A distance of two opposite faces with it is a
    two-point size."""
    zone: Literal["", "planes", "cylinder", "sphere"] = ""
    """Of position, orientation; "": planes for a face, sphere for a point, else cylinder."""
    modifier: Literal["", "maximum material", "least material"] = ""
    """Widens the tolerance of a position by the departure of the size from its material limit."""
    material_size: float = 0.0
    """mm: limit of maximum or least material, see ``modifier``."""
    length: float = 0.0
    """mm: toleranced length of an axis; zero: the probed length."""
    offset: float = 0.0
    """mm: offset of a profile's zone from the nominal surface (UZ); negative into the material."""
    at: float = 0.0
    """mm: distance from the datum plane, along its normal, of the diameter of a cone."""
    cut: Vector3 = (0.0, 0.0, 0.0)
    cut_at: Vector3 = (0.0, 0.0, 0.0)
    within: float = 0.5
    """`cut`, `cut_at`, `within`: Normal and point, frame of the nominals, of a plane that cuts the
    features of a profile, and the distance from it, mm, up to which points count; `cut` zero: all
    points."""
    faces: tuple[NominalFace, ...] = ()
    """Faces that ball centres are compared with; default: the nominal surface of each feature."""


def points_note(features: Sequence[ActualFeature], *, of_form: bool) -> str:
    """Return a note on too few points, or nothing.

    Form from fewer points than recommended misses most of it; other quantities then do not reveal
    form at all. With ``of_form`` the measurand is the form of the surface.
    """
    few = [
        feature
        for feature in features
        if feature.touches is not None
        and len(feature.numbers) < feature.fit.shape.spec.recommended_points
    ]
    if not few:
        return ""
    gaps = [
        f"{feature.nominal.name} has {len(feature.numbers)} of "
        f"{feature.fit.shape.spec.recommended_points} recommended"
        for feature in few
    ]
    # One sentence each: lists would be ambiguous in other languages.
    if of_form:
        return " ".join(f"Few points: {gap}." for gap in gaps)
    return " ".join(f"Form not evaluated: {gap}." for gap in gaps)


@dataclass(frozen=True, slots=True)
class FormNoise:
    """Deviations whose range is the value, and their noise."""

    deviations: Float
    """(m,), mm: the value is their range."""
    by_coordinates: DeviationRows
    """Of the m: without the share of the least-squares element."""
    free: Float
    """(m, k): by the k parameters that minimise the zone; k = 0 without minimisation."""
    mirrored: bool = False
    """The middle of the zone is fixed: the value is the range of the m and their opposites."""


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
    across: Float | None = None
    """(3,), unit, world: normal of the plane of a section; None without one."""


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
            None if self.ranked is None else self.ranked.gradients,
        )
        found = {place for row in rows if row is not None for place in row.places.tolist()}
        if self.noise is not None:
            found.update(self.noise.by_coordinates.touched.tolist())
        return sorted(found)
