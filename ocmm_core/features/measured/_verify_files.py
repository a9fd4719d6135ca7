"""Files of reference pairs: pairing, shape, and certified numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core.documents import LARGEST_DOCUMENT, find_files
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.side_files import read_guarded
from ocmm_core.tables import NUMBER, NumberGrammar, decoded
from ocmm_core.units import unit_statement

_FIELDS = re.compile(r"[\s;,]+")
_COMMENT = re.compile(r"(#|%|!|//|\*).*")
POINTS_ENDING = ".ds"
RESULT_ENDING = ".fit"
FURTHER_ENDINGS = (".txt", ".csv", ".dat", ".asc", ".xyz", ".pts")
"""Endings of point files with a result of the same name in the folder."""

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
