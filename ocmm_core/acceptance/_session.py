"""The engine: an acceptance test from its plan to its record, durable at every step.

State follows from the lines of a chain file, each on the disk before a method returns: what was
told to the operator is stored. Whoever resumes after a power cut goes on with the next point.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np

from ocmm_core.acceptance._events import (
    AcceptanceView,
    Begun,
    ClimateNoted,
    Event,
    Finished,
    Line,
    PointRefused,
    PointTaken,
    PositionRedone,
    RetestBegun,
)
from ocmm_core.acceptance._guards import (
    begin_findings,
    climate_reasons,
    require_usable,
    spots_hash,
)
from ocmm_core.acceptance._kinds import Retest, kind_of, plan_of, quantities_of, values_of
from ocmm_core.acceptance._placement import judge_point, judge_position
from ocmm_core.acceptance._planning import vector
from ocmm_core.acceptance._result import (
    RECORD_SCHEMA,
    AcceptanceRecord,
    Climate,
    Observation,
    Refusal,
    Verdict,
)
from ocmm_core.acceptance._situation import (
    Situation,
    Stage,
    situation_of,
    wanted,
    worst_of,
)
from ocmm_core.calibration.guided import Spots, utc_text
from ocmm_core.calibration.records import ArtefactUse, let_pass
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, InputError
from ocmm_core.geometry import Float

S = TypeVar("S", bound=msgspec.Struct)


class AcceptanceSession:
    """One test; made by `begin` and `resume`. Its methods may be called from any thread."""

    def __init__(self, chain: ChainFile[Line]) -> None:
        self._chain = chain
        self._lock = threading.RLock()
        first = chain.items[0].event if chain.items else None
        if not isinstance(first, Begun):
            raise CalibrationError(
                "acceptance.session",
                f"{chain.path}: this is no session of an acceptance test.",
                "Choose another file, or begin a new test.",
            )
        self._begun = first
        self.stage = Stage(first.procedure, first.instrument, first.artefacts, first.seed)
        self._plan = list(first.plan)
        self._taken: list[list[Observation]] = [[] for _ in self._plan]
        self._refusals: list[Refusal] = []
        self._climate: list[Climate] = []
        self._retests = 0
        self._finished: Finished | None = None
        self._seen: set[str] = set(first.reserved)
        for line in chain.items[1:]:
            self._fold(line.event)

    @classmethod
    def begin(
        cls,
        path: Path,
        stage: Stage,
        procedure_sha256: str,
        now: datetime,
        *,
        temperature_c: float,
        who: str,
        place: str = "",
        customer: str = "",
        condition: str = "as found",
        calibration_artefacts: Sequence[ArtefactUse] = (),
        qualification_artefacts: Sequence[ArtefactUse] = (),
        reserved: Sequence[str] = (),
        force: bool = False,
    ) -> AcceptanceSession:
        """Begin a test in a new file.

        Parameters
        ----------
        temperature_c
            Of the room.
        calibration_artefacts, qualification_artefacts
            What the calibration and the tip rest on.
        reserved
            `spots_hash` of observations that the calibration and the tip were computed from.
        force
            Pass what only warns.

        Raises
        ------
        CalibrationError
            An artefact is missing, expired, too coarse, or was used for the calibration; the
            calibration may not be used; the artefact does not suit the volume.
        InputError
            The file exists.
        """
        if path.exists():
            raise InputError(
                "acceptance.exists", f"{path}: the file exists.", "Resume it, or give another name."
            )
        plan, notes = plan_of(stage)
        found = begin_findings(
            stage, now, temperature_c, calibration_artefacts, qualification_artefacts
        )
        let_pass(found, force=True)
        del force
        notes += tuple(one.what for one in found if not one.refuses)
        chain = ChainFile(path, Line, remembered=True)
        chain.append(
            Line(
                Begun(
                    utc=utc_text(now),
                    procedure=stage.procedure,
                    procedure_sha256=procedure_sha256,
                    instrument=stage.instrument,
                    artefacts=stage.artefacts,
                    made_by=who,
                    place=place,
                    customer=customer,
                    condition=condition,
                    seed=stage.seed,
                    plan=plan,
                    notes=notes,
                    reserved=tuple(reserved),
                )
            )
        )
        session = cls(chain)
        session.note_temperature(temperature_c, now)
        return session

    @classmethod
    def resume(cls, path: Path) -> AcceptanceSession:
        """Continue the test of a file; raise StorageError where it is not as it was written."""
        return cls(ChainFile(path, Line, remembered=True))

    @property
    def path(self) -> Path:
        """Return the session file."""
        return self._chain.path

    # What is taken.

    def note_temperature(self, celsius: float, now: datetime) -> None:
        """Note the temperature: the end of what was measured, and the begin of what comes."""
        if not -50.0 < celsius < 100.0:
            raise InputError(
                "acceptance.temperature",
                f"{celsius:g} °C is no temperature of a room.",
                "Give it in degrees Celsius.",
            )
        with self._lock:
            self._require_open()
            current, utc = self._current(), utc_text(now)
            before = self._last_touched()
            if before >= 0 and before != current:
                self._append(
                    ClimateNoted(
                        utc=utc, position=self._plan[before].name, when="end", celsius=celsius
                    )
                )
            if current >= 0:
                begun = bool(self._taken[current])
                self._append(
                    ClimateNoted(
                        utc=utc,
                        position=self._plan[current].name,
                        when="end" if begun else "begin",
                        celsius=celsius,
                    )
                )

    def take(
        self,
        tip_world: Float,
        now: datetime,
        *,
        handle: Float | None = None,
        uv: Spots | None = None,
        sigma_px: float = 0.0,
    ) -> str:
        """Take the next point.

        Returns
        -------
        hint
            Why the position that it completed is to be taken anew; empty where it is not.

        Raises
        ------
        CalibrationError
            The point is refused, with the reason, which is logged; or nothing is to be taken.
        """
        with self._lock:
            self._require_open()
            position = self._current()
            if position < 0:
                raise CalibrationError(
                    "acceptance.nothing_next", "All points were taken.", "Finish the test."
                )
            tip = np.asarray(tip_world, dtype=np.float64)
            require_usable(tip)
            if self.needs_temperature():
                raise CalibrationError(
                    "acceptance.no_temperature",
                    f"No temperature was noted for '{self._plan[position].name}'.",
                    "Note the temperature, then take the point.",
                )
            reason = self._reused(uv) or judge_point(self.situation(), position, tip)
            if reason:
                self._append(PointRefused(utc=utc_text(now), position=position, reason=reason))
                raise CalibrationError(
                    "acceptance.refused", reason, "Take the point again where it belongs."
                )
            plan = self._plan[position]
            self._append(
                PointTaken(
                    utc=utc_text(now),
                    position=position,
                    item=len(self._taken[position]) % len(plan.points_world),
                    tip=vector(tip),
                    handle=None if handle is None else vector(handle),
                    uv=uv,
                    sigma_px=sigma_px,
                )
            )
            if len(self._taken[position]) < wanted(plan):
                return ""
            hint = judge_position(self.situation(), position)
            if hint:
                self._append(PositionRedone(utc=utc_text(now), position=position, reason=hint))
            return hint

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what of the advice could not be followed, and what only warns."""
        return self._begun.notes

    @property
    def current(self) -> int:
        """Return the position whose points come next; -1 where all were taken."""
        with self._lock:
            return self._current()

    def hint(self, tip_world: Float) -> str:
        """Return why a ball at rest would be refused now; empty where it would be taken."""
        with self._lock:
            position = self._current()
            return "" if position < 0 else judge_point(self.situation(), position, tip_world)

    def retest(self, now: datetime) -> Retest:
        """Begin a retest, and return what is measured again.

        Raises
        ------
        CalibrationError
            Points are missing, nothing failed, too much did, or no retest is left.
        """
        with self._lock:
            self._require_open()
            self._require_complete()
            allowed = self.stage.procedure.retests_allowed
            if self._retests >= allowed:
                raise CalibrationError(
                    "acceptance.retests",
                    f"{self._retests} of {allowed} retests were made.",
                    "Finish the test with this result.",
                )
            positions = kind_of(self.stage).retest(self.situation())
            self._append(RetestBegun(utc=utc_text(now), positions=positions))
            return positions

    def finish(self, now: datetime, temperature_c: float) -> AcceptanceRecord:
        """Give the verdict and return the record.

        Raises
        ------
        CalibrationError
            Points are missing, or a corner of the volume was not reached.
        """
        with self._lock:
            self._require_open()
            self._require_complete()
            missing = kind_of(self.stage).open_end(self.situation(), self.stage.procedure.test)
            if missing:
                raise CalibrationError(
                    "acceptance.open_end", missing, "Begin a new test whose plan reaches it."
                )
            self.note_temperature(temperature_c, now)
            verdict = self._verdict()
            self._append(Finished(utc=utc_text(now), verdict=verdict))
            return self.record()

    def record(self) -> AcceptanceRecord:
        """Return the record of a finished test; raise CalibrationError where it is not."""
        with self._lock:
            if self._finished is None:
                raise CalibrationError(
                    "acceptance.unfinished", "The test is not finished.", "Take what is missing."
                )
            begun, values = self._begun, tuple(values_of(self.situation()))
            return AcceptanceRecord(
                schema=RECORD_SCHEMA, number=self._chain.links[0][:12], procedure=begun.procedure,
                procedure_sha256=begun.procedure_sha256, instrument=begun.instrument,
                artefacts=begun.artefacts, made_by=begun.made_by, place=begun.place,
                customer=begun.customer, condition=begun.condition, begun_utc=begun.utc,
                ended_utc=self._finished.utc, seed=begun.seed, plan=tuple(self._plan),
                notes=begun.notes, observations=self._observations(),
                climate=tuple(_plain(one, Climate) for one in self._climate),
                refusals=tuple(_plain(one, Refusal) for one in self._refusals),
                values=values, quantities=quantities_of(values), retests=self._retests,
                void_reasons=tuple(climate_reasons(self.stage, self._climate)),
                verdict=self._finished.verdict, wording=begun.procedure.wording,
                chain_head=self._chain.links[-1],
            )  # fmt: skip

    # What is seen.

    @property
    def view(self) -> AcceptanceView:
        """Return the snapshot."""
        with self._lock:
            position = self._current()
            complete = position < 0
            values = tuple(values_of(self.situation())) if any(self._taken) else ()
            return AcceptanceView(
                title=self.stage.procedure.title, wording=self.stage.procedure.wording,
                positions=tuple(self._plan), done=tuple(len(one) for one in self._taken),
                current=position,
                next_item=-1 if complete else self._next_item(position),
                instruction=self._instruction(position), values=values,
                verdict=self._verdict() if complete else None,
                retests_left=self.stage.procedure.retests_allowed - self._retests,
                needs_temperature=self.needs_temperature(),
                refusals=tuple(one.reason for one in self._refusals),
                void_reasons=tuple(climate_reasons(self.stage, self._climate)),
                finished=self._finished is not None,
            )  # fmt: skip

    def situation(self) -> Situation:
        """Return what was taken."""
        return situation_of(
            self.stage, self._plan, [one for many in self._taken for one in many], self._climate
        )

    def needs_temperature(self) -> bool:
        """Return whether the temperature is to be noted before the next point."""
        position = self._current()
        if position < 0 or self._taken[position]:
            return False
        name = self._plan[position].name
        return not any(one.position == name and one.when == "begin" for one in self._climate)

    def _next_item(self, position: int) -> int:
        return len(self._taken[position]) % len(self._plan[position].points_world)

    def _instruction(self, position: int) -> str:
        if position < 0:
            return "All points taken. Finish, or repeat what failed."
        plan, item = self._plan[position], self._next_item(position)
        where = "({:.0f}, {:.0f}, {:.0f})".format(*plan.points_world[item])
        turn = len(self._taken[position]) // len(plan.points_world)
        repeat = f", repeat {turn + 1} of {plan.repeats}" if plan.repeats > 1 else ""
        what = {
            "bar": f"put the ball into nest {item + 1} of {len(plan.points_world)} at {where}",
            "cone": f"put the ball into the cone at {where} and turn the probe",
        }.get(plan.role, f"touch point {item + 1} of {len(plan.points_world)} at {where}")
        return f"{plan.name}{repeat}: {what}."

    # The file.

    def _append(self, event: Event) -> None:
        self._chain.append(Line(event))
        self._fold(event)

    def _fold(self, event: Event) -> None:
        if isinstance(event, PointTaken):
            self._taken[event.position].append(event)
            if event.uv is not None:
                self._seen.add(spots_hash(event.uv))
        elif isinstance(event, PositionRedone):
            self._taken[event.position] = []
            self._refusals.append(event)
        elif isinstance(event, PointRefused):
            self._refusals.append(event)
        elif isinstance(event, RetestBegun):
            self._plan += event.positions
            self._taken += [[] for _ in event.positions]
            self._retests += 1
        elif isinstance(event, ClimateNoted):
            self._climate.append(event)
        elif isinstance(event, Finished):
            self._finished = event

    def _current(self) -> int:
        for position, plan in enumerate(self._plan):
            if len(self._taken[position]) < wanted(plan):
                return position
        return -1

    def _last_touched(self) -> int:
        touched = [i for i, one in enumerate(self._taken) if one]
        return touched[-1] if touched else -1

    def _reused(self, uv: Spots | None) -> str:
        if uv is None or spots_hash(uv) not in self._seen:
            return ""
        return "These spots were used before, in the calibration or in this test."

    def _observations(self) -> tuple[Observation, ...]:
        return tuple(_plain(one, Observation) for many in self._taken for one in many)

    def _verdict(self) -> Verdict:
        if climate_reasons(self.stage, self._climate):
            return Verdict.VOID
        values = values_of(self.situation())
        return worst_of([one.verdict for one in values if not one.superseded])

    def _require_open(self) -> None:
        if self._finished is not None:
            raise CalibrationError(
                "acceptance.finished",
                "The test is finished; nothing is added to it.",
                "Begin a new test.",
            )

    def _require_complete(self) -> None:
        missing = sum(wanted(one) for one in self._plan) - sum(len(one) for one in self._taken)
        if missing:
            raise CalibrationError(
                "acceptance.incomplete", f"{missing} points are missing.", "Take them first."
            )


def _plain(event: msgspec.Struct, kind: type[S]) -> S:
    """Return an event as the struct that it is made from, without its tag."""
    return kind(**{name: getattr(event, name) for name in kind.__struct_fields__})
