"""What one kind of characteristic is: all that the rest of the product asks about it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

from ocmm_core.alignment import AnyAlignment
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.tolerances.kinds._shape_groups import ALL
from ocmm_core.tolerances.zones import Characteristic, Evaluation, Frames

Fault = tuple[str, str]
"""The field of the characteristic, and what is wrong with it."""

Zone = Literal["planes", "cylinder", "sphere"]
Polygon = tuple[tuple[float, float], ...]

Evaluate = Callable[
    [Characteristic, Mapping[str, ActualFeature], AnyAlignment | None, Frames], Evaluation
]
"""Value and gradient; of the features that count, the alignment of the plan, and the frames."""

OfGeometry = Callable[
    [Characteristic, Mapping[str, Float], Mapping[str, Shape], AnyAlignment | None], float
]
"""The value, mm or deg, from geometry vectors (12,) and shapes by name."""


@dataclass(frozen=True, slots=True)
class Asked:
    """A characteristic with the plan that it stands in."""

    item: Characteristic
    shapes: Mapping[str, Shape]
    """Of all features of the plan, probed and constructed, by name."""
    nominals: Mapping[str, Float]
    """Geometry vectors (12,) of those of which they are known, part frame."""
    probed: Collection[str]
    """Names of the features that are probed."""
    aligned: bool

    @property
    def first(self) -> Shape:
        """Return the shape of the first feature."""
        return self.shapes[self.item.features[0]]

    @property
    def of_planes(self) -> bool:
        """Return whether the zone of a centre or axis is asked to be two planes."""
        return self.item.zone == "planes" and self.first is not Shape.PLANE


Check = Callable[[Asked], Fault | None]


class MonteCarlo(Enum):
    """How a value may be simulated; what the way does not fit goes through every evaluation."""

    SECOND_ORDER = "the value of the geometry of refitted elements"
    RANGE = "the range of the residuals of a least-squares element"
    VECTOR = "the length of a vector that follows the centres to first order"
    EVALUATED = "every trial is evaluated like the job"


@dataclass(frozen=True, slots=True)
class QifWords:
    """How QIF 3.0 calls a kind."""

    word: str
    """Begins the names of its elements."""
    of_shape: Mapping[Shape, str] = field(default_factory=dict)
    """Where the first feature's shape has a word of its own."""
    of_one: str = ""
    """Where it names one feature alone; empty if that makes no difference."""
    has_modifier: bool = False
    planes: str = "NonDiametricalZone"
    """Word for a zone of two planes."""


@dataclass(frozen=True, slots=True)
class Symbol:
    """Strokes of a symbol (ISO 1101, ISO 7083) in a box of one by one, y downwards."""

    lines: tuple[Polygon, ...] = ()
    """Corners of open polygons."""
    circles: tuple[tuple[float, float, float], ...] = ()
    """Centre and radius."""
    bow: Literal["", "open", "closed"] = ""
    """Half a circle open at the bottom; ``"closed"`` with the line below."""


def no_association(asked: Asked) -> Fault | None:
    """Refuse every association."""
    return "association", "goes with sizes, distances of faces and form only"


def never(item: Characteristic) -> bool:
    """Return that a value does not refer to the part frame."""
    return False


def needs_no_sense(item: Characteristic, alignment: AnyAlignment | None) -> bool:
    """Return that a value needs no direction of the plan to tell its side."""
    return False


@dataclass(frozen=True, slots=True, kw_only=True)
class KindSpec:
    """One kind of characteristic."""

    name: str
    words: str
    """What the screen calls it."""
    unit: Literal["mm", "deg"]
    one_sided: bool
    """The value is the width of a zone: never negative, with an upper limit only."""
    evaluate: Evaluate
    """Computes value and gradient."""
    geometry: OfGeometry | None
    """The value from geometry alone; None where it takes points or the frame of datums."""
    monte_carlo: MonteCarlo
    """The way in which trials may be computed quickly."""
    qif: QifWords
    symbol: Symbol | None
    """On drawings; None where it is written as a word."""
    shapes: tuple[Shape, ...]
    """That its features may have."""
    features: tuple[int, int] = (1, 1)
    datums: tuple[int, int] = (0, 0)
    """`features`, `datums`: Least and greatest number of them."""
    datum_shapes: tuple[Shape, ...] = ALL
    """That its first datum may have."""
    takes: frozenset[Literal["axis", "at", "faces", "length", "modifier", "offset"]] = frozenset()
    """Fields that go with it besides those of all kinds."""
    zones: tuple[Zone, ...] = ()
    """That may be asked for; empty where the kind leaves no choice."""
    zone_of: Callable[[Characteristic | None, Shape | None, tuple[Shape, ...]], Zone] | None = None
    """The zone that counted, of the characteristic of the plan (None if it is not known), the shape
    of the first feature (None if it is not known) and those of the datums; None where the zone has
    one shape only, or there is none."""
    association_fault: Check = no_association
    """What is wrong with an association that was given."""
    checks: tuple[Check, ...] = ()
    """What else must hold; asked after all that is common to the kinds."""
    in_part: Callable[[Characteristic], bool] = never
    """Whether the value refers to the part frame of the plan's alignment."""
    needs_sense: Callable[[Characteristic, AnyAlignment | None], bool] = needs_no_sense
    """Whether the part frame is needed to tell on which side the value is."""
    datums_make_frame: bool = False
    """The datums hold a frame in their precedence, in which the nominal places count."""
    own_form: bool = False
    """The form of the surface is what is measured, so that it is no uncertainty."""
    form_alone: bool = False
    """The form deviation of one feature by itself: none on a perfect part."""
    probed: Literal["", "faces", "all"] = ""
    """Which of its features must have points of their own."""
    folds: bool = False
    """The value is an absolute one: near zero it does not follow the points in a straight line."""
    below_u: str = ""
    """What to say of a value that is smaller than its uncertainty."""
    symbol_of_shape: Mapping[Shape, Symbol] = field(default_factory=dict)
    """Where the first feature's shape has another symbol."""
    stands_for: Mapping[Shape, str] = field(default_factory=dict)
    """Kind that this one is by another name, where the first feature has that shape."""
    is_place: bool = False
    """It is the coordinate of a place along ``axis``."""
