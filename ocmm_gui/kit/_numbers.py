"""Display format of numbers, lengths and dates, defined here only.

Internally and in files numbers have a point, lengths are in mm and dates are ISO 8601. The display
follows language and settings: `style_of` makes a `NumberStyle`, and `use_numbers` activates it
before windows are created.

Sentences from `tr` format numbers in this style automatically. Other texts use `localised`, lengths
`length_number` with `unit_word`, days and times `day_words` and `time_words`.
"""

from __future__ import annotations

import re
import string
from dataclasses import dataclass
from datetime import date, datetime
from numbers import Real
from typing import Any, ClassVar

from ocmm_core.tables import typed_number
from ocmm_core.typed_numbers import NumberField
from ocmm_core.units import find_unit, named_unit, scaled

INCH_MM = named_unit("inch", "length").factor

_INCH_DECIMALS = 2
"""Additional decimals: 0.001 mm is 0.00004 in."""
_POINT = re.compile(r"(?<=\d)\.(?=\d)")
_BOTH = re.compile(r"[.,]")


@dataclass(frozen=True, slots=True)
class NumberStyle:
    comma: bool = False
    """Comma as decimal sign, point as thousands separator."""
    inch: bool = False
    """Lengths of the part are shown and typed in inch."""
    day: str = "%Y-%m-%d"


_DAYS = {"de": "%d.%m.%Y"}
_COMMAS = ("de",)


def style_of(language: str, decimal: str = "locale", units: str = "mm") -> NumberStyle:
    """Return the number style of a language; `decimal`: ``locale``, ``point`` or ``comma``."""
    comma = language in _COMMAS if decimal == "locale" else decimal == "comma"
    return NumberStyle(comma, units == "inch", _DAYS.get(language, NumberStyle().day))


class _InUse:
    style: ClassVar[NumberStyle] = NumberStyle()


def use_numbers(style: NumberStyle) -> None:
    """Use a style from now on, in this process; existing displays do not change."""
    _InUse.style = style


def numbers_in_use() -> NumberStyle:
    return _InUse.style


def localised(text: str) -> str:
    """Return a text with the decimal sign in use for points between digits."""
    return _POINT.sub(",", text) if _InUse.style.comma else text


def plain_number(text: str) -> str:
    """Return one typed number in Python syntax, with a decimal point.

    Texts with both signs, two commas, or a possible thousands separator (1,234 with decimal points)
    get a question mark, so that they are invalid: a guess could be wrong by a factor of a thousand.
    """
    text = text.strip()
    return f"{text}?" if is_ambiguous(text) else text.replace(",", ".")


def is_ambiguous(text: str) -> bool:
    """Return whether a typed number could mean two values."""
    digits = any(sign.isdigit() for sign in text)
    return digits and bool(_BOTH.search(text)) and typed_value(text) is None


def typed_value(text: str) -> float | None:
    """Return a typed number; None if invalid or ambiguous."""
    return typed_number(text, comma=_InUse.style.comma)


def read_number(field: NumberField, text: str) -> float:
    """Return a number typed in the style in use; InputError as `NumberField.read`."""
    return field.read(text, comma=_InUse.style.comma)


def unit_word() -> str:
    return "in" if _InUse.style.inch else "mm"


def length_number(value_mm: float, *, signed: bool = False, decimals: int = 3) -> str:
    """Return a length without unit; `decimals` are for mm, two more in inch."""
    value = value_mm
    if _InUse.style.inch:
        value, decimals = value_mm / INCH_MM, decimals + _INCH_DECIMALS
    rounded = round(value, decimals) + 0.0  # adding zero turns -0.0 into 0.0
    return localised(f"{rounded:+.{decimals}f}" if signed else f"{rounded:.{decimals}f}")


def length_words(value_mm: float, *, signed: bool = False, decimals: int = 3) -> str:
    return f"{length_number(value_mm, signed=signed, decimals=decimals)} {unit_word()}"


_TYPED_DECIMALS = 8
"""Of an inch in a field: half a step is a tenth of the nanometre to which it is read."""

_READ_DECIMALS = 6
_WITH_UNIT = re.compile(r"(?P<number>.*?[\d.,])?\s*(?P<unit>[^\d\s.,+-]\D*)")


def field_length(value_mm: float) -> str:
    """Return a length for a field, with the unit only in inch."""
    if not _InUse.style.inch:
        short = f"{value_mm:g}"
        return localised(short if float(short) == value_mm else str(value_mm))
    text = f"{value_mm / INCH_MM:.{_TYPED_DECIMALS}f}".rstrip("0").rstrip(".")
    return f"{localised('0' if text == '-0' else text)} {unit_word()}"


def split_unit(text: str) -> tuple[str, str]:
    """Return a number as it was typed, and the unit of length behind it or an empty text."""
    found = _WITH_UNIT.fullmatch(text.strip())
    if found is None or find_unit(found["unit"], "length") is None:
        return text.strip(), ""
    return (found["number"] or "").strip(), found["unit"]


def to_mm(value: float, unit: str) -> float:
    """Return a length in mm; without a unit it is in the one that is shown."""
    factor = named_unit(unit or unit_word(), "length").factor
    return value if factor == 1.0 else round(scaled(value, factor), _READ_DECIMALS)


def day_words(when: date | str) -> str:
    """Return a day; of an ISO 8601 time the local one, of other text the text."""
    if isinstance(when, str):
        try:
            if len(when) > len("2026-01-31"):
                return day_words(datetime.fromisoformat(when).astimezone())
            return day_words(date.fromisoformat(when))
        except ValueError:
            return when
    return f"{when:{_InUse.style.day}}"


def time_words(when: datetime) -> str:
    """Return day, hour and minute."""
    return f"{when:{_InUse.style.day} %H:%M}"


class _Commas(string.Formatter):
    def format_field(self, value: Any, format_spec: str) -> Any:
        text = super().format_field(value, format_spec)
        if not isinstance(value, Real) or isinstance(value, bool):
            return text
        return _BOTH.sub(lambda sign: "," if sign.group() == "." else ".", text)


_COMMAS_FORMATTER = _Commas()


class Sentence(str):
    """A sentence whose `format` writes decimal commas; otherwise a plain string."""

    __slots__ = ()

    def format(self, *args: object, **names: object) -> str:
        """Format; numbers get a comma, texts are unchanged."""
        return _COMMAS_FORMATTER.vformat(self, args, names)
