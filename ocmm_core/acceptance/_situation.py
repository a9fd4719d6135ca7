"""Data for planning, recording and judging a test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from ocmm_core.acceptance._procedure import Mpe, ProcedureDocument
from ocmm_core.acceptance._result import (
    AcceptanceVerdict,
    ClimateReading,
    InstrumentState,
    JudgedValue,
    Observation,
    PlannedPosition,
    UsedArtefact,
)
from ocmm_core.calibration import probe_design
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.verification import corners_of
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3, unit

_EARLIER_U_K = 0.6
"""U (k = 2) of the thermometer in records of versions that did not ask for it."""

THIRDS = ("near third", "middle third", "far third")


@dataclass(frozen=True, slots=True)
class Stage:
    """Procedure, instrument and artefacts, which determine the plan."""

    procedure: ProcedureDocument
    instrument: InstrumentState
    artefacts: tuple[UsedArtefact, ...]
    seed: int = 0

    @property
    def volume(self) -> Float:
        """Return the volume (2, 3), mm."""
        return np.array([self.instrument.volume_min, self.instrument.volume_max])

    def of_role(self, role: str) -> tuple[UsedArtefact, ...]:
        return tuple(one for one in self.artefacts if one.role == role)

    def only(self, role: str) -> UsedArtefact:
        """Return the artefact with a role; raise CalibrationError if missing."""
        found = self.of_role(role)
        if not found:
            raise CalibrationError(
                "acceptance.artefact_missing",
                f"'{self.procedure.id}' needs a {role}, and none was given.",
                f"Add one to the register (ocmm artefact add), and name it with --{role}.",
            )
        return found[0]

    def limit(self, quantity: str) -> Mpe:
        """Return the limit of a quantity; raise CalibrationError if missing."""
        found = self.procedure.limits.get(quantity)
        if found is None:
            raise CalibrationError(
                "acceptance.limit_missing",
                f"'{self.procedure.id}' states no limit of {quantity}.",
                f"Add [limits.{quantity}] to the procedure.",
            )
        return found


@dataclass(frozen=True, slots=True)
class Situation:
    """Recorded ball centres and handles of every position."""

    stage: Stage
    plan: tuple[PlannedPosition, ...]
    """Positions, retests last."""
    tips: tuple[Points3, ...]
    """(n, 3), mm, of every position, in point order."""
    handles: tuple[Points3, ...]
    """(n, 3), or (0, 3) if unknown."""
    temperatures: tuple[Temperature | None, ...]
    """Per position; None if not logged."""

    def root(self, position: int) -> int:
        """Return the original position of a retest chain; itself if not a retest."""
        while self.plan[position].retest_of >= 0:
            position = self.plan[position].retest_of
        return position

    def depth(self, position: int) -> int:
        """Return the retest number of a position; zero for none."""
        found = 0
        while self.plan[position].retest_of >= 0:
            position, found = self.plan[position].retest_of, found + 1
        return found

    def is_complete(self, position: int) -> bool:
        return len(self.tips[position]) == wanted(self.plan[position])

    def complete(self) -> list[int]:
        return [i for i in range(len(self.plan)) if self.is_complete(i)]

    def value(
        self,
        quantity: str,
        position: int,
        name: str,
        *,
        item: int = 0,
        nominal: float = 0.0,
        measured: float,
        certified: float = 0.0,
        expanded: float = 0.0,
    ) -> JudgedValue:
        limit = self.stage.limit(quantity).at(nominal)
        error, plan = measured - certified, self.plan[position]
        expanded = float(np.hypot(expanded, self.stage.procedure.fixing))
        return JudgedValue(
            quantity=quantity, position=plan.name, name=name, key=f"{self.root(position)}/{item}",
            nominal_mm=nominal, measured_mm=measured, certified_mm=certified, error_mm=error,
            expanded_mm=expanded, limit_mm=limit,
            verdict=judge(error, expanded, limit, guarded=self.stage.procedure.rule == "guarded"),
            retest=self.depth(position),
        )  # fmt: skip


def judge(error: float, expanded: float, limit: float, *, guarded: bool) -> AcceptanceVerdict:
    """Return the verdict on a test value (ISO 14253-1; uncertainty: ISO 14253-5)."""
    if not guarded:
        return AcceptanceVerdict.PASS if abs(error) <= limit else AcceptanceVerdict.FAIL
    if abs(error) + expanded <= limit:
        return AcceptanceVerdict.PASS
    if abs(error) - expanded > limit:
        return AcceptanceVerdict.FAIL
    return AcceptanceVerdict.LEANING_IN if abs(error) <= limit else AcceptanceVerdict.LEANING_OUT


def worst_of(verdicts: Sequence[AcceptanceVerdict]) -> AcceptanceVerdict:
    order = (
        AcceptanceVerdict.VOID,
        AcceptanceVerdict.FAIL,
        AcceptanceVerdict.LEANING_OUT,
        AcceptanceVerdict.LEANING_IN,
    )
    return next((one for one in order if one in verdicts), AcceptanceVerdict.PASS)


def certified_at(
    artefact: UsedArtefact, length: float, temperature: Temperature | None
) -> tuple[float, float]:
    """Return a length at a temperature and U (k = 2), mm (`probe_design.certified_at`)."""
    expanded = artefact.expanded + artefact.expanded_per_length * abs(length)
    return probe_design.certified_at(
        length, expanded, artefact.expansion, artefact.expansion_sigma, temperature
    )


def wanted(position: PlannedPosition) -> int:
    """Return the number of points of a position, with repeats."""
    return len(position.points_world) * position.repeats


def third_of(point: Float, stage: Stage) -> str:
    """Return the third of the volume with a point (3,), mm, in the cameras' direction."""
    return THIRDS[min(max(int(3.0 * depth_share(point, stage)), 0), 2)]


def depth_share(point: Float, stage: Stage) -> float:
    """Return the relative depth of a point: 0 nearest to the cameras, 1 farthest."""
    away = unit(np.array(stage.instrument.away))
    depths = corners_of(stage.volume) @ away
    return float((point @ away - depths.min()) / np.ptp(depths))


def stand_at(place: str, stage: Stage, room: float) -> Float:
    """Return a place in a third of the volume for a radius `room`, (3,), mm."""
    away, volume = unit(np.array(stage.instrument.away)), stage.volume
    middle = volume.mean(axis=0)
    reach = float(np.abs(away) @ np.ptp(volume, axis=0))
    step = {THIRDS[0]: -0.30, THIRDS[2]: 0.30}.get(place, 0.0)
    clipped: Float = np.clip(middle + step * reach * away, volume[0] + room, volume[1] - room)
    return clipped


def situation_of(
    stage: Stage,
    plan: Sequence[PlannedPosition],
    observations: Sequence[Observation],
    climate: Sequence[ClimateReading],
) -> Situation:
    tips: list[Points3] = []
    handles: list[Points3] = []
    for position in range(len(plan)):
        own = [one for one in observations if one.position == position]
        tips.append(np.array([one.tip for one in own]).reshape(-1, 3))
        held = [one.handle for one in own if one.handle is not None]
        whole = held if len(held) == len(own) else []
        handles.append(np.array(whole).reshape(-1, 3))
    means = [_mean([one for one in climate if one.position == each.name]) for each in plan]
    return Situation(stage, tuple(plan), tuple(tips), tuple(handles), tuple(means))


def _mean(noted: Sequence[ClimateReading]) -> Temperature | None:
    """Return the mean of the readings of a thermometer, whose error they share."""
    if not noted:
        return None
    stated = [_EARLIER_U_K if isinstance(one.u_k, msgspec.UnsetType) else one.u_k for one in noted]
    return Temperature(float(np.mean([one.celsius for one in noted])), 0.5 * max(stated), "")
