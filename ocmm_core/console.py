"""Output on consoles of any encoding."""

from __future__ import annotations

import codecs
import io
import sys
import unicodedata

_SPELLED = {
    "ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss", "µ": "u", "μ": "u",
    "±": "+/-", "°": "deg", "²": "^2", "×": "x", "·": "*", "…": "...", "–": "-", "−": "-", "Ø": "O",
    "„": '"', "“": '"', "”": '"', "‘": "'", "’": "'", "⌀": "D", "█": "#",  # noqa: RUF001
}  # fmt: skip
"""Spelling of the signs in messages if the encoding of a terminal lacks them."""
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
