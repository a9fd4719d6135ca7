"""Guided quick check of a tip, one minute: whether it is still the one that was qualified.

Steps: ``prepare``, ``sphere`` (13 points), ``cone`` (five attitudes), ``result``. A check that
cannot tell asks for more points; it never passes because of too large an uncertainty.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from ocmm_core import __version__
from ocmm_core.calibration.guided import (
    OPEN,
    Decided,
    Gate,
    Kind,
    SessionLine,
    first_line,
    session_path,
    utc_text,
)
from ocmm_core.calibration.records import (
    CHECK_SCHEMA,
    ArtefactUse,
    CalibrationStore,
    ProbeStore,
    Sphere,
    TipCheckRecord,
    TipRecord,
    TipRecords,
    probe_from_records,
    record_hash,
)
from ocmm_core.calibration.tip._check import (
    CHANCE,
    DIAMETER_DEFECT_MM,
    DIAMETER_SIGMA_MM,
    TipCheckDecision,
    decide_check,
    never_conclusive,
)
from ocmm_core.calibration.tip._errors import sigma_of_difference
from ocmm_core.calibration.tip._events import TipCheckBegun, TouchEvent
from ocmm_core.calibration.tip._qualification import doubtful_warning, nearest_to_limit
from ocmm_core.calibration.tip._sphere_layout import (
    CHECK_RINGS,
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
from ocmm_core.calibration.tip._views import CheckVerdict, TipCheckOutcome, TipCheckView
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError
from ocmm_core.tracking import ProbeBody

_ARTEFACT_LIMIT_MM = 0.5 * DIAMETER_DEFECT_MM


class TipCheckProcedure(TouchProcedure[TipCheckOutcome]):
    """See `procedure`; made by `begin` and `resume`.

    Drive it like every procedure: `watch` frames; whenever ``view.base.live.ready`` is set, `take`;
    when the gate of the step is open, `advance`; in the last step `compute`, then `accept` (which
    stores the check, also one that failed) or `keep`. `drop` takes the last point back, `take_back`
    any.
    """

    kind = Kind.TIP_CHECK

    def __init__(
        self,
        chain: ChainFile[SessionLine[TouchEvent]],
        begun: TipCheckBegun,
        rig: Rig,
        body: ProbeBody,
        store: ProbeStore,
        records: TipRecords,
        cameras: CalibrationStore | None,
        hold_s: float,
    ) -> None:
        self._begun = begun
        self._qualification = _qualified(records, begun.qualification)
        frame = frame_about(POLE, rig)
        calibrated = probe_from_records(body, records.calibration, None)
        places = sphere_layout(CHECK_RINGS, frame)
        wanted = Wanted(
            frame=frame,
            places=places,
            attitudes=cone_layout(frame),
            points=len(places.names),
            places_needed=len(places.names) - 2,
            sigma_of=lambda errors: sigma_of_difference(
                errors, begun.sphere, begun.temperature_c, self._qualification, rig, calibrated
            ),
            diameter_sigma=DIAMETER_SIGMA_MM,
            artefact_limit=_ARTEFACT_LIMIT_MM,
            chance=CHANCE,
        )
        self._decision: tuple[int, TipCheckDecision] | None = None
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
        cameras: CalibrationStore | None = None,
        hold_s: float = 0.0,
    ) -> TipCheckProcedure:
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
        cameras
            Calibrations of the rig: a sphere that was used there is warned of.
        hold_s
            The ball must rest for so long after it is seen well, so that a hand has time to settle.

        Raises
        ------
        CalibrationError
            The tip is not mounted or was never qualified, or the sphere may not be used.
        StorageError
            The session file cannot be written.
        """
        records = mounted_records(store, tip)
        qualification = _qualified(records, None)
        judge_sphere(sphere, _ARTEFACT_LIMIT_MM, now, temperature_c)
        begun = TipCheckBegun(
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
            nominal_mm=qualification.diameter_mm,
            qualification=record_hash(qualification),
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
    ) -> TipCheckProcedure:
        """Continue the session of a file where it stopped; the file names tip and sphere.

        Raises
        ------
        CalibrationError
            It is empty, or was begun with another rig, probe, calibration or qualification.
        StorageError
            The file is not as it was written.
        """
        chain = open_chain(path)
        begun = first_line(chain)
        assert isinstance(begun, TipCheckBegun)  # noqa: S101 - the only first line of this kind
        records = continued_records(store, begun, path)
        return cls(chain, begun, rig, body, store, records, cameras, hold_s)

    @property
    def view(self) -> TipCheckView:
        """Return the snapshot."""
        with self._lock:
            decision = self._decide_now()
            return self._snapshot(
                TipCheckView,
                so_far=decision.verdict,
                advice=decision.advice,
                outcome=self._outcome,
            )

    def _decide_now(self) -> TipCheckDecision:
        if self._decision is None or self._decision[0] != self._version:
            state, begun = self._state, self._begun
            decision = decide_check(
                state.sphere_touches, state.cone_touches, begun.sphere, self._qualification,
                state.rig, state.body, begun.temperature_c,
            )  # fmt: skip
            self._decision = (self._version, decision)
        return self._decision[1]

    def _sphere_said(self) -> Gate:
        gate = places_gate(self._state)
        progress = self._state.sphere
        if not gate.open or progress.diameter_sigma_mm <= progress.diameter_sigma_limit_mm:
            return gate
        reason = (
            "Inconclusive: the diameter can be compared to "
            f"{1e3 * progress.diameter_sigma_mm:.1f} um only, and "
            f"{1e3 * progress.diameter_sigma_limit_mm:.1f} um are needed."
        )
        if never_conclusive(self._qualification):
            return Gate(
                False,
                "The qualification knows the diameter too badly: no check can compare with it.",
                "Qualify the tip again.",
            )
        return Gate(False, reason, f"More points: touch the sphere {self._state.next_words()}.")

    def _cone_said(self) -> Gate:
        gate = attitudes_gate(self._state)
        decision = self._decide_now()
        if gate.open and decision.verdict is CheckVerdict.INCONCLUSIVE:
            return Gate(False, "The check is inconclusive.", decision.advice)
        return OPEN if gate.open else gate

    def _calculation(self) -> Callable[[], TipCheckOutcome]:
        # Quick: there is nothing to be calculated apart from the state.
        outcome = self._concluded()
        return lambda: outcome

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
        )

    def _check(self, outcome: TipCheckOutcome) -> None:
        super()._check(outcome)
        active = self._store.active(self.tip)
        if active is None or (
            active.qualification is None
            or record_hash(active.qualification) != self._begun.qualification
        ):
            raise _requalified()

    def _put(self, outcome: TipCheckOutcome, decided: Decided) -> None:
        now = datetime.fromisoformat(decided.utc)
        self._store.check(outcome.record, now, self._chain.path)


def _qualified(records: TipRecords, digest: str | None) -> TipRecord:
    """Return the qualification in force, which must have a hash where one is given.

    Raises
    ------
    CalibrationError
        There is none, or it is another one.
    """
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
        "The tip was qualified anew since this session was begun.",
        "Begin a new session.",
    )
