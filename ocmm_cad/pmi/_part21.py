"""Entities of a STEP file (ISO 10303-21), read as text.

The classes of the geometry library lose data that tolerances need (the sign of a lower limit, sets
of faces) and abort the process at dangling references.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

MOST_ENTITIES = 5_000_000
_DEEPEST = 30
_STATEMENT = re.compile(r"((?:[^;']++|'[^']*+')*+);")
_ENTITY = re.compile(r"\s*+#\s*+(\d++)\s*+=\s*+(.*)", re.DOTALL)
_DATA = re.compile(r"\s*+DATA\s*+(\(|\Z)")
_TEXT_OR_COMMENT = re.compile(r"'[^']*+'|/\*")
_HEAD = re.compile(r"[A-Z_0-9]+")
_TOKEN = re.compile(
    r"\s*(?:(?P<text>'(?:[^']|'')*+')|#\s*(?P<ref>\d+)|\.(?P<word>[A-Z_0-9a-z]+)\."
    r"|(?P<number>[+-]?\d+(?:\.\d*)?(?:[Ee][+-]?\d+)?)|(?P<name>[A-Z_][A-Z_0-9]*)"
    r'|(?P<binary>"[0-9A-F]*")|(?P<mark>[(),$*]))'
)
_OUTLINE = re.compile(r"'(?:[^']|'')*+'|[()]|(?<![A-Z_0-9])[A-Z][A-Z_0-9]*+(?=\s*+\()")
_SHAPES = (
    "ADVANCED_FACE", "AXIS", "B_SPLINE", "CARTESIAN_POINT", "CIRCLE", "COLOUR", "COORDINATES",
    "COMPLEX_TRI", "DIRECTION", "EDGE_", "FACE_", "LINE(", "ORIENTED_EDGE", "PLANE(", "POLYLINE",
    "PRESENTATION_STYLE", "SURFACE_S", "TESSELLATED", "TRIANGULATED", "VECTOR", "VERTEX",
)  # fmt: skip
"""Start of entity types of geometry and style, which never refer to a tolerance."""
_REFERENCE = re.compile(r"'[^']*+'|#\s*+(\d++)")
_WIDE = re.compile(r"\\X2\\([0-9A-Fa-f]*)\\X0\\|\\X4\\([0-9A-Fa-f]*)\\X0\\|\\X\\([0-9A-Fa-f]{2})")


class BadEntityError(ValueError):
    """Fault of an entity, as a part of a sentence."""


class Ref(NamedTuple):
    """A reference to an entity by its number."""

    number: int


class Word(NamedTuple):
    """A word of an enumeration, without its points."""

    word: str


class Typed(NamedTuple):
    """A value with its type, such as a measure."""

    name: str
    values: tuple[Any, ...]


Argument: TypeAlias = "Ref | Word | Typed | str | float | int | tuple[Any, ...] | None"


@dataclass(frozen=True, slots=True)
class Part21:
    """Entities of a file."""

    bodies: dict[int, str]
    """Text of each entity by its number, in the order of the file."""
    twice: frozenset[int]
    """Duplicate numbers: neither entity can be trusted."""
    by_type: dict[str, list[int]]
    """Numbers of the entities by type, also of complex ones."""
    _read: dict[int, dict[str, tuple[Argument, ...]]] = field(default_factory=dict)
    _users: dict[int, list[int]] = field(default_factory=dict)

    def all_of(self, *types: str) -> list[int]:
        """Return the numbers of the entities of any of the types, in the order of the file."""
        return sorted({number for word in types for number in self.by_type.get(word, ())})

    def types(self, number: int) -> frozenset[str]:
        """Return the types of an entity; BadEntityError if missing."""
        return frozenset(self.records(number))

    def records(self, number: int) -> dict[str, tuple[Argument, ...]]:
        """Return the arguments by type; BadEntityError if missing, double or unreadable."""
        if number in self._read:
            return self._read[number]
        if number in self.twice:
            raise BadEntityError(f"the file has two entities #{number}")
        if number not in self.bodies:
            raise BadEntityError(f"it refers to #{number}, which the file does not have")
        found = _records(self.bodies[number], number)
        self._read[number] = found
        return found

    def arguments(self, number: int, *types: str) -> tuple[Argument, ...]:
        """Return the arguments for the first type that an entity has; BadEntityError if none."""
        records = self.records(number)
        for word in types:
            if word in records:
                return records[word]
        raise BadEntityError(f"#{number} is no {types[0]}")

    def argument(self, number: int, place: int, *types: str) -> Argument:
        """Return one argument for the first type that an entity has; BadEntityError if missing."""
        arguments = self.arguments(number, *types)
        if place >= len(arguments):
            raise BadEntityError(f"#{number} has {len(arguments)} arguments, fewer than its type")
        return arguments[place]

    def reference(self, number: int, place: int, *types: str) -> int:
        """Return the one entity that an argument refers to; BadEntityError if none or several."""
        found = refs(self.argument(number, place, *types))
        if len(found) != 1:
            raise BadEntityError(f"#{number} refers to {len(found)} entities where one is needed")
        return found[0]

    def users_of(self, number: int) -> list[int]:
        """Return the entities other than geometry that refer to an entity."""
        if not self._users:
            for user, body in self.bodies.items():
                if not body.startswith(_SHAPES):
                    for target in {int(one) for one in _REFERENCE.findall(body) if one}:
                        self._users.setdefault(target, []).append(user)
        return self._users.get(number, [])

    def users(self, word: str, place: int) -> dict[int, list[int]]:
        """Return the users of entities by a type at an argument index; skips unreadable ones."""
        found: dict[int, list[int]] = {}
        for number in self.all_of(word):
            try:
                arguments = self.arguments(number, word)
            except BadEntityError:
                continue
            if place < len(arguments):
                for target in refs(arguments[place]):
                    found.setdefault(target, []).append(number)
        return found


def read_part21(text: str) -> Part21:
    """Return the entities of the text of a file; their arguments are read when asked for.

    BadEntityError without a data section, or with more entities than a model can have.
    """
    if "/*" in text:
        text = _without_comments(text)
    bodies: dict[int, str] = {}
    twice: set[int] = set()
    by_type: dict[str, list[int]] = {}
    in_data = False
    for statement in _statements(text):
        in_data = in_data or _DATA.match(statement) is not None
        found = _ENTITY.match(statement) if in_data else None
        if found is None:
            continue
        number, body = int(found[1]), found[2].strip()
        if number in bodies:
            twice.add(number)
        bodies[number] = body
        for word in _words(body):
            by_type.setdefault(word, []).append(number)
        if len(bodies) > MOST_ENTITIES:
            raise BadEntityError(f"the file has more than {MOST_ENTITIES} entities")
    if not in_data:
        raise BadEntityError("the file has no data section")
    return Part21(bodies, frozenset(twice), by_type)


def refs(argument: Argument) -> list[int]:
    """Return the numbers that an argument refers to, also inside lists and typed values."""
    if isinstance(argument, Ref):
        return [argument.number]
    if isinstance(argument, Typed):
        return [number for value in argument.values for number in refs(value)]
    if isinstance(argument, tuple) and not isinstance(argument, Word):
        return [number for value in argument for number in refs(value)]
    return []


def plain(argument: Argument, longest: int = 200) -> str:
    """Return a text as one printable line; empty for anything else."""
    if not isinstance(argument, str):
        return ""
    line = " ".join("".join(c if c.isprintable() else " " for c in argument).split())
    return line if len(line) <= longest else line[: longest - 1] + "…"


def _statements(text: str) -> Iterator[str]:
    """Yield statements, split at semicolons outside of texts, in one pass."""
    start = 0
    while found := _STATEMENT.match(text, start):
        yield found[1]
        start = found.end()


def _without_comments(text: str) -> str:
    kept: list[str] = []
    place = 0
    while found := _TEXT_OR_COMMENT.search(text, place):
        if found[0] != "/*":
            kept.append(text[place : found.end()])
            place = found.end()
            continue
        kept.append(text[place : found.start()])
        end = text.find("*/", found.end())
        if end < 0:
            return "".join(kept)
        place = end + 2
    return "".join((*kept, text[place:]))


def _words(body: str) -> Iterator[str]:
    if not body.startswith("("):
        if found := _HEAD.match(body):
            yield found[0]
        return
    # Top-level parts of a complex entity are its types; nested ones are arguments.
    depth = 0
    for found in _OUTLINE.finditer(body):
        sign = found[0]
        depth += (sign == "(") - (sign == ")")
        if depth == 1 and sign[0].isalpha():
            yield sign


def _records(body: str, number: int) -> dict[str, tuple[Argument, ...]]:
    tokens = _tokens(body, number)
    try:
        if body.startswith("("):
            next(tokens)
            found: dict[str, tuple[Argument, ...]] = {}
            for kind, value in tokens:
                if kind != "name":
                    break
                next(tokens)
                found[str(value)] = _list(tokens, 0)
            return found
        kind, value = next(tokens)
        next(tokens)
        return {str(value): _list(tokens, 0)}
    except StopIteration:
        raise BadEntityError(f"the text of #{number} ends too early") from None


def _tokens(body: str, number: int) -> Iterator[tuple[str, Any]]:
    place = 0
    while place < len(body):
        found = _TOKEN.match(body, place)
        if found is None:
            if not body[place:].strip():
                return
            raise BadEntityError(f"the text of #{number} cannot be read")
        place = found.end()
        kind = found.lastgroup or ""
        yield kind, found[kind]


def _list(tokens: Iterator[tuple[str, Any]], depth: int) -> tuple[Argument, ...]:
    if depth > _DEEPEST:
        raise BadEntityError("its lists stand deeper in each other than any model needs")
    found: list[Argument] = []
    for kind, value in tokens:
        match kind:
            case "mark":
                if value == ")":
                    return tuple(found)
                if value == "(":
                    found.append(_list(tokens, depth + 1))
                elif value in "$*":
                    found.append(None)
            case "text":
                found.append(_decoded(value[1:-1].replace("''", "'")))
            case "ref":
                found.append(Ref(int(value)))
            case "word":
                found.append(Word(value))
            case "number":
                found.append(float(value) if set(value) & set(".Ee") else int(value[:300]))
            case "name":
                next(tokens)
                found.append(Typed(value, _list(tokens, depth + 1)))
    raise StopIteration


def _decoded(text: str) -> str:
    """Decode characters beyond ASCII (ISO 10303-21, 6.4.3)."""

    def one(found: re.Match[str]) -> str:
        try:
            if found[1] is not None:
                return bytes.fromhex(found[1]).decode("utf-16-be", "replace")
            if found[2] is not None:
                return bytes.fromhex(found[2]).decode("utf-32-be", "replace")
            return chr(int(found[3], 16))
        except ValueError:
            return "?"

    return _WIDE.sub(one, text).replace("\\\\", "\\")
