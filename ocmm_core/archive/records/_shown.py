"""Text of archived rows as it may be shown: the one function for every output.

Anybody with a login of the archive can write any text into a row. A terminal would obey its escape
sequences, and a line of a table would be turned round by marks of bidirectional text.
"""

from __future__ import annotations

from ocmm_core.archive.records._rows import LONGEST_SENTENCE


def shown_text(text: str, instead: str = "\N{REPLACEMENT CHARACTER}") -> str:
    """Return a text without control, format or surrogate characters, of bounded length.

    Parameters
    ----------
    instead
        In the place of each character that cannot be shown.
    """
    kept = text[:LONGEST_SENTENCE]
    if kept.isprintable():
        return kept
    return "".join(c if c.isprintable() else instead for c in kept)
