"""Sanitise text of rows for display: no escape sequences, no bidirectional marks.

Any login of the archive can write any text into a row.
"""

from __future__ import annotations

from ocmm_core.archive.records._rows import LONGEST_SENTENCE


def shown_text(text: str, instead: str = "\N{REPLACEMENT CHARACTER}") -> str:
    """Replace control, format and surrogate characters in a text, and limit its length."""
    kept = text[:LONGEST_SENTENCE]
    if kept.isprintable():
        return kept
    return "".join(c if c.isprintable() else instead for c in kept)
