"""Sanitise text of archived rows for display; used by every output.

Any login of the archive can write any text into a row. Terminals would execute its escape
sequences, and bidirectional marks would reorder table lines.
"""

from __future__ import annotations

from ocmm_core.archive.records._rows import LONGEST_SENTENCE


def shown_text(text: str, instead: str = "\N{REPLACEMENT CHARACTER}") -> str:
    """Return a text without control, format or surrogate characters, of bounded length.

    `instead`: replaces each such character.
    """
    kept = text[:LONGEST_SENTENCE]
    if kept.isprintable():
        return kept
    return "".join(c if c.isprintable() else instead for c in kept)
