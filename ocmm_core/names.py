"""Names that people give: which are accepted, their normal form, and names of files made from them.

Two kinds: labels (part, plan, operator, serial number, order, batch) are printable Unicode; names
that plans refer to (features, characteristics) leave out the signs that lists, patterns and other
programs read as their own.
"""

from __future__ import annotations

import hashlib
import unicodedata
from collections.abc import Mapping
from typing import Any

LONGEST_NAME = 60
"""Characters; a part name has to fit on a label and into a column."""

_LONGEST_STEM = 160
"""Bytes of a file name without its ending; states and numbers are appended to it (255 in all)."""

_JOINERS = "\u200c\u200d"
"""Needed between letters of some scripts; every other format character is refused."""
_FIRST_JOINED = 0x0600
"""Arabic; scripts before it have no joined forms, so that a joiner would only hide."""

FORMULA_SIGNS = "=+-@\uff1d\uff0b\uff0d\uff20"
"""A spreadsheet computes what begins with them (CWE-1236), also in full width."""

_SIGNS = {
    "Cc": "a control character", "Cf": "an invisible format character", "Cs": "half a character",
    "Co": "a private character", "Cn": "an unassigned character", "Zl": "an end of line",
    "Zp": "an end of paragraph", "Zs": "a special space",
}  # fmt: skip

_DEVICES = frozenset(
    {"CON", "PRN", "AUX", "NUL", "CLOCK$", "CONIN$", "CONOUT$"}
    | {f"{port}{number}" for port in ("COM", "LPT") for number in (*"0123456789", *"¹²³")}
)
"""Names that are no files on Windows, whatever follows after a dot."""

_RESERVED = '<>:"/\\|?*'


def normal_name(text: str) -> str:
    """Return a name in the normal form NFC, so that one name has one spelling."""
    return unicodedata.normalize("NFC", text)


def normal_text(data: Any) -> Any:
    """Return plain data with all its text in the normal form NFC."""
    if isinstance(data, str):
        return normal_name(data)
    if isinstance(data, Mapping):
        return {key: normal_text(value) for key, value in data.items()}
    return [normal_text(value) for value in data] if isinstance(data, list) else data


def label_fault(name: str) -> str:
    """Return why a label cannot be used, as the predicate of a sentence; empty if it can be."""
    if not name:
        return "is empty"
    for place, sign in enumerate(name, start=1):
        kind = _SIGNS.get(unicodedata.category(sign), "")
        if sign == " " or not kind or (sign in _JOINERS and _joins(name[place - 2 : place + 1])):
            continue
        return f"contains {kind} (U+{ord(sign):04X}, character {place})"
    if len(name) > LONGEST_NAME:
        return f"has {len(name)} characters; at most {LONGEST_NAME}"
    if name != name.strip():
        return "begins or ends with a space"
    if name[0] in FORMULA_SIGNS:
        return f"begins with '{name[0]}', which a spreadsheet takes for a formula"
    if unicodedata.category(name[0]).startswith("M"):
        return "begins with a combining mark"
    return "" if name == normal_name(name) else "is not in the Unicode normal form NFC"


def _joins(three: str) -> bool:
    """Return whether a joiner stands between letters of a script that needs it."""
    return len(three) == 3 and all(
        ord(sign) >= _FIRST_JOINED and unicodedata.category(sign)[0] in "LM" for sign in three[::2]
    )


def name_fault(name: str) -> str:
    """Return why a name that plans refer to cannot be used; empty if it can be.

    Letters, marks, digits of any script, spaces and ``_ . - /``; first a letter, digit or ``_``.
    """
    if fault := label_fault(name):
        return fault
    for place, sign in enumerate(name):
        inside = place > 0 and sign in " .-/\u200c\u200d"
        if not (inside or sign == "_" or unicodedata.category(sign)[0] in "LMN"):
            where = "begins with" if place == 0 else "contains"
            return f"{where} '{sign}'; letters, digits, spaces, '_', '.', '-' and '/' are accepted"
    return ""


def usable_name(text: str, longest: int = LONGEST_NAME) -> str:
    """Return text of another program as a name that plans refer to; empty if nothing remains."""
    kept = "".join(sign if not name_fault(f"_{sign}_") else " " for sign in normal_name(text))
    return " ".join(kept.split()).lstrip(" .-/")[:longest].rstrip()


def file_stem(name: str) -> str:
    """Return a file name without its ending for a name, valid on every system and unique to it.

    Spaces become ``_``; names changed otherwise get a short hash: ``A/B`` and ``A_B`` differ.
    """
    plain = normal_name(name).replace(" ", "_")
    kept = "".join("_" if sign in _RESERVED or not sign.isprintable() else sign for sign in plain)
    kept = kept.rstrip(".")
    if not kept or kept[0] in ".-~" or kept.split(".")[0].upper() in _DEVICES:
        kept = f"_{kept}"
    if kept == plain and len(kept.encode("utf-8", "surrogatepass")) <= _LONGEST_STEM:
        return kept
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:8]
    return f"{kept.encode()[: _LONGEST_STEM - 9].decode('utf-8', 'ignore')}-{digest}"


def ascii_name(name: str) -> str:
    """Return a name for a program that reads ASCII alone; one that is changed gets a short hash."""
    if name.isascii():
        return name
    feature, dot, number = name.rpartition(".")
    if number.isdecimal() and feature:
        # All points of a feature keep the name of the feature.
        return f"{ascii_name(feature)}{dot}{number}"
    kept = ascii_text(name)[: LONGEST_NAME - 9]
    return f"{kept}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def ascii_text(text: str) -> str:
    """Return text without accents; other signs that are not ASCII become ``_``. Not unique."""
    parts = unicodedata.normalize("NFKD", text)
    plain = "".join(sign for sign in parts if not unicodedata.combining(sign))
    return "".join(sign if sign.isascii() else "_" for sign in plain)
