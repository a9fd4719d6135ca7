"""Texts of others as they are shown on a terminal."""

from __future__ import annotations

import re

_CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)


def shown(text: str) -> str:
    """Return a text without characters that steer a terminal: each is shown as its number."""
    return _CONTROL.sub(lambda found: f"\\x{ord(found[0]):02x}", text)
