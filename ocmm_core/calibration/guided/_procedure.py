"""Guided procedures: steps with gates, seen as immutable snapshots.

Push frames, record or drop observations, enter the next step. Screens poll the snapshot `view`
(`_procedure_views`). Every accepted observation is one line of a session file, on disk before the
call returns; the state is a pure fold over these lines, so `resume` restores a killed procedure.

The procedures, each with ``begin`` and ``resume`` (see their modules):

- `cameras.KnownPointsProcedure`: ``prepare``, ``collect``, ``result``
- `relocation.RelocationProcedure`: ``prepare``, ``seats``, ``wave``, ``bar``, ``world``, ``again``,
  ``result``
- `verification.VerificationProcedure`: ``prepare``, ``seats``, ``lines``, ``spheres``, ``again``,
  ``result``
- `sweeping.PivotProcedure`: ``prepare``, ``first``, ``second``, ``again``, ``result``

``begin`` writes what is fixed for the session (rig, artefacts, people, temperature). `compute` may
take seconds; call it from a separate thread or process. Its result is not stored: the same
observations reproduce it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import Finding
from ocmm_core.geometry import Int, Pixels


class ProcedureKind(StrEnum):
    """Kind of procedure; session files start with this name."""

    KNOWN_POINTS = "known-points"
    RELOCATION = "relocation"
    VERIFICATION = "verification"
    PIVOT = "pivot"
    QUALIFICATION = "qualification"
    TIP_CHECK = "tip-check"


class ProcedureDecision(StrEnum):
    """How a procedure ended."""

    OPEN = "open"
    ACCEPTED = "accepted"
    KEPT = "kept the old one"


@dataclass(frozen=True, slots=True)
class Gate:
    """Permission to enter the next step."""

    open: bool
    reason: str = ""
    remedy: str = ""
    """`reason`, `remedy`: Why it is closed, and what to do; one sentence each, empty if open."""


OPEN = Gate(True)


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a procedure."""

    name: str
    title: str
    instruction: str
    """`title`, `instruction`: User text: a few words, and the present task."""
    gate: Gate
    """Leads out of this step."""
    done: int = 0
    wanted: int = 0
    """`done`, `wanted`: Observations of this step; zero wanted if not counted."""


@dataclass(frozen=True, slots=True)
class CameraLive:
    """Current spots of one camera."""

    name: str
    uv: Pixels
    """(k, 2), px: its spots in the latest frame."""
    labels: Int
    """(k,): LED number of each spot, -1 if unknown."""


@dataclass(frozen=True, slots=True)
class Live:
    """Current view, and whether it can be recorded."""

    cameras: tuple[CameraLive, ...] = ()
    """One for each camera; empty before the first frame."""
    ready: bool = False
    """`take` would record it now."""
    hint: str = "No frames yet."
    """Why not, or the next task, in one sentence."""
    frames: int = 0
    wanted: int = 0
    """`frames`, `wanted`: Frames in the current average, and the number that completes it."""
    motion_px: float = float("nan")
    """Motion of the spots during the average, px; NaN without an average."""


@dataclass(frozen=True, slots=True)
class ProcedureView:
    """Common part of the snapshots of all procedures."""

    kind: StrEnum
    """One of `ProcedureKind`, or of another package's enumeration."""
    session: Path
    rig: str
    begun_utc: str
    who: str
    """`begun_utc`, `who`: ISO 8601 text, and the operator."""
    steps: tuple[Step, ...]
    current: int
    live: Live
    decision: ProcedureDecision
    """Outcome; `ProcedureDecision.OPEN` until it has ended."""
    stored: bool
    """The accepted result is in the store; if not, `compute` and `accept` put it there."""
    error: Finding | None
    """Objection of the last calculation, or None."""
    torn: str = ""
    """Message about an entry being written when the program stopped, or empty."""

    @property
    def step(self) -> Step:
        return self.steps[self.current]


class Procedure(Protocol):
    """Interface of any procedure; thread-safe. Times come from the caller, for tests."""

    @property
    def base(self) -> ProcedureView:
        """Return the common part of the snapshot."""
        ...

    def watch(self, block: FrameBlock) -> None:
        """Process frames in the order of exposure; never records anything."""
        ...

    def require_name(self) -> None:
        """Raise StorageError if the session file lost its name, and stop recording. Cheap."""
        ...

    def take(self, now: datetime) -> None:
        """Record the current view as the next observation of the current step.

        CalibrationError, with the reason, unless `Live.ready`; StorageError if not stored.
        """
        ...

    def drop(self, now: datetime) -> None:
        """Remove the last observation of the current step, if any."""
        ...

    def advance(self, now: datetime) -> None:
        """Enter the next step; CalibrationError, with reason and remedy, if the gate is closed."""
        ...

    def back(self, now: datetime) -> None:
        """Return to the previous step; observations are kept."""
        ...

    def record_temperature(self, now: datetime, sensors_c: Sequence[float | None]) -> None:
        """Record the sensor temperatures, degrees Celsius, camera by camera; None: unknown."""
        ...

    def note_temperature(self, now: datetime, temperature: Temperature) -> None:
        """Record a new reading of the thermometer in the room; InputError if not certified."""
        ...

    def compute(self) -> None:
        """Calculate the result, up to some seconds; CalibrationError, also in the snapshot."""
        ...

    def accept(self, now: datetime, reason: str) -> None:
        """Store the result in the rig's calibrations and end the procedure.

        A calibration is then in force, and SUSPECT until a verification passes. The verdict of a
        verification is stored in any case. Repeat the call if it was interrupted. CalibrationError
        without a result, or after another decision.
        """
        ...

    def keep(self, now: datetime, reason: str) -> None:
        """End the procedure without changes to the store."""
        ...
