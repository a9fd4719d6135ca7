"""A sentence with names for what is filled in, recognised in what was said."""

from __future__ import annotations

import re
import string
from collections.abc import Iterator
from dataclasses import dataclass

NUMBER, WORD, KNOWN_WORD, SENTENCE = "n", "w", "k", "s"
"""What stands behind the name of a field: ``{count:n}``."""

_NUMBER = re.compile(r"\s*[-+−±]?(\d[\d,_]*(\.\d+)?([eE][-+]?\d+)?|inf|nan)%?\s*")


@dataclass(frozen=True, slots=True)
class Pattern:
    """A sentence of the sources."""

    template: str
    """The sentence, with names in braces: ``Camera {name} sees {count:n} LEDs.``"""
    literals: tuple[str, ...]
    """What stands before, between and behind the fields; one more than fields."""
    names: tuple[str, ...]
    marks: tuple[str, ...]
    """What each field holds: a number ``n``, a word of the program ``w`` (where it is none,
    whatever it is), a word of the program for certain ``k``, a sentence of the program ``s``, or
    anything."""

    @classmethod
    def from_template(cls, template: str) -> Pattern:
        """Return the pattern of a sentence with names in braces, or raise ValueError."""
        literals, names, marks = [""], [], []
        for text, name, mark, _ in string.Formatter().parse(template):
            literals[-1] += text
            if name is not None:
                names.append(name)
                marks.append(mark or "")
                literals.append("")
        return cls(template, tuple(literals), tuple(names), tuple(marks))

    @property
    def weight(self) -> int:
        """How many characters of a sentence it says itself."""
        return sum(map(len, self.literals))

    def fillings(self, text: str) -> tuple[tuple[str, ...], ...]:
        """Return what was filled in where a text is this sentence; nothing where it is not.

        One tuple if there is one way to read the text. If there are several, the two that differ
        most are returned: fields that end as early as possible, and as late. (Order the ways to
        read a text by the ends of their fields, the first field first; these two are the least and
        the greatest. Where they are equal there is no other.)
        """
        if not self.names:
            return ((),) if text == self.literals[0] else ()
        if not text.startswith(self.literals[0]) or not text.endswith(self.literals[-1]):
            return ()
        if len(text) < self.weight:
            return ()
        early = self._read(text, late=False)
        if early is None:
            return ()
        late = self._read(text, late=True)
        return (early,) if late is None or late == early else (early, late)

    def _read(self, text: str, *, late: bool) -> tuple[str, ...] | None:
        """Return one way to read a text. Places that led nowhere are not tried again.

        So the time grows with the square of the length of a text at most, whoever wrote it.
        """
        dead: set[tuple[int, int]] = set()
        last = len(self.names) - 1

        def from_field(field: int, start: int) -> list[str] | None:
            if (field, start) in dead:
                return None
            for end in self._ends(text, field, start, late=late):
                value = text[start:end]
                if self.marks[field] == NUMBER and not _NUMBER.fullmatch(value):
                    continue
                if field == last:
                    return [value]
                rest = from_field(field + 1, end + len(self.literals[field + 1]))
                if rest is not None:
                    return [value, *rest]
            dead.add((field, start))
            return None

        found = from_field(0, len(self.literals[0]))
        return None if found is None else tuple(found)

    def _ends(self, text: str, field: int, start: int, *, late: bool) -> Iterator[int]:
        """Return where a field that begins at a place can end."""
        stop = len(text) - len(self.literals[-1])
        if field == len(self.names) - 1:
            if start <= stop:
                yield stop
            return
        literal = self.literals[field + 1]
        if late:
            at = text.rfind(literal, start, stop)
            while at >= 0:
                yield at
                at = text.rfind(literal, start, at + len(literal) - 1)
        else:
            at = text.find(literal, start, stop)
            while at >= 0:
                yield at
                at = text.find(literal, at + 1, stop)

    def filled(self, values: dict[str, str]) -> str:
        """Return the sentence with what is filled in, as it is."""
        parts = [self.literals[0]]
        for name, literal in zip(self.names, self.literals[1:], strict=True):
            parts += (values[name], literal)
        return "".join(parts)
