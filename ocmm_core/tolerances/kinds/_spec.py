"""Specification of a kind of characteristic: its traits and computations.

Also groups of shapes by trait, and the value from geometry with its gradient by central
differences, for the entries of kinds.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal, get_args

import numpy as np

from ocmm_core.alignment import AnyAlignment
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import GEOMETRY_SIZE, Shape, shapes_where
from ocmm_core.geometry import Float
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.zones import AXES, Characteristic, Evaluation, Frames, moved_geometry

ALL = tuple(Shape)
WITH_RADIUS = shapes_where(lambda spec: spec.is_radial)
WITH_DIAMETER = shapes_where(lambda spec: spec.has_size("diameter"))
SLOTS = shapes_where(lambda spec: spec.has_sides)
"""Shapes with two long sides, hence a middle plane."""
WITH_SIZE = (*WITH_RADIUS, *SLOTS)
LONG_AND_WIDE = shapes_where(lambda spec: spec.has_size("length"))
WITH_WIDTH = shapes_where(lambda spec: spec.has_size("width"))
DIRECTED = (Shape.PLANE, *AXES)
ROUND_AXES = (*AXES, Shape.CIRCLE)
SPHERICAL = shapes_where(lambda spec: spec.centred and not spec.has_direction)
"""Shapes with a centre and without a direction."""
OF_A_LINE = shapes_where(lambda spec: spec.is_flat or not spec.has_normals)
"""Shapes that can be touched as a line on a surface: points, edges and outlines."""
OF_A_SURFACE = shapes_where(
    lambda spec: not spec.is_flat and (spec.has_normals or spec.located == "everywhere")
)
"""Shapes that can be touched as a surface, including points."""

Fault = tuple[str, str]
"""Faulty field of the characteristic, and the fault."""

Zone = Literal["planes", "cylinder", "sphere"]
Polygon = tuple[tuple[float, float], ...]

Evaluate = Callable[
    [Characteristic, Mapping[str, ActualFeature], AnyAlignment | None, Frames], Evaluation
]
"""Value and gradient; from the relevant features, the alignment of the plan, and the frames."""

OfGeometry = Callable[
    [Characteristic, Mapping[str, Float], Mapping[str, Shape], AnyAlignment | None], float
]
"""The value, mm or deg, from geometry vectors (12,) and shapes by name."""


@dataclass(frozen=True, slots=True)
class PlannedCharacteristic:
    """A characteristic in the context of its plan."""

    item: Characteristic
    shapes: Mapping[str, Shape]
    """Of all features of the plan, probed and constructed, by name."""
    nominals: Mapping[str, Float]
    """Geometry vectors (12,) of features with a nominal, part frame."""
    probed: Collection[str]
    aligned: bool

    @property
    def first(self) -> Shape:
        return self.shapes[self.item.features[0]]

    @property
    def of_planes(self) -> bool:
        """Return whether the zone of a centre or axis is specified as two planes."""
        return self.item.zone == "planes" and self.first is not Shape.PLANE


Check = Callable[[PlannedCharacteristic], Fault | None]


class MonteCarlo(Enum):
    """Method to simulate a value; unsuitable trials fall back to full evaluation."""

    SECOND_ORDER = "the value of the geometry of refitted elements"
    RANGE = "the range of the residuals of a least-squares element"
    VECTOR = "the length of a vector that follows the centres to first order"
    EVALUATED = "every trial is evaluated like the job"


@dataclass(frozen=True, slots=True)
class QifWords:
    """QIF 3.0 terms of a kind."""

    word: str
    """Prefix of its element names."""
    of_shape: Mapping[Shape, str] = field(default_factory=dict)
    """Special terms by the first feature's shape."""
    of_one: str = ""
    """Term for one feature alone; empty if the same."""
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


def no_association(asked: PlannedCharacteristic) -> Fault | None:
    """Refuse every association."""
    return "association", "goes with sizes, distances of faces and form only"


_Taken = Literal["axis", "at", "cut", "faces", "length", "modifier", "offset"]


@dataclass(frozen=True, slots=True, kw_only=True)
class KindSpec:
    """One kind of characteristic."""

    name: str
    title: str = ""
    """In sentences; empty: its name."""
    unit: Literal["mm", "deg"] = "mm"
    one_sided: bool = False
    """The value is the width of a zone: nonnegative, with an upper limit only."""
    evaluate: Evaluate
    geometry: OfGeometry | None = None
    """The value from geometry alone; None if it needs points or the datum frame."""
    monte_carlo: MonteCarlo
    qif: QifWords
    symbol: Symbol | None = None
    """On drawings; None if written as a word."""
    shapes: tuple[Shape, ...]
    """Permitted for its features."""
    features: tuple[int, int] = (1, 1)
    datums: tuple[int, int] = (0, 0)
    """`features`, `datums`: Minimum and maximum number."""
    datum_shapes: tuple[Shape, ...] = ALL
    """Permitted for its first datum."""
    takes: frozenset[_Taken] = frozenset()
    """Permitted fields in addition to the common ones."""
    zones: tuple[Zone, ...] = ()
    """Permitted zones; empty without a choice."""
    zone_of: Callable[[Characteristic | None, Shape | None, tuple[Shape, ...]], Zone] | None = None
    """The applicable zone, from the characteristic of the plan, the shape of the first feature
    (each None if unknown) and those of the datums; None if the kind has a single zone or none."""
    association_fault: Check = no_association
    checks: tuple[Check, ...] = ()
    """Further checks, after those common to all kinds."""
    in_part: Callable[[Characteristic], bool] = lambda item: False
    """Whether the value refers to the part frame of the plan's alignment."""
    needs_sense: Callable[[Characteristic, AnyAlignment | None], bool] = lambda item, rule: False
    """Whether the part frame determines the side of the value."""
    datums_make_frame: bool = False
    """The datums define a frame in order of precedence, in which nominal places count."""
    own_form: bool = False
    """Surface form is the measurand, hence no uncertainty contribution."""
    form_alone: bool = False
    """Form deviation of one feature alone: zero on a perfect part."""
    probed: Literal["", "faces", "all"] = ""
    """Features that need points of their own."""
    folds: bool = False
    """Absolute value: not linear in the points near zero."""
    below_u: str = ""
    """Note for a value smaller than its uncertainty."""
    symbol_of_shape: Mapping[Shape, Symbol] = field(default_factory=dict)
    """Special symbols by the first feature's shape."""
    stands_for: Mapping[Shape, str] = field(default_factory=dict)
    """Equivalent kind, by the first feature's shape."""
    is_size: bool = False
    """Size of one feature, which has limits of material."""
    is_place: bool = False
    """Coordinate of a place along ``axis``."""

    @property
    def label(self) -> str:
        return self.title or self.name

    @property
    def unused(self) -> frozenset[str]:
        """Return the fields of `Characteristic` without a meaning for this kind."""
        used = {
            "nominal": not self.one_sided,
            "lower": not self.one_sided,
            "datums": self.datums[1] > 0,
            "association": self.association_fault is not no_association,
            "zone": bool(self.zones),
            "material_size": "modifier" in self.takes,
            "cut_at": "cut" in self.takes,
            "within": "cut" in self.takes,
            **{field: field in self.takes for field in get_args(_Taken)},
        }
        return frozenset(field for field, is_used in used.items() if not is_used)


STEP = 1e-5
"""Step of the central differences over geometry: mm, and for directions a fraction of one."""


def by_differences(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    value_of: Callable[[Mapping[str, Float]], float],
) -> Evaluation:
    """Return the value of geometry vectors (12,) by name, with its gradient by points."""
    geometries = {name: feature.fit.geometry for name, feature in actual.items()}
    gradient = Rows.nothing()
    for name in (*characteristic.features, *characteristic.datums):
        feature = actual[name]
        slope = np.zeros(GEOMETRY_SIZE)
        for k in np.flatnonzero(feature.jacobian.moving()).tolist():
            ahead, behind = (
                value_of(moved_geometry(geometries, name, k, step)) for step in (STEP, -STEP)
            )
            slope[k] = (ahead - behind) / (2.0 * STEP)
        gradient += slope @ feature.jacobian
    return Evaluation(value_of(geometries), gradient)


def by_geometry(
    characteristic: Characteristic,
    actual: Mapping[str, ActualFeature],
    alignment: AnyAlignment | None,
    value_of: OfGeometry,
) -> Evaluation:
    """Return the value that a kind has from geometry, with its gradient by points."""
    shapes = {name: item.fit.shape for name, item in actual.items()}
    return by_differences(
        characteristic, actual, lambda moved: value_of(characteristic, moved, shapes, alignment)
    )
