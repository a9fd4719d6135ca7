"""Values of a certificate that have no limit, with U, and as they were before an adjustment."""

from __future__ import annotations

import math

from ocmm_core.export.certificate import Certificate, CertificateValue
from ocmm_gui.reports._canvas import STRONG, Canvas, Column, PageField

_VALUES = (
    Column("Value", 1000.0),
    Column("", 400.0, right=True),
    Column("U (k = 2)", 400.0, right=True),
)
_PAIRS = (
    Column("Value", 560.0),
    Column("Before", 250.0, right=True),
    Column("U (k = 2)", 220.0, right=True),
    Column("After", 250.0, right=True),
    Column("U (k = 2)", 220.0, right=True),
    Column("Change", 250.0, right=True),
)
_PLACES = 6
_UNITS = {
    "\\milli\\metre": "mm",
    "\\radian": "rad",
    "\\milli\\metre\\tothe{-1}": "1/mm",
    "\\milli\\metre\\tothe{-2}": "1/mm²",
    "\\milli\\metre\\tothe{-4}": "1/mm⁴",
}


def table_of_values(canvas: Canvas, paper: Certificate) -> None:
    """Lay the table out; nothing where there are no such values."""
    if not paper.values:
        return
    if not paper.values_before:
        # Those of the state before stand in its table.
        adjusted = len(paper.runs) > 1
        words = "Further values, after the adjustment" if adjusted else "Further values"
        canvas.heading(words, 120.0)
        canvas.table(_VALUES, [[PageField(_name(one)), *_stated(one)] for one in paper.values])
        return
    before = {one.name: one for one in paper.values_before}
    canvas.heading("Further values, before and after the adjustment", 160.0)
    rows = []
    for one in paper.values:
        old = before.get(one.name)
        known = [PageField("–")] * 2 if old is None else [PageField(x.text) for x in _stated(old)]
        rows.append([PageField(_name(one)), *known, *_stated(one), _change(old, one)])
    canvas.table(_PAIRS, rows)


def _name(one: CertificateValue) -> str:
    unit = _UNITS.get(one.unit, "")
    return f"{one.name}, {unit}" if unit else one.name


def _stated(one: CertificateValue) -> list[PageField]:
    """Return a value to the second digit of its U, and U."""
    if one.expanded is None or not one.expanded > 0.0:
        return [PageField(f"{one.value:z.6g}", STRONG), PageField("–")]
    places = _places(one.expanded)
    if places is None:
        return [PageField(f"{one.value:.3e}", STRONG), PageField(f"{one.expanded:.1e}")]
    return [
        PageField(f"{one.value:z.{places}f}", STRONG), PageField(f"{one.expanded:.{places}f}")
    ]  # fmt: skip


def _change(old: CertificateValue | None, one: CertificateValue) -> PageField:
    if old is None:
        return PageField("–")
    difference = one.value - old.value
    places = _places(one.expanded or 0.0)
    return PageField(f"{difference:+.1e}" if places is None else f"{difference:+z.{places}f}")


def _places(expanded: float) -> int | None:
    """Return the decimal places of two digits of U; None where powers of ten read better."""
    if not expanded > 0.0:
        return None
    places = max(1 - math.floor(math.log10(expanded)), 0)
    return places if places <= _PLACES else None
