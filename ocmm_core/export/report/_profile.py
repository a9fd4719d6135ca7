"""Profile: format of the text files of a report."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import msgspec

from ocmm_core.documents import Document, load_document, resource
from ocmm_core.errors import InputError
from ocmm_core.export.report._tables import FEATURE_COLUMNS, POINT_COLUMNS, REPORT_COLUMNS, Units

SCHEMA = "ocmm.profile/1"

_DELIMITERS = {",": ",", ";": ";", "tab": "\t"}
_LINE_ENDS = {"CRLF": "\r\n", "LF": "\n"}
_MOST_DECIMALS = 9


class TableProfile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    header: bool
    columns: list[str]
    when_needed: list[str] = msgspec.field(default_factory=list)
    """Further columns, written if the job has values for them."""


class Profile(Document, frozen=True, kw_only=True):
    """A profile as stored."""

    name: str
    delimiter: Literal[",", ";", "tab"]
    decimal: Literal[".", ","]
    lengths: Literal["mm", "inch"]
    length_decimals: int
    angle_decimals: int
    vector_decimals: int
    """`length_decimals`, `angle_decimals`, `vector_decimals`: Digits after the decimal sign."""
    encoding: Literal["ascii", "utf-8", "utf-8-sig"]
    """Of the tables; only ASCII characters are written, except with UTF-8."""
    line_end: Literal["CRLF", "LF"]
    points: TableProfile
    features: TableProfile
    report: TableProfile
    centres: bool = False
    """Also write the ball centres, into separate files."""

    @property
    def separator(self) -> str:
        return _DELIMITERS[self.delimiter]

    @property
    def newline(self) -> str:
        return _LINE_ENDS[self.line_end]

    @property
    def units(self) -> Units:
        return Units(self.lengths, self.length_decimals, self.angle_decimals, self.vector_decimals)


def load_profile(path: Path | str) -> Profile:
    """Return the profile of a document; InputError if malformed, or files were unreadable."""
    path = Path(path)
    profile = load_document(path, Profile, SCHEMA)
    if profile.separator == profile.decimal:
        raise _error(path, "delimiter", f"is {profile.delimiter!r}, and so is the decimal sign")
    for field in ("length_decimals", "angle_decimals", "vector_decimals"):
        count = getattr(profile, field)
        if not 0 <= count <= _MOST_DECIMALS:
            raise _error(path, field, f"is {count}; give 0 to {_MOST_DECIMALS}")
    for field, known in (
        ("points", POINT_COLUMNS),
        ("features", FEATURE_COLUMNS),
        ("report", REPORT_COLUMNS),
    ):
        _check_columns(path, field, getattr(profile, field), known)
    return profile


def polyworks_profile() -> Profile:
    return load_profile(resource("profiles", "polyworks.toml"))


def _check_columns(path: Path, field: str, table: TableProfile, known: tuple[str, ...]) -> None:
    names = [*table.columns, *table.when_needed]
    if not table.columns:
        raise _error(path, f"{field}.columns", "is empty")
    for name in names:
        if name not in known:
            raise _error(path, f"{field}.columns", f"names {name!r}; there are {', '.join(known)}")
        if names.count(name) > 1:
            raise _error(path, f"{field}.columns", f"names {name!r} twice")


def _error(path: Path, field: str, fault: str) -> InputError:
    return InputError(
        "profile.field", f"{path}: field '{field}' {fault}.", "Correct that field of the profile."
    )
