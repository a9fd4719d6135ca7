"""What tip qualification and quick tip check have in common as guided procedures.

Steps ``prepare``, ``sphere``, ``cone``, ``result``. Nothing that was taken is left out by the
program: whoever doubts a point takes it back, and the session file says so.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import (
    OPEN,
    STILL_FRAMES,
    Average,
    BlowSense,
    Gate,
    Live,
    O,
    ProbeProcedure,
    ProbeSpots,
    SessionLine,
    Step,
    from_spots,
    hash_of,
    note_blow,
    require_no_doubt_since,
    to_spots,
    touch_of,
    utc_text,
)
from ocmm_core.calibration.records import (
    CalibrationStore,
    Finding,
    MadeRecord,
    ProbeStore,
    Sphere,
    TipRecords,
    let_pass,
    probe_from_records,
)
from ocmm_core.calibration.tip._events import (
    BallInCone,
    BallOnSphere,
    TakenBack,
    TipBegun,
    TipCheckBegun,
    TouchEvent,
)
from ocmm_core.calibration.tip._qualification import sphere_warnings
from ocmm_core.calibration.tip._state import TouchState, Wanted
from ocmm_core.calibration.tip._touch_hints import judge_in_cone, judge_on_sphere
from ocmm_core.calibration.tip._views import (
    Countdown,
    Phase,
    TipCheckOutcome,
    TipOutcome,
    TouchView,
)
from ocmm_core.camera import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, TrackingError
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

PREPARE, SPHERE, CONE, RESULT = "prepare", "sphere", "cone", "result"
POLE = np.array([0.0, 0.0, 1.0])
"""Of the sphere: its stem is below."""

_APART_MM, _APART_RAD = 2.0, np.radians(8.0)

V = TypeVar("V", bound=TouchView)
R = TypeVar("R", bound=MadeRecord)


class TouchProcedure(ProbeProcedure[TouchEvent, O]):
    """See the module; made by ``begin`` and ``resume`` of the two procedures.

    Parameters
    ----------
    records
        In force for the tip.
    wanted
        Layouts and limits.
    cameras
        Calibrations of the rig; None where nobody says.
    hold_s
        The ball must rest for so long after it could be taken.
    """

    step_names = (PREPARE, SPHERE, CONE, RESULT)

    def __init__(
        self,
        chain: ChainFile[SessionLine[TouchEvent]],
        begun: TipBegun | TipCheckBegun,
        rig: Rig,
        body: ProbeBody,
        store: ProbeStore,
        records: TipRecords,
        wanted: Wanted,
        cameras: CalibrationStore | None,
        hold_s: float,
    ) -> None:
        super().__init__(chain, begun, rig, store, begun.tip)
        if begun.probe_identity != body.identity:
            raise CalibrationError(
                "session.probe",
                f"{chain.path}: this session was begun with another probe.",
                "Continue it with that probe, or begin a new one.",
            )
        self._touching, self._records, self._wanted = begun, records, wanted
        self._cameras, self._hold_s = cameras, hold_s
        calibrated = probe_from_records(body, records.calibration, None)
        self._state = TouchState(rig, calibrated, begun, wanted)
        self._probe = ProbeSpots(
            rig, calibrated, STILL_FRAMES, resting=True, distance_mm=_APART_MM,
            turn_rad=_APART_RAD, inside=True,
        )  # fmt: skip
        self._blows = BlowSense()
        self._watched, self._now_ns = 0, 0
        self._ready_ns: int | None = None
        self._sight: tuple[tuple[int, int, str], Live] | None = None
        self._fold()

    @property
    def sphere(self) -> Sphere:
        """Return the sphere that the session was begun with."""
        return self._touching.sphere

    def watch(self, block: FrameBlock) -> None:
        """Look at frames."""
        with self._lock:
            self._probe.feed(block)
            if not len(block):
                return
            if len(self._blows.feed(block)):
                note_blow(self._store, datetime.now(UTC))
            self._watched += len(block)
            self._now_ns = int(block.time_ns[-1])
            if not self._hold_s:
                return
            if not self._judged().ready:
                self._ready_ns = None
            elif self._ready_ns is None:
                self._ready_ns = self._now_ns

    def take_shot(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Take recorded averaged spots (C, L, 2), px, as the next observation.

        Raises
        ------
        CalibrationError
            Nothing is taken in this step.
        TrackingError
            The spots determine no pose.
        """
        with self._lock:
            if not self._wants():
                raise CalibrationError(
                    "tip.nothing_next",
                    "There is nothing to be taken in this step.",
                    "Go on to the next step.",
                )
            # What cannot be computed must not come into the file.
            touch_of(uv, sigma_px, self._state.rig, self._state.body)
            self._append(self._event(Average(uv, sigma_px), utc_text(now)))

    def take_back(self, point: int, now: datetime) -> None:
        """Take back one observation of the current step by its index in the snapshot.

        Raises
        ------
        CalibrationError
            There is none with that index.
        """
        with self._lock:
            if not 0 <= point < self._count(self._step):
                raise CalibrationError(
                    "tip.no_point",
                    f"There is no point {point + 1} in this step.",
                    "Choose one of those that were taken.",
                )
            self._append(TakenBack(utc=utc_text(now), step=self._step, point=point))

    @abstractmethod
    def _sphere_said(self) -> Gate:
        """Return whether the sphere was touched enough."""

    @abstractmethod
    def _cone_said(self) -> Gate:
        """Return whether the probe was held in enough attitudes."""

    def _snapshot(self, kind: Callable[..., V], **own: object) -> V:
        """Return the snapshot of a kind: `TouchView` and what only it has."""
        state, begun = self._state, self._touching
        certified, expanded = begun.sphere.artefact.at(begun.sphere.diameter, begun.temperature_c)
        return kind(
            base=self.base,
            probe=state.body.name,
            tip=begun.tip,
            sphere_name=begun.sphere.artefact.use.name,
            sphere_diameter_mm=certified,
            sphere_expanded_mm=expanded,
            nominal_mm=begun.nominal_mm,
            sphere=state.sphere,
            cone=state.cone,
            countdown=self._countdown(),
            **own,
        )

    def _check(self, outcome: O) -> None:
        # Another process may have put something else in force.
        self._store.refresh()
        super()._check(outcome)
        passed = isinstance(outcome, TipOutcome | TipCheckOutcome) and outcome.record.passed
        if passed and not self._is_stored():
            require_no_doubt_since(self._store, self.tip, datetime.fromisoformat(self._first.utc))

    def _warned(self) -> tuple[Finding, ...]:
        """Return what makes the result weaker: the sphere, and how well it is known."""
        begun = self._touching
        known = begun.sphere.artefact.judge(
            begun.sphere.diameter,
            self._wanted.artefact_limit,
            datetime.fromisoformat(begun.utc),
            begun.temperature_c,
        )
        if self._cameras is None:
            return let_pass(known, force=False)
        used = sphere_warnings(begun.sphere, self._cameras.active(), self._cameras.verifications())
        return (*let_pass(known, force=False), *used)

    @property
    def _made_utc(self) -> str:
        """Return when the last observation was taken."""
        return max(event.utc for event in self._state.taken)

    def _record(self, kind: Callable[..., R], **own: object) -> R:
        """Return a record of what was taken, with what only its kind has."""
        taken = self._state.taken
        cone = self._touching.cone
        return kind(
            probe=self._records.calibration.probe,
            tip=self.tip,
            made_utc=self._made_utc,
            made_by=self._first.who,
            software=self._first.software,
            temperature_c=self._first.temperature_c,
            rig=self.rig.name,
            rig_identity=self.rig.identity,
            data_sha256=hash_of(np.array([from_spots(event.uv) for event in taken])),
            calibration=self._first.running,
            artefacts=(self.sphere.artefact.use, *((cone,) if cone is not None else ())),
            **own,
        )

    # What is seen now.

    def _seen(self) -> Live:
        live = self._judged()
        left = self._left_s(live)
        if left > 0.0:
            return replace(live, ready=False, hint=f"Hold still: {left:.1f} s.")
        return live

    def _judged(self) -> Live:
        """Return what is seen, judged against what is wanted, without the time it must rest."""
        key = (self._watched, self._version, self._step)
        if self._sight is None or self._sight[0] != key:
            live = self._probe.live()
            hint = self._misplaced() if live.ready and self._wants() else ""
            self._sight = (key, replace(live, ready=False, hint=hint) if hint else live)
        return self._sight[1]

    def _left_s(self, live: Live) -> float:
        if not live.ready or not self._hold_s:
            return 0.0
        since = self._now_ns if self._ready_ns is None else self._ready_ns
        return max(0.0, self._hold_s - 1e-9 * (self._now_ns - since))

    def _countdown(self) -> Countdown:
        live = self._judged()
        if live.ready and self._wants():
            left = self._left_s(live)
            share = 1.0 - left / self._hold_s if self._hold_s else 1.0
            return Countdown(Phase.RESTING if left else Phase.READY, left, share)
        if live.hint.startswith("Hold still") and live.wanted:
            left = (live.wanted - live.frames) / self.rig.frame_rate_hz + self._hold_s
            return Countdown(Phase.RESTING, left, live.frames / live.wanted)
        taken = live.hint.startswith("This place was taken")
        return Countdown(Phase.TAKEN if taken else Phase.SEARCHING, 0.0, 0.0)

    def _misplaced(self) -> str:
        """Return why what rests now is not what is wanted; empty where it is."""
        average = self._probe.average()
        try:
            touch = touch_of(average.uv, average.sigma_px, self._state.rig, self._state.body)
        except TrackingError as error:
            return error.remedy
        judge = judge_on_sphere if self._step == SPHERE else judge_in_cone
        return judge(self._state, touch)

    # What `GuidedProcedure` asks for.

    def _wants(self) -> bool:
        return self._step in (SPHERE, CONE)

    def _observation(self, utc: str) -> TouchEvent:
        return self._event(self._probe.average(), utc)

    def _event(self, average: Average, utc: str) -> BallOnSphere | BallInCone:
        kind = BallOnSphere if self._step == SPHERE else BallInCone
        return kind(utc=utc, uv=to_spots(average.uv), sigma_px=average.sigma_px)

    def _observe(self, event: TouchEvent) -> None:
        if isinstance(event, TakenBack):
            self._state.remove(event.step, event.point)
        elif isinstance(event, BallOnSphere | BallInCone):
            self._state.add(event)
            self._probe.taken(Average(from_spots(event.uv), event.sigma_px))
            self._ready_ns = None

    def _count(self, step: str) -> int:
        held = {SPHERE: len(self._state.on_sphere), CONE: len(self._state.in_cone)}
        return held.get(step, 0)

    def _has_observation(self, step: str) -> bool:
        return self._count(step) > 0

    def _undo(self, step: str) -> None:
        self._state.remove(step, -1)

    def _steps(self) -> tuple[Step, ...]:
        state, wanted = self._state, self._wanted
        use, words = self.sphere.artefact.use, self._state.next_words()
        attitude = state.cone.next_attitude
        hold = "more" if attitude is None else state.cone.attitudes[attitude].name
        return (
            Step(
                PREPARE,
                "Prepare",
                f"Clamp sphere '{use.name}' (serial {use.serial}) and a cone where the cameras see "
                f"them well; clean sphere, cone and ball. Tip '{self.tip}' must be on the probe.",
                OPEN,
            ),
            Step(
                SPHERE,
                "Sphere",
                f"Touch the sphere {words}." if words else "The sphere was touched enough.",
                self._sphere_said(),
                len(state.on_sphere),
                wanted.points,
            ),
            Step(
                CONE,
                "Cone",
                f"Put the ball into the cone and hold the probe {hold}."
                if not self._cone_said().open
                else "The probe was held in enough attitudes.",
                self._cone_said(),
                len(state.in_cone),
                len(wanted.attitudes.names),
            ),
            Step(
                RESULT,
                "Result",
                "Look at the result, and store it.",
                Gate(False, "This is the last step.", "Store the result."),
            ),
        )


def mounted_records(store: ProbeStore, tip: str) -> TipRecords:
    """Return what is in force for the tip that is on the probe.

    Raises
    ------
    CalibrationError
        It was never calibrated, or another one is mounted.
    """
    store.refresh()
    records = store.active(tip)
    if records is None:
        raise CalibrationError(
            "probe_record.none",
            f"The probe was never calibrated with tip '{tip}'.",
            "Calibrate the probe with this tip.",
        )
    if store.mounted != tip:
        raise CalibrationError(
            "tip.not_mounted",
            f"Tip '{store.mounted}' is said to be on the probe, not '{tip}'.",
            "Say which tip is mounted.",
        )
    return records


def judge_sphere(
    sphere: Sphere, limit_mm: float, now: datetime, temperature_c: float | None
) -> None:
    """Refuse a sphere whose certificate does not hold now or is not good enough for a limit."""
    let_pass(sphere.artefact.judge(sphere.diameter, limit_mm, now, temperature_c), force=False)


def continued_records(store: ProbeStore, begun: TipBegun | TipCheckBegun, path: Path) -> TipRecords:
    """Return the records that a session was begun with.

    Raises
    ------
    CalibrationError
        Another calibration is in force now.
    """
    records = store.active(begun.tip)
    if records is None or store.active_hash(begun.tip) != begun.running:
        raise CalibrationError(
            "session.calibration",
            f"{path}: this session was begun with another calibration of the probe than is in "
            f"force now.",
            "Begin a new session.",
        )
    return records


def open_chain(path: Path) -> ChainFile[SessionLine[TouchEvent]]:
    """Return the session file."""
    return ChainFile(path, SessionLine[TouchEvent])
