"""Guided tip qualification: touch a calibrated sphere, rest the ball in a cone.

Steps: ``prepare``, ``sphere`` (25 points, ISO 10360-5 layout, and more while the diameter is too
uncertain), ``cone`` (five attitudes), ``result``.
"""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import msgspec

from ocmm_core.calibration import guided, records
from ocmm_core.calibration.probe_design import Temperature
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
from ocmm_core.calibration.tip._touch_session import POLE, TipSite, TouchProcedure
from ocmm_core.calibration.tip._views import TipOutcome, TipView
from ocmm_core.calibration.tip._wanted import VALID_DAYS
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.fieldbus.described import doubts_by_name
from ocmm_core.tracking import ProbeBody
from ocmm_core.typed_numbers import BALL


class TipQualificationProcedure(TouchProcedure[TipOutcome, qualification.TipBegun]):
    """See `TouchProcedure`; made by `start` and `resume`."""

    kind = guided.ProcedureKind.QUALIFICATION

    sessions = guided.SessionFormat(
        kind, guided.SessionLine[qualification.TouchEvent], qualification.TipBegun
    )

    @classmethod
    def start(
        cls,
        folder: Path,
        site: TipSite,
        tip: str,
        sphere: records.Sphere,
        now: datetime,
        *,
        who: str,
        temperature: Temperature | None = None,
        cone: records.ArtefactUse | None = None,
        nominal_mm: float | None = None,
        limits: qualification.TipLimits | None = None,
        valid_days: int = VALID_DAYS,
    ) -> TipQualificationProcedure:
        """Start a session.

        ``nominal_mm``: ball diameter, default that of the document. CalibrationError if the tip is
        not mounted or was never calibrated, or the sphere may not be used; StorageError if the
        session file cannot be written.
        """
        chosen = limits or qualification.usual_limits(site.rig)
        return cls._start(
            folder, site, qualification.mounted_records(site.store, tip), sphere, now,
            limit_mm=chosen.nominal, who=who, temperature=temperature, cone=cone,
            nominal_mm=2.0 * site.body.tip_radius if nominal_mm is None else BALL.check(nominal_mm),
            limits=chosen, valid_days=valid_days,
        )  # fmt: skip

    @property
    def view(self) -> TipView:
        with self._lock:
            return self._snapshot(TipView, outcome=self._outcome)

    def _wanting(self, rig: Rig, calibrated: ProbeBody) -> TouchPlan:
        begun, frame = self._begun, frame_about(POLE, rig)
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
        made = datetime.fromisoformat(self._made_utc)
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
