"""Procedures as documents (`ocmm.acceptance/1`): every number of a test is a field.

A procedure names the standard that it is modelled on, its edition, the limits, the decision rule,
and who compared it with the standard clause by clause. As long as nobody did, every paper says
"modelled on".
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal, TypeAlias

import msgspec

from ocmm_core.documents import Document, digest, load_document, resource
from ocmm_core.errors import InputError

PROCEDURE_SCHEMA = "ocmm.acceptance/1"


class Mpe(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Permissible error: min(constant + per_length L, largest), mm.

    ``largest`` is None where there is none: A + L/K; ``per_length`` zero gives a constant.
    """

    constant: float
    per_length: float = 0.0
    largest: float | None = None

    def at(self, length: float) -> float:
        """Return the limit of a length, mm."""
        limit = self.constant + self.per_length * abs(length)
        return limit if self.largest is None else min(limit, self.largest)

    def describe(self) -> str:
        """Return it in words, um and mm."""
        grows = f" + L/{1.0 / (1e3 * self.per_length):.4g}" if self.per_length else ""
        text = f"{1e3 * self.constant:g} µm{grows}"
        return text if self.largest is None else f"min({text}, {1e3 * self.largest:g} µm)"


class ClimateRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where a test is valid: degrees Celsius, and the largest change, K/h; beyond, it is void."""

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
    """`lines`, `lengths`: At least so many lines, and test lengths on each."""
    diagonal_share: float
    corner_share: float
    """`diagonal_share`, `corner_share`: Longest length over the space diagonal; an end reaches a
    corner within this share of each edge."""
    angle_deg: float
    """Between two lines, at least."""


class SphereTest(_Numbers, frozen=True, kw_only=True, tag="sphere"):
    """A sphere probed with rings of points at some places (ISO 10360-5): P_Form, P_Size."""

    rings: tuple[tuple[float, int, float], ...]
    """(angle below the pole, number, azimuth of the first), degrees."""
    places: tuple[str, ...]
    """Thirds of the volume."""
    diameter: tuple[float, float]
    """Smallest and largest, mm."""
    gain: float
    """Largest standard deviation of the diameter over that of a point."""
    match_deg: float
    """So far a point may be from its place."""


class LocationTest(_Numbers, frozen=True, kw_only=True, tag="location"):
    """One sphere in several attitudes of the probe (L_Dia of ISO 10360-12, -5)."""

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
    """So many of the sets of repeats may have one value outside, and are measured again."""
    retest_repeats: int
    """How often."""
    angle_deg: float


class E0BlockTest(E0Test, frozen=True, kw_only=True, tag="e0-block"):
    """The same with gauge blocks besides, which are probed from both sides: E0, R0.

    A bar is unidirectional, so that an error of the ball's radius would not be seen.
    """

    block_largest: float
    """No block is longer, mm."""
    block_face: tuple[float, float]
    """Of a measuring face, mm: where the points lie."""
    block_points: int
    block_repeats: int
    """`block_points`, `block_repeats`: On either face, which are averaged; how often the block is
    measured."""


class LongStylusTest(E0Test, frozen=True, kw_only=True, tag="e0-stylus"):
    """The same on two diagonals with the longest stylus (as E150 of ISO 10360-2): E_L, R0."""

    stylus: float
    """From the ball to the nearest LED, mm, at least."""


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
    """Thickness and coplanarity of a plate (the thesis, Table 5): Thickness, Coplanarity."""

    points: int
    size: tuple[float, float]
    """Of the plate in x and y, mm."""


class BallTest(_Numbers, frozen=True, kw_only=True, tag="ball"):
    """A ball measured several times (the thesis, Tables 6 to 8): P_Size, P_Form, L_Dia."""

    points: int
    repeats: int
    diameter: tuple[float, float]


class InterimTest(_Numbers, frozen=True, kw_only=True, tag="interim"):
    """Two spheres that stay at the machine, in 90 seconds: Interim_L, Interim_D."""

    points: int
    distance: float


class PartTest(_Numbers, frozen=True, kw_only=True, tag="part"):
    """Results of a calibrated workpiece (ISO 15530-3): its U, for similar parts alone.

    It is computed from jobs (`ocmm msa part`), not taken point by point.
    """

    cycles: int
    results: int
    """`cycles`, `results`: At least so many, each with the part taken out and clamped again."""
    large: float
    large_share: float
    small: float
    """`large`, `large_share`, `small`: How far the dimension of another part may be: the share
    above ``large`` mm, else ``small`` mm."""
    angle_deg: float
    """How far it may be turned."""


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


class Procedure(Document, frozen=True, kw_only=True):
    """A procedure."""

    id: str
    title: str
    """`id`, `title`: What it is called."""
    standard: str
    edition: str
    """`standard`, `edition`: What it is modelled on."""
    checked_by: str = ""
    """Who compared it with the standard clause by clause; empty: nobody."""
    accreditation: str = ""
    """Number under which certificates are issued; empty: in-house record."""
    by_agreement: str = ""
    """Why it is outside the scope of the standard; empty where it is inside."""
    rule: Literal["simple", "guarded"]
    """"simple", or "guarded": U(q) is taken off the limit."""
    retests_allowed: int
    minutes: float
    """That it takes a trained person."""
    fixing: float = 0.0
    """U (k = 2) of how the artefact is held, mm."""
    limits: dict[str, Mpe]
    climate: ClimateRule
    test: TestNumbers
    """`climate`, `test`: See there."""
    cameras: Literal["proven", "unproven"] | msgspec.UnsetType = msgspec.UNSET
    """"unproven" allows cameras that cannot prove the age or the order of their data; records from
    before it could be said keep their hash."""

    @property
    def wording(self) -> str:
        """Return what may be said about the standard."""
        name = f"{self.standard}:{self.edition}"
        return f"tested to {name}" if self.checked_by.strip() else f"modelled on {name}"


def load_procedure(path: Path | str) -> tuple[Procedure, str]:
    """Return a procedure and the SHA-256 of its file.

    Raises
    ------
    InputError
        It is malformed, or a number in it cannot be meant.
    """
    procedure = load_document(path, Procedure, PROCEDURE_SCHEMA)
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
    return procedure, digest(path)


def procedure_files(*, of_jobs: bool = False) -> dict[str, Path]:
    """Return the shipped procedures by their id.

    Parameters
    ----------
    of_jobs
        Those that are computed from jobs, instead of those that are taken point by point.
    """
    folder = resource("acceptance", "length_7x5.toml").parent
    found = {}
    for path in sorted(folder.glob("*.toml")):
        procedure = load_procedure(path)[0]
        if isinstance(procedure.test, PartTest) is of_jobs:
            found[procedure.id] = path
    return found


def find_procedure(name: str) -> Path:
    """Return the file of a procedure by its id or its path.

    Raises
    ------
    InputError
        There is none.
    """
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
