"""Grammar of I++ DME: dialects and errors, bytes to a command, numbers to text. Pure."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from ocmm_core.documents import read_text, resource


class DmeDialect(StrEnum):
    """Edition of the protocol; the value is that of the command line."""

    V14 = "1.4"
    """I++ DME 1.4.3, as the public test suite of NIST judges it."""
    V25 = "2.5"
    """VDMA 8722:2024."""

    @property
    def version(self) -> str:
        return "1.4.3" if self is DmeDialect.V14 else "2.5"


@dataclass(frozen=True, slots=True)
class ErrorRow:
    severity: int
    text: str


def _rows(dialect: DmeDialect) -> dict[int, ErrorRow]:
    table = read_text(resource("ippdme", f"errors_{dialect.value}.txt"))
    rows = (line.split(" ", 2) for line in table.splitlines())
    return {int(number): ErrorRow(int(severity), text) for number, severity, text in rows}


ERRORS: Mapping[DmeDialect, Mapping[int, ErrorRow]] = {
    DmeDialect.V14: _rows(DmeDialect.V14),
    DmeDialect.V25: _rows(DmeDialect.V14) | _rows(DmeDialect.V25),
}
"""Files: number, severity and text of each error; an edition adds to the one before."""


def error_line(dialect: DmeDialect, tag: str, number: int, where: str) -> str:
    """Return the line of an error, with the text and the severity of the table."""
    row = ERRORS[dialect][number]
    values = (f"{row.severity}", f"{number:04d}", quoted(where) if where else '""')
    return f"{tag} ! {call_text('Error', *values, quoted(row.text))}"


LONGEST_LINE = 65_536
"""Characters of a line, with CR LF."""
NO_TAG = "E0000"
"""Tag of server events, and of errors in lines without a usable tag."""

_TAG = re.compile(r"E(?!0000)\d{4}|(?!00000)\d{5}")
_NAME = re.compile(r"[A-Za-z]\w*(?:\.[A-Za-z]\w*)*", re.ASCII)
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?(?![0-9A-Za-z_.])")
_STRING = re.compile(r'"([^"]+)"')
_MOST_DIGITS = 16
_DEEPEST = 8


@dataclass(frozen=True, slots=True)
class BareWord:
    """A bare word: the name of a coordinate system, a tag."""

    name: str


@dataclass(frozen=True, slots=True)
class Call:
    """A name with arguments in brackets: ``X(1)``, ``Tool.Name()``."""

    name: str
    args: tuple[Value, ...]


Value = float | str | BareWord | Call
"""An argument; `str` is a quoted string."""


@dataclass(frozen=True, slots=True)
class DmeCommand:
    tag: str
    name: str
    args: tuple[Value, ...]


class DmeError(Exception):
    """An error of the protocol.

    `number`: row of the table. `where`: function that failed. `tag`: of the line, if it was read.
    `detail`: sentence for the operator; the text for the client is that of the table.
    """

    def __init__(
        self, number: int, where: str = "", *, tag: str = NO_TAG, detail: str = ""
    ) -> None:
        super().__init__(number, where, detail)
        self.number, self.where, self.tag, self.detail = number, where, tag, detail


def parse(line: bytes) -> DmeCommand:
    """Return the command of a line without CR LF; raise DmeError if it is malformed."""
    text = line.decode("latin-1")
    found = _TAG.match(text)
    if found is None:
        raise DmeError(1, "Protocol")
    tag = found.group()
    if len(line) + 2 > LONGEST_LINE:
        raise DmeError(8, "Protocol", tag=tag)
    if any(not 32 <= sign <= 126 for sign in line):
        raise DmeError(7, "Protocol", tag=tag)
    if text[5:6] != " ":
        raise DmeError(2, "Protocol", tag=tag)
    reader = _Reader(text, tag)
    call = reader.call()
    if reader.at != len(text):
        raise reader.error(call.name)
    return DmeCommand(tag, call.name, call.args)


class _Reader:
    def __init__(self, text: str, tag: str) -> None:
        self._text, self._tag, self.at = text, tag, 6

    def error(self, where: str = "Protocol", number: int = 8) -> DmeError:
        return DmeError(number, where, tag=self._tag)

    def call(self) -> Call:
        name = self._match(_NAME)
        if name is None or not self._opens():
            raise self.error()
        return Call(name.group(), self._args(name.group(), 0))

    def _args(self, where: str, depth: int) -> tuple[Value, ...]:
        """Return the arguments up to the closing bracket, which is consumed."""
        if depth > _DEEPEST:
            raise self.error(where)
        values: list[Value] = []
        self._skip()
        if self._sign(")"):
            return ()
        while True:
            values.append(self._value(where, depth))
            self._skip()
            if self._sign(")"):
                return tuple(values)
            if not self._sign(","):
                raise self.error(where)
            self._skip()

    def _value(self, where: str, depth: int) -> Value:
        number = self._match(_NUMBER)
        if number is not None:
            mantissa = re.split("[eE]", number.group())[0]
            value = float(number.group())
            if sum(map(str.isdigit, mantissa)) > _MOST_DIGITS:
                raise self.error(where)
            if not math.isfinite(value):
                raise self.error(where, 509)
            return value
        string = self._match(_STRING)
        if string is not None:
            return string.group(1)
        name = self._match(_NAME)
        if name is None:
            raise self.error(where)
        if self._opens():
            return Call(name.group(), self._args(where, depth + 1))
        return BareWord(name.group())

    def _match(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        found = pattern.match(self._text, self.at)
        if found is not None:
            self.at = found.end()
        return found

    def _skip(self) -> None:
        while self._text[self.at : self.at + 1] == " ":
            self.at += 1

    def _sign(self, sign: str) -> bool:
        if self._text[self.at : self.at + 1] != sign:
            return False
        self.at += 1
        return True

    def _opens(self) -> bool:
        """Consume an opening bracket, also after spaces; return whether there is one."""
        before = self.at
        self._skip()
        if self._sign("("):
            return True
        self.at = before
        return False


def number_text(value: float) -> str:
    """Return a number in at most 16 characters: six decimals while they fit."""
    if not math.isfinite(value):
        msg = f"{value} cannot be sent"
        raise ValueError(msg)
    text = f"{value:.6f}"
    text = text.rstrip("0").rstrip(".") if len(text) <= _MOST_DIGITS else f"{value:.8e}"
    return "0" if text == "-0" else text


def list_text(values: Iterable[float | str]) -> str:
    """Return values with commas; texts are written as they are."""
    return ", ".join(one if isinstance(one, str) else number_text(one) for one in values)


def call_text(name: str, *values: float | str) -> str:
    """Return ``name(values)``, as `list_text`."""
    return f"{name}({list_text(values)})"


def quoted(text: str) -> str:
    """Return a text as a string of the protocol: ASCII, without quotes, never empty."""
    plain = text.encode("ascii", "replace").decode().replace('"', "'")
    return f'"{"".join(sign if sign.isprintable() else " " for sign in plain) or " "}"'
