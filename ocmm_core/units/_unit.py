"""The table of units: lengths in mm, angles in degrees, temperatures in degrees Celsius."""

from __future__ import annotations

import math
import re
import unicodedata
from dataclasses import dataclass
from decimal import Context, Decimal
from pathlib import Path
from typing import Literal, TypeAlias

from ocmm_core.errors import InputError

Dimension: TypeAlias = Literal["length", "angle", "temperature"]

_SAME = 1e-6
"""Relative difference up to which a factor agrees with its name: the US survey foot is 2e-6 off."""
_LONGEST = 60
_MARKS = str.maketrans(
    dict.fromkeys("\u2033\u201c\u201d\u201e\u201f", '"')
    | dict.fromkeys("\u2032\u2019\u2018\u00b4", "'")
)
_SI_OF: dict[Dimension, float] = {"length": 1e-3, "angle": math.radians(1.0), "temperature": 1.0}
_BASE: dict[Dimension, str] = {"length": "mm", "angle": "degrees", "temperature": "kelvin"}
_EXAMPLES: dict[Dimension, str] = {
    "length": "mm, cm, m, µm, inch, mil, ft",
    "angle": "deg, rad, gon, arcmin, arcsec",
    "temperature": "°C, K, °F",
}

_PREFIXES = (
    ("kilo", "k", 1e3), ("hecto hekto", "h", 1e2), ("deca deka", "da", 1e1),
    ("deci dezi", "d", 1e-1), ("centi zenti", "c", 1e-2),
    ("milli mili", "m", 1e-3), ("micro mikro", "µ", 1e-6), ("micro mikro", "u", 1e-6),
    ("nano", "n", 1e-9),
)  # fmt: skip
_METRES = "metre metres meter meters metern metro metros metri metr metry metrow"
_MULTIPLE = re.compile(
    r"(?:1/(?P<part>\d{1,9})|10\^(?P<power>[+-]?\d{1,2})|"
    r"(?P<times>\d{1,9}(?:[.,]\d{1,9})?(?:e[+-]?\d{1,2})?))\s*[*x×·]?\s*(?P<unit>[^\s*x×·/^].*)",
    re.IGNORECASE,
)


_EXACT = Context(prec=60)


def scaled(value: float, factor: float) -> float:
    """Return the product of two decimal numbers, rounded once: 1.5 inch is 38.1 mm.

    Their shortest notations are multiplied: of 1.5 and 25.4, not of their nearest binary numbers.
    """
    if factor == 1.0 or not math.isfinite(value):
        return value
    return float(_EXACT.multiply(Decimal(repr(float(value))), Decimal(repr(float(factor)))))


@dataclass(frozen=True, slots=True)
class MeasureUnit:
    """A unit of length, angle or temperature."""

    symbol: str
    dimension: Dimension
    factor: float
    """Size of one in mm, degrees or kelvin; `si` converts to metre, radian and kelvin."""
    offset: float = 0.0
    """Zero of a temperature scale, degrees Celsius."""

    @property
    def si(self) -> float:
        """Return the size of one in metre, radian or kelvin."""
        return self.factor * _SI_OF[self.dimension]


def _lengths() -> dict[str, MeasureUnit]:
    sizes = [
        ("m", _METRES, 1e3),
        (
            "inch",
            "in inch inches zoll pouce pouces pulgada pulgadas pollice pollici polegada polegadas "
            "duim tum \" '' internationalinch "
            "英寸 吋 インチ 인치 дюйм дюймы дюймах",
            25.4,
        ),
        (
            "ft",
            "foot feet fuß fuss pied pieds pie pies piede piedi ' internationalfoot "
            "internationalfeet",
            304.8,
        ),
        (
            "US survey ft",
            "ussurveyfoot ussurveyfeet ussurveyft surveyfoot surveyfeet usft ftus sft",
            1200e3 / 3937.0,
        ),
        ("yd", "yard yards", 914.4),
        ("mi", "mile miles", 1609344.0),
        (
            "mil",
            "mils thou thous milliinch milliinches thousandthofaninch thousandthsofaninch "
            "thousandthofinch thousandthsofinch thousandthsinch",
            0.0254,
        ),
        ("µin", "microinch microinches uin", 25.4e-6),
        ("µm", "µ micron microns mikron", 1e-3),
        ("Å", "angstrom angstroms å", 1e-7),
        ("mm", "毫米 公厘 ミリ ミリメートル 밀리미터 мм миллиметр миллиметры миллиметрах", 1.0),
        ("cm", "厘米 センチメートル см", 10.0),
        ("µm", "微米 ミクロン マイクロメートル мкм", 1e-3),
        ("m", "米 メートル м метр метры метрах", 1e3),
    ]
    for words, sign, scale in _PREFIXES:
        names = " ".join(word + base for word in words.split() for base in _METRES.split())
        symbol = "µm" if sign == "u" else f"{sign}m"
        sizes.append((symbol, f"{sign}m {names}", scaled(1e3, scale)))
    return _table(sizes, "length")


def _table(sizes: list[tuple[str, str, float]], of: Dimension) -> dict[str, MeasureUnit]:
    found: dict[str, MeasureUnit] = {}
    for symbol, names, factor in sizes:
        unit = MeasureUnit(symbol, of, factor)
        for name in (symbol, *names.split()):
            found[_key(name)] = unit
    return found


def _key(text: str) -> str:
    """Return a name without case, accents, blanks, hyphens and a full stop."""
    folded = text.replace("μ", "µ").replace("\u212b", "å").casefold().replace("μ", "µ")
    folded = re.sub(r"[\s_\\-]", "", folded).removesuffix(".")
    if folded in ("å", "µ"):
        return folded
    plain = unicodedata.normalize("NFD", folded)
    return "".join(sign for sign in plain if not unicodedata.combining(sign))


_UNITS: dict[Dimension, dict[str, MeasureUnit]] = {
    "length": _lengths(),
    "angle": _table(
        [
            ("deg", "° degree degrees degs angdec angdegdec gradi grados degre degres", 1.0),
            ("rad", "radian radians radiant", math.degrees(1.0)),
            ("mrad", "milliradian milliradians", math.degrees(1e-3)),
            ("µrad", "urad microradian microradians", math.degrees(1e-6)),
            ("gon", "gons gradian gradians", 0.9),
            ("arcmin", "arcminute arcminutes minuteofarc minutesofarc bogenminute "
             "bogenminuten '", 1.0 / 60.0),
            ("arcsec", "arcsecond arcseconds secondofarc secondsofarc bogensekunde "
             "bogensekunden \"", 1.0 / 3600.0),
        ],
        "angle",
    ),
    "temperature": _table([("K", "kelvin kelvins", 1.0)], "temperature"),
}  # fmt: skip
_CELSIUS = MeasureUnit("°C", "temperature", 1.0)
_FAHRENHEIT = MeasureUnit("°F", "temperature", 5.0 / 9.0, -160.0 / 9.0)
_UNITS["temperature"] |= dict.fromkeys(
    ("°c", "c", "degc", "celsius", "degreecelsius", "degreescelsius", "gradcelsius", "tempc"),
    _CELSIUS,
) | dict.fromkeys(
    ("°f", "f", "degf", "fahrenheit", "degreefahrenheit", "degreesfahrenheit", "tempf"), _FAHRENHEIT
)
_DISTINCT = {"M", "Mm", "mM", "Nm", "NM", "nM", "MI", "k", "kelvins."}
"""Spellings whose case makes them another quantity, or leaves it open."""


def find_unit(text: str, dimension: Dimension | None = None) -> MeasureUnit | None:
    """Return the unit that ``text`` names, or None.

    A name in one of several languages, a symbol or a multiple such as "0.001 inch". Without a
    ``dimension``, marks such as ``"`` are lengths.
    """
    plain = text.strip().translate(_MARKS)
    if not plain or len(plain) > _LONGEST:
        return None
    key, distinct = _key(plain), plain.rstrip(".") in _DISTINCT
    for of, table in _UNITS.items():
        if dimension in (None, of) and key in table and not distinct:
            return table[key]
    multiple = _MULTIPLE.fullmatch(plain)
    if multiple is None:
        return None
    unit = find_unit(multiple["unit"], dimension)
    if unit is None or unit.dimension == "temperature" or _MULTIPLE.fullmatch(multiple["unit"]):
        return None
    if multiple["power"]:
        scale = float(f"1e{multiple['power']}")
    elif multiple["part"]:
        scale = 1.0 / max(int(multiple["part"]), 1)
    else:
        scale = float(multiple["times"].replace(",", "."))
    if not 0.0 < scale < math.inf:
        return None
    symbol = unit.symbol if scale == 1.0 else plain
    return MeasureUnit(symbol, unit.dimension, scaled(scale, unit.factor))


def named_unit(
    text: str, dimension: Dimension, path: Path | str = "", line: int = 0
) -> MeasureUnit:
    """Return the unit that ``text`` names; InputError if unknown or of another quantity.

    ``path`` and ``line`` are its place, for the error; empty and 0 if a user typed it.
    """
    unit = find_unit(text, dimension)
    if unit is None:
        kind, name, examples = dimension, text[:_LONGEST], _EXAMPLES[dimension]
        raise InputError(
            "unit.unknown",
            f"{f'{path}, line {line}: ' if line else f'{path}: ' if path else ''}"
            f"{name!r} is not a known unit of {kind}.",
            f"Use one of {examples}.",
        )
    return unit


def agreed_unit(
    name: str, si_factor: float | None, dimension: Dimension, where: str
) -> MeasureUnit:
    """Return the unit ``name``; InputError if unknown, or if it contradicts its factor.

    ``si_factor``: size of one in metre, radian or kelvin by the document; None if not given.
    ``where``: start of the error's sentence: file, and line or item.
    """
    unit = named_unit(name, dimension, where)
    if si_factor is not None and not abs(si_factor / unit.si - 1.0) <= _SAME:
        size = si_factor / _SI_OF[dimension]
        raise InputError(
            "unit.contradiction",
            f"{where}: one {name[:_LONGEST]!r} is {size:g} {_BASE[dimension]} in the document, "
            f"but {unit.factor:g} by its name.",
            "Correct the name or the factor of the unit.",
        )
    return unit
