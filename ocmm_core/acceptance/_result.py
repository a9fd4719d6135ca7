"""Result of an acceptance test: raw observations, judged values, sealed record.

The record contains everything behind its numbers: the procedure verbatim, the artefacts, every ball
centre with its spots, temperatures, and refusals. `recompute` needs nothing else. Lengths are in
mm; U is expanded with k = 2.
"""

from __future__ import annotations

from enum import StrEnum

import msgspec

from ocmm_core.acceptance._procedure import ProcedureDocument
from ocmm_core.ambient import HUMIDITY, PRESSURE, number_of
from ocmm_core.calibration.guided import Spots
from ocmm_core.calibration.records import ArtefactUse
from ocmm_core.camera import Vector3
from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS

RECORD_SCHEMA = "ocmm.acceptance-record/1"


class AcceptanceVerdict(StrEnum):
    """Result of a test; `VOID`: no result, repeat the test."""

    PASS = "PASS"  # noqa: S105 - a verdict
    FAIL = "FAIL"
    LEANING_IN = "NOT PROVEN, leaning in"
    LEANING_OUT = "NOT PROVEN, leaning out"
    VOID = "VOID"


class JudgedValue(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One test value against its limit."""

    quantity: str
    """Quantity: "E", "P_Form", "P_Size", "L_Dia", "R0", ... as in the procedure's limits."""
    position: str
    name: str
    """`position`, `name`: texts: "diagonal 1", and "240 mm, repeat 2"."""
    key: str
    """Position and item; a retest has the key of the value it replaces."""
    nominal_mm: float
    """Abscissa in graphs; zero if none."""
    measured_mm: float
    certified_mm: float
    error_mm: float
    """`measured_mm`, `certified_mm`, `error_mm`: error is the test value q; the form itself."""
    expanded_mm: float
    """U(q) of the test value: certificate, temperature, fixing and form of the artefact."""
    limit_mm: float
    verdict: AcceptanceVerdict
    superseded: bool = False
    """Replaced by a retest; kept in record and report."""
    retest: int = 0
    """Zero for the first measurement, 1 for the first retest, and so on."""


class QuantityResult(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All values of one quantity together."""

    quantity: str
    count: int
    """`quantity`, `count`: name, and number of values that are not superseded."""
    worst: int
    """Index in `AcceptanceRecord.values` of the value nearest to its limit or farthest beyond."""
    error_mm: float
    expanded_mm: float
    limit_mm: float
    verdict: AcceptanceVerdict


class ClimateReading(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A logged temperature; ``when`` is "begin" or "end" of a position."""

    utc: str
    position: str
    when: str
    celsius: float
    u_k: float | msgspec.UnsetType = msgspec.UNSET
    """Expanded uncertainty (k = 2) of the thermometer, K; unset in earlier versions."""


class RoomAir(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Ambient air; None if not measured."""

    humidity_percent: float | None = None
    pressure_hpa: float | None = None

    @classmethod
    def read(cls, humidity: str, pressure: str) -> RoomAir:
        """Return the typed values; raise InputError for implausible numbers."""
        return cls(
            humidity_percent=number_of(HUMIDITY, humidity),
            pressure_hpa=number_of(PRESSURE, pressure),
        )

    @property
    def lines(self) -> tuple[str, ...]:
        told = []
        if self.humidity_percent is not None:
            told.append(f"Humidity {self.humidity_percent:g} %")
        if self.pressure_hpa is not None:
            told.append(f"Air pressure {self.pressure_hpa:g} hPa")
        return tuple(told)


class UsedArtefact(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    role: str
    """Role in the plan: "bar", "sphere", "block", "plate", "cone"."""
    use: ArtefactUse
    laboratory: str = ""
    sizes: tuple[float, ...]
    """Certified at 20 degrees, mm: nests of a bar, diameter of a sphere, length of a block."""
    expanded: float
    expanded_per_length: float = 0.0
    """`expanded`, `expanded_per_length`: U (k = 2): constant, mm, and length-dependent part."""
    form: float = 0.0
    """Certified form error, mm; zero if within ``expanded``."""
    expansion: float
    expansion_sigma: float
    """`expansion`, `expansion_sigma`: 1/K."""
    temperatures: tuple[float, float]
    """Validity of the certificate, degrees Celsius."""
    supports: str = ""
    identity: str
    """SHA-256 of its document."""


class InstrumentState(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    rig: str
    calibration: str
    """`rig`, `calibration`: name, and hash of the calibration in force; empty if none."""
    calibration_status: str
    probe: str
    tip: str
    tip_record: str
    """`probe`, `tip`, `tip_record`: names, and the hash of the record."""
    ball_radius: float
    ball_sigma: float
    cameras: tuple[str, ...]
    """Serial numbers or names."""
    volume_min: Vector3
    volume_max: Vector3
    """`volume_min`, `volume_max`: box, mm, world."""
    software: str
    simulated: bool
    away: Vector3 = (0.0, 1.0, 0.0)
    """Unit vector from the cameras to the middle of the volume."""
    stylus: float | msgspec.UnsetType = msgspec.UNSET
    """From ball to nearest LED, mm; omitted in older records, whose hash stays valid."""
    camera_doubts: tuple[str, ...] | msgspec.UnsetType = msgspec.UNSET
    age_doubts: tuple[str, ...] | msgspec.UnsetType = msgspec.UNSET
    """`camera_doubts`, `age_doubts`: sentences on what the cameras cannot prove, and on those that
    leave the age or order of data open. Omitted for our own cameras, so that hashes stay valid."""

    @property
    def unproven(self) -> tuple[str, ...]:
        """Return what the cameras cannot prove, in sentences; empty for our own."""
        return self.camera_doubts or ()

    @property
    def states(self) -> tuple[str, ...]:
        """Return the status words of its tests: SIMULATED, CAMERAS UNPROVEN."""
        unproven = (UNPROVEN_CAMERAS,) if self.unproven else ()
        return (*(("SIMULATED",) if self.simulated else ()), *unproven)


class PlannedPosition(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One place at which an artefact is measured."""

    name: str
    role: str
    points_world: tuple[Vector3, ...]
    """Wanted ball centres in order, mm."""
    normals: tuple[Vector3, ...] = ()
    """Directions of touch from the sphere's centre, or empty."""
    handle: Vector3 | None = None
    """Wanted direction of the handle, from the ball to the hand, or None."""
    corners: tuple[int, ...] = ()
    """Corners of the volume (0 to 7) that an end must reach."""
    items: tuple[int, ...] = ()
    """Indices of lengths measured there, or empty."""
    repeats: int = 1
    place: str = ""
    """"near third", "middle third" or "far third" of the volume, or empty."""
    retest_of: int = -1
    """Index of the position that is repeated; -1: none."""


class Observation(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The ball at rest."""

    position: int
    item: int
    """`position`, `item`: index in the plan, and point of it."""
    utc: str
    tip: Vector3
    """Ball centre, mm, world."""
    handle: Vector3 | None = None
    """Direction from the ball to the hand; None if unknown."""
    uv: Spots | None = None
    sigma_px: float = 0.0
    """`uv`, `sigma_px`: averaged spots, their standard deviation; None if only points exist."""


class RefusedPoint(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A refused point, or a repeated position, with the reason."""

    utc: str
    position: int
    reason: str


class AcceptanceRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    schema: str
    number: str
    """Unique: the first characters of the hash of the session's first line."""
    procedure: ProcedureDocument
    procedure_sha256: str
    """`procedure`, `procedure_sha256`: verbatim, and the hash of its file."""
    instrument: InstrumentState
    artefacts: tuple[UsedArtefact, ...]
    made_by: str
    place: str
    customer: str
    """`made_by`, `place`, `customer`: tester, place, customer."""
    condition: str
    """"as found" or "after adjustment"."""
    begun_utc: str
    ended_utc: str
    """`begun_utc`, `ended_utc`: ISO 8601 text, UTC."""
    seed: int
    plan: tuple[PlannedPosition, ...]
    notes: tuple[str, ...]
    """`plan`, `notes`: positions in measuring order, retests last; advice not followed."""
    observations: tuple[Observation, ...]
    climate: tuple[ClimateReading, ...]
    refusals: tuple[RefusedPoint, ...]
    """`observations`, `climate`, `refusals`: raw data, without repeated observations."""
    values: tuple[JudgedValue, ...]
    quantities: tuple[QuantityResult, ...]
    retests: int
    void_reasons: tuple[str, ...]
    verdict: AcceptanceVerdict
    wording: str
    """`verdict`, `wording`: of the whole test, and the permitted statement about the standard."""
    chain_head: str
    air: RoomAir | msgspec.UnsetType = msgspec.UNSET
    """Humidity and pressure, if measured; omitted in older records, whose hash stays valid."""
