"""Import of dimensions as sizes, distances and angles with limits.

Limits of fits such as H7 and g6, up to 500 mm (ISO 286-1:2010, tables 1 to 5; ISO 286-2).

The tables are those of the standard, micrometres: its formulas are rounded by unstated rules. A
hole has the deviation of the shaft of the same letter with opposite sign; K to P, for interference
fits, are shifted by the difference of two grades (ISO 286-1, 4.3.2.5) so that hole and shaft of
neighbouring grades fit as the basic shaft system does.

General tolerances of linear dimensions by a note on the drawing: ISO 2768-1.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import msgspec

from ocmm_cad.drawing._context import AccountItem, Context, Found, RefusedError, plan_name
from ocmm_cad.pmi import Dimension
from ocmm_core.documents import Document, load_document, resource
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.tolerances.zones import Characteristic

_SCHEMA = "ocmm.general-tolerances/1"
Letter = Literal["f", "m", "c", "v"]
CLASSES: dict[str, Letter] = {f"iso2768-{letter}": letter for letter in ("f", "m", "c", "v")}
"""Accepted words."""


class ToleranceStep(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Deviations of nominal sizes up to ``to``, mm; zero if undefined."""

    to: float
    f: float
    m: float
    c: float
    v: float


class ToleranceTable(Document, frozen=True, kw_only=True, rename={"start": "from"}):
    name: str
    source: str
    """`name`, `source`: The standard, and the place in it."""
    start: float
    """mm: the smallest nominal size."""
    steps: list[ToleranceStep]


@dataclass(frozen=True, slots=True)
class General:
    """General tolerance requested by a note."""

    words: str
    """As on the drawing: ``ISO 2768-m``."""
    _letter: Letter
    _table: ToleranceTable

    def deviation(self, nominal: float) -> float | None:
        """Return the symmetric deviation of a size, mm; None beyond the table."""
        if nominal < self._table.start:
            return None
        for step in self._table.steps:
            if nominal <= step.to:
                found: float = getattr(step, self._letter)
                return found or None
        return None


def general_of(asked: str) -> General | None:
    """Return the general tolerance of a word, None if empty; InputError if unknown."""
    if not asked:
        return None
    letter = CLASSES.get(asked.lower())
    if letter is None:
        raise InputError(
            "plan.general",
            f"{asked!r} is no general tolerance.",
            f"Choose one of {', '.join(CLASSES)}, or none.",
        )
    table = load_document(resource("general_tolerances", "iso2768_1.toml"), ToleranceTable, _SCHEMA)
    return General(f"ISO 2768-{letter}", letter, table)


_UP_TO = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""mm: above the previous one, up to and including this one."""
_GRADES = {
    4: (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
}
"""Standard tolerances IT4 to IT11."""
_CLEAR = {
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
}
"""Distance of the upper limit of a shaft below the nominal size."""
_TIGHT = {
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
"""Distance of the lower limit of a shaft above the nominal size; for k, grades 4 to 7."""
_SHIFTED_TO = {"k": 8, "m": 8, "n": 8, "p": 7}
"""Grade up to which holes of the letter are shifted."""
_CODE = re.compile(r"([A-Za-z]{1,2})(\d{1,2})")
_LEAST = 5


def fit_limits(code: str, size: float) -> tuple[float, float, bool]:
    """Return lower and upper deviation, mm, of ``H7``, ``g6``, and whether it is a hole.

    `size`: nominal diameter, mm. RefusedError if the tables do not have it.
    """
    found = _CODE.fullmatch(code)
    letter, grade = (found.group(1), int(found.group(2))) if found else ("", 0)
    known = letter.lower() in (*_CLEAR, *_TIGHT, "js") and (letter.isupper() or letter.islower())
    if not known or grade not in range(_LEAST, max(_GRADES) + 1):
        raise RefusedError(
            f"its limits are the fit {code}; known are D to H, JS, K, M, N, P and d to h, js, k, "
            f"m, n, p in the grades {_LEAST} to {max(_GRADES)}"
        )
    if not 0.0 < size <= _UP_TO[-1]:
        raise RefusedError(f"the fit {code} is known up to {_UP_TO[-1]} mm, it has {size:g} mm")
    row = next(place for place, last in enumerate(_UP_TO) if size <= last)
    wide, is_hole, word = _GRADES[grade][row], letter.isupper(), letter.lower()
    if word == "js":
        low, high = -0.5 * wide, 0.5 * wide
    elif word in _CLEAR:
        off = _CLEAR[word][row]
        low, high = (off, off + wide) if is_hole else (-off - wide, -off)
    elif is_hole:
        high = _upper_of_hole(word, grade, row, code)
        low = high - wide
    else:
        low = 0 if word == "k" and grade > 7 else _TIGHT[word][row]
        high = low + wide
    return round(1e-3 * low, 6), round(1e-3 * high, 6), is_hole


def _upper_of_hole(word: str, grade: int, row: int, code: str) -> float:
    last = _SHIFTED_TO[word]
    if grade > last:
        if word == "n":
            return -4.0 if row == 0 else 0.0
        if word == "k":
            raise RefusedError(f"its limits are the fit {code}, which the tables do not have")
        return -_TIGHT[word][row]
    if word == "m" and grade == 6 and _UP_TO[row] == 315:
        # The only exception in the standard.
        return -9.0
    # Up to 3 mm the standard has no shift.
    shift = 0 if row == 0 else _GRADES[grade][row] - _GRADES[grade - 1][row]
    return shift - _TIGHT[word][row]


THEORETICAL = "theoretical"
"""Word in the file for a theoretically exact (basic) dimension."""
_BASIC = (THEORETICAL, "basic", "theoretically exact")
_REFERENCE = ("auxiliary", "reference")
_SIZES = {
    "diameter": ("diameter", (Shape.CYLINDER, Shape.SPHERE)),
    "spherical diameter": ("diameter", (Shape.SPHERE,)),
    "radius": ("radius", (Shape.CYLINDER, Shape.SPHERE)),
    "spherical radius": ("radius", (Shape.SPHERE,)),
}
_BETWEEN_FACES = ("size", "width", "thickness", "linear distance", "distance")


@dataclass(frozen=True, slots=True)
class SizeLimits:
    low: float
    high: float


class Sizes:
    """Import dimensions into a plan, and keep the limits of imported sizes."""

    def __init__(self, context: Context, general: General | None) -> None:
        self._context, self._general = context, general
        self.limits: dict[str, list[SizeLimits]] = {}
        """Of diameters, by the name of the feature; all for a feature with several sizes."""

    def import_item(self, item: Dimension) -> AccountItem:
        """Import a dimension, and return its result."""
        said = AccountItem(
            group="dimension", name=item.name, kind=_text(item), entity=item.entity,
            status="refused",
        )  # fmt: skip
        try:
            if item.fault:
                raise RefusedError(item.fault)
            found = self._found(item)
            item, general = self._with_limits(item, found)
            if item.lower is None:
                return self._as_nominal(item, found, said)
            wanted = self._context.checked(self._characteristics(item, found))
            names = self._context.add(wanted)
            if not item.is_location:
                self._remember(wanted)
        except RefusedError as error:
            return msgspec.structs.replace(said, why=str(error))
        remarks = [general] if general else []
        remarks += [f"the file names some of the faces of {name} only" for name in found.part_of]
        return msgspec.structs.replace(
            said, status="partly" if found.missing else "taken", became=names,
            why="; ".join(found.missing), remark="; ".join(remarks),
        )  # fmt: skip

    def _found(self, item: Dimension) -> Found:
        surfaces = self._context.surfaces
        if not item.is_location:
            return surfaces.all_of(item.faces, item.odd)
        both = [surfaces.one(faces, item.odd) for faces in (item.faces, item.other_faces)]
        if both[0].name == both[1].name:
            raise RefusedError(f"both of its ends are {both[0].name}")
        return Found(tuple(both), (), ())

    def _with_limits(self, item: Dimension, found: Found) -> tuple[Dimension, str]:
        for note in item.notes:
            if note in _REFERENCE:
                raise RefusedError("it is a reference dimension, which has no tolerance")
            if note not in _BASIC:
                raise RefusedError(f"its note '{note}' is not supported")
        if item.fit:
            return self._with_fit(item, found)
        if item.nominal is None:
            raise RefusedError("the file gives it no value")
        basic = any(note in _BASIC for note in item.notes)
        if basic and item.lower is not None:
            raise RefusedError("it is theoretically exact and has limits at once")
        if basic or item.lower is not None:
            return item, ""
        if self._general is None:
            raise RefusedError("it has no tolerance, and no general tolerance was asked for")
        if item.of != "length":
            raise RefusedError(f"{self._general.words} is taken for lengths only")
        off = self._general.deviation(item.nominal)
        if off is None:
            raise RefusedError(f"{self._general.words} has no value for {item.nominal:g} mm")
        words = f"by the general tolerance {self._general.words}: ±{off:g} mm"
        return msgspec.structs.replace(item, lower=-off, upper=off), words

    def _with_fit(self, item: Dimension, found: Found) -> tuple[Dimension, str]:
        if item.nominal is None:
            raise RefusedError(f"its limits are the fit {item.fit}, and the file gives it no value")
        if item.word != "diameter" or item.of != "length" or item.lower is not None or item.notes:
            raise RefusedError(
                f"its limits are the fit {item.fit}, which is taken for a diameter without notes "
                "or limits as numbers"
            )
        lower, upper, is_hole = fit_limits(item.fit, item.nominal)
        for feature in found.features:
            if (feature.side == "inner") != is_hole:
                what = "hole" if is_hole else "shaft"
                raise RefusedError(
                    f"its limits are the fit {item.fit} of a {what}, and {feature.name} is none"
                )
        words = f"{item.fit} by ISO 286-1: {1e3 * upper:+g} {1e3 * lower:+g} \u00b5m"
        return msgspec.structs.replace(item, lower=lower, upper=upper), words

    def _as_nominal(self, item: Dimension, found: Found, said: AccountItem) -> AccountItem:
        """Return the result of a theoretically exact dimension: the model must match it."""
        exact = msgspec.structs.replace(item, lower=0.0, upper=0.0)
        wanted = self._context.checked(self._characteristics(exact, found))
        names = tuple(dict.fromkeys(name for one in wanted for name in one.features))
        return msgspec.structs.replace(
            said, status="partly" if found.missing else "taken",
            became=tuple(f"nominal of {name}" for name in names), why="; ".join(found.missing),
        )  # fmt: skip

    def _characteristics(self, item: Dimension, found: Found) -> list[Characteristic]:
        features = found.features
        if item.of == "angle":
            return self._angles(item, features)
        if item.is_location:
            if item.word != "linear distance":
                raise RefusedError(f"a distance of the kind '{item.word}' is not supported")
            return [_characteristic(item, "distance", features)]
        if item.word in _SIZES:
            kind, shapes = _SIZES[item.word]
            for feature in features:
                if feature.shape not in shapes:
                    word = feature.shape.value.lower()
                    raise RefusedError(f"{feature.name} is a {word}, which has no {item.word}")
            return [
                _characteristic(item, kind, (one,), several=len(features) > 1) for one in features
            ]
        if item.word in _BETWEEN_FACES:
            flat = [one for one in features if one.shape is Shape.PLANE]
            if len(flat) != 2 or len(features) != 2 or found.missing:
                raise RefusedError(f"a {item.word} is taken of two opposite faces only")
            return [_characteristic(item, "distance", features)]
        raise RefusedError(f"a size of the kind '{item.word}' is not supported")

    def _angles(
        self, item: Dimension, features: tuple[NominalFeature, ...]
    ) -> list[Characteristic]:
        if item.is_location:
            return [_characteristic(item, "angle", features)]
        for feature in features:
            if feature.shape is not Shape.CONE:
                raise RefusedError(f"{feature.name} is no cone, which has an angle")
        return [
            _characteristic(item, "angle", (one,), several=len(features) > 1) for one in features
        ]

    def _remember(self, taken: list[Characteristic]) -> None:
        for item in taken:
            factor = {"diameter": 1.0, "radius": 2.0}.get(item.kind)
            if factor is not None:
                low, high = (factor * (item.nominal + off) for off in (item.lower, item.upper))
                self.limits.setdefault(item.features[0], []).append(SizeLimits(low, high))


def _characteristic(
    item: Dimension, kind: str, features: tuple[NominalFeature, ...], *, several: bool = False
) -> Characteristic:
    if item.nominal is None or item.lower is None or item.upper is None:
        raise RefusedError("the file gives it no value")
    return Characteristic(
        name=plan_name(item.name, features[0] if several else None), kind=kind,
        features=[feature.name for feature in features], nominal=item.nominal, lower=item.lower,
        upper=item.upper,
    )  # fmt: skip


def _text(item: Dimension) -> str:
    said = item.word
    unit = {"length": " mm", "angle": "°"}.get(item.of, "")
    if item.nominal is not None:
        said += f" {item.nominal:g}"
        if item.lower is not None and item.upper is not None:
            if item.lower == -item.upper:
                said += f" ±{item.upper:g}"
            else:
                said += f" {item.upper:+g} {item.lower:+g}"
        said += unit
    if item.fit:
        said += f" {item.fit}"
    return said + "".join(f", {note}" for note in item.notes)
