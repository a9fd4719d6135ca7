"""Compare fits with certified reference pairs, by geometry, never by parameters.

A pair is a file ``NAME.ds`` with points and a file ``NAME.fit`` with certified numbers, as
published by NIST. The meaning of the numbers differs between institutes (`Convention`), and a point
on an axis is arbitrary.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np

from ocmm_core.documents import LARGEST_DOCUMENT, find_files
from ocmm_core.errors import FitError, InputError
from ocmm_core.features.measured._fit import fit_shape
from ocmm_core.features.shapes import (
    MINIMUM_POINTS,
    Criterion,
    Fit,
    PointsFile,
    Shape,
    read_points_file,
)
from ocmm_core.geometry import Float, Points3
from ocmm_core.side_files import read_guarded
from ocmm_core.tables import NUMBER, NumberGrammar, TableAccount, decoded
from ocmm_core.units import unit_statement

_FIELDS = re.compile(r"[\s;,]+")
_COMMENT = re.compile(r"(#|%|!|//|\*).*")
POINTS_ENDING, RESULT_ENDING = ".ds", ".fit"
FURTHER_ENDINGS = (".txt", ".csv", ".dat", ".asc", ".xyz", ".pts")
"""Endings of point files with a result of the same name in the folder."""

_WORDS = (
    ("cir", Shape.CIRCLE), ("con", Shape.CONE), ("cyl", Shape.CYLINDER), ("lin", Shape.LINE),
    ("pla", Shape.PLANE), ("pln", Shape.PLANE), ("sph", Shape.SPHERE),
)  # fmt: skip
_NUMBERS = {
    Shape.LINE: 6, Shape.PLANE: 6, Shape.CIRCLE: 7, Shape.SPHERE: 4, Shape.CYLINDER: 7,
    Shape.CONE: 8,
}  # fmt: skip


def pairs_below(root: Path) -> list[Path]:
    """Return the point files of all pairs below ``root``, by name and number; or InputError."""
    if not root.is_dir():
        raise InputError("verify.no_folder", f"{root}: is not a folder.", "Give an existing one.")
    paths, left_out = find_files(root)
    if left_out:
        raise left_out[0]
    files = [file for file in paths if file.is_file()]
    results = {_stem(file) for file in files if file.suffix.lower() == RESULT_ENDING}
    found = [file for file in files if file.suffix.lower() == POINTS_ENDING]
    own = {_stem(file) for file in found}
    for file in files:
        further = file.suffix.lower() in FURTHER_ENDINGS and _stem(file) in results
        if further and _stem(file) not in own:
            found.append(file)
    if not found:
        raise InputError(
            "verify.no_pairs",
            f"{root}: holds no reference pairs (NAME.ds with NAME.fit).",
            "Give a folder with such pairs, itself or in its folders.",
        )
    return sorted(found, key=_by_number)


def _stem(file: Path) -> Path:
    return file.parent / file.stem.lower()


def _by_number(file: Path) -> tuple[str, list[tuple[int, str]]]:
    """Return a key that sorts cir9 before cir11."""
    parts = re.findall(r"\d+|\D+", file.stem)
    return file.parent.as_posix(), [(int(part) if part.isdigit() else -1, part) for part in parts]


def result_beside(file: Path) -> Path:
    """Return the file with the certified result of ``file``, ignoring case."""
    for other in sorted(file.parent.iterdir()):
        if other.suffix.lower() == RESULT_ENDING and _stem(other) == _stem(file):
            return other
    return file.with_suffix(RESULT_ENDING)


def shape_of(file: Path) -> Shape:
    """Return the shape that starts the name of ``file`` or its folder; else raise InputError."""
    names: Sequence[str] = (file.stem.lower(), file.parent.name.lower())
    for name in names:
        for word, shape in _WORDS:
            if name.startswith(word):
                return shape
    raise InputError(
        "verify.shape",
        f"{file}: neither its name nor that of its folder begins with the name of a shape.",
        "Name it line, plane, circle, sphere, cylinder or cone (or their first three letters).",
    )


def lengths_of(shape: Shape) -> list[int]:
    """Return the indices of the certified numbers of a shape that are lengths."""
    size = [] if shape in (Shape.LINE, Shape.PLANE) else [6 if shape is Shape.CONE else -1]
    return [0, 1, 2, *size]


@dataclass(frozen=True, slots=True)
class CertifiedNumbers:
    """Content of a file with a certified result."""

    values: Float
    """In the unit of the points, and degrees or radians."""
    form: float | None
    left_out: tuple[str, ...]
    """Comments, and words such as "radius:"."""


def certified_of(file: Path, shape: Shape, factor: float) -> CertifiedNumbers:
    """Return the certified numbers in ``file``, and the form if it follows them.

    One or several numbers a line, with comments and words. They are in the unit of the points, of
    ``factor`` mm.

    Raises
    ------
    InputError
        It cannot be read, states another unit, or has the wrong count of numbers.
    """
    try:
        lines = decoded(read_guarded(file, LARGEST_DOCUMENT)).splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            "verify.no_result",
            f"{file}: the certified result cannot be read.",
            "Put it beside the file with the points.",
        ) from error
    for number, line in enumerate(lines, 1):
        stated = unit_statement(NUMBER.sub("", line))
        if stated is not None and (stated.unit is None or stated.unit.factor != factor):
            raise InputError(
                "verify.unit",
                f"{file}, line {number}: the line states the unit {stated.text}, but the points "
                f"have one of {factor:g} mm.",
                "Give the certified result in the unit of its points.",
            )
    comments = [found[0].strip() for line in lines if (found := _COMMENT.search(line))]
    words = [word for line in lines for word in _FIELDS.split(_COMMENT.sub("", line))]
    words = [word.strip("=:()[]{}<>") for word in words]
    odd = [word for word in words if word[:1].isdigit() and not NUMBER.fullmatch(word)]
    if odd or any(word.lower() in ("nan", "inf") for word in words):
        raise InputError(
            "verify.number", f"{file}: contains a non-number.", "Give one number per line."
        )
    numbers = np.array([NumberGrammar().value(word) for word in words if NUMBER.fullmatch(word)])
    needed = _NUMBERS[shape]
    if len(numbers) not in (needed, needed + 1):
        raise InputError(
            "verify.numbers",
            f"{file}: has {len(numbers)} numbers; a {shape.value.lower()} needs "
            f"{needed} finite ones.",
            "Check that the file is complete.",
        )
    other = (word for word in words if word and not NUMBER.fullmatch(word))
    form = float(numbers[needed]) if len(numbers) > needed else None
    return CertifiedNumbers(numbers[:needed], form, (*comments, *other))


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
    def summary(self) -> str:
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
        name, fit.shape, len(points), position, size, direction, apex, reading=reading.summary
    )
