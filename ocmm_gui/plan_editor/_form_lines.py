"""Lines of a form, derived from the types of the core: all that a plan can hold can be edited.

A type is a struct, or a union of structs whose tag is a line of its own; ``None`` among them is the
empty choice. The lines of a nested struct follow those of the outer one, with keys like
``start.primary``. Each line has a text, and the text a meaning.
"""

from __future__ import annotations

import re
import types
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Literal, Union, get_args, get_origin

import msgspec

from ocmm_core.errors import InputError
from ocmm_core.names import normal_name
from ocmm_core.part_model import NominalFace
from ocmm_core.typed_numbers import COORDINATE
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.plan_editor._field_labels import FieldUnit, Words, choices_of, measure_of, words_of

GIVEN = "given"
"""Pseudo field: whether an optional struct without a tag is present."""


class FieldKind(Enum):
    TEXT = "text"
    COUNT = "whole number"
    NUMBER = "number"
    FLAG = "yes or no"
    CHOICE = "one of a list"
    VECTOR = "three numbers"
    NUMBERS = "any count of numbers"
    NAMES = "names"
    PLACES = "a name and three numbers on every line"
    SPAN = "least and most, or nothing"
    FIXED = "only shown: it comes from a document with a hash"


@dataclass(frozen=True, slots=True)
class FormLine:
    key: str
    """As in the document; parts of a nested struct after a dot."""
    label: str
    tip: str
    kind: FieldKind
    choices: tuple[str, ...] = ()
    """The only possible values, if any."""
    neutral: Any = ""
    """Initial value."""
    decides: bool = False
    """Other lines depend on its choice."""
    parts: tuple[str, ...] = ()
    """Fields of every line of `FieldKind.PLACES`: of the name, and of the numbers."""
    measure: FieldUnit = FieldUnit.NONE
    """Whether its numbers are lengths."""


def form_lines(
    make: Any,
    data: Mapping[str, Any],
    without: tuple[str, ...] = (),
    at: str = "",
    head: Words | None = None,
) -> tuple[FormLine, ...]:
    """Return the lines for an item of a type.

    ``make``: a struct, or a union of structs and optionally ``None``; ``data``: current content by
    field, which selects the struct of a union; ``without``: fields without a line; ``at``: prefix
    of the keys; ``head``: label and explanation of the line that selects the struct.
    """
    variants, optional = _variants(make)
    field = tag_field(make)
    lines: list[FormLine] = []
    if field:
        choices = (*(("",) if optional else ()), *variants)
        label, tip = head or words_of(next(iter(variants.values())), field)
        start = choices[0]
        lines.append(
            FormLine(at + field, label, tip, FieldKind.CHOICE, choices, start, decides=True)
        )
        chosen = str(data.get(field, start))
    else:
        chosen = next(iter(variants))
    struct = variants.get(chosen)
    if struct is None:
        return tuple(lines)
    for item in msgspec.structs.fields(struct):
        if item.name in without:
            continue
        if _is_structs(item.type):
            inner = data.get(item.name) or {}
            words = words_of(struct, item.name)
            lines += form_lines(item.type, inner, at=f"{at}{item.name}.", head=words)
        else:
            lines.append(_line(struct, item, at))
    return tuple(lines)


def opened(make: Any, data: Any) -> dict[str, Any]:
    """Return plain data of an item with every choice of `form_lines` filled in."""
    variants, optional = _variants(make)
    field = tag_field(make)
    found: dict[str, Any] = dict(data or {})
    if field:
        found.setdefault(field, "" if data is None and optional else next(iter(variants)))
    struct = variants.get(found.get(field, next(iter(variants))))
    for item in () if struct is None else msgspec.structs.fields(struct):
        if _is_structs(item.type):
            found[item.name] = opened(item.type, found.get(item.name))
    return found


def closed(make: Any, data: Mapping[str, Any]) -> Any:
    """Return the inverse of `opened`: plain data without fields that the type lacks."""
    variants, optional = _variants(make)
    field = tag_field(make)
    struct = variants.get(str(data.get(field, "")) if field else next(iter(variants)))
    if struct is None:
        return None
    if not field and optional and all(data.get(name) is None for name in struct.__struct_fields__):
        return None
    plain = {field: data[field]} if field and field != GIVEN else {}
    for item in msgspec.structs.fields(struct):
        if item.name in data:
            inner = data[item.name]
            plain[item.name] = closed(item.type, inner) if _is_structs(item.type) else inner
    return plain


def tag_field(make: Any) -> str:
    """Return the field that distinguishes the structs of a union; empty for a single struct.

    An optional struct with only optional fields is present if any field is.
    """
    variants, optional = _variants(make)
    first = next(iter(variants.values()))
    if len(variants) == 1 and (not optional or _is_all_optional(first)):
        return ""
    config = first.__struct_config__
    return str(config.tag_field) if config.tag_field else GIVEN


def _is_all_optional(struct: type[msgspec.Struct]) -> bool:
    return all(item.default is None for item in msgspec.structs.fields(struct))


def _variants(make: Any) -> tuple[dict[str, type[msgspec.Struct]], bool]:
    """Return the structs of a type by tag, and whether None is allowed."""
    members = get_args(make) if _is_union(make) else (make,)
    structs = [item for item in members if item is not type(None)]
    named = {str(item.__struct_config__.tag or GIVEN): item for item in structs}
    return named, type(None) in members


def _is_union(make: Any) -> bool:
    return get_origin(make) in (Union, types.UnionType)


def _is_structs(make: Any) -> bool:
    members = get_args(make) if _is_union(make) else (make,)
    return all(
        item is type(None) or (isinstance(item, type) and issubclass(item, msgspec.Struct))
        for item in members
    )


def _line(struct: type[msgspec.Struct], item: msgspec.structs.FieldInfo, at: str) -> FormLine:
    label, tip = words_of(struct, item.name)
    kind, choices, neutral = _held(item.type)
    if kind is FieldKind.TEXT and (words := choices_of(struct, item.name)):
        kind, choices, neutral = FieldKind.CHOICE, words, words[0]
    parts = get_args(item.type)[0].__struct_fields__ if kind is FieldKind.PLACES else ()
    if item.default is not msgspec.NODEFAULT:
        neutral = item.default
    elif item.default_factory is not msgspec.NODEFAULT:
        neutral = item.default_factory()
    if "digest" in struct.__struct_fields__ and item.name != "limit":
        # The hash covers all of the document except the fields edited here.
        kind = FieldKind.FIXED
    neutral = msgspec.to_builtins(neutral)
    measure = FieldUnit.NONE if kind is FieldKind.FIXED else measure_of(struct, item.name)
    return FormLine(
        at + item.name, label, tip, kind, choices, neutral, parts=parts, measure=measure
    )


def _held(make: Any) -> tuple[FieldKind, tuple[str, ...], Any]:
    """Return kind, choices, and initial value of a field's type."""
    origin, inner = get_origin(make), get_args(make)
    if _is_union(make):
        # The only such fields in a plan are ambient limits.
        return FieldKind.SPAN, (), None
    if origin is Literal:
        return FieldKind.CHOICE, inner, inner[0]
    if origin in (list, tuple):
        return _listed(inner)
    if issubclass(make, Enum):
        words = tuple(str(item.value) for item in make)
        return FieldKind.CHOICE, words, words[0]
    if issubclass(make, bool):
        return FieldKind.FLAG, (), False
    if issubclass(make, int):
        return FieldKind.COUNT, (), 0
    if issubclass(make, float):
        return FieldKind.NUMBER, (), 0.0
    return FieldKind.TEXT, (), ""


def _listed(inner: tuple[Any, ...]) -> tuple[FieldKind, tuple[str, ...], Any]:
    first = inner[0]
    if first is float:
        return (
            (FieldKind.NUMBERS, (), []) if Ellipsis in inner else (FieldKind.VECTOR, (), [0.0] * 3)
        )
    if get_origin(first) is Literal:
        return FieldKind.NAMES, get_args(first), []
    if first is str:
        return FieldKind.NAMES, (), []
    # Rows of numbers and faces of a model come from documents only.
    fixed = get_origin(first) is tuple or first is NominalFace
    return (FieldKind.FIXED if fixed else FieldKind.PLACES), (), []


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
