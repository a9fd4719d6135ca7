"""Faces of a shape aspect."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ocmm_cad.pmi._part21 import BadEntityError, Part21, plain, refs
from ocmm_cad.pmi._schema import RELATIONS, USAGES, check_entity

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
                msg = f"it stands for more than {MOST_FACES} faces"
                raise BadEntityError(msg)
        return Faces(tuple(sorted(found)), tuple(others), derived)

    def _check(self, aspect: int, role: str) -> None:
        check_entity(self._file, aspect, role)
        for by_first, of in ((self._usages, "usage"), (self._children, "relation")):
            for word, found in by_first:
                for number in found.get(aspect, ()):
                    check_entity(self._file, number, of)
                    name = plain(self._file.argument(number, 0, word))
                    if of == "relation" and _OTHER_RELATIONS.search(name):
                        msg = f"its relation '{name}' #{number} is not supported"
                        raise BadEntityError(msg)

    def _items(self, aspect: int) -> list[int]:
        return [
            item
            for word, by_definition in self._usages
            for usage in by_definition.get(aspect, ())
            for item in refs(self._file.argument(usage, 4, word))
        ]
