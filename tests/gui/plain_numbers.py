"""Typed numbers in Python syntax."""

from __future__ import annotations

from ocmm_gui.kit._texts import is_ambiguous


def plain_number(text: str) -> str:
    """Return one typed number with a decimal point, and a question mark if it is ambiguous."""
    text = text.strip()
    return f"{text}?" if is_ambiguous(text) else text.replace(",", ".")
