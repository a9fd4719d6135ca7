"""Guided procedures: steps with gates, seen as immutable snapshots.

Window and command line use the same objects. A procedure is driven by few calls - frames are
shown to it, observations are taken or dropped, the next step is entered - and everything that a
screen needs is in the snapshot `view`, which is pulled. Every accepted observation is one line of
a session file that is on the disk before the call returns; the state is a pure fold over these
lines, so that a procedure that was killed at any moment is the same one after `resume`.

The three procedures, each with ``begin`` and ``resume`` (see their modules):

- `procedure_known_points.KnownPointsProcedure`: steps ``prepare``, ``collect``, ``result``
- `procedure_relocation.RelocationProcedure`: ``prepare``, ``wave``, ``bar``, ``world``, ``result``
- `procedure_verification.VerificationProcedure`: ``prepare``, ``lines``, ``spheres``, ``result``

``begin`` writes what is fixed for the whole session (rig, artefacts, people, temperature); the step
``prepare`` shows it. A calculation that takes longer than a moment is `compute`; call it from a
thread or a process of your own, it may run beside everything else. What it returned is then in the
snapshot. It is not stored, because the same observations give the same result again.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guards import Finding
from ocmm_core.calibration.outcome import CalibrationOutcome, VerificationOutcome
from ocmm_core.geometry import Float, Int, Pixels


class Kind(StrEnum):
    """Which procedure it is; session files begin with this name."""

    KNOWN_POINTS = "known-points"
    RELOCATION = "relocation"
    VERIFICATION = "verification"


class Decision(StrEnum):
    """How a procedure ended."""

    OPEN = "open"
    ACCEPTED = "accepted"
    KEPT = "kept the old one"


@dataclass(frozen=True, slots=True)
class Gate:
    """Whether the next step may be entered.

    Attributes
    ----------
    open
        It may.
    reason, remedy
        Why not, and what to do; one sentence each, empty where it is open.
    """

    open: bool
    reason: str = ""
    remedy: str = ""


OPEN = Gate(True)


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a procedure.

    Attributes
    ----------
    name
        Stable identifier.
    title, instruction
        For people: a few words, and what to do now.
    gate
        Out of this step.
    done, wanted
        Observations of this step; zero wanted where nothing is counted.
    """

    name: str
    title: str
    instruction: str
    gate: Gate
    done: int = 0
    wanted: int = 0


@dataclass(frozen=True, slots=True)
class CameraLive:
    """What one camera sees now.

    Attributes
    ----------
    name
        Of the camera.
    uv
        (k, 2), px: its spots in the latest frame.
    labels
        (k,): number of the LED of each spot, -1 where unknown.
    """

    name: str
    uv: Pixels
    labels: Int


@dataclass(frozen=True, slots=True)
class Live:
    """What is seen now, and whether it could be taken.

    Attributes
    ----------
    cameras
        One for each camera; empty before the first frame.
    ready
        `take` would take it now.
    hint
        Why not, or what to do next, in one sentence.
    frames, wanted
        Frames of the present average, and how many make it complete.
    motion_px
        How far the spots moved during the average, px; NaN while there is none.
    """

    cameras: tuple[CameraLive, ...] = ()
    ready: bool = False
    hint: str = "No frame has arrived yet."
    frames: int = 0
    wanted: int = 0
    motion_px: float = float("nan")


@dataclass(frozen=True, slots=True)
class Cell:
    """One cell of the volume.

    Attributes
    ----------
    name
        Where it is, in words ("near top left").
    low_world, high_world
        (3,), mm.
    poses, wanted
        Of the probe in it.
    """

    name: str
    low_world: Float
    high_world: Float
    poses: int
    wanted: int


@dataclass(frozen=True, slots=True)
class Tilt:
    """One way of holding the probe.

    Attributes
    ----------
    name
        In words ("leaning left").
    poses, wanted
        Held so.
    """

    name: str
    poses: int
    wanted: int


@dataclass(frozen=True, slots=True)
class Coverage:
    """What of the volume was shown.

    Attributes
    ----------
    cells, tilts
        With what is still missing.
    fraction
        Of what is wanted, 0 to 1.
    """

    cells: tuple[Cell, ...]
    tilts: tuple[Tilt, ...]
    fraction: float

    @property
    def missing(self) -> tuple[str, ...]:
        """Return the names of cells and tilts that lack poses, the emptiest first."""
        lacking = [one for one in (*self.cells, *self.tilts) if one.poses < one.wanted]
        return tuple(one.name for one in sorted(lacking, key=lambda one: one.poses / one.wanted))


@dataclass(frozen=True, slots=True)
class ProcedureView:
    """Everything that a screen shows of any procedure.

    Attributes
    ----------
    kind
        Which procedure.
    session
        Its file.
    rig
        Name of the rig.
    begun_utc, who
        ISO 8601 text, and who does it.
    steps
        In order.
    current
        Index of the current step.
    live
        What is seen now.
    decision
        How it ended, `Decision.OPEN` until then.
    error
        What the last calculation said against the observations; None while nothing did.
    """

    kind: Kind
    session: Path
    rig: str
    begun_utc: str
    who: str
    steps: tuple[Step, ...]
    current: int
    live: Live
    decision: Decision
    error: Finding | None

    @property
    def step(self) -> Step:
        """Return the current step."""
        return self.steps[self.current]


@dataclass(frozen=True, slots=True)
class KnownPoint:
    """One reference point of the list.

    Attributes
    ----------
    name
        As in the list.
    position_world
        (3,), mm.
    views
        Cameras that saw it; None until it was taken.
    """

    name: str
    position_world: Float
    views: int | None


@dataclass(frozen=True, slots=True)
class KnownPointsView:
    """Snapshot of the calibration from known points.

    Attributes
    ----------
    base
        What all procedures show.
    points
        All of the list, in its order.
    next_point
        Index of the point that is taken next; None after the last one.
    outcome
        Of `compute`; None before it, and after another point was taken.
    """

    base: ProcedureView
    points: tuple[KnownPoint, ...]
    next_point: int | None
    outcome: CalibrationOutcome | None


@dataclass(frozen=True, slots=True)
class RelocationView:
    """Snapshot of the relocation.

    Attributes
    ----------
    base
        What all procedures show.
    poses
        Of the waved probe that were taken.
    coverage
        Of the volume.
    length_sigma_mm
        Predicted standard uncertainty of a length of ``length_mm`` anywhere in the volume, from
        what was collected so far (`predict`); None before the first prediction.
    length_mm, length_limit_mm
        Which length, and from where on it is good enough.
    bar_placements, bars_wanted
        Taken so far, and wanted.
    world_points, world_wanted
        Control points taken so far by name, and the names that are wanted.
    outcome
        Of `compute`; None before it, and after another observation was taken.
    """

    base: ProcedureView
    poses: int
    coverage: Coverage
    length_sigma_mm: float | None
    length_mm: float
    length_limit_mm: float
    bar_placements: int
    bars_wanted: int
    world_points: tuple[str, ...]
    world_wanted: tuple[str, ...]
    outcome: CalibrationOutcome | None


@dataclass(frozen=True, slots=True)
class LinePlan:
    """One measuring line of the verification.

    Attributes
    ----------
    name
        In words ("space diagonal 1").
    ends_world
        (2, 3), mm: where the first and the last nest of the bar should be.
    taken
        Nests that were taken, of `wanted`.
    wanted
        Nests of the bar.
    hint
        What speaks against the placement as it was taken; empty where nothing does.
    """

    name: str
    ends_world: Float
    taken: int
    wanted: int
    hint: str = ""


@dataclass(frozen=True, slots=True)
class VerificationView:
    """Snapshot of the verification.

    Attributes
    ----------
    base
        What all procedures show.
    lines
        The seven lines.
    current_line
        Index of the line that is being taken; None after the last one.
    spheres
        Points taken on each sphere; empty where none was chosen.
    sphere_points
        Wanted on each.
    outcome
        Of `compute`; the verdict, or None before it.
    """

    base: ProcedureView
    lines: tuple[LinePlan, ...]
    current_line: int | None
    spheres: tuple[int, ...]
    sphere_points: int
    outcome: VerificationOutcome | None


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
