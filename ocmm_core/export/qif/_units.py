"""Units of a QIF document: declared once, named by values, never guessed.

A document declares its units by name and factor (Units.xsd, ``S = (X + Offset) Factor``); a value
names one of them, or none for the primary one. In characteristics the PMI units have priority. A
known name must have its usual factor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, MutableMapping
from dataclasses import dataclass

from lxml import etree

from ocmm_core.units import Dimension, agreed_unit, find_unit, scaled

_ROUNDED = 1e-6
"""Relative: a factor is written with at least seven digits."""


class NotTakenError(Exception):
    """Why an item, or the whole document, is not imported."""


@dataclass(frozen=True, slots=True)
class DocumentUnits:
    lengths: MutableMapping[str, float]
    """mm per declared unit, by name."""
    angles: MutableMapping[str, float]
    """Degrees per declared unit, by name."""
    primary: MutableMapping[str, str]
    """Names of the primary units by element, such as ``PMIAngularUnit``."""

    def length(self, name: str, *, is_pmi: bool) -> float:
        """Return mm per unit, the primary one for an empty name; NotTakenError if unknown."""
        return self._scale(name, "LinearUnit", self.lengths, "length", is_pmi=is_pmi)

    def angle(self, name: str, *, is_pmi: bool) -> float:
        """Return degrees per unit of a value, likewise."""
        return self._scale(name, "AngularUnit", self.angles, "angle", is_pmi=is_pmi)

    def _scale(
        self,
        name: str,
        element: str,
        declared: Mapping[str, float],
        dimension: Dimension,
        *,
        is_pmi: bool,
    ) -> float:
        primary = self.primary.get(element, "")
        word = name or (self.primary.get(f"PMI{element}", primary) if is_pmi else primary)
        if not word:
            raise NotTakenError(f"the document states no {element} for it")
        known = find_unit(word, dimension)
        found = declared.get(word, None if known is None else known.factor)
        if found is None:
            raise NotTakenError(f"its unit {word[:30]!r} is not known")
        return found


def units_of(root: etree._Element, prefix: str) -> DocumentUnits:
    """Read the units that a document declares.

    `prefix`: namespace of its elements, in braces. Raises InputError if a name contradicts its
    factor, NotTakenError for an unknown unit without a factor, or one name with two factors.
    """
    units = DocumentUnits({}, {}, {})
    for group in ("PrimaryUnits", "OtherUnits"):
        for unit in root.iterfind(f"{prefix}FileUnits/{prefix}{group}/*"):
            word = str(unit.tag).removeprefix(prefix)
            if word not in ("LinearUnit", "PMILinearUnit", "AngularUnit", "PMIAngularUnit"):
                continue
            name = (unit.findtext(f"{prefix}UnitName") or "").strip()
            is_length = word.endswith("LinearUnit")
            scale = _scale_of(unit, name, prefix, "length" if is_length else "angle")
            held = units.lengths if is_length else units.angles
            if not math.isclose(held.setdefault(name, scale), scale, rel_tol=_ROUNDED):
                raise NotTakenError(f"unit {name[:30]!r} has two factors")
            if group == "PrimaryUnits" and units.primary.setdefault(word, name) != name:
                raise NotTakenError(f"it has two primary units {word}")
    return units


def _scale_of(unit: etree._Element, name: str, prefix: str, dimension: Dimension) -> float:
    """Return mm or degrees per declared unit; the exact factor of a known name."""
    si = (unit.findtext(f"{prefix}SIUnitName") or "").strip()
    if si not in ("", "meter" if dimension == "length" else "radian"):
        raise NotTakenError(f"unit {name[:30]!r} is converted to {si[:30]!r}")
    conversion, factor = unit.find(f"{prefix}UnitConversion"), None
    if conversion is not None:
        factor = number(conversion.findtext(f"{prefix}Factor") or "")
        if factor <= 0.0 or number(conversion.findtext(f"{prefix}Offset") or "0") != 0.0:
            raise NotTakenError(f"unit {name[:30]!r} has no positive factor alone")
    if find_unit(name, dimension) is not None:
        return agreed_unit(name, factor, dimension, "FileUnits").factor
    if factor is None:
        raise NotTakenError(f"unit {name[:30]!r} is not known and has no factor")
    return scaled(factor, 1000.0 if dimension == "length" else math.degrees(1.0))


def number(text: str) -> float:
    """Return a finite number; NotTakenError otherwise."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise NotTakenError(f"{text.strip()[:30]!r} is no number")
    return value
