"""Dimensions with their limits, signs and qualifiers (ISO 10303-47), and faces of an aspect."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import msgspec

from ocmm_cad.pmi._items import Dimension
from ocmm_cad.pmi._measures import (
    LOCATIONS,
    RELATIONS,
    SIZES,
    USAGES,
    Measure,
    check_entity,
    measure_of,
    qualifiers_of,
)
from ocmm_cad.pmi._part21 import BadEntityError, Part21, Typed, plain, refs

_FACES = frozenset({"ADVANCED_FACE", "FACE_SURFACE"})
_CURVES = frozenset({"EDGE_CURVE", "TRIMMED_CURVE", "COMPOSITE_CURVE", "POLYLINE"})
_OTHER_RELATIONS = re.compile(
    r"affected|associat|intersection|resulting|starting|ending|boundary|direction", re.IGNORECASE
)
"""In names of relations that do not compose an aspect, such as 'affected plane association'."""
MOST_FACES = 10_000


@dataclass(frozen=True, slots=True)
class Faces:
    numbers: tuple[int, ...] = ()
    """Numbers in the file, each once, in its order."""
    others: tuple[str, ...] = ()
    """Other members, such as edges, by type of the file."""
    derived: bool = False
    """Derived from these faces, such as a middle plane."""


class Aspects:
    """All aspects of a file, with their faces."""

    def __init__(self, file: Part21) -> None:
        self._file = file
        self._usages = [(word, file.users(word, 2)) for word in USAGES if word in file.by_type]
        self._children = [(word, file.users(word, 2)) for word in RELATIONS if word in file.by_type]

    def related(self, aspect: int) -> list[int]:
        """Return the second aspects of relations in which this one is the first."""
        return [
            number
            for word, by_first in self._children
            for relation in by_first.get(aspect, ())
            for number in refs(self._file.argument(relation, 3, word))
        ]

    def faces(self, aspect: int, *, is_note: bool = False) -> Faces:
        """Return the faces of an aspect (`is_note`: of a note) and of its components.

        BadEntityError if a visited entity is missing, cannot be read, or is not supported.
        """
        found: dict[int, None] = {}
        others: dict[str, None] = {}
        derived = False
        seen: set[int] = set()
        ahead = [aspect]
        while ahead:
            number = ahead.pop(0)
            if number in seen:
                continue
            seen.add(number)
            types = self._file.types(number)
            if number != aspect and "DATUM" in types:
                # A datum feature thus names its datum.
                continue
            if not is_note:
                self._check(number, "datum" if "DATUM" in types else "aspect")
            derived = derived or bool(types & {"DERIVED_SHAPE_ASPECT", "CENTRE_OF_SYMMETRY"})
            for item in self._items(number):
                kinds = self._file.types(item)
                if kinds & _FACES:
                    found[item] = None
                else:
                    others[" ".join(sorted(kinds & _CURVES or kinds))] = None
            ahead += self.related(number)
            if len(found) > MOST_FACES:
                raise BadEntityError(f"it stands for more than {MOST_FACES} faces")
        return Faces(tuple(sorted(found)), tuple(others), derived)

    def _check(self, aspect: int, role: str) -> None:
        check_entity(self._file, aspect, role)
        for by_first, of in ((self._usages, "usage"), (self._children, "relation")):
            for word, found in by_first:
                for number in found.get(aspect, ()):
                    check_entity(self._file, number, of)
                    name = plain(self._file.argument(number, 0, word))
                    if of == "relation" and _OTHER_RELATIONS.search(name):
                        raise BadEntityError(f"its relation '{name}' #{number} is not supported")

    def _items(self, aspect: int) -> list[int]:
        return [
            item
            for word, by_definition in self._usages
            for usage in by_definition.get(aspect, ())
            for item in refs(self._file.argument(usage, 4, word))
        ]


_OTHERS = (
    "DIRECTED_DIMENSIONAL_LOCATION",
    "DIMENSIONAL_LOCATION_WITH_PATH",
    "DIMENSIONAL_LOCATION_WITH_DATUM_FEATURE",
    "DIMENSIONAL_SIZE_WITH_PATH",
    "DIMENSIONAL_SIZE_WITH_DATUM_FEATURE",
)
"""Listed and not imported: their additions change the meaning."""
DIMENSIONS = (*SIZES, *LOCATIONS, *_OTHERS)
_SLACK = 1e-9
_NOTE = "dimensional note"
_LIMITS = ("nominal value", "upper limit", "lower limit")


class Dimensions:
    """Read dimensions; faults are stored in the item and do not affect others."""

    def __init__(self, file: Part21, aspects: Aspects, labels: dict[int, str]) -> None:
        self._file, self._aspects, self._labels = file, aspects, labels
        self._values = file.users("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION", 0)
        self._tolerances = file.users("PLUS_MINUS_TOLERANCE", 1)

    def all(self) -> tuple[Dimension, ...]:
        return tuple(self._dimension(number) for number in self._file.all_of(*DIMENSIONS))

    def _dimension(self, number: int) -> Dimension:
        item = Dimension(
            entity=number, name=self._labels.get(number, f"dimension #{number}"), word="dimension",
            is_location=False,
        )  # fmt: skip
        try:
            types = self._file.types(number)
            is_location = any("LOCATION" in word for word in types)
            item = msgspec.structs.replace(item, is_location=is_location)
            other = sorted(types & set(_OTHERS))
            if other:
                word = other[0].replace("_", " ").lower()
                item = msgspec.structs.replace(item, word=word)
                raise BadEntityError(f"a {word} is not supported")
            check_entity(self._file, number, "dimension")
            if is_location:
                word = plain(self._file.argument(number, 0, *LOCATIONS))
            else:
                word = plain(self._file.argument(number, 1, *SIZES))
            if any("ANGULAR" in one for one in types):
                word = word or "angle"
            item = msgspec.structs.replace(item, word=word or "size")
            item = self._with_faces(item)
            item = self._with_value(item)
            return self._with_limits(item)
        except BadEntityError as error:
            return msgspec.structs.replace(item, fault=str(error))

    def _with_faces(self, item: Dimension) -> Dimension:
        if not item.is_location:
            first = self._aspects.faces(self._file.reference(item.entity, 0, *SIZES))
            odd = (*first.others, *(["a derived aspect"] if first.derived else []))
            return msgspec.structs.replace(item, faces=first.numbers, odd=odd)
        one, two = (
            self._aspects.faces(self._file.reference(item.entity, place, *LOCATIONS))
            for place in (2, 3)
        )
        odd = tuple(dict.fromkeys((*one.others, *two.others)))
        if one.derived or two.derived:
            odd = (*odd, "a derived aspect")
        return msgspec.structs.replace(item, faces=one.numbers, other_faces=two.numbers, odd=odd)

    def _with_value(self, item: Dimension) -> Dimension:
        users = self._values.get(item.entity, [])
        if len(users) > 1:
            raise BadEntityError(f"the file gives it {len(users)} values")
        if not users:
            return item
        word = "DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"
        check_entity(self._file, users[0], "value")
        held = self._file.reference(users[0], 1, word)
        check_entity(self._file, held, "values")
        found: dict[str, Measure] = {}
        notes: list[str] = []
        for number in refs(self._file.argument(held, 1, "SHAPE_DIMENSION_REPRESENTATION")):
            records = self._file.records(number)
            if "MEASURE_REPRESENTATION_ITEM" not in records:
                notes += _notes(self._file, number)
                continue
            name = plain(_own_name(records)) or "nominal value"
            notes += qualifiers_of(self._file, number)
            if name not in _LIMITS or name in found:
                raise BadEntityError(f"the file gives it '{name}' that is unknown or stands twice")
            found[name] = measure_of(self._file, number, is_qualified=True)
        return _with_found(item, found, tuple(dict.fromkeys(notes)))

    def _with_limits(self, item: Dimension) -> Dimension:
        users = self._tolerances.get(item.entity, [])
        if not users:
            return item
        if len(users) > 1 or item.lower is not None:
            raise BadEntityError("the file gives it limits more than once")
        check_entity(self._file, users[0], "limits")
        held = self._file.reference(users[0], 0, "PLUS_MINUS_TOLERANCE")
        if "LIMITS_AND_FITS" in self._file.types(held):
            check_entity(self._file, held, "fit")
            parts = self._file.arguments(held, "LIMITS_AND_FITS")
            code = "".join(plain(part) for part in (parts[0], parts[2])) if len(parts) > 2 else ""
            return msgspec.structs.replace(item, fit=code or "without a code")
        check_entity(self._file, held, "limit values")
        low, high = (
            measure_of(self._file, self._file.reference(held, place, "TOLERANCE_VALUE"))
            for place in (0, 1)
        )
        if item.of and {low.of, high.of} != {item.of}:
            raise BadEntityError(f"its limits are no {item.of}s, as its value is")
        return _checked(msgspec.structs.replace(item, lower=low.value, upper=high.value))


def _with_found(item: Dimension, found: dict[str, Measure], notes: tuple[str, ...]) -> Dimension:
    if len({measure.of for measure in found.values()}) > 1:
        raise BadEntityError("its values are lengths and angles at once")
    item = msgspec.structs.replace(item, notes=notes)
    if not found:
        return item
    item = msgspec.structs.replace(item, of=next(iter(found.values())).of)
    low, high = found.get("lower limit"), found.get("upper limit")
    nominal = found.get("nominal value")
    if (low is None) != (high is None):
        word = "upper" if low is None else "lower"
        raise BadEntityError(f"the file gives it the {word} limit alone")
    if nominal is not None:
        item = msgspec.structs.replace(item, nominal=nominal.value)
    if low is None or high is None:
        return item
    middle = nominal.value if nominal else round(0.5 * (low.value + high.value), 6)
    return _checked(
        msgspec.structs.replace(
            item,
            nominal=middle,
            lower=round(low.value - middle, 6) + 0.0,
            upper=round(high.value - middle, 6) + 0.0,
        )
    )


def _checked(item: Dimension) -> Dimension:
    if item.nominal is None or item.lower is None or item.upper is None:
        raise BadEntityError("the file gives it a tolerance and no value")
    if item.upper - item.lower < _SLACK:
        word = "below" if item.upper < item.lower else "no more than"
        raise BadEntityError(
            f"its upper limit {item.upper:+g} is {word} the lower one {item.lower:+g}"
        )
    if item.nominal + item.lower < 0.0 or item.nominal <= 0.0:
        raise BadEntityError(
            f"its limits {item.nominal:g} {item.lower:+g} {item.upper:+g} reach below zero"
        )
    return item


def _own_name(records: dict[str, Any]) -> Any:
    for word in ("REPRESENTATION_ITEM", "MEASURE_REPRESENTATION_ITEM"):
        if records.get(word):
            return records[word][0]
    return ""


def _notes(file: Part21, number: int) -> list[str]:
    records = file.records(number)
    if "DESCRIPTIVE_REPRESENTATION_ITEM" in records:
        name, text = map(plain, file.arguments(number, "DESCRIPTIVE_REPRESENTATION_ITEM")[:2])
        return [text if name in ("", _NOTE) else f"{name}: {text}"]
    if "COMPOUND_REPRESENTATION_ITEM" in records:
        held = file.argument(number, 1, "COMPOUND_REPRESENTATION_ITEM")
        if isinstance(held, Typed):
            found = []
            for below in refs(held):
                if below != number and "COMPOUND_REPRESENTATION_ITEM" not in file.types(below):
                    found += _notes(file, below)
            return found
    return [" ".join(sorted(records)).replace("_", " ").lower()]
