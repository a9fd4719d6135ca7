"""Numbers as other programs write them: decimal sign, thousands, exponents, units.

The decimal sign follows from evidence over the whole file. A file without evidence is refused.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.units import MeasureUnit, find_unit

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,3})?")
_SIMPLE = re.compile(r"[+-]?\d+(?:(?P<sign>[.,])\d*)?")
_SIGNED = re.compile(r"(?P<size>[+-]?[\d.,]*\d[\d.,]*)(?P<power>[eEdD][+-]?\d{1,3})?")
_GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}(?P<sign>[ '_])\d{3}(?:(?P=sign)\d{3})*(?:[.,]\d*)?")
_GROUPED = {sign: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:\{sign}\d{{3}})+") for sign in ".,"}
_WITH_UNIT = re.compile(
    r"(?P<number>[+-]?[\d.,' ]*[\d.](?:[eE][+-]?\d+)?)\s*(?P<unit>[^\d\s.,+-].*)"
)
_MINUS = dict.fromkeys(map(ord, "\u2212\u2012\u2013\ufe63\uff0d\u2010\u2011"), "-")
_BLANKS = dict.fromkeys(map(ord, "\u00a0\u2007\u2009\u202f\u200a"), " ")
_APOSTROPHES = dict.fromkeys(map(ord, "\u2019\u02bc\u00b4\u2018"), "'")
_OTHER_SIGNS = {**_MINUS, **_BLANKS, **_APOSTROPHES}
BLANKS = "".join(map(chr, _BLANKS))
MIXED = ".,"
"""Decimal sign of a file with both, whose numbers are clear one by one."""
DECIMALS = {"point": ".", "comma": ","}
"""Words of the option ``--decimal``."""


@dataclass(frozen=True, slots=True)
class NumberGrammar:
    """Decimal sign of a file, and its evidence."""

    decimal: str = "."
    evidence: str = ""
    """A sentence part such as "'0,012' in line 3"; empty if no number has decimals."""

    def value(self, text: str) -> float:
        """Return the number that ``text`` is; NaN for other texts."""
        if self.decimal == "." and NUMBER.fullmatch(text):
            return float(text.replace("d", "e").replace("D", "e"))
        if self.decimal == "," and _SIMPLE.fullmatch(text) and "." not in text:
            return float(text.replace(",", "."))
        plain = plain_signs(text)
        if self.decimal == MIXED:
            plain = plain.replace(",", ".")
            return NumberGrammar().value(plain) if plain.count(".") < 2 else math.nan
        if (groups := _GROUPS.fullmatch(plain)) is not None and groups["sign"] != "_":
            plain = plain.replace(groups["sign"], "")
        other = "." if self.decimal == "," else ","
        whole, sign, rest = plain.partition(self.decimal)
        if other in whole:
            if not _GROUPED[other].fullmatch(whole):
                return math.nan
            whole = whole.replace(other, "")
        joined = f"{whole}.{rest}" if sign else whole
        found = NUMBER.fullmatch(joined)
        return float(re.sub("[dD]", "e", joined)) if found else math.nan


def plain_signs(text: str) -> str:
    """Return ``text`` with ASCII digits, minus signs, blanks and apostrophes."""
    if text.isascii():
        return text.strip()
    return unicodedata.normalize("NFKC", text.translate(_OTHER_SIGNS)).strip()


def is_number(text: str) -> bool:
    """Return whether ``text`` is a number with some decimal sign; it may have a unit of length."""
    if NUMBER.fullmatch(text) or _SIMPLE.fullmatch(text):
        return True
    if not any(sign.isdigit() for sign in text):
        return False
    plain = plain_signs(text)
    if _SIGNED.fullmatch(plain) or _GROUPS.fullmatch(plain):
        return True
    bare, unit = number_with_unit(text)
    return unit is not None and bool(bare)


def number_with_unit(text: str) -> tuple[str, MeasureUnit | None]:
    """Return a number and the unit of length behind it, None if it has none."""
    if NUMBER.fullmatch(text):
        return text, None
    plain = plain_signs(text)
    if _GROUPS.fullmatch(plain):
        return text, None
    found = _WITH_UNIT.fullmatch(plain)
    unit = None if found is None else find_unit(found["unit"], "length")
    return (text, None) if found is None or unit is None else (found["number"].strip(), unit)


def grammar_of(path: Path, cells: Iterable[tuple[int, str]], decimal: str = "") -> NumberGrammar:
    """Return the decimal sign that the numbers of a file prove.

    ``cells``: line and text of every numeric cell; ``decimal``: ``point`` or ``comma`` if stated by
    the user, else empty. InputError if numbers contradict each other or are ambiguous, as 1,234.
    """
    if decimal and decimal not in DECIMALS:
        raise InputError(
            "table.decimal", f"{shortened(decimal)} is not a decimal sign.", "Give point or comma."
        )
    if decimal:
        return NumberGrammar(DECIMALS[decimal], "as stated")
    cells = list(cells)
    proofs, groups, unclear = _weighed(cells, is_short=True)
    if len(proofs) == 2:
        proofs, groups, unclear = _weighed(cells, is_short=False)
    if len(proofs) == 2:
        (_, point), (_, comma) = sorted(proofs.items(), key=lambda item: item[0] == ",")
        both = f"{shortened(point[1])} in line {point[0]}, {shortened(comma[1])} in line {comma[0]}"
        if not groups and not unclear:
            return NumberGrammar(MIXED, both)
        line, text = next(iter((*groups.values(), *unclear.values())))
        raise InputError(
            "table.decimal",
            f"{path}: the numbers have decimal points and decimal commas ({both}); "
            f"{shortened(text)} in line {line} could mean two values.",
            "Write all numbers with the same decimal sign.",
        )
    sign = next(iter(proofs), "." if "," not in unclear else "")
    other = {".": ",", ",": "."}.get(sign, ",")
    if other in unclear and other not in groups:
        line, text = unclear[other]
        low = text.replace(other, ".")
        raise InputError(
            "table.decimal",
            f"{path}, line {line}: {shortened(text)} could be {low} or {text.replace(other, '')}.",
            "State the decimal sign: point or comma.",
        )
    line, text = proofs.get(sign, (0, ""))
    return NumberGrammar(sign or ".", f"{shortened(text)} in line {line}" if line else "")


_Found: TypeAlias = dict[str, tuple[int, str]]
"""Line and text of the first number of a kind, by its sign."""


def _weighed(cells: Iterable[tuple[int, str]], *, is_short: bool) -> tuple[_Found, _Found, _Found]:
    """Return proofs of the decimal sign, of thousands, and ambiguous numbers.

    `is_short`: Leave out numbers with the sign that is proven already.
    """
    proofs: _Found = {}
    groups: _Found = {}
    unclear: _Found = {}
    for line, text in cells:
        simple = _SIMPLE.fullmatch(text) if is_short else None
        if simple is None or not (simple["sign"] is None or simple["sign"] in proofs):
            _weigh(line, text, proofs, groups, unclear)
    return proofs, groups, unclear


def _weigh(line: int, text: str, proofs: _Found, groups: _Found, unclear: _Found) -> None:
    """Enter what one number proves: its decimal sign, its sign between thousands, or nothing."""
    plain = plain_signs(number_with_unit(text)[0])
    if _GROUPS.fullmatch(plain):
        tail = re.search("[.,]", plain)
        if tail is not None:
            proofs.setdefault(tail[0], (line, text))
        return
    signed = _SIGNED.fullmatch(plain)
    if signed is None:
        return
    size = signed["size"]
    point, comma = size.count("."), size.count(",")
    if point and comma:
        last = max(".,", key=size.rfind)
        other = "," if last == "." else "."
        if size.count(last) == 1 and _GROUPED[other].fullmatch(size[: size.rfind(last)]):
            proofs.setdefault(last, (line, text))
            groups.setdefault(other, (line, text))
        return
    sign = "." if point else ","
    count = point or comma
    if count == 0:
        return
    if _GROUPED[sign].fullmatch(size) and not signed["power"]:
        if count > 1:
            other = "," if sign == "." else "."
            groups.setdefault(sign, (line, text))
            proofs.setdefault(other, (line, text))
        else:
            unclear.setdefault(sign, (line, text))
    elif count == 1:
        proofs.setdefault(sign, (line, text))


def typed_number(text: str, *, comma: bool) -> float | None:
    """Return a number typed into a field; None if it is not a number or could mean two values.

    ``comma``: the field shows numbers with a decimal comma. The other sign is also a decimal sign,
    unless it could separate thousands: 1,234 is refused where numbers have a decimal point.
    """
    plain = plain_signs(text)
    shown = "," if comma else "."
    other = "." if comma else ","
    if other in plain and (shown in plain or _GROUPED[other].fullmatch(plain)):
        return None
    value = NumberGrammar().value(plain.replace(",", "."))
    return value if math.isfinite(value) and plain.count(",") <= 1 else None
