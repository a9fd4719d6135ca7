"""Words of reports about features and results, and certificate values without limit, with U."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import replace

from ocmm_core.export.certificate import Certificate, CertificateValue
from ocmm_core.export.report import Element, ReportData, ReportedResult
from ocmm_core.export.template import PaperLengths
from ocmm_core.inspection.evaluation import FeatureView
from ocmm_core.wording import Speech
from ocmm_gui.kit import numbers_in_use, style_of, use_numbers
from ocmm_gui.reports._canvas import STRONG, Column, PageCanvas, PageField


def speech_of(data: ReportData) -> Speech:
    return Speech(data.paper.template.language)


def lengths_of(data: ReportData) -> PaperLengths:
    return PaperLengths(data.paper.template.lengths)


@contextlib.contextmanager
def numbers_of(data: ReportData) -> Iterator[None]:
    """Use unit and decimal sign of a report in code shared with the screen (scales, marks)."""
    before, template = numbers_in_use(), data.paper.template
    use_numbers(style_of(template.language, units=template.lengths))
    try:
        yield
    finally:
        use_numbers(before)


def count_words(seen: FeatureView) -> str:
    """Return the number of points of a feature, and of how many if not done."""
    unfinished = seen.provisional and seen.taken < seen.needed
    return f"{seen.taken} of {seen.needed}" if unfinished else str(seen.taken)


def element_words(element: Element, speech: Speech, lengths: PaperLengths) -> str:
    """Return an element in up to three lines: position, direction, size."""
    parts = ["x {}  y {}  z {}".format(*(lengths.number(float(x)) for x in element.point))]
    if element.direction is not None:
        parts.append("i {:z.5f}  j {:z.5f}  k {:z.5f}".format(*element.direction))
    named = (
        ("Ø", element.diameter),
        (speech.word("length"), element.length),
        (speech.word("width"), element.width),
    )
    sizes = [f"{name} {lengths.number(value)}" for name, value in named if value is not None]
    if element.angle_deg is not None:
        sizes.append(f"{speech.word('angle')} {element.angle_deg:.4f}°")
    return speech.number("\n".join([*parts, *(["   ".join(sizes)] if sizes else [])]))


def measurand(item: ReportedResult, speech: Speech) -> str:
    axis = f" {item.asked.axis}" if item.asked is not None and item.asked.axis else ""
    of = speech.word("of")
    return f"{speech.word(item.result.kind)}{axis} {of} {', '.join(item.result.features)}"


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
_LENGTH = "\\milli\\metre"
_UNITS = {
    "\\radian": "rad",
    "\\milli\\metre\\tothe{-1}": "1/mm",
    "\\milli\\metre\\tothe{-2}": "1/mm²",
    "\\milli\\metre\\tothe{-4}": "1/mm⁴",
}


def table_of_values(canvas: PageCanvas, paper: Certificate) -> None:
    """Lay out the table, if there are such values."""
    if not paper.values:
        return
    speech, lengths = canvas.speech, canvas.lengths
    values = [_in_unit(one, lengths) for one in paper.values]
    if not paper.values_before:
        # Earlier values are in the table of their state.
        words = "Further values, after the adjustment" if len(paper.runs) > 1 else "Further values"
        canvas.heading(words, 120.0)
        canvas.table(
            _VALUES,
            [[PageField(_name(one, speech, lengths)), *_stated(one, speech)] for one in values],
        )
        return
    before = {one.name: _in_unit(one, lengths) for one in paper.values_before}
    canvas.heading("Further values, before and after the adjustment", 160.0)
    rows = []
    for one in values:
        old = before.get(one.name)
        known = [PageField("–")] * 2
        if old is not None:
            known = [PageField(field.text) for field in _stated(old, speech)]
        name, change = PageField(_name(one, speech, lengths)), _change(old, one, speech)
        rows.append([name, *known, *_stated(one, speech), change])
    canvas.table(_PAIRS, rows)


def _in_unit(one: CertificateValue, lengths: PaperLengths) -> CertificateValue:
    """Return a length in the unit of the report; other values unchanged."""
    if one.unit != _LENGTH:
        return one
    wide = None if one.expanded is None else one.expanded * lengths.per_mm
    return replace(one, value=one.value * lengths.per_mm, expanded=wide)


def _name(one: CertificateValue, speech: Speech, lengths: PaperLengths) -> str:
    unit = lengths.word if one.unit == _LENGTH else _UNITS.get(one.unit, "")
    whose, mark, what = one.name.rpartition(": ")
    name = f"{whose}{mark}{speech.text(what)}"
    return f"{name}, {unit}" if unit else name


def _stated(one: CertificateValue, speech: Speech) -> list[PageField]:
    """Return a value to the second digit of its U, and U."""
    if one.expanded is None or not one.expanded > 0.0:
        return [PageField(speech.number(f"{one.value:z.6g}"), STRONG), PageField("–")]
    places = _places(one.expanded)
    value, expanded = f"{one.value:.3e}", f"{one.expanded:.1e}"
    if places is not None:
        value, expanded = f"{one.value:z.{places}f}", f"{one.expanded:.{places}f}"
    return [PageField(speech.number(value), STRONG), PageField(speech.number(expanded))]


def _change(old: CertificateValue | None, one: CertificateValue, speech: Speech) -> PageField:
    if old is None:
        return PageField("–")
    difference = one.value - old.value
    places = _places(one.expanded or 0.0)
    told = f"{difference:+.1e}" if places is None else f"{difference:+z.{places}f}"
    return PageField(speech.number(told))


def _places(expanded: float) -> int | None:
    """Return the decimal places of two digits of U; None if powers of ten are more legible."""
    if not expanded > 0.0:
        return None
    places = max(1 - math.floor(math.log10(expanded)), 0)
    return places if places <= _PLACES else None
