"""Names and texts in files of other programs: names are checked, free text is cleaned.

Names for commands and files are accepted or refused; text has no control characters.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from datetime import UTC, datetime

from ocmm_core.errors import StorageError
from ocmm_core.names import FORMULA_SIGNS, file_stem, label_fault, name_fault

_LONGEST = 250
_NO_TEXT = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
"""Invisible Unicode categories: controls, directions, surrogates, line ends."""

_COMMANDS = ("=", "+", "-", "@")
"""Start of a formula in a spreadsheet (CWE-1236)."""


def last_moment(begun_utc: str, taken_utc: Iterable[str]) -> datetime:
    """Return the latest time of points, or the start of a job, as UTC; StorageError if invalid."""
    return max([_moment_of(text) for text in taken_utc] or [_moment_of(begun_utc)])


def _moment_of(text: str) -> datetime:
    try:
        moment = datetime.fromisoformat(text)
        if moment.tzinfo is not None:
            return moment.astimezone(UTC)
    except (ValueError, OverflowError):
        pass
    raise StorageError(
        "export.time",
        f"The job has the time {text[:40]!r}, which is no ISO 8601 time with its zone.",
        "Report from the job file itself, or from an earlier copy of it.",
    )


def check_name(kind: str, name: str) -> str:
    """Return a name of a `kind` if reports can contain it; StorageError otherwise."""
    if fault := label_fault(name) if kind == "plan" else name_fault(name):
        raise StorageError(
            "export.name",
            f"The {kind} name {name!r} cannot be used in a report: it {fault}.",
            "Correct the name in the plan, and measure by that plan.",
        )
    return name


def check_file_stem(name: str) -> str:
    """Return the name of a job valid for file names; StorageError otherwise."""
    if (
        file_stem(name) != name.replace(" ", "_")
        or name != name.strip()
        or name[0] in FORMULA_SIGNS
    ):
        raise StorageError(
            "export.name",
            f"The job name {name!r} is not a valid file name on every system.",
            f"Copy the job file to another name, such as {file_stem(name)}, and report the copy.",
        )
    return name


def clean_text(text: str) -> str:
    """Return free text on one line, without control characters and surrogates, truncated."""
    return one_line(text)[:_LONGEST]


def one_line(text: str) -> str:
    """Return free text as `clean_text`, without truncation."""
    kept = "".join(" " if unicodedata.category(sign) in _NO_TEXT else sign for sign in text)
    return " ".join(kept.split())


def spreadsheet_text(text: str) -> str:
    """Return text, quoted if a spreadsheet would compute it (OWASP ASVS 1.2.10); never numbers."""
    return f"'{text}" if text.lstrip().startswith(_COMMANDS) else text
