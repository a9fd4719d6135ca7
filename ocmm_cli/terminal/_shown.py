from __future__ import annotations

import re

_CONTROL = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)


def shown(text: str) -> str:
    """Return a text with control characters replaced by their codes."""
    return _CONTROL.sub(lambda found: f"\\x{ord(found[0]):02x}", text)
