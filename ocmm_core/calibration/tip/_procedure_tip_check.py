"""Guided quick check (one minute): ``sphere`` (13 points), ``cone`` (five attitudes)."""

from __future__ import annotations

from datetime import datetime

from ocmm_core.calibration import guided
from ocmm_core.calibration.records import (
    CHECK_SCHEMA,
    ProbeStore,
    TipCheckRecord,
    TipRecord,
    TipRecords,
    record_hash,
)
from ocmm_core.calibration.tip import _check as check
from ocmm_core.calibration.tip._fit import sigma_of_difference
from ocmm_core.calibration.tip._qualification import (
    TipCheckBegun,
    TouchEvent,
    doubtful_warning,
    mounted_records,
    nearest_to_limit,
)
from ocmm_core.calibration.tip._sphere_layout import (
    CHECK_RINGS,
    cone_layout,
    frame_about,
    sphere_layout,
)
from ocmm_core.calibration.tip._state import TouchPlan
from ocmm_core.calibration.tip._steps import attitudes_gate, places_gate
from ocmm_core.calibration.tip._touch_session import POLE, TouchProcedure, TouchSetup
from ocmm_core.calibration.tip._views import CheckVerdict, TipCheckOutcome, TipCheckView
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody

_ARTEFACT_LIMIT_MM = 0.5 * check.DIAMETER_DEFECT_MM


class TipCheckProcedure(TouchProcedure[TipCheckOutcome, TipCheckBegun, TouchSetup]):
    """See `TouchProcedure`; with the qualified limits."""

    kind = guided.ProcedureKind.TIP_CHECK
    sessions = guided.SessionFormat(kind, guided.SessionLine[TouchEvent], TipCheckBegun)
    _decision: tuple[int, check.TipCheckDecision] | None = None

    @classmethod
    def _first_line(
        cls, site: guided.SessionSite, setup: TouchSetup, now: datetime
    ) -> dict[str, object]:
        qualified = _qualified(mounted_records(ProbeStore(site.records), setup.tip), None)
        return cls._touch_line(site, setup, now, _ARTEFACT_LIMIT_MM) | {
            "nominal_mm": qualified.diameter_mm, "qualification": record_hash(qualified)
        }  # fmt: skip

    @property
    def view(self) -> TipCheckView:
        with self._lock:
            decision = self._decide_now()
            return self._snapshot(TipCheckView, so_far=decision.verdict, outcome=self._outcome)

    def _decide_now(self) -> check.TipCheckDecision:
        if self._decision is None or self._decision[0] != self._version:
            state, begun = self._state, self._begun
            decision = check.decide_check(
                state.sphere_touches, state.cone_touches, begun.sphere, self._qualification,
                state.rig, state.body, begun.temperature,
            )  # fmt: skip
            self._decision = (self._version, decision)
        return self._decision[1]

    def _wanting(self, begun: TipCheckBegun, rig: Rig, calibrated: ProbeBody) -> TouchPlan:
        frame = frame_about(POLE, rig)
        places = sphere_layout(CHECK_RINGS, frame)
        self._qualification = qualified = _qualified(self._records, begun.qualification)
        return TouchPlan(
            frame=frame,
            places=places,
            attitudes=cone_layout(frame),
            points=len(places.names),
            places_needed=len(places.names) - 2,
            sigma_of=lambda errors: sigma_of_difference(
                errors, begun.sphere, begun.temperature, qualified, rig, calibrated
            ),
            diameter_sigma=check.DIAMETER_SIGMA_MM,
            artefact_limit=_ARTEFACT_LIMIT_MM,
            chance=check.CHANCE,
        )

    def _diameter_unknown(self, sigma_mm: float, limit_mm: float) -> guided.Gate:
        if check.never_conclusive(self._qualification):
            return guided.Gate(
                False,
                "The qualified diameter is too uncertain for any check.",
                "Qualify the tip again.",
            )
        next_words = self._state.next_words()
        return guided.Gate(
            False,
            f"Inconclusive: U of the compared diameter (k = 2) is {2e3 * sigma_mm:.1f} um; "
            f"{2e3 * limit_mm:.1f} um are needed.",
            f"More points: touch the sphere {next_words}.",
        )

    def _cone_said(self) -> guided.Gate:
        gate = attitudes_gate(self._state)
        decision = self._decide_now()
        if gate.open and decision.verdict is CheckVerdict.INCONCLUSIVE:
            return guided.Gate(False, "The check is inconclusive.", decision.advice)
        return guided.OPEN if gate.open else gate

    def _concluded(self) -> TipCheckOutcome:
        gate = attitudes_gate(self._state)
        if gate.open:
            gate = places_gate(self._state)
        if not gate.open:
            raise CalibrationError("tip_check.incomplete", gate.reason, gate.remedy)
        decision = self._decide_now()
        if decision.verdict is CheckVerdict.INCONCLUSIVE or decision.ball is None:
            raise CalibrationError(
                "tip_check.inconclusive", "The check is inconclusive.", decision.advice
            )
        checks, findings = decision.checks, decision.findings
        record = self._record(
            TipCheckRecord,
            schema=CHECK_SCHEMA,
            qualification=self._begun.qualification,
            checks=checks,
            passed=decision.verdict is CheckVerdict.PASSED,
        )
        return TipCheckOutcome(
            record=record,
            largest=nearest_to_limit(checks),
            findings=findings,
            warnings=(*(() if findings else doubtful_warning(decision.ball)), *self._warned()),
            due_utc=self._records.due_utc,
        )

    def _check(self, outcome: TipCheckOutcome) -> None:
        super()._check(outcome)
        active = self._store.active(self.tip)
        if active is None or (
            active.qualification is None
            or record_hash(active.qualification) != self._begun.qualification
        ):
            raise _requalified()

    def _put(self, outcome: TipCheckOutcome, decided: guided.Decided) -> None:
        now = datetime.fromisoformat(decided.utc)
        self._store.check(outcome.record, now, self._log.path)


def _qualified(records: TipRecords, digest: str | None) -> TipRecord:
    """Return the qualification in force; it must match ``digest`` if given."""
    found = records.qualification
    if found is None:
        raise CalibrationError(
            "tip_check.not_qualified",
            f"Tip '{records.calibration.tip}' was not qualified since the probe was calibrated: "
            f"there is nothing to check against.",
            "Qualify the tip on the sphere.",
        )
    if digest is not None and record_hash(found) != digest:
        raise _requalified()
    return found


def _requalified() -> CalibrationError:
    return CalibrationError(
        "session.qualification",
        "The tip has been requalified since this session was started.",
        "Start a new session.",
    )
