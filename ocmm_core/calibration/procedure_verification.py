"""Guided verification: the bar along seven lines, spheres, and a verdict on the calibration.

The ball of the probe is put into every nest of the bar; what is kept are the averaged spots, so
that lengths can be computed anew. Everything that was taken counts: a line may be taken back before
the verdict only where its placement was wrong, and repeated once where it failed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from ocmm_core import __version__
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.artefacts import LengthBar, Sphere
from ocmm_core.calibration.collecting import STILL_FRAMES, Average, ProbeSpots
from ocmm_core.calibration.guards import Finding, let_pass
from ocmm_core.calibration.history import CalibrationStore
from ocmm_core.calibration.outcome import VerificationOutcome
from ocmm_core.calibration.procedure import OPEN, Gate, Kind, Live, Step
from ocmm_core.calibration.procedure_views import LinePlan, VerificationView
from ocmm_core.calibration.session import CameraProcedure
from ocmm_core.calibration.session_events import (
    Decided,
    SessionLine,
    first_line,
    from_spots,
    session_path,
    to_spots,
    utc_text,
)
from ocmm_core.calibration.verification import (
    SPHERE_POINTS,
    Limits,
    judge_nest,
    plan_lines,
    worst,
)
from ocmm_core.calibration.verification_state import (
    LineRepeated,
    NestTaken,
    SphereTouched,
    VerificationBegun,
    VerificationEvent,
    VerificationState,
)
from ocmm_core.camera.rig import Rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float
from ocmm_core.tracking.body import ProbeBody
from ocmm_core.tracking.pose import solve

PREPARE, LINES, SPHERES, RESULT = "prepare", "lines", "spheres", "result"
_APART_MM = 5.0


class VerificationProcedure(CameraProcedure[VerificationEvent, VerificationOutcome]):
    """See `procedure`; made by `begin` and `resume`."""

    kind = Kind.VERIFICATION
    step_names = (PREPARE, LINES, SPHERES, RESULT)

    def __init__(
        self,
        chain: ChainFile[SessionLine[VerificationEvent]],
        begun: VerificationBegun,
        rig: Rig,
        body: ProbeBody,
        store: CalibrationStore,
    ) -> None:
        super().__init__(chain, begun, rig, store)
        if begun.probe_identity != body.identity:
            raise CalibrationError(
                "session.probe",
                f"{chain.path}: this session was begun with another probe.",
                "Continue it with that probe, or begin a new one.",
            )
        self._begun = begun
        plans = plan_lines(rig.volume_world, begun.bar.nests[-1] - begun.bar.nests[0])
        self._state = VerificationState(rig, body, begun, plans)
        self._probe = ProbeSpots(
            rig, body, STILL_FRAMES, resting=True, distance_mm=_APART_MM, inside=True
        )
        self._fold()

    @classmethod
    def begin(
        cls,
        folder: Path,
        rig: Rig,
        body: ProbeBody,
        store: CalibrationStore,
        bar: LengthBar,
        now: datetime,
        *,
        who: str,
        temperature_c: float | None = None,
        spheres: tuple[Sphere, ...] = (),
        limits: Limits | None = None,
    ) -> VerificationProcedure:
        """Begin a session.

        Parameters
        ----------
        folder
            Of session files.
        rig
            With the calibration in force.
        body
            The probe.
        store
            Calibrations of that rig.

        Raises
        ------
        CalibrationError
            The rig is not that of the calibration in force, an artefact may not be used, or the bar
            does not suit the volume.
        StorageError
            The session file cannot be written.
        """
        if rig.identity != store.active_hash:
            raise CalibrationError(
                "verification.other",
                f"Rig '{rig.name}' is not used with the calibration in force.",
                "Calibrate the cameras first; a rig document cannot be verified.",
            )
        chosen = limits or Limits()
        findings = [
            one
            for nest in bar.nests[1:]
            for one in bar.artefact.judge(
                nest - bar.nests[0], chosen.of_length(nest - bar.nests[0]), now, temperature_c
            )
        ]
        for sphere in spheres:
            findings += sphere.artefact.judge(
                sphere.diameter, chosen.diameter, now, temperature_c
            )
        let_pass(findings, force=False)
        begun = VerificationBegun(
            utc=utc_text(now),
            rig=rig.name,
            rig_identity=rig.identity,
            running=rig.identity,
            who=who,
            software=__version__,
            temperature_c=temperature_c,
            probe_identity=body.identity,
            bar=bar,
            spheres=spheres,
            limits=chosen,
        )
        plan_lines(rig.volume_world, bar.nests[-1] - bar.nests[0])
        chain = _chain(session_path(folder, cls.kind, now))
        chain.append(SessionLine(begun))
        return cls(chain, begun, rig, body, store)

    @classmethod
    def resume(
        cls, path: Path, rig: Rig, body: ProbeBody, store: CalibrationStore
    ) -> VerificationProcedure:
        """Continue the session of a file where it stopped.

        Raises
        ------
        StorageError
            The file is not as it was written.
        CalibrationError
            It is empty, or was begun with another calibration or probe.
        """
        chain = _chain(path)
        begun = first_line(chain)
        assert isinstance(begun, VerificationBegun)  # noqa: S101 - the only first line of this kind
        return cls(chain, begun, rig, body, store)

    @property
    def bar(self) -> LengthBar:
        """Return the bar that the session was begun with."""
        return self._begun.bar

    @property
    def spheres(self) -> tuple[Sphere, ...]:
        """Return the spheres that the session was begun with."""
        return self._begun.spheres

    @property
    def view(self) -> VerificationView:
        """Return the snapshot."""
        with self._lock:
            state, wanted = self._state, len(self._begun.bar.nests)
            lines = tuple(
                LinePlan(plan.name, plan.ends_world, len(state.line_tips(i)), wanted, state.hint(i))
                for i, plan in enumerate(state.plans)
            )
            touched = tuple(len(state.sphere_tips(i)) for i in range(len(self._begun.spheres)))
            return VerificationView(
                self.base, lines, state.current_line(), touched, SPHERE_POINTS, self._outcome
            )

    def watch(self, block: FrameBlock) -> None:
        """Look at frames."""
        with self._lock:
            self._probe.feed(block)

    def take_shot(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Take recorded averaged spots (C, L, 2), px, as the next observation.

        Raises
        ------
        CalibrationError
            Nothing is taken in this step, or all of it was.
        """
        with self._lock:
            if not self._wants():
                raise CalibrationError(
                    "verification.nothing_next",
                    "There is nothing left to be taken in this step.",
                    "Go on to the next step.",
                )
            self._append(self._event(Average(uv, sigma_px), utc_text(now)))

    def repeat_line(self, line: int, now: datetime) -> None:
        """Take a line anew: where it is placed wrongly, or once where it failed.

        Raises
        ------
        CalibrationError
            It neither failed nor is placed wrongly, or it was repeated before.
        """
        with self._lock:
            state = self._state
            wrong = bool(state.hint(line)) or state.is_begun(line)
            failed = not wrong and state.has_failed(line)
            if not wrong and (not failed or line in state.repeated):
                why = "was repeated before" if line in state.repeated else "did not fail"
                raise CalibrationError(
                    "verification.repeat",
                    f"Line '{state.plans[line].name}' may not be taken again: it {why}.",
                    "Accept the verdict, or begin a new verification.",
                )
            self._append(LineRepeated(utc=utc_text(now), line=line, failed=failed))

    def _seen(self) -> Live:
        live = self._probe.live()
        line = self._state.current_line() if self._step == LINES else None
        if not live.ready or line is None:
            return live
        average = self._probe.average()
        pose = solve(average.uv[None], self._state.rig, self._state.body, average.sigma_px)
        state = self._state
        hint = judge_nest(
            state.plans[line], pose.tip_world[0], state.line_tips(line), self._begun.bar
        )
        return replace(live, ready=False, hint=hint) if hint else live

    def _wants(self) -> bool:
        if self._step == LINES:
            return self._state.current_line() is not None
        return self._step == SPHERES and self._state.current_sphere() is not None

    def _observation(self, utc: str) -> VerificationEvent:
        return self._event(self._probe.average(), utc)

    def _event(self, average: Average, utc: str) -> NestTaken | SphereTouched:
        spots, sigma = to_spots(average.uv), average.sigma_px
        line, sphere = self._state.current_line(), self._state.current_sphere()
        if self._step == LINES and line is not None:
            nest = len(self._state.line_tips(line))
            return NestTaken(utc=utc, line=line, nest=nest, uv=spots, sigma_px=sigma)
        assert sphere is not None  # noqa: S101 - a point is wanted
        return SphereTouched(utc=utc, sphere=sphere, uv=spots, sigma_px=sigma)

    def _observe(self, event: VerificationEvent) -> None:
        if isinstance(event, LineRepeated):
            self._state.repeat(event)
        elif isinstance(event, NestTaken | SphereTouched):
            self._state.add(event)
            self._probe.taken(Average(from_spots(event.uv), event.sigma_px))

    def _has_observation(self, step: str) -> bool:
        if step == LINES:
            # A complete line counts; see `repeat_line`.
            return bool(self._state.nests) and self._state.is_begun(self._state.nests[-1].line)
        return step == SPHERES and bool(self._state.touched)

    def _undo(self, step: str) -> None:
        if step == LINES:
            self._state.remove_nest()
        else:
            self._state.remove_touch()

    def _instructions(self) -> tuple[str, str]:
        """Return what to do now on the lines, and on the spheres."""
        state, bar, spheres = self._state, self._begun.bar, self._begun.spheres
        on_lines = "All lines are taken."
        line = state.current_line()
        if line is not None:
            plan, nest = state.plans[line], len(state.line_tips(line))
            begin, end = ("({:.0f}, {:.0f}, {:.0f})".format(*one) for one in plan.ends_world)
            on_lines = (
                f"Line {line + 1} of {len(state.plans)}, {plan.name}: lay the bar from {begin} to "
                f"{end} and put the ball into nest {nest + 1} of {len(bar.nests)}."
            )
        on_spheres = "All spheres are touched." if spheres else "No sphere was chosen."
        sphere = state.current_sphere()
        if sphere is not None:
            on_spheres = (
                f"Touch sphere '{spheres[sphere].artefact.use.name}' all around, from the pole to "
                f"the equator."
            )
        return on_lines, on_spheres

    def _steps(self) -> tuple[Step, ...]:
        state, bar = self._state, self._begun.bar
        on_lines, on_spheres = self._instructions()
        return (
            Step(
                PREPARE,
                "Prepare",
                f"Take bar '{bar.artefact.use.name}' (serial {bar.artefact.use.serial}); it and "
                f"the cameras must have the temperature of the room.",
                OPEN,
            ),
            Step(
                LINES,
                "Lengths",
                on_lines,
                state.lines_gate(),
                len(state.nests),
                len(state.plans) * len(bar.nests),
            ),
            Step(
                SPHERES,
                "Spheres",
                on_spheres,
                state.spheres_gate(),
                len(state.touched),
                len(self._begun.spheres) * SPHERE_POINTS,
            ),
            Step(
                RESULT,
                "Verdict",
                "Look at the errors against their limits, and store the verdict.",
                Gate(False, "This is the last step.", "Store the verdict."),
            ),
        )

    def _calculation(self) -> Callable[[], VerificationOutcome]:
        # Quick: there is nothing to be calculated apart from the state.
        record, warnings = self._state.verdict(), self._reused()
        return lambda: VerificationOutcome(record, worst(record.checks), warnings)

    def _reused(self) -> tuple[Finding, ...]:
        """Return a warning where the bar also gave the scale of the calibration."""
        running = self._store.active()
        use = self._begun.bar.artefact.use
        if running is None or use.serial not in {one.serial for one in running.artefacts}:
            return ()
        return (
            Finding(
                "verification.same_artefact",
                f"The cameras were calibrated with the same '{use.name}' (serial {use.serial}): an "
                f"error of its certificate would not show.",
                "Verify with another bar now and then.",
                refuses=False,
            ),
        )

    def _put(self, outcome: VerificationOutcome, decided: Decided) -> None:
        now = datetime.fromisoformat(decided.utc)
        self._store.verify(outcome.record, now, self._chain.path)


def _chain(path: Path) -> ChainFile[SessionLine[VerificationEvent]]:
    return ChainFile(path, SessionLine[VerificationEvent])
