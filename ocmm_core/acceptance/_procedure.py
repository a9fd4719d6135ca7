"""Procedure documents (`ocmm.acceptance/1`): every number of a test is a field.

Without a comparison with the standard, clause by clause, reports read "modelled on".
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal, TypeAlias

import msgspec

from ocmm_core.documents import Document, load_with_text, resource, text_digest
from ocmm_core.errors import InputError

PROCEDURE_SCHEMA = "ocmm.acceptance/1"


class Mpe(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Permissible error min(constant + per_length L, largest), mm; ``largest`` None: A + L/K."""

    constant: float
    per_length: float = 0.0
    largest: float | None = None

    def at(self, length: float) -> float:
        """Return the limit of a length, mm."""
        limit = self.constant + self.per_length * abs(length)
        return limit if self.largest is None else min(limit, self.largest)

    def describe(self) -> str:
        """Return it as text, um and mm."""
        grows = f" + L/{1.0 / (1e3 * self.per_length):.4g}" if self.per_length else ""
        text = f"{1e3 * self.constant:g} µm{grows}"
        return text if self.largest is None else f"min({text}, {1e3 * self.largest:g} µm)"


class ClimateRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Permitted temperatures, °C, and largest change, K/h; otherwise the test is void."""

    low: float
    high: float
    per_hour: float


class _Numbers(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind"
):
    """Numbers of one kind of test."""


class LengthTest(_Numbers, frozen=True, kw_only=True, tag="length"):
    """Lengths along lines in the volume (VDI/VDE 2634 part 1): E."""

    lines: int
    lengths: int
    """`lines`, `lengths`: minimum number of lines, and test lengths on each."""
    diagonal_share: float
    corner_share: float
    """Longest length by space diagonal; distance of its ends from a corner by each edge."""
    angle_deg: float
    """Minimum between two lines."""


class SphereTest(_Numbers, frozen=True, kw_only=True, tag="sphere"):
    """A sphere probed with rings of points in places (ISO 10360-5): P_Form, P_Size."""

    rings: tuple[tuple[float, int, float], ...]
    """(angle below the pole, number, azimuth of the first), degrees."""
    places: tuple[str, ...]
    """Thirds of the volume."""
    diameter: tuple[float, float]
    """Smallest and largest, mm."""
    gain: float
    """Largest standard deviation of the diameter over that of a point."""
    match_deg: float
    """Maximum deviation of a point from its place."""


class LocationTest(_Numbers, frozen=True, kw_only=True, tag="location"):
    """One sphere in several probe attitudes (L_Dia of ISO 10360-12, -5)."""

    lean_deg: float
    attitude_deg: float
    places: tuple[str, ...]
    diameter: tuple[float, float]


class E0Test(_Numbers, frozen=True, kw_only=True, tag="e0"):
    """Calibrated lengths, repeated, in several positions (ISO 10360-2): E0, R0."""

    positions: int
    lengths: int
    repeats: int
    """`positions`, `lengths`, `repeats`: 7, 5 and 3."""
    line_share: float
    """Longest length over the longest possible on that line."""
    sets_outside: int
    """Number of sets of repeats that may have one value outside, and are repeated."""
    retest_repeats: int
    angle_deg: float


class E0BlockTest(E0Test, frozen=True, kw_only=True, tag="e0-block"):
    """E0 and R0 with gauge blocks from both sides: reveals errors of the ball's radius."""

    block_largest: float
    """Longest block, mm."""
    block_face: tuple[float, float]
    """Measuring face with the points, mm."""
    block_points: int
    block_repeats: int
    """`block_points`, `block_repeats`: averaged points per face; measurements of the block."""


class LongStylusTest(E0Test, frozen=True, kw_only=True, tag="e0-stylus"):
    """E0 on two diagonals with the longest stylus (as E150 of ISO 10360-2): E_L, R0."""

    stylus: float
    """Minimum from ball to nearest LED, mm."""


class SpatTest(_Numbers, frozen=True, kw_only=True, tag="spat"):
    """The ball in a cone while the probe turns (ASME B89.4.22): SPAT_max, SPAT_2s."""

    points: int
    places: tuple[str, ...]
    spread_deg: float


class VolumetricTest(_Numbers, frozen=True, kw_only=True, tag="volumetric"):
    """One length in many placements (ASME B89.4.22): V_max, V_range, V_2RMS."""

    placements: int
    octants: int


class DiameterTest(_Numbers, frozen=True, kw_only=True, tag="diameter"):
    """The effective diameter of a sphere (ASME B89.4.22): D_eff."""

    rings: tuple[tuple[float, int, float], ...]
    repeats: int
    diameter: tuple[float, float]


class PlateTest(_Numbers, frozen=True, kw_only=True, tag="plate"):
    """Thickness and coplanarity of a plate (thesis, Table 5): Thickness, Coplanarity."""

    points: int
    size: tuple[float, float]
    """Plate in x and y, mm."""


class BallTest(_Numbers, frozen=True, kw_only=True, tag="ball"):
    """Repeated measurement of a ball (thesis, Tables 6 to 8): P_Size, P_Form, L_Dia."""

    points: int
    repeats: int
    diameter: tuple[float, float]


class InterimTest(_Numbers, frozen=True, kw_only=True, tag="interim"):
    """Two spheres kept at the machine, in 90 seconds: Interim_L, Interim_D."""

    points: int
    distance: float


class PartTest(_Numbers, frozen=True, kw_only=True, tag="part"):
    """U of a task from a calibrated workpiece (ISO 15530-3), by jobs (`ocmm msa part`)."""

    cycles: int
    results: int
    """`cycles`, `results`: minimum numbers, each with the part reclamped."""
    large: float
    large_share: float
    small: float
    """`large`, `large_share`, `small`: other part: share above ``large`` mm, else ``small`` mm."""
    angle_deg: float
    """Maximum turn."""


TestNumbers: TypeAlias = (
    LengthTest
    | SphereTest
    | LocationTest
    | E0Test
    | E0BlockTest
    | LongStylusTest
    | SpatTest
    | VolumetricTest
    | DiameterTest
    | PlateTest
    | BallTest
    | InterimTest
    | PartTest
)


class ProcedureDocument(Document, frozen=True, kw_only=True):
    id: str
    title: str
    standard: str
    edition: str
    checked_by: str = ""
    """Who compared it with the standard clause by clause; empty if not done."""
    accreditation: str = ""
    """Accreditation number for certificates; empty: in-house record."""
    by_agreement: str = ""
    """Why it is outside the scope of the standard; empty if inside."""
    rule: Literal["simple", "guarded"]
    """"simple", or "guarded": the limit is reduced by U(q)."""
    retests_allowed: int
    minutes: float
    """Duration for a trained person."""
    fixing: float = 0.0
    """U (k = 2) of fixing the artefact, mm."""
    limits: dict[str, Mpe]
    climate: ClimateRule
    test: TestNumbers
    cameras: Literal["proven", "unproven"] | msgspec.UnsetType = msgspec.UNSET
    """"unproven" allows cameras of unproven age or order; older records omit it."""

    @property
    def source(self) -> str:
        """Return the standard with its year, or another document with its edition in words."""
        if self.edition.isdigit():
            return f"{self.standard}:{self.edition}"
        return f"{self.standard}, {self.edition}"

    @property
    def wording(self) -> str:
        """Return the permitted statement about the standard."""
        name = self.source
        return f"tested to {name}" if self.checked_by.strip() else f"modelled on {name}"


def load_procedure(path: Path | str) -> tuple[ProcedureDocument, str]:
    """Return a procedure and the SHA-256 of its file; raise InputError if invalid."""
    procedure, text = load_with_text(path, ProcedureDocument, PROCEDURE_SCHEMA)
    for name, limit in procedure.limits.items():
        if not (limit.constant > 0.0 and limit.per_length >= 0.0) or (
            limit.largest is not None and limit.largest < limit.constant
        ):
            raise _wrong(path, f"limits.{name}", "is not a limit above zero that grows")
    if not 0 <= procedure.retests_allowed <= 5:
        raise _wrong(path, "retests_allowed", "is not within 0 to 5")
    if procedure.fixing < 0.0 or not procedure.climate.low < procedure.climate.high:
        raise _wrong(path, "climate", "is no range, or 'fixing' is below zero")
    if not procedure.climate.per_hour > 0.0:
        raise _wrong(path, "climate.per_hour", "is not above zero")
    return procedure, text_digest(text)


def procedure_files(*, of_jobs: bool = False) -> dict[str, Path]:
    """Return the shipped procedures by id; `of_jobs`: computed from jobs, not points."""
    folder = resource("acceptance", "length_7x5.toml").parent
    found = {}
    for path in sorted(folder.glob("*.toml")):
        procedure = load_procedure(path)[0]
        if isinstance(procedure.test, PartTest) is of_jobs:
            found[procedure.id] = path
    return found


def find_procedure(name: str) -> Path:
    """Return the file of a procedure by id or path; raise InputError if absent."""
    shipped = {**procedure_files(), **procedure_files(of_jobs=True)}
    for known, path in shipped.items():
        if known.casefold() == name.casefold():
            return path
    path = Path(name)
    if path.suffix == ".toml":
        return path
    raise InputError(
        "acceptance.procedure",
        f"There is no procedure '{name}'.",
        f"Give a TOML file, or one of {', '.join(shipped)}.",
    )


def _wrong(path: Path | str, field: str, what: str) -> InputError:
    return InputError("acceptance.field", f"{path}: field '{field}' {what}.", "Correct that field.")
