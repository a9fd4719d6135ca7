"""Guided procedures: steps with gates, seen as immutable snapshots.

Window and command line use the same objects. A procedure is driven by few calls - frames are
shown to it, observations are taken or dropped, the next step is entered - and everything that a
screen needs is in the snapshot `view` (`_procedure_views`), which is pulled. Every accepted
observation is one line of a session file that is on the disk before the call returns; the state is
a pure fold over these lines, so that a procedure that was killed at any moment is the same one
after `resume`.

The procedures, each with ``begin`` and ``resume`` (see their modules):

- `cameras.KnownPointsProcedure`: steps ``prepare``, ``collect``, ``result``
- `relocation.RelocationProcedure`: ``prepare``, ``seats``, ``wave``, ``bar``, ``world``,
  ``again``, ``result``
- `verification.VerificationProcedure`: ``prepare``, ``seats``, ``lines``, ``spheres``,
  ``again``, ``result``
- `sweeping.PivotProcedure`: ``prepare``, ``first``, ``second``, ``again``, ``result``

``begin`` writes what is fixed for the whole session (rig, artefacts, people, temperature); the step
``prepare`` shows it. A calculation that takes longer than a moment is `compute`; call it from a
thread or a process of your own, it may run beside everything else. What it returned is then in the
snapshot. It is not stored, because the same observations give the same result again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.records import Finding
from ocmm_core.geometry import Int, Pixels


class ProcedureKind(StrEnum):
    """Which procedure it is; session files begin with this name."""

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
    """Whether the next step may be entered."""

    open: bool
    """It may."""
    reason: str = ""
    remedy: str = ""
    """`reason`, `remedy`: Why not, and what to do; one sentence each, empty where it is open."""


OPEN = Gate(True)


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a procedure."""

    name: str
    """Stable identifier."""
    title: str
    instruction: str
    """`title`, `instruction`: For people: a few words, and what to do now."""
    gate: Gate
    """Out of this step."""
    done: int = 0
    wanted: int = 0
    """`done`, `wanted`: Observations of this step; zero wanted where nothing is counted."""


@dataclass(frozen=True, slots=True)
class CameraLive:
    """What one camera sees now."""

    name: str
    uv: Pixels
    """(k, 2), px: its spots in the latest frame."""
    labels: Int
    """(k,): number of the LED of each spot, -1 where unknown."""


@dataclass(frozen=True, slots=True)
class Live:
    """What is seen now, and whether it could be taken."""

    cameras: tuple[CameraLive, ...] = ()
    """One for each camera; empty before the first frame."""
    ready: bool = False
    """`take` would take it now."""
    hint: str = "No frames yet."
    """Why not, or what to do next, in one sentence."""
    frames: int = 0
    wanted: int = 0
    """`frames`, `wanted`: Frames of the present average, and how many make it complete."""
    motion_px: float = float("nan")
    """How far the spots moved during the average, px; NaN while there is none."""


@dataclass(frozen=True, slots=True)
class ProcedureView:
    """Everything that a screen shows of any procedure."""

    kind: StrEnum
    """Which procedure: one of `ProcedureKind`, or of the enumeration of another room."""
    session: Path
    rig: str
    """Name of the rig."""
    begun_utc: str
    who: str
    """`begun_utc`, `who`: ISO 8601 text, and who does it."""
    steps: tuple[Step, ...]
    """In order."""
    current: int
    """Index of the current step."""
    live: Live
    """What is seen now."""
    decision: ProcedureDecision
    """How it ended, `ProcedureDecision.OPEN` until then."""
    stored: bool
    """What was accepted is in the store; where it is not, `compute` and `accept` put it there."""
    error: Finding | None
    """What the last calculation said against the observations; None while nothing did."""
    torn: str = ""
    """What is to be told of an entry that was being written when the program stopped; empty where
    there was none."""

    @property
    def step(self) -> Step:
        """Return the current step."""
        return self.steps[self.current]


class Procedure(Protocol):
    """What window and command line do with any procedure; any thread may call.

    Times come from the caller, so that a test says what time it is.
    """

    @property
    def base(self) -> ProcedureView:
        """Return the part of the snapshot that all procedures have."""
        ...

    def watch(self, block: FrameBlock) -> None:
        """Look at frames, in the order of their exposure; never takes anything by itself."""
        ...

    def require_name(self) -> None:
        """Raise StorageError if the session file is not on the disk under its name.

        All entries are then in another file, and no observation is ready any more. Cheap: for a
        timer.
        """
        ...

    def take(self, now: datetime) -> None:
        """Take what is seen now as the next observation of the current step.

        Raises
        ------
        CalibrationError
            `Live.ready` is not set; the sentence says why.
        StorageError
            It could not be stored; nothing was taken.
        """
        ...

    def drop(self, now: datetime) -> None:
        """Take back the last observation of the current step; without one, do nothing."""
        ...

    def advance(self, now: datetime) -> None:
        """Enter the next step.

        Raises
        ------
        CalibrationError
            The gate is closed; the sentence says why and what to do.
        """
        ...

    def back(self, now: datetime) -> None:
        """Return to the step before; observations are kept."""
        ...

    def record_temperature(self, now: datetime, sensors_c: Sequence[float | None]) -> None:
        """Keep how warm the sensors are, degrees Celsius, camera by camera; None: not known."""
        ...

    def compute(self) -> None:
        """Calculate the result of the observations so far; takes up to some seconds.

        Raises
        ------
        CalibrationError
            They do not allow it; the same is in the snapshot.
        """
        ...

    def accept(self, now: datetime, reason: str) -> None:
        """Store the result in the calibrations of the rig and end the procedure.

        A calibration is then in force, and SUSPECT until a verification passed. Of a verification
        this stores the verdict, whatever it is. May be called again where it was interrupted.

        Raises
        ------
        CalibrationError
            There is no result, or another one ended the procedure.
        """
        ...

    def keep(self, now: datetime, reason: str) -> None:
        """End the procedure and leave everything as it was."""
        ...
