"""Template of a report: letterhead, order of sections, signatures, and lengths in mm or inch.

Lengths are in the unit of the head; machine-readable files keep theirs.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import msgspec

from ocmm_core import documents
from ocmm_core.errors import InputError
from ocmm_core.seals import ReleaseState, Signed, release_state

LengthUnit = Literal["mm", "inch"]

_MM_PER_INCH = 25.4
"""Exact, by the definition of 1959."""

_DECIMALS: dict[LengthUnit, int] = {"mm": 4, "inch": 5}
"""0.00001 in is 0.25 µm. One digit less, 2.5 µm, is as large as U: a limit of 0.02 mm would be
printed as 0.0008 in, which is 0.0203 mm."""

_WORDS: dict[LengthUnit, str] = {"mm": "mm", "inch": "in"}


@dataclass(frozen=True, slots=True)
class PaperLengths:
    """Format of lengths, and U, in a report."""

    unit: LengthUnit = "mm"

    @property
    def word(self) -> str:
        return _WORDS[self.unit]

    @property
    def per_mm(self) -> float:
        """Return the number of units per mm."""
        return 1.0 / _MM_PER_INCH if self.unit == "inch" else 1.0

    @property
    def decimals(self) -> int:
        return _DECIMALS[self.unit]

    def number(self, mm: float, *, signed: bool = False) -> str:
        """Return a length without its unit and never as a negative zero."""
        value = mm / _MM_PER_INCH if self.unit == "inch" else mm
        return f"{value:+z.{self.decimals}f}" if signed else f"{value:z.{self.decimals}f}"

    def quantity(self, value: float, unit: str, *, signed: bool = False) -> str:
        """Return a value for tables with a unit in the head; `value`: mm, or degrees, with sign."""
        if unit == "deg":
            return f"{value:+z.4f}°" if signed else f"{value:z.4f}°"
        return self.number(value, signed=signed)

    @property
    def sentence(self) -> str:
        if self.unit == "inch":
            return (
                "Lengths of tables and plots in inch (1 in = 25.4 mm), in sentences in mm; "
                "angles in degrees."
            )
        return "Lengths in mm, angles in degrees."


SCHEMA = "ocmm.report-template/1"

Section = Literal["results", "why", "deviations", "picture", "features", "basis"]
SECTIONS: tuple[Section, ...] = get_args(Section)
"""Parts of the report that a template orders or omits; head and records are always included."""

_NEEDED: tuple[Section, ...] = ("results", "basis")
"""ISO/IEC 17025 requires results with their uncertainty: templates cannot omit them."""

_LARGEST_LOGO = 2_000_000
_PICTURES = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")
"""Magic bytes of PNG and JPEG: no other format, which might refer to other files, is decoded."""

_MOST_LINES = 12
_LONGEST_LINE = 400
_MOST_SIGNERS = 3

_TABLE = re.compile(r"\s*\[+([^\]]*)\]")
_UNKNOWN_FIELD = re.compile(r"unknown field `([^`]*)`")
_MISSING_FIELD = re.compile(r"missing required field `([^`]*)`")
_TYPE_WORDS = {
    "str": "a text", "int": "a whole number", "float": "a number", "bool": "yes or no",
    "array": "a list", "object": "a table", "null": "nothing",
}  # fmt: skip

RELATES_ONLY = "The results relate only to the items measured."
WHOLE_ONLY = "This report may be copied only as a whole, unless the laboratory agrees in writing."


class LaboratoryPart(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The laboratory, for the letterhead."""

    name: str = ""
    address: list[str] = msgspec.field(default_factory=list)
    contact: str = ""
    logo: str = ""
    """PNG or JPEG next to the template; may be empty."""
    accreditation: str = ""
    """Accreditation number for the reported work; may be empty."""
    country: str = ""
    """Two letters (ISO 3166-1), for digital certificates; may be empty."""


class MachinePart(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The measuring machine as named by the laboratory: name, serial number, inventory number."""

    name: str = ""
    serial: str = ""
    inventory: str = ""


class ReportTemplate(documents.Document, frozen=True, kw_only=True):
    name: str
    language: Literal["en", "de"] = "en"
    """Language of the report; machine-readable files (JSON, tables, QIF) are in English."""
    lengths: LengthUnit = "mm"
    """Unit of lengths in report and workbook; machine-readable files are in mm."""
    title: str = "Measurement report"
    laboratory: LaboratoryPart = msgspec.field(default_factory=LaboratoryPart)
    machine: MachinePart = msgspec.field(default_factory=MachinePart)
    place: str = ""
    """Default place of the measurement."""
    statements: list[str] = msgspec.field(default_factory=list)
    """Sentences above the signatures, in addition to those of every report."""
    signatures: list[str] = msgspec.field(
        default_factory=lambda: ["Measured by, date", "Authorised by, date"]
    )
    """Text below the lines."""
    sections: list[Section] = msgspec.field(default_factory=lambda: list(SECTIONS))


@dataclass(frozen=True, slots=True)
class Particulars:
    """Report data given with the request; empty ones are printed as "not stated"."""

    number: str = ""
    """Number of the report; if empty, it is made from job, identity and step."""
    customer: str = ""
    customer_address: str = ""
    order: str = ""
    drawing: str = ""
    revision: str = ""
    """`order`, `drawing`, `revision`: of the order; ``order`` only if the job has none."""
    machine: str = ""
    """The machine that made the part, for statistics."""
    place: str = ""
    """Place of the measurement; empty for that of the template."""
    received: str = ""
    """Date and condition of the item's receipt."""
    room: str = ""
    humidity: str = ""
    pressure: str = ""
    """`room`, `humidity`, `pressure`: °C, %, hPa: number, range or ± U (`ambient_conditions`)."""
    deviations: tuple[str, ...] = ()
    """From the plan or the method, in sentences, in addition to those found in the job."""
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Paper:
    """A template with its external data."""

    template: ReportTemplate
    logo: bytes = b""
    """Content of the picture, or empty."""
    given: Particulars = field(default_factory=Particulars)
    release: ReleaseState | None = None
    """Release of the template; None without a template, and for the shipped one."""

    @property
    def label(self) -> str:
        """Return the name of the template with its release; empty without a release."""
        return "" if self.release is None else f"{self.template.name}: {self.release.summary}"


def plain_paper() -> Paper:
    """Return the report sheet without a template."""
    return Paper(ReportTemplate(schema=SCHEMA, unit="mm", name="plain"))


def standard_template() -> Path:
    """Return the shipped template, to be copied and filled in."""
    return documents.resource("reports", "standard.toml")


def load_paper(path: Path | str, given: Particulars | None = None) -> Paper:
    """Return the template of the document at ``path`` with its logo.

    InputError: the document is malformed, omits a required section, repeats a section, has a text
    that is too long to print, or its logo is not a PNG or JPEG file next to it.
    """
    path = Path(path)
    try:
        template = documents.load_document(path, ReportTemplate, SCHEMA)
    except InputError as error:
        if error.code != "document.field":
            raise
        raise _field_error(path, error) from error
    country = template.laboratory.country
    if country and not (len(country) == 2 and country.isascii() and country.isupper()):
        raise _error(path, "laboratory.country", "is no code of two capital letters")
    missing = [name for name in _NEEDED if name not in template.sections]
    if missing:
        raise _error(path, "sections", f"leaves out {', '.join(missing)}, which a report must have")
    if len(set(template.sections)) != len(template.sections):
        raise _error(path, "sections", "names a section twice")
    if not 1 <= len(template.signatures) <= _MOST_SIGNERS:
        raise _error(path, "signatures", f"has {len(template.signatures)} lines; give 1 to 3")
    for name, lines in (
        ("laboratory.address", template.laboratory.address),
        ("statements", template.statements),
        ("signatures", template.signatures),
    ):
        if len(lines) > _MOST_LINES or any(len(line) > _LONGEST_LINE for line in lines):
            raise _error(
                path,
                name,
                f"is too long; at most {_MOST_LINES} lines of {_LONGEST_LINE} characters",
            )
    logo = _logo(path, template.laboratory.logo)
    shipped = path == standard_template()
    release = None if shipped else release_state(path, Signed.TEMPLATE)
    return Paper(template, logo, given or Particulars(), release)


def _logo(path: Path, name: str) -> bytes:
    if not name:
        return b""
    # Foreign templates must not embed other files of this computer.
    if Path(name).name != name:
        raise _error(path, "laboratory.logo", "is not the name of a file beside the template")
    try:
        content = documents.read_bytes(path.with_name(name), _LARGEST_LOGO)
    except InputError as error:
        raise _error(path, "laboratory.logo", f"cannot be used: {error.what}") from error
    if not content.startswith(_PICTURES):
        raise _error(path, "laboratory.logo", "is neither a PNG nor a JPEG")
    return content


def _error(path: Path, field: str, fault: str) -> InputError:
    return InputError(
        "report.template",
        f"{_place(path, field)}: field '{field}' {fault.removesuffix('.')}.",
        "Correct that field of the template.",
    )


def _field_error(path: Path, error: InputError) -> InputError:
    said = error.what.removeprefix(f"{path}: ").removesuffix(".")
    fault, _, where = said.partition(" - at `$")
    field = re.sub(r"\[(?:\d+|\.\.\.)\]", "", where.rstrip("`").lstrip("."))
    unknown = _UNKNOWN_FIELD.search(fault)
    if unknown is not None:
        field = ".".join(part for part in (field, unknown.group(1)) if part)
        return _error(path, field, "is not known")
    missing = _MISSING_FIELD.search(fault)
    if missing is not None:
        field = ".".join(part for part in (field, missing.group(1)) if part)
        return _error(path, field, "is missing")
    for word, told in _TYPE_WORDS.items():
        fault = fault.replace(f"`{word}`", told)
    return _error(path, field, f"is wrong: {fault[:1].lower()}{fault[1:]}")


def _place(path: Path, field: str) -> str:
    """Return the file, with the line of a field if present."""
    table, _, key = field.rpartition(".")
    now = ""
    try:
        lines = documents.read_text(path, documents.LARGEST_DOCUMENT).splitlines()
    except InputError:
        return str(path)
    for number, line in enumerate(lines, 1):
        heads = _TABLE.match(line)
        if heads is not None:
            now = heads.group(1).strip()
        if (now == table and _assigns(line, key)) or (not now and _assigns(line, field)):
            return f"{path}, line {number}"
        if heads is not None and now == field:
            return f"{path}, line {number}"
    return str(path)


def _assigns(line: str, key: str) -> bool:
    name, equals, _ = line.partition("=")
    return bool(equals) and name.strip().strip("\"'") == key
