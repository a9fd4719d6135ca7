"""Texts of others as they are shown on a terminal, in any encoding."""

from __future__ import annotations

import codecs
import io
import re
import sys
import unicodedata

_CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)


def shown(text: str) -> str:
    """Return a text without characters that steer a terminal: each is shown as its number."""
    return _CONTROL.sub(lambda found: f"\\x{ord(found[0]):02x}", text)


_SPELLED = {
    "ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "µ": "u", "μ": "u",
    "±": "+/-", "°": "deg", "²": "^2", "×": "x", "·": "*", "…": "...", "–": "-", "−": "-", "Ø": "O",
    "„": '"', "“": '"', "”": '"', "‘": "'", "’": "'", "⌀": "D", "█": "#",  # noqa: RUF001
}  # fmt: skip
"""Signs of our own sentences where the encoding of a terminal lacks them."""
_HANDLER = "ocmm.spelled"


def print_in_any_encoding() -> None:
    """Let standard output and errors spell what their encoding lacks instead of failing.

    A sign of a sentence is spelled (``µm`` is ``um``), a space is a space, and any other character
    is shown as its number, so that no text of others is changed into another one.
    """
    codecs.register_error(_HANDLER, _spelled)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=_HANDLER)


def _spelled(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_sign(one) for one in error.object[error.start : error.end]), error.end


def _sign(one: str) -> str:
    if unicodedata.category(one) == "Zs":
        return " "
    return _SPELLED.get(one, one.encode("ascii", "backslashreplace").decode("ascii"))
