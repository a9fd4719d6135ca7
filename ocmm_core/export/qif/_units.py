"""Units of a QIF document: declared once, named by values, never guessed.

A document declares its units by name and factor (Units.xsd, ``S = (X + Offset) Factor``); a value
names one of them, or none and has the primary one. In characteristics the PMI units come first. A
name that is known elsewhere must have the factor it has everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from lxml import etree

_MM = {
    "mm": 1.0, "millimeter": 1.0, "millimetre": 1.0, "cm": 10.0, "m": 1000.0, "meter": 1000.0,
    "metre": 1000.0, "um": 1e-3, "µm": 1e-3, "μm": 1e-3, "micrometer": 1e-3, "micrometre": 1e-3,
    "in": 25.4, "inch": 25.4, "ft": 304.8, "foot": 304.8, "mil": 0.0254, "uin": 25.4e-6,
}  # fmt: skip
_DEGREES = {
    "degree": 1.0, "deg": 1.0, "degrees": 1.0, "°": 1.0, "radian": math.degrees(1.0),
    "rad": math.degrees(1.0), "radians": math.degrees(1.0), "revolution": 360.0,
}  # fmt: skip
_ROUNDED = 1e-6
"""Relative: a factor is written with at least seven digits."""


class NotTakenError(Exception):
    """Reason why an item, or the whole document, is not taken."""


@dataclass(frozen=True, slots=True)
class Units:
    """Units of length and angle of a document."""

    lengths: Mapping[str, float] = field(default_factory=dict)
    """mm for one of each declared unit, by its name in lower case."""
    angles: Mapping[str, float] = field(default_factory=dict)
    """Degrees for one of each, likewise."""
    primary: Mapping[str, str] = field(default_factory=dict)
    """Names of the primary units by their elements, such as ``PMIAngularUnit``."""

    def length(self, name: str, *, is_pmi: bool) -> float:
        """Return mm for one of a value's unit; an empty name is the primary one.

        Raises
        ------
        NotTakenError
            The unit is not stated or not known.
        """
        return self._scale(name, "LinearUnit", self.lengths, _MM, is_pmi=is_pmi)

    def angle(self, name: str, *, is_pmi: bool) -> float:
        """Return degrees for one of a value's unit, likewise."""
        return self._scale(name, "AngularUnit", self.angles, _DEGREES, is_pmi=is_pmi)

    def _scale(
        self,
        name: str,
        element: str,
        declared: Mapping[str, float],
        known: Mapping[str, float],
        *,
        is_pmi: bool,
    ) -> float:
        primary = (self.primary.get(f"PMI{element}", "") if is_pmi else "") or self.primary.get(
            element, ""
        )
        word = (name or primary).casefold()
        if not word:
            raise NotTakenError(f"the document states no {element} for it")
        found = declared.get(word, known.get(word))
        if found is None:
            raise NotTakenError(f"its unit {word[:30]!r} is not known")
        return found


def units_of(root: etree._Element, prefix: str) -> Units:
    """Read the units that a document declares.

    Parameters
    ----------
    root
        The document.
    prefix
        Namespace of its elements, in braces.

    Raises
    ------
    NotTakenError
        A name and its factor contradict each other, or one name has two factors.
    """
    lengths: dict[str, float] = {}
    angles: dict[str, float] = {}
    primary: dict[str, str] = {}
    groups = ("PrimaryUnits", "OtherUnits")
    for group in groups:
        for unit in root.iterfind(f"{prefix}FileUnits/{prefix}{group}/*"):
            word = str(unit.tag).removeprefix(prefix)
            is_length = word in ("LinearUnit", "PMILinearUnit")
            if not is_length and word not in ("AngularUnit", "PMIAngularUnit"):
                continue
            name = (unit.findtext(f"{prefix}UnitName") or "").strip().casefold()
            known, held = (_MM, lengths) if is_length else (_DEGREES, angles)
            scale = _scale_of(unit, name, known.get(name), prefix, is_length=is_length)
            if not math.isclose(held.setdefault(name, scale), scale, rel_tol=_ROUNDED):
                raise NotTakenError(f"unit {name!r} has two factors")
            if group == "PrimaryUnits" and primary.setdefault(word, name) != name:
                raise NotTakenError(f"it has two primary units {word}")
    return Units(lengths, angles, primary)


def _scale_of(
    unit: etree._Element, name: str, known: float | None, prefix: str, *, is_length: bool
) -> float:
    """Return mm or degrees for one of a declared unit; the exact factor of a known name."""
    si = (unit.findtext(f"{prefix}SIUnitName") or "").strip()
    meant = "meter" if is_length else "radian"
    if si not in ("", meant):
        raise NotTakenError(f"unit {name[:30]!r} is converted to {si[:30]!r}, not to {meant}")
    conversion = unit.find(f"{prefix}UnitConversion")
    if conversion is None:
        # Without a conversion it is the SI unit, if the document names that, or a known one.
        factor = 1.0 if si or known is None else None
    else:
        factor = _positive(conversion.findtext(f"{prefix}Factor"), name)
        if float(conversion.findtext(f"{prefix}Offset") or 0.0) != 0.0:
            raise NotTakenError(f"unit {name[:30]!r} has an offset")
    stated = None if factor is None else factor * (1000.0 if is_length else math.degrees(1.0))
    if known is None:
        if conversion is None or stated is None:
            raise NotTakenError(f"unit {name[:30]!r} is not known and has no factor")
        return stated
    if stated is not None and not math.isclose(stated, known, rel_tol=_ROUNDED):
        raise NotTakenError(f"unit {name!r} contradicts its factor {factor:g}")
    return known


def _positive(text: str | None, name: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise NotTakenError(f"unit {name[:30]!r} has the factor {(text or '')[:30]!r}")
    return value
