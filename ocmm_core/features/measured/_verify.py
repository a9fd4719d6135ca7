"""Compare fits with certified reference pairs, by geometry, never by parameters.

A pair is a file ``NAME.ds`` with points and a file ``NAME.fit`` with certified numbers, as
published by NIST. The meaning of the numbers differs between institutes (`Convention`), and a point
on an axis is arbitrary.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np

from ocmm_core.errors import FitError
from ocmm_core.features.measured._fit import fit_shape
from ocmm_core.features.measured._verify_files import (
    CertifiedNumbers,
    certified_of,
    lengths_of,
    pairs_below,
    result_beside,
    shape_of,
)
from ocmm_core.features.shapes import (
    MINIMUM_POINTS,
    Criterion,
    Fit,
    PointsFile,
    Shape,
    read_points_file,
)
from ocmm_core.geometry import Float, Points3
from ocmm_core.tables import TableAccount

POSITION_LIMIT, SIZE_LIMIT = 1e-6, 1e-6
DIRECTION_LIMIT, APEX_LIMIT = 1e-8, 1e-6
"""mm, mm, rad, deg: specification of the product."""


class Convention(Enum):
    """Meaning of the certified numbers.

    ``NIST``: diameters; a circle in space is fitted in the plane of its points; a cone's axis
    points to growing radius, its size is the distance of the axis point from the surface. ``PTB``:
    radii; the circle is one problem in space; a cone's axis points to falling radius, its size is
    the radius square to the axis. Both: full apex angle in degrees. ``ANY``: each number is read in
    the way that agrees, and the result states which one.
    """

    NIST = "nist"
    PTB = "ptb"
    ANY = "any"


@dataclass(frozen=True, slots=True)
class PairResult:
    """Deviation of one fit from its certified result."""

    name: str
    shape: Shape
    points: int
    position: float | None = None
    size: float | None = None
    direction: float | None = None
    apex: float | None = None
    """`position`, `size`, `direction`, `apex`: mm, mm, rad, deg; None if the shape has none, or if
    only residuals are comparable because several elements pass through so few points."""
    residual: float | None = None
    """mm: rms of the residuals if only they are compared, else None."""
    failure: str = ""
    """Why there is no fit, or empty."""
    form: float | None = None
    """mm: difference of the zone width, if certified."""
    reading: str = ""
    """Reading of the certified numbers if not the convention of NIST, or empty."""
    account: TableAccount | None = None
    """Of the reader of the points."""
    left_out: tuple[str, ...] = ()
    """Texts of the file with the certified result that are not read."""

    @property
    def passed(self) -> bool:
        """Return whether all comparable quantities meet the specification."""
        compared = (
            (self.position, POSITION_LIMIT),
            (self.size, SIZE_LIMIT),
            (self.direction, DIRECTION_LIMIT),
            (self.apex, APEX_LIMIT),
            (self.residual, POSITION_LIMIT),
            (self.form, SIZE_LIMIT),
        )
        return not self.failure and all(
            value is None or value <= limit for value, limit in compared
        )


@dataclass(frozen=True, slots=True)
class SetReport:
    """The worst errors of one folder's pairs."""

    name: str
    results: tuple[PairResult, ...]
    """In the order of their names."""

    @property
    def passed(self) -> bool:
        """Return whether every pair passed."""
        return all(result.passed for result in self.results)

    def worst(self, field: str) -> float | None:
        """Return the greatest error of a field of `PairResult`, or None if no pair has one."""
        values = [getattr(result, field) for result in self.results]
        known = [value for value in values if value is not None]
        return max(known) if known else None


def verify_folder(
    folder: Path | str,
    convention: Convention = Convention.NIST,
    criterion: Criterion = Criterion.LEAST_SQUARES,
) -> tuple[SetReport, ...]:
    """Return the comparison of cold-started fits with all pairs below ``folder``; or InputError."""
    root = Path(folder)
    sets: dict[str, list[PairResult]] = {}
    for file in pairs_below(root):
        parent = file.parent
        name = parent.name if parent == root else parent.relative_to(root).as_posix()
        sets.setdefault(name, []).append(verify_pair(file, convention, criterion))
    return tuple(SetReport(name, tuple(results)) for name, results in sorted(sets.items()))


def verify_pair(
    file: Path,
    convention: Convention = Convention.NIST,
    criterion: Criterion = Criterion.LEAST_SQUARES,
) -> PairResult:
    """Return the comparison of the fit of ``file`` with its certified result.

    The certified result is in the unit of the points. After its numbers the form may follow: the
    width of the zone, or the diameter for a line in space. InputError if unreadable or unknown.
    """
    held = read_points_file(file)
    numbers = certified_of(result_beside(file), shape_of(file), held.factor)
    found = _verified(file, held, numbers, convention, criterion)
    return replace(found, account=held.account, left_out=numbers.left_out)


def _verified(
    file: Path,
    held: PointsFile,
    numbers: CertifiedNumbers,
    convention: Convention,
    criterion: Criterion,
) -> PairResult:
    shape, points, form = shape_of(file), held.points, numbers.form
    certified = numbers.values.copy()
    certified[lengths_of(shape)] *= held.factor
    results = []
    for reading in _readings(shape, convention, criterion):
        try:
            fit = fit_shape(shape, points, criterion=criterion, free=reading.free)
        except FitError as error:
            results.append(PairResult(file.stem, shape, len(points), failure=error.what))
            continue
        if shape is Shape.CONE and len(points) == MINIMUM_POINTS[shape]:
            return PairResult(file.stem, shape, len(points), residual=fit.rms)
        # The certified element may be the rival that the points do not exclude.
        for one in (fit, fit.rival):
            if one is None:
                continue
            found = _compared(file.stem, one, points, certified, reading)
            if form is not None:
                found = replace(found, form=abs(one.form - held.factor * form))
            if found.passed:
                return found
            results.append(found)
    return results[0]


@dataclass(frozen=True, slots=True)
class _Reading:
    """Reading of certified numbers: circles, sizes, and angle and axis of a cone."""

    free: bool = False
    radius: bool = False
    square: bool = False
    falling: bool = False
    angle: float = 2.0
    radians: bool = False

    @property
    def words(self) -> str:
        """Return the differences from the convention of NIST."""
        words = (
            (self.free, "circle as one problem in space"),
            (self.radius, "radius"),
            (self.square, "radius square to the axis"),
            (self.falling, "axis towards the falling radius"),
            (self.angle == 1.0, "half angle"),
            (self.radians, "angle in rad"),
        )
        return ", ".join(word for said, word in words if said)


def _readings(shape: Shape, convention: Convention, criterion: Criterion) -> list[_Reading]:
    if convention is Convention.NIST:
        return [_Reading()]
    circle = shape is Shape.CIRCLE and criterion is Criterion.LEAST_SQUARES
    if convention is Convention.PTB:
        cone = shape is Shape.CONE
        sized = shape.spec.is_radial
        return [_Reading(free=circle, radius=sized, square=cone, falling=cone)]
    if shape is Shape.CONE:
        # The axis point determines the side of opening; only the sense is read either way.
        return [
            _Reading(False, False, square, falling, angle, radians)
            for radians in (False, True)
            for angle in (2.0, 1.0)
            for falling in (False, True)
            for square in (False, True)
        ]
    return [
        _Reading(free, radius) for free in ((False, True) if circle else (False,))
        for radius in (False, True)
    ]  # fmt: skip


def _compared(
    name: str, fit: Fit, points: Points3, certified: Float, reading: _Reading
) -> PairResult:
    arm = certified[:3] - fit.point
    position, along = float(np.linalg.norm(arm)), 0.0
    direction: float | None = None
    if fit.shape is not Shape.SPHERE:
        true = certified[3:6] / np.linalg.norm(certified[3:6])
        along = float(arm @ fit.direction)
        if reading.falling:
            true = -true
        # Only a cone's axis has a sense.
        sense = 1.0 if fit.shape is Shape.CONE or true @ fit.direction > 0.0 else -1.0
        direction = 2.0 * float(
            np.arctan2(
                np.linalg.norm(true - sense * fit.direction),
                np.linalg.norm(true + sense * fit.direction),
            )
        )
        if fit.shape is Shape.PLANE:
            position = abs(along)
        elif fit.shape is not Shape.CIRCLE:
            position = float(np.linalg.norm(arm - along * fit.direction))
    size = apex = None
    if fit.shape is Shape.CONE:
        there = fit.radius + along * np.tan(fit.half_angle)
        own = there if reading.square else there * np.cos(fit.half_angle)
        size = abs(float(own - certified[6]))
        angle = np.degrees(certified[7]) if reading.radians else certified[7]
        apex = abs(float(np.degrees(2.0 * fit.half_angle) - 2.0 / reading.angle * angle))
    elif fit.shape not in (Shape.LINE, Shape.PLANE):
        size = abs((1.0 if reading.radius else 2.0) * fit.radius - float(certified[-1]))
    return PairResult(
        name, fit.shape, len(points), position, size, direction, apex, reading=reading.words
    )
