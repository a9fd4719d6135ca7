"""What an acceptance test leaves: raw observations, judged values, and a sealed record.

The record holds everything that its numbers follow from: the procedure word for word, the
artefacts, every ball centre with its spots, the temperatures, and what was refused. `recompute`
needs nothing else. Lengths are in mm; U is expanded with k = 2.
"""

from __future__ import annotations

from enum import StrEnum

import msgspec

from ocmm_core.acceptance._procedure import Procedure
from ocmm_core.calibration.guided import Spots
from ocmm_core.calibration.records import ArtefactUse
from ocmm_core.camera import Vector3
from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS
from ocmm_core.surroundings import HUMIDITY, PRESSURE, number_of

RECORD_SCHEMA = "ocmm.acceptance-record/1"


class Verdict(StrEnum):
    """What a test shows; `VOID` says that it shows nothing and is to be done again."""

    PASS = "PASS"  # noqa: S105 - a verdict
    FAIL = "FAIL"
    LEANING_IN = "NOT PROVEN, leaning in"
    LEANING_OUT = "NOT PROVEN, leaning out"
    VOID = "VOID"


class JudgedValue(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One test value against its limit."""

    quantity: str
    """What it is of: "E", "P_Form", "P_Size", "L_Dia", "R0", ... as in the procedure's limits."""
    position: str
    name: str
    """`position`, `name`: Of the plan, in words: "diagonal 1", and "240 mm, repeat 2"."""
    key: str
    """Position and item; a retest has the key of what it replaces."""
    nominal_mm: float
    """The length that a graph shows it over; zero where it has none."""
    measured_mm: float
    certified_mm: float
    error_mm: float
    """`measured_mm`, `certified_mm`, `error_mm`: ``error_mm`` is the test value q; for a form it is
    the form itself."""
    expanded_mm: float
    """U(q) of the test value: certificate, temperature, fixing and form of the artefact."""
    limit_mm: float
    """MPE."""
    verdict: Verdict
    """By the rule of the procedure."""
    superseded: bool = False
    """A retest stands in its place; it stays in the record and on paper."""
    retest: int = 0
    """Zero for the first measurement, 1 for the first retest, and so on."""


class QuantityResult(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All values of one quantity together."""

    quantity: str
    count: int
    """`quantity`, `count`: Its name, and how many values count (superseded ones do not)."""
    worst: int
    """Index in `AcceptanceRecord.values` of the value that is nearest to its limit or farthest
    beyond."""
    error_mm: float
    expanded_mm: float
    limit_mm: float
    """`error_mm`, `expanded_mm`, `limit_mm`: Of that value."""
    verdict: Verdict


class Climate(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A temperature that was noted; ``when`` is "begin" or "end" of a position."""

    utc: str
    position: str
    when: str
    celsius: float


class RoomAir(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The air where it was tested, read off once; None where nobody did."""

    humidity_percent: float | None = None
    pressure_hpa: float | None = None
    """`humidity_percent`, `pressure_hpa`: Relative humidity, and pressure."""

    @classmethod
    def read(cls, humidity: str, pressure: str) -> RoomAir:
        """Return what was typed; InputError where it is no number of a room."""
        return cls(
            humidity_percent=number_of(HUMIDITY, humidity),
            pressure_hpa=number_of(PRESSURE, pressure),
        )

    @property
    def words(self) -> tuple[str, ...]:
        """Return what was read off, with its unit."""
        told = []
        if self.humidity_percent is not None:
            told.append(f"Humidity {self.humidity_percent:g} %")
        if self.pressure_hpa is not None:
            told.append(f"Air pressure {self.pressure_hpa:g} hPa")
        return tuple(told)


class UsedArtefact(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An artefact as it was used."""

    role: str
    """What the plan calls it: "bar", "sphere", "block", "plate", "cone"."""
    use: ArtefactUse
    """Name, serial, certificate and due date."""
    laboratory: str = ""
    """That issued the certificate; empty where nobody said."""
    sizes: tuple[float, ...]
    """Certified at 20 degrees, mm: nests of a bar, diameter of a sphere, length of a block."""
    expanded: float
    expanded_per_length: float = 0.0
    """`expanded`, `expanded_per_length`: U (k = 2): constant part, mm, and part of the length."""
    form: float = 0.0
    """Certified form error, mm; zero where it is within ``expanded``."""
    expansion: float
    expansion_sigma: float
    """`expansion`, `expansion_sigma`: 1/K."""
    temperatures: tuple[float, float]
    """Where the certificate holds, degrees Celsius."""
    supports: str = ""
    """How it is held."""
    identity: str
    """SHA-256 of its document."""


class Instrument(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What was tested."""

    rig: str
    calibration: str
    """`rig`, `calibration`: Name of the rig, and hash of the calibration in force; empty without a
    record."""
    calibration_status: str
    probe: str
    tip: str
    tip_record: str
    """`probe`, `tip`, `tip_record`: Names, and the hash of the record."""
    ball_radius: float
    ball_sigma: float
    """`ball_radius`, `ball_sigma`: Of the tip, mm."""
    cameras: tuple[str, ...]
    """Serial numbers or names."""
    volume_min: Vector3
    volume_max: Vector3
    """`volume_min`, `volume_max`: Box, mm, world."""
    software: str
    """Version."""
    simulated: bool
    """Measured on the virtual rig."""
    away: Vector3 = (0.0, 1.0, 0.0)
    """Unit vector from the cameras to the middle of the volume."""
    stylus: float | msgspec.UnsetType = msgspec.UNSET
    """From the ball to the nearest LED, mm; a record from before it was asked for has none, and
    keeps its hash."""
    camera_doubts: tuple[str, ...] | msgspec.UnsetType = msgspec.UNSET
    age_doubts: tuple[str, ...] | msgspec.UnsetType = msgspec.UNSET
    """`camera_doubts`, `age_doubts`: What the cameras cannot prove, in sentences; and what of it
    leaves their data without an age or an order. Records of our own cameras have neither, and keep
    their hash."""

    @property
    def unproven(self) -> tuple[str, ...]:
        """Return what the cameras cannot prove, in sentences; empty where they are ours."""
        return self.camera_doubts or ()

    @property
    def states(self) -> tuple[str, ...]:
        """Return what a test of it must not be taken for: SIMULATED, CAMERAS UNPROVEN."""
        unproven = (UNPROVEN_CAMERAS,) if self.unproven else ()
        return (*(("SIMULATED",) if self.simulated else ()), *unproven)


class PlannedPosition(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One place where an artefact is measured."""

    name: str
    role: str
    points_world: tuple[Vector3, ...]
    """Wanted ball centres, in the order in which they are taken, mm."""
    normals: tuple[Vector3, ...] = ()
    """Directions of touch from the sphere's centre, or empty."""
    handle: Vector3 | None = None
    """Wanted direction of the handle, from the ball to the hand, or None."""
    corners: tuple[int, ...] = ()
    """Of the volume (0 to 7) that an end must reach."""
    items: tuple[int, ...] = ()
    """What is measured there: indices of lengths, or empty."""
    repeats: int = 1
    """How often all points are taken one after the other."""
    place: str = ""
    """"near third", "middle third" or "far third" of the volume, or empty."""
    retest_of: int = -1
    """Index of the position that is measured again; -1: none."""


class Observation(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The ball at rest."""

    position: int
    item: int
    """`position`, `item`: Index in the plan, and which of its points."""
    utc: str
    """When."""
    tip: Vector3
    """Ball centre, mm, world."""
    handle: Vector3 | None = None
    """Direction from the ball to the hand; None where nobody knows it."""
    uv: Spots | None = None
    sigma_px: float = 0.0
    """`uv`, `sigma_px`: Averaged spots and their standard deviation; None where only points are
    known."""


class Refusal(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A point that was refused, or a position that was taken anew, with the reason."""

    utc: str
    position: int
    reason: str


class AcceptanceRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A finished test."""

    schema: str
    """`RECORD_SCHEMA`."""
    number: str
    """Unique: the first characters of the hash of the session's first line."""
    procedure: Procedure
    procedure_sha256: str
    """`procedure`, `procedure_sha256`: Word for word, and the hash of its file."""
    instrument: Instrument
    artefacts: tuple[UsedArtefact, ...]
    """`instrument`, `artefacts`: What was tested, and with what."""
    made_by: str
    place: str
    customer: str
    """`made_by`, `place`, `customer`: Who tested, where, for whom."""
    condition: str
    """"as found" or "after adjustment"."""
    begun_utc: str
    ended_utc: str
    """`begun_utc`, `ended_utc`: ISO 8601 text, UTC."""
    seed: int
    """Of the order of the positions."""
    plan: tuple[PlannedPosition, ...]
    notes: tuple[str, ...]
    """`plan`, `notes`: Positions in the order in which they were taken, retests last; what of the
    advice could not be followed."""
    observations: tuple[Observation, ...]
    climate: tuple[Climate, ...]
    refusals: tuple[Refusal, ...]
    """`observations`, `climate`, `refusals`: Raw data. Observations that were taken anew are not
    among them."""
    values: tuple[JudgedValue, ...]
    quantities: tuple[QuantityResult, ...]
    """`values`, `quantities`: What follows."""
    retests: int
    """How many were made."""
    void_reasons: tuple[str, ...]
    """Why it shows nothing; empty where it does."""
    verdict: Verdict
    wording: str
    """`verdict`, `wording`: Of the whole test, and what may be said about the standard."""
    chain_head: str
    air: RoomAir | msgspec.UnsetType = msgspec.UNSET
    """Humidity and pressure, where somebody read them off; a record from before it was asked for
    has none, and keeps its hash."""
