"""Words of the report about features and results."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from ocmm_core.export.report import Element, ReportData, ReportedResult
from ocmm_core.export.template import PaperLengths
from ocmm_core.inspection.evaluation import FeatureView
from ocmm_core.wording import Speech
from ocmm_gui.kit import numbers_in_use, style_of, use_numbers


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
