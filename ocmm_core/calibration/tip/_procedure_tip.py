"""Guided qualification of a tip: a calibrated sphere touched all around, and the ball in a cone.

Steps: ``prepare``, ``sphere`` (25 points, ISO 10360-5 layout, and more where the diameter is not
yet known well enough), ``cone`` (five attitudes), ``result``.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

from ocmm_core import __version__
from ocmm_core.calibration.guided import (
    Decided,
    Gate,
    Kind,
    SessionLine,
    articulate,
    first_line,
    session_path,
    utc_text,
)
from ocmm_core.calibration.records import (
    TIP_SCHEMA,
    ArtefactUse,
    CalibrationStore,
    ProbeStore,
    Sphere,
    TipRecord,
    TipRecords,
    probe_from_records,
    record_hash,
)
from ocmm_core.calibration.tip._errors import sigma_with_sphere
from ocmm_core.calibration.tip._events import TipBegun, TouchEvent
from ocmm_core.calibration.tip._fit import fit_ball_on
from ocmm_core.calibration.tip._qualification import (
    TipLimits,
    conforms,
    doubtful_warning,
    nearest_to_limit,
    qualification_checks,
)
from ocmm_core.calibration.tip._sphere_layout import (
    QUALIFICATION_RINGS,
    cone_layout,
    frame_about,
    sphere_layout,
)
from ocmm_core.calibration.tip._state import Wanted
from ocmm_core.calibration.tip._touch_hints import attitudes_gate, places_gate
from ocmm_core.calibration.tip._touch_session import (
    POLE,
    TouchProcedure,
    continued_records,
    judge_sphere,
    mounted_records,
    open_chain,
)
from ocmm_core.calibration.tip._views import TipOutcome, TipView
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody

VALID_DAYS = 30


class TipQualificationProcedure(TouchProcedure[TipOutcome]):
    """See `procedure`; made by `begin` and `resume`.

    Drive it like every procedure: `watch` frames; whenever ``view.base.live.ready`` is set, `take`;
    when the gate of the step is open, `advance`; in the last step `compute`, then `accept` (which
    stores the qualification, also one that failed) or `keep`. `drop` takes the last point back,
    `take_back` any.
    """

    kind = Kind.QUALIFICATION

    def __init__(
        self,
        chain: ChainFile[SessionLine[TouchEvent]],
        begun: TipBegun,
        rig: Rig,
        body: ProbeBody,
        store: ProbeStore,
        records: TipRecords,
        cameras: CalibrationStore | None,
        hold_s: float,
    ) -> None:
        self._begun = begun
        frame, limits = frame_about(POLE, rig), begun.limits
        calibrated = probe_from_records(body, records.calibration, None)
        wanted = Wanted(
            frame=frame,
            places=sphere_layout(QUALIFICATION_RINGS, frame),
            attitudes=cone_layout(frame),
            points=limits.points,
            places_needed=limits.places,
            sigma_of=lambda errors: sigma_with_sphere(
                errors, begun.sphere, begun.temperature_c, rig, calibrated
            ),
            diameter_sigma=limits.diameter_sigma,
            artefact_limit=limits.nominal,
        )
        super().__init__(chain, begun, rig, body, store, records, wanted, cameras, hold_s)

    @classmethod
    def begin(
        cls,
        folder: Path,
        rig: Rig,
        body: ProbeBody,
        store: ProbeStore,
        tip: str,
        sphere: Sphere,
        now: datetime,
        *,
        who: str,
        temperature_c: float | None = None,
        cone: ArtefactUse | None = None,
        nominal_mm: float | None = None,
        limits: TipLimits | None = None,
        valid_days: int = VALID_DAYS,
        cameras: CalibrationStore | None = None,
        hold_s: float = 0.0,
    ) -> TipQualificationProcedure:
        """Begin a session.

        Parameters
        ----------
        folder
            Of session files.
        rig
            With the calibration in force.
        body
            The probe by its document.
        store
            Records of this probe.
        tip
            Name of the tip that is mounted.
        sphere
            On which the ball is measured.
        cone
            Where it has a name.
        nominal_mm
            Diameter that the ball should have; None is that of the document.
        limits
            What it must show.
        valid_days
            For how long the qualification may be used.
        cameras
            Calibrations of the rig: a sphere that was used there is warned of.
        hold_s
            The ball must rest for so long after it is seen well, so that a hand has time to settle.

        Raises
        ------
        CalibrationError
            The tip is not mounted or was never calibrated, or the sphere may not be used.
        StorageError
            The session file cannot be written.
        """
        records, chosen = mounted_records(store, tip), limits or TipLimits()
        judge_sphere(sphere, chosen.nominal, now, temperature_c)
        begun = TipBegun(
            utc=utc_text(now),
            rig=rig.name,
            rig_identity=rig.identity,
            running=record_hash(records.calibration),
            who=who,
            software=__version__,
            temperature_c=temperature_c,
            tip=tip,
            probe_identity=body.identity,
            sphere=sphere,
            cone=cone,
            nominal_mm=2.0 * body.tip_radius if nominal_mm is None else nominal_mm,
            limits=chosen,
            valid_days=valid_days,
        )
        chain = open_chain(session_path(folder, cls.kind, now))
        chain.append(SessionLine(begun))
        return cls(chain, begun, rig, body, store, records, cameras, hold_s)

    @classmethod
    def resume(
        cls,
        path: Path,
        rig: Rig,
        body: ProbeBody,
        store: ProbeStore,
        *,
        cameras: CalibrationStore | None = None,
        hold_s: float = 0.0,
    ) -> TipQualificationProcedure:
        """Continue the session of a file where it stopped; the file names tip and sphere.

        Raises
        ------
        CalibrationError
            It is empty, or was begun with another rig, probe or calibration.
        StorageError
            The file is not as it was written.
        """
        chain = open_chain(path)
        begun = first_line(chain)
        assert isinstance(begun, TipBegun)  # noqa: S101 - the only first line of this kind
        records = continued_records(store, begun, path)
        return cls(chain, begun, rig, body, store, records, cameras, hold_s)

    @property
    def view(self) -> TipView:
        """Return the snapshot."""
        with self._lock:
            return self._snapshot(TipView, outcome=self._outcome)

    def _sphere_said(self) -> Gate:
        gate = places_gate(self._state)
        progress = self._state.sphere
        if not gate.open or progress.diameter_sigma_mm <= progress.diameter_sigma_limit_mm:
            return gate
        return Gate(
            False,
            f"The diameter is known to {1e3 * progress.diameter_sigma_mm:.1f} um only, and "
            f"{1e3 * progress.diameter_sigma_limit_mm:.1f} um are wanted.",
            f"Go closer to the equator: touch the sphere {self._state.next_words()}.",
        )

    def _cone_said(self) -> Gate:
        return attitudes_gate(self._state)

    def _calculation(self) -> Callable[[], TipOutcome]:
        # Quick: there is nothing to be calculated apart from the state.
        outcome = self._concluded()
        return lambda: outcome

    def _concluded(self) -> TipOutcome:
        for gate in (self._sphere_said(), self._cone_said()):
            if not gate.open:
                raise CalibrationError("tip.incomplete", gate.reason, gate.remedy)
        state, begun = self._state, self._begun
        ball = fit_ball_on(
            state.sphere_touches, begun.sphere, state.rig, state.body, begun.temperature_c
        )
        found = articulate(state.cone_touches, state.rig, state.body)
        checks = qualification_checks(ball, found, begun.nominal_mm, begun.limits)
        made = datetime.fromisoformat(self._made_utc)
        record = self._record(
            TipRecord,
            schema=TIP_SCHEMA,
            valid_until_utc=utc_text(made + timedelta(days=begun.valid_days)),
            diameter_mm=ball.diameter,
            diameter_sigma_mm=ball.diameter_sigma,
            noise_sigma_mm=ball.errors.noise,
            by_cameras=tuple(ball.errors.by_cameras.tolist()),
            by_geometry=tuple(ball.errors.by_geometry.tolist()),
            form_mm=ball.form,
            points=len(state.on_sphere),
            point_sigma_mm=ball.point_sigma,
            articulation_2s_mm=found.spread_2s,
            articulation_max_mm=found.largest,
            attitudes=len(state.in_cone),
            checks=checks,
            passed=all(conforms(check) for check in checks),
        )
        return TipOutcome(
            record=record,
            largest=nearest_to_limit(checks),
            warnings=(*doubtful_warning(ball), *self._warned()),
            previous=self._records.qualification,
            residuals_mm=ball.residuals,
            directions_world=ball.directions_world,
            cone_off_world=found.off_world,
        )

    def _put(self, outcome: TipOutcome, decided: Decided) -> None:
        now = datetime.fromisoformat(decided.utc)
        self._store.qualify(outcome.record, now, self._chain.path)
