"""Guided tip qualification and quick check: touch a calibrated sphere, rest the ball in a cone.

Steps of the qualification: ``prepare``, ``sphere`` (25 points, ISO 10360-5 layout, and more while
the diameter is too uncertain), ``cone`` (five attitudes), ``result``. The check takes one minute:
``sphere`` (13 points), ``cone`` (five attitudes).
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

import msgspec

from ocmm_core.calibration import guided, records
from ocmm_core.calibration.records import (
    CHECK_SCHEMA,
    ProbeStore,
    TipCheckRecord,
    TipRecord,
    TipRecords,
    record_hash,
)
from ocmm_core.calibration.tip import _check as check
from ocmm_core.calibration.tip import _qualification as qualification
from ocmm_core.calibration.tip._fit import fit_ball_on, sigma_of_difference, sigma_with_sphere
from ocmm_core.calibration.tip._qualification import (
    TipCheckBegun,
    TouchEvent,
    doubtful_warning,
    mounted_records,
    nearest_to_limit,
)
from ocmm_core.calibration.tip._sphere_layout import (
    CHECK_RINGS,
    QUALIFICATION_RINGS,
    cone_layout,
    frame_about,
    sphere_layout,
)
from ocmm_core.calibration.tip._state import TouchPlan
from ocmm_core.calibration.tip._steps import attitudes_gate, places_gate
from ocmm_core.calibration.tip._touch_session import POLE, TouchProcedure, TouchSetup
from ocmm_core.calibration.tip._views import (
    CheckVerdict,
    TipCheckOutcome,
    TipCheckView,
    TipOutcome,
    TipView,
)
from ocmm_core.calibration.tip._wanted import VALID_DAYS
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.fieldbus.described import doubts_by_name
from ocmm_core.tracking import ProbeBody
from ocmm_core.typed_numbers import BALL


@dataclass(frozen=True, slots=True, kw_only=True)
class QualificationSetup(TouchSetup):
    nominal_mm: float | None = None
    """Ball diameter; None: that of the document."""
    limits: qualification.TipLimits | None = None
    valid_days: int = VALID_DAYS


class TipQualificationProcedure(
    TouchProcedure[TipOutcome, qualification.TipBegun, QualificationSetup]
):
    """See `TouchProcedure`."""

    kind = guided.ProcedureKind.QUALIFICATION
    sessions = guided.SessionFormat(
        kind, guided.SessionLine[qualification.TouchEvent], qualification.TipBegun
    )

    @classmethod
    def _first_line(
        cls, site: guided.SessionSite, setup: QualificationSetup, now: datetime
    ) -> dict[str, object]:
        qualification.mounted_records(records.ProbeStore(site.records), setup.tip)
        limits, nominal = setup.limits or qualification.usual_limits(site.rig), setup.nominal_mm
        return cls._touch_line(site, setup, now, limits.nominal) | {
            "nominal_mm": 2.0 * site.body.tip_radius if nominal is None else BALL.check(nominal),
            "limits": limits, "valid_days": setup.valid_days,
        }  # fmt: skip

    @property
    def view(self) -> TipView:
        with self._lock:
            return self._snapshot(TipView, outcome=self._outcome)

    def _wanting(self, begun: qualification.TipBegun, rig: Rig, calibrated: ProbeBody) -> TouchPlan:
        frame = frame_about(POLE, rig)
        return TouchPlan(
            frame=frame,
            places=sphere_layout(QUALIFICATION_RINGS, frame),
            attitudes=cone_layout(frame),
            points=begun.limits.points,
            places_needed=begun.limits.places,
            sigma_of=lambda errors: sigma_with_sphere(
                errors, begun.sphere, begun.temperature, rig, calibrated
            ),
            diameter_sigma=begun.limits.diameter_sigma,
            artefact_limit=begun.limits.nominal,
        )

    def _diameter_unknown(self, sigma_mm: float, limit_mm: float) -> guided.Gate:
        next_words = self._state.next_words()
        return guided.Gate(
            False,
            f"U of the diameter (k = 2) is {2e3 * sigma_mm:.1f} um; {2e3 * limit_mm:.1f} um are "
            "required.",
            f"Go closer to the equator: touch the sphere {next_words}.",
        )

    def _cone_said(self) -> guided.Gate:
        return attitudes_gate(self._state)

    def _concluded(self) -> TipOutcome:
        for gate in (self._sphere_said(), self._cone_said()):
            if not gate.open:
                raise CalibrationError("tip.incomplete", gate.reason, gate.remedy)
        state, begun = self._state, self._begun
        ball = fit_ball_on(
            state.sphere_touches, begun.sphere, state.rig, state.body, begun.temperature
        )
        found = guided.articulate(state.cone_touches, state.rig, state.body)
        checks = qualification.qualification_checks(ball, found, begun.nominal_mm, begun.limits)
        made = datetime.fromisoformat(max(event.utc for event in state.taken))
        record = self._record(
            records.TipRecord, schema=records.TIP_SCHEMA,
            valid_until_utc=guided.utc_text(made + timedelta(days=begun.valid_days)),
            diameter_mm=ball.diameter, diameter_sigma_mm=ball.diameter_sigma,
            noise_sigma_mm=ball.errors.noise, by_cameras=tuple(ball.errors.by_cameras.tolist()),
            by_geometry=tuple(ball.errors.by_geometry.tolist()), form_mm=ball.form,
            points=len(state.on_sphere), point_sigma_mm=ball.point_sigma,
            articulation_2s_mm=found.spread_2s, articulation_max_mm=found.largest,
            attitudes=len(state.in_cone), checks=checks,
            passed=all(qualification.conforms(check) for check in checks),
            camera_doubts=doubts_by_name(state.rig.device) or msgspec.UNSET,
        )  # fmt: skip
        return TipOutcome(
            record=record,
            largest=qualification.nearest_to_limit(checks),
            warnings=(*qualification.doubtful_warning(ball), *self._warned()),
            previous=self._records.qualification,
            residuals_mm=ball.residuals,
            directions_world=ball.directions_world,
            cone_off_world=found.off_world,
        )

    def _put(self, outcome: TipOutcome, decided: guided.Decided) -> None:
        now = datetime.fromisoformat(decided.utc)
        self._store.qualify(outcome.record, now, self._log.path)


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
