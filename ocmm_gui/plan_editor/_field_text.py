"""Texts of the fields of a form, and their meaning."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from ocmm_core.errors import InputError
from ocmm_core.names import normal_name
from ocmm_core.typed_numbers import COORDINATE
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.plan_editor._field_labels import FieldUnit
from ocmm_gui.plan_editor._form_lines import FieldKind, FormLine

_YES, _NO = "yes", "no"
FLAGS = (_NO, _YES)

_WANTED: Mapping[FieldKind, str] = {
    FieldKind.COUNT: later("a whole number"),
    FieldKind.NUMBER: later("a number"),
    FieldKind.VECTOR: later("three numbers separated by spaces"),
    FieldKind.NUMBERS: later("numbers separated by spaces"),
    FieldKind.SPAN: later("two numbers, least and most"),
    FieldKind.PLACES: later("one name and three numbers per line"),
}


_TO = re.compile(r"\s+(?:to|bis|-|–|…)\s+|\s*[–…]\s*|\s+")
"""Separators of least and most."""


def text_of(line: FormLine, value: Any, *, angle: bool = False) -> str:
    """Return the text of a field; `angle`: values of kind length are in degrees."""
    match line.kind:
        case _ if kit.numbers_in_use().inch and _is_length(line, angle=angle):
            return _in_inch(line, value)
        case FieldKind.FLAG:
            return _YES if value else _NO
        case FieldKind.NAMES:
            return ", ".join(value)
        case FieldKind.VECTOR | FieldKind.NUMBERS:
            return _row(value)
        case FieldKind.SPAN:
            return " – ".join(map(_plain, value or ()))
        case FieldKind.PLACES:
            return "\n".join(_place(item) for item in value)
        case FieldKind.FIXED if isinstance(value, list | tuple):
            return "\n".join(_place(item) if isinstance(item, Mapping) else
                             _row(item) if isinstance(item, list | tuple) else _plain(item)
                             for item in value)  # fmt: skip
        case _:
            return _plain(value)


def value_of(line: FormLine, text: str, *, angle: bool = False) -> Any:
    """Return the value of a field's text, lengths in mm; InputError names the field."""
    text = normal_name(text)
    match line.kind:
        case FieldKind.FLAG:
            return text == _YES
        case FieldKind.NAMES:
            return [part.strip() for part in text.split(",") if part.strip()]
        case FieldKind.TEXT | FieldKind.CHOICE:
            return text
        case FieldKind.SPAN:
            ends = _numbers(line, text, _TO.split(text), None) if text else []
            if len(ends) not in (0, 2):
                raise _fault(line, text)
            return ends or None
        case FieldKind.PLACES:
            rows = [row.split() for row in text.splitlines() if row.strip()]
            units = [_taken_unit(line, row, angle=angle) for row in rows]
            if any(len(row) < 4 for row in rows):
                raise _fault(line, text)
            name, place = line.parts
            return [
                {name: " ".join(row[:-3]), place: _numbers(line, text, row[-3:], unit)}
                for row, unit in zip(rows, units, strict=True)
            ]
        case _:
            words = text.split()
            unit = _taken_unit(line, words, angle=angle)
            values = _numbers(line, text, words, unit)
    if line.kind is FieldKind.NUMBERS:
        return values
    if len(values) != (3 if line.kind is FieldKind.VECTOR else 1):
        raise _fault(line, text)
    if line.kind is FieldKind.VECTOR:
        return values
    if line.kind is FieldKind.COUNT:
        if values[0] != int(values[0]):
            raise _fault(line, text)
        return int(values[0])
    return values[0]


def _is_length(line: FormLine, *, angle: bool) -> bool:
    return line.measure is FieldUnit.LENGTH or (line.measure is FieldUnit.BY_KIND and not angle)


def _in_inch(line: FormLine, value: Any) -> str:
    """Return lengths in inch; the unit follows the last one of a row."""
    if line.kind is FieldKind.PLACES:
        rows = [(name, values) for name, values in (item.values() for item in value)]
        return "\n".join(f"{name}  {_inches(values)}" for name, values in rows)
    return _inches(value if isinstance(value, list | tuple) else (value,))


def _inches(values: Iterable[float]) -> str:
    texts = [kit.field_length(float(value)).removesuffix(f" {kit.unit_word()}") for value in values]
    return f"{'  '.join(texts)} {kit.unit_word()}" if texts else ""


def _taken_unit(line: FormLine, words: list[str], *, angle: bool) -> str | None:
    """Remove the unit from the end of a row of words; None if its numbers are no lengths."""
    if not _is_length(line, angle=angle):
        # With a unit such a number is invalid.
        return None
    if not words:
        return kit.unit_word()
    last, unit = kit.split_unit(words[-1])
    if unit:
        words[-1:] = [last] if last else []
    return unit or kit.unit_word()


def _numbers(line: FormLine, text: str, words: list[str], unit: str | None) -> list[float]:
    values = [kit.typed_value(word) for word in words]
    if unit is not None:
        values = [value if value is None else kit.to_mm(value, unit) for value in values]
    found = [value for value in values if value is not None]
    if len(found) < len(values):
        raise _fault(line, text)
    return [replace(COORDINATE, words=line.label).check(value) for value in found]


def _fault(line: FormLine, text: str) -> InputError:
    unclear = next((word for word in text.split() if kit.is_ambiguous(word)), "")
    if unclear:
        return InputError(
            f"plan.form.{line.key}",
            tr("{label} is '{text}': '{part}' may have thousands or decimals.").format(
                label=line.label, text=text, part=unclear
            ),
            tr("Write the number without a sign between thousands."),
        )
    return InputError(
        f"plan.form.{line.key}",
        tr("{label} is '{text}', which is not {wanted}.").format(
            label=line.label, text=text, wanted=tr(_WANTED[line.kind])
        ),
        f"{line.tip}.",
    )


def _place(item: Mapping[str, Any]) -> str:
    if "poles" in item:
        # A face of the model has thousands of numbers: show its number only.
        return str(item["number"])
    name, values = item.values()
    return f"{name}  {_row(values)}"


def _row(values: Iterable[Any]) -> str:
    return "  ".join(_plain(value) for value in values)


def _plain(value: Any) -> str:
    if isinstance(value, float):
        short = f"{value:g}"
        return kit.localised(short if float(short) == value else str(value))
    return "" if value is None else str(value)
