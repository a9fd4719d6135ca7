"""Fits against certified reference pairs: geometry is compared, never parameters.

A pair is a file ``NAME.ds`` with points and a file ``NAME.fit`` with certified numbers, as NIST
gives them out. What a number means differs from institute to institute (`Convention`), and a point
on an axis may lie anywhere on it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from ocmm_core.errors import FitError, InputError
from ocmm_core.features.fit import fit_shape
from ocmm_core.features.points_file import read_points
from ocmm_core.features.shapes import MINIMUM_POINTS, Fit, Shape
from ocmm_core.geometry import Float, Points3

POSITION_LIMIT, SIZE_LIMIT = 1e-6, 1e-6
DIRECTION_LIMIT, APEX_LIMIT = 1e-8, 1e-6
"""mm, mm, rad, deg: what the product promises."""

_WORDS = (
    ("cir", Shape.CIRCLE),
    ("con", Shape.CONE),
    ("cyl", Shape.CYLINDER),
    ("lin", Shape.LINE),
    ("pla", Shape.PLANE),
    ("pln", Shape.PLANE),
    ("sph", Shape.SPHERE),
)
_NUMBERS = {
    Shape.LINE: 6,
    Shape.PLANE: 6,
    Shape.CIRCLE: 7,
    Shape.SPHERE: 4,
    Shape.CYLINDER: 7,
    Shape.CONE: 8,
}


class Convention(Enum):
    """What the certified numbers mean.

    ``NIST``: diameters; a circle in space is fitted in the plane of its points; a cone's axis
    points to where the radius grows, its size is the distance of the point of the axis from the
    surface. ``PTB``: radii; the circle is one problem in space; a cone's axis points to where the
    radius falls, its size is the radius square to the axis. Both: full apex angle in degrees.
    """

    NIST = "nist"
    PTB = "ptb"


@dataclass(frozen=True, slots=True)
class PairResult:
    """How far one fit lies from its certified result.

    Attributes
    ----------
    name
        Of the pair.
    shape
        What was fitted.
    points
        How many.
    position, size, direction, apex
        mm, mm, rad, deg; None where the shape has none, or where only residuals can be compared
        because several elements pass through so few points.
    residual
        mm: rms of the residuals where only they are compared, else None.
    failure
        Why there is no fit, or empty.
    """

    name: str
    shape: Shape
    points: int
    position: float | None = None
    size: float | None = None
    direction: float | None = None
    apex: float | None = None
    residual: float | None = None
    failure: str = ""

    @property
    def passed(self) -> bool:
        """Return whether all that can be compared is within what the product promises."""
        compared = (
            (self.position, POSITION_LIMIT),
            (self.size, SIZE_LIMIT),
            (self.direction, DIRECTION_LIMIT),
            (self.apex, APEX_LIMIT),
            (self.residual, POSITION_LIMIT),
        )
        return not self.failure and all(
            value is None or value <= limit for value, limit in compared
        )


@dataclass(frozen=True, slots=True)
class SetReport:
    """The worst errors of one folder's pairs.

    Attributes
    ----------
    name
        Of the folder.
    results
        Of its pairs, in the order of their names.
    """

    name: str
    results: tuple[PairResult, ...]

    @property
    def passed(self) -> bool:
        """Return whether every pair passed."""
        return all(result.passed for result in self.results)

    def worst(self, field: str) -> float | None:
        """Return the greatest error of a field of `PairResult`, or None where no pair has one."""
        values = [getattr(result, field) for result in self.results]
        known = [value for value in values if value is not None]
        return max(known) if known else None


def verify_folder(
    folder: Path | str, convention: Convention = Convention.NIST
) -> tuple[SetReport, ...]:
    """Return how the fits of the product compare with all pairs below ``folder``, cold started.

    Raises
    ------
    InputError
        There are no pairs, or one cannot be read; the sentence names the file.
    """
    root = Path(folder)
    if not root.is_dir():
        raise InputError("verify.no_folder", f"{root}: is not a folder.", "Give an existing one.")
    files = sorted(root.rglob("*.ds"), key=_by_number)
    if not files:
        raise InputError(
            "verify.no_pairs",
            f"{root}: holds no reference pairs (NAME.ds with NAME.fit).",
            "Give a folder with such pairs, itself or in its folders.",
        )
    sets: dict[str, list[PairResult]] = {}
    for file in files:
        parent = file.parent
        name = parent.name if parent == root else parent.relative_to(root).as_posix()
        sets.setdefault(name, []).append(verify_pair(file, convention))
    return tuple(SetReport(name, tuple(results)) for name, results in sorted(sets.items()))


def verify_pair(file: Path, convention: Convention = Convention.NIST) -> PairResult:
    """Return how the fit of the points in ``file`` compares with the certified result beside it.

    Raises
    ------
    InputError
        One of the two files cannot be read, or what shape it is cannot be told.
    """
    shape = _shape_of(file)
    points = read_points(file)
    certified = _certified(file.with_suffix(".fit"), shape)
    try:
        fit = fit_shape(shape, points, free=_free(shape, convention))
    except FitError as error:
        return PairResult(file.stem, shape, len(points), failure=error.what)
    if shape is Shape.CONE and len(points) == MINIMUM_POINTS[shape]:
        return PairResult(file.stem, shape, len(points), residual=fit.rms)
    return _compared(file.stem, fit, points, certified, convention)


def _free(shape: Shape, convention: Convention) -> bool:
    return shape is Shape.CIRCLE and convention is Convention.PTB


def _compared(
    name: str, fit: Fit, points: Points3, certified: Float, convention: Convention
) -> PairResult:
    arm = certified[:3] - fit.point
    position, along = float(np.linalg.norm(arm)), 0.0
    direction: float | None = None
    if fit.shape is not Shape.SPHERE:
        true = certified[3:6] / np.linalg.norm(certified[3:6])
        along = float(arm @ fit.direction)
        if fit.shape is Shape.CONE and convention is Convention.PTB:
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
        cosine = np.cos(fit.half_angle)
        there = fit.radius + along * np.tan(fit.half_angle)
        own = there if convention is Convention.PTB else there * cosine
        size = abs(float(own - certified[6]))
        apex = abs(float(2.0 * np.degrees(fit.half_angle) - certified[7]))
    elif fit.shape not in (Shape.LINE, Shape.PLANE):
        factor = 1.0 if convention is Convention.PTB else 2.0
        size = abs(factor * fit.radius - float(certified[-1]))
    return PairResult(name, fit.shape, len(points), position, size, direction, apex)


def _by_number(file: Path) -> tuple[str, list[tuple[int, str]]]:
    """Return a key that sorts cir9 before cir11."""
    parts = re.findall(r"\d+|\D+", file.stem)
    return file.parent.as_posix(), [
        (int(part) if part.isdigit() else -1, part) for part in parts
    ]


def _shape_of(file: Path) -> Shape:
    names: Sequence[str] = (file.stem.lower(), file.parent.name.lower())
    for name in names:
        for word, shape in _WORDS:
            if name.startswith(word):
                return shape
    raise InputError(
        "verify.shape",
        f"{file}: neither its name nor that of its folder begins with the name of a shape.",
        "Name it line, plane, circle, sphere, cylinder or cone (or by their first three letters).",
    )


def _certified(file: Path, shape: Shape) -> Float:
    try:
        words = file.read_text(encoding="utf-8").split()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            "verify.no_result",
            f"{file}: the certified result cannot be read.",
            "Put it beside the file with the points.",
        ) from error
    try:
        numbers = np.array([float(word) for word in words])
    except ValueError as error:
        raise InputError(
            "verify.number", f"{file}: holds what is not a number.", "Give one number a line."
        ) from error
    if len(numbers) != _NUMBERS[shape] or not np.isfinite(numbers).all():
        raise InputError(
            "verify.numbers",
            f"{file}: has {len(numbers)} numbers; a {shape.value.lower()} needs "
            f"{_NUMBERS[shape]} finite ones.",
            "Check whether the file is whole.",
        )
    return numbers
