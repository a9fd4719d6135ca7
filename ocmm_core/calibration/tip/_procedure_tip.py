"""Guided tip qualification: touch a calibrated sphere, rest the ball in a cone.

Steps: ``prepare``, ``sphere`` (25 points, ISO 10360-5 layout, and more while the diameter is too
uncertain), ``cone`` (five attitudes), ``result``.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

import msgspec

from ocmm_core.calibration import guided, records
from ocmm_core.calibration.tip import _qualification as qualification
from ocmm_core.calibration.tip._fit import fit_ball_on, sigma_with_sphere
from ocmm_core.calibration.tip._sphere_layout import (
    QUALIFICATION_RINGS,
    cone_layout,
    frame_about,
    sphere_layout,
)
from ocmm_core.calibration.tip._state import TouchPlan
from ocmm_core.calibration.tip._steps import attitudes_gate
from ocmm_core.calibration.tip._touch_session import POLE, TouchProcedure, TouchSetup
from ocmm_core.calibration.tip._views import TipOutcome, TipView
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
