"""Guided verification: seats, bar lines, spheres, seats again, verdict.

The ball is put into every nest of the bar; averaged spots are kept. All observations count: before
the verdict, a line may be removed only if misplaced, and one in total may be repeated once if it
failed. Two seats fixed to the table are visited first and last to detect motion in between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import guided
from ocmm_core.calibration.records import CalibrationStore, LengthBar, Sphere, let_pass
from ocmm_core.calibration.verification import _verification as judging
from ocmm_core.calibration.verification._limits import Limits
from ocmm_core.calibration.verification._line_planning import CORNER_NAMES, plan_lines
from ocmm_core.calibration.verification._state import (
    PLACES,
    CornerExcused,
    LineRepeated,
    NestTaken,
    Resting,
    SphereTouched,
    Taken,
    VerificationBegun,
    VerificationEvent,
    VerificationState,
)
from ocmm_core.calibration.verification._verdict import judge_artefacts, verdict
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float
from ocmm_core.tracking import solve

PREPARE, SEATS_FIRST, LINES, SPHERES = "prepare", "seats", "lines", "spheres"
SEATS_AGAIN, RESULT = "again", "result"
_APART_MM = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class VerificationSetup(guided.SessionSetup):
    bar: LengthBar
    spheres: tuple[Sphere, ...] = ()
    two_places: bool = False
    """Touch every sphere in the near and the far third of the volume."""
    limits: Limits | None = None


class VerificationProcedure(
    guided.CameraProcedure[
        VerificationEvent, guided.VerificationOutcome, VerificationBegun, VerificationSetup
    ]
):
    """See `procedure`."""

    kind = guided.ProcedureKind.VERIFICATION
    for_trackers = True
    sessions = guided.SessionFormat(kind, guided.SessionLine[VerificationEvent], VerificationBegun)
    step_names = (PREPARE, SEATS_FIRST, LINES, SPHERES, SEATS_AGAIN, RESULT)

    def __init__(
        self,
        site: guided.SessionSite,
        chain: ChainFile[guided.SessionLine[VerificationEvent]],
        begun: VerificationBegun,
    ) -> None:
        super().__init__(site, chain, begun)
        rig, body = site.rig, site.body
        guided.require_probe(chain.path, begun.probe_identity, body)
        planning = plan_lines(rig.volume_world, begun.bar.nests[-1] - begun.bar.nests[0])
        self._state = VerificationState(rig, body, begun, planning)
        self._probe = guided.ProbeSpotAverager(
            rig, body, guided.STILL_FRAMES, resting=True, distance_mm=_APART_MM, inside=True
        )
        self._fold()

    @classmethod
    def _first_line(
        cls, site: guided.SessionSite, setup: VerificationSetup, now: datetime
    ) -> dict[str, object]:
        rig, bar, store = site.rig, setup.bar, CalibrationStore(site.records)
        if rig.identity != store.active_hash:
            raise CalibrationError(
                "verification.other",
                f"Rig '{rig.name}' does not use the active calibration.",
                "Calibrate the cameras first; a rig document cannot be verified."
                if rig.markers is None
                else "Calibrate the tracker, then close the job and open it: only then its markers "
                "are read by the new calibration.",
            )
        own = setup.limits
        chosen = judging.limits_of(rig, site.body) if own in (None, Limits()) else own
        findings = judge_artefacts(
            bar, setup.spheres, chosen, now, setup.temperature, store.active()
        )
        let_pass(findings, force=False)
        # Refuse an unsuitable bar before there is a session.
        plan_lines(rig.volume_world, bar.nests[-1] - bar.nests[0])
        places = PLACES if setup.two_places else ("",)
        return {
            "probe_identity": site.body.identity, "bar": bar,
            "spheres": tuple(one for one in setup.spheres for _ in places),
            "places": tuple(place for _ in setup.spheres for place in places), "limits": chosen,
        }  # fmt: skip

    @property
    def bar(self) -> LengthBar:
        return self._begun.bar

    @property
    def spheres(self) -> tuple[Sphere, ...]:
        return self._begun.spheres

    @property
    def view(self) -> guided.VerificationView:
        with self._lock:
            state, wanted = self._state, len(self._begun.bar.nests)
            places = np.array(self._begun.bar.nests)
            shares = tuple(((places - places[0]) / (places[-1] - places[0])).tolist())
            lines = tuple(
                guided.LinePlan(
                    name=plan.name,
                    ends_world=plan.ends_world,
                    taken=len(state.line_tips(i)),
                    wanted=wanted,
                    hint=state.hint(i),
                    shares=shares,
                )
                for i, plan in enumerate(state.plans)
            )
            touched = tuple(len(state.sphere_tips(i)) for i in range(len(self._begun.spheres)))
            visits = [state.visits(seat) for seat in range(guided.SEATS)]
            return guided.VerificationView(
                base=self.base, lines=lines, current_line=state.current_line(), spheres=touched,
                sphere_points=judging.SPHERE_POINTS, outcome=self._outcome,
                places=self._begun.places,
                seats_world=tuple(state.taken[one[0]].tip for one in visits if one),
                next_seat=(
                    state.unvisited_seat() if self._step == SEATS_FIRST else state.seat_to_repeat()
                ),
                corners=state.corners(), notes=state.planning.notes,
            )  # fmt: skip

    def watch(self, block: FrameBlock) -> None:
        with self._lock:
            self._probe.push(block)

    def take_shot(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Add spots (C, L, 2), px, as the next observation; CalibrationError if none is due."""
        with self._lock:
            if not self._wants():
                raise CalibrationError(
                    "verification.nothing_next",
                    "Nothing left to take in this step.",
                    "Go to the next step.",
                )
            self._append(self._event(guided.Average(uv, sigma_px), guided.utc_text(now)))

    def repeat_line(self, line: int, now: datetime) -> None:
        """Repeat a line that is misplaced, or once if it failed; else CalibrationError."""
        with self._lock:
            state = self._state
            wrong = bool(state.hint(line)) or state.is_begun(line)
            failed = not wrong and state.has_failed(line)
            others = [i for i in range(len(state.plans)) if i != line and state.has_failed(i)]
            if not wrong and (not failed or state.repeated or others):
                why = "it did not fail"
                if failed and others:
                    why = f"only one line may be repeated, and {len(others) + 1} failed"
                if failed and state.repeated:
                    before = state.plans[state.repeated[0]].name
                    why = f"only one line may be repeated, and '{before}' already was"
                raise CalibrationError(
                    "verification.repeat",
                    f"Line '{state.plans[line].name}' cannot be repeated: {why}.",
                    "Accept the verdict, or start a new verification.",
                )
            self._append(LineRepeated(utc=guided.utc_text(now), line=line, failed=failed))

    def excuse_corner(self, corner: str, reason: str, now: datetime) -> None:
        """Set the reason why no test length can end in a corner; an empty one removes it.

        CalibrationError if the corner is none of `CORNER_NAMES`, ignoring case and blanks.
        """
        name = next((one for one in CORNER_NAMES if _bare(one) == _bare(corner)), None)
        if name is None:
            raise CalibrationError(
                "verification.corner",
                f"'{corner}' is not a corner of the volume.",
                f"Write it like '{CORNER_NAMES[0]}'.",
            )
        with self._lock:
            self._append(
                CornerExcused(utc=guided.utc_text(now), corner=name, reason=reason.strip())
            )

    def _seen(self) -> guided.Live:
        live = self._probe.live()
        if not live.ready or not self._wants() or self._step == SPHERES:
            return live
        average, state = self._probe.average(), self._state
        pose = solve(average.uv[None], state.rig, state.body, average.sigma_px)
        tip, line = pose.tip_world[0], state.current_line()
        if self._step == LINES and line is not None:
            hint = judging.judge_nest(
                state.plans[line], tip, state.line_tips(line), self._begun.bar
            )
        else:
            hint = state.judge_seat(tip, again=self._step == SEATS_AGAIN)
        return replace(live, ready=False, hint=hint) if hint else live

    def _wants(self) -> bool:
        state = self._state
        wanted = {
            SEATS_FIRST: state.unvisited_seat,
            LINES: state.current_line,
            SPHERES: state.current_sphere,
            SEATS_AGAIN: state.seat_to_repeat,
        }
        return self._step in wanted and wanted[self._step]() is not None

    def _observation(self, utc: str) -> VerificationEvent:
        return self._event(self._probe.average(), utc)

    def _event(self, average: guided.Average, utc: str) -> Resting:
        state, spots, sigma = self._state, guided.to_spots(average.uv), average.sigma_px
        line, sphere = state.current_line(), state.current_sphere()
        if self._step == LINES and line is not None:
            nest = len(state.line_tips(line))
            return NestTaken(utc=utc, line=line, nest=nest, uv=spots, sigma_px=sigma)
        if self._step == SPHERES and sphere is not None:
            return SphereTouched(utc=utc, sphere=sphere, uv=spots, sigma_px=sigma)
        first = self._step == SEATS_FIRST
        seat = state.unvisited_seat() if first else state.seat_to_repeat()
        assert seat is not None  # noqa: S101 - a visit is wanted
        return guided.SeatVisited(utc=utc, seat=seat, uv=spots, sigma_px=sigma)

    def _observe(self, event: VerificationEvent) -> None:
        if isinstance(event, LineRepeated):
            self._state.repeat(event)
        elif isinstance(event, CornerExcused):
            self._state.excuse(event)
        elif isinstance(event, NestTaken | SphereTouched | guided.SeatVisited):
            self._state.add(event)
            self._probe.taken(guided.Average(guided.from_spots(event.uv), event.sigma_px))

    def _has_observation(self, step: str) -> bool:
        return self._last_of(step) is not None

    def _undo(self, step: str) -> None:
        last = self._last_of(step)
        if last is not None:
            self._state.remove(last)

    def _last_of(self, step: str) -> Taken | None:
        state = self._state
        if step == LINES:
            # A complete line counts; see `repeat_line`.
            nest = state.last(NestTaken)
            begun = (
                nest is not None
                and isinstance(nest.event, NestTaken)
                and state.is_begun(nest.event.line)
            )
            return nest if begun else None
        if step == SPHERES:
            return state.last(SphereTouched)
        if step == SEATS_FIRST and all(
            isinstance(one.event, guided.SeatVisited) for one in state.taken
        ):
            # Later observations depend on it; a visit at the end is a result.
            return state.last(guided.SeatVisited)
        return None

    def _instructions(self) -> tuple[str, str]:
        state, bar, spheres = self._state, self._begun.bar, self._begun.spheres
        on_lines = "All lines taken."
        line = state.current_line()
        if line is not None:
            plan, nest = state.plans[line], len(state.line_tips(line))
            sentence = plan.name
            begin, end = ("({:z.0f}, {:z.0f}, {:z.0f})".format(*one) for one in plan.ends_world)
            on_lines = (
                f"Line {line + 1} of {len(state.plans)}, {sentence}: lay the bar from {begin} to "
                f"{end} mm in the world frame and put the ball into nest {nest + 1} of "
                f"{len(bar.nests)}."
            )
        on_spheres = "All spheres touched." if spheres else "No sphere was chosen."
        sphere = state.current_sphere()
        if sphere is not None:
            depth_part = self._begun.places[sphere]
            where = f" in the {depth_part} of the volume" if depth_part else ""
            on_spheres = (
                f"Touch sphere '{spheres[sphere].artefact.use.name}'{where} all around, from the "
                f"pole to the equator."
            )
        return on_lines, on_spheres

    def _seat_instructions(self) -> tuple[str, str]:
        first, again = self._state.unvisited_seat(), self._state.seat_to_repeat()
        return guided.first_instruction(first), guided.again_instruction(again)

    def _steps_rest_on(self) -> object:
        return ()

    def _steps(self) -> tuple[guided.Step, ...]:
        state, bar = self._state, self._begun.bar
        on_lines, on_spheres = self._instructions()
        on_first, on_again = self._seat_instructions()
        nests = sum(len(state.line_taken(line)) for line in range(len(state.plans)))
        touched = sum(len(state.sphere_tips(i)) for i in range(len(self._begun.spheres)))
        first = sum(bool(state.visits(seat)) for seat in range(guided.SEATS))
        again = state.seat_to_repeat()
        return (
            guided.Step(
                PREPARE,
                "Prepare",
                f"Take bar '{bar.artefact.use.name}' (serial {bar.artefact.use.serial}); it and "
                "the cameras must be at room temperature.",
                guided.OPEN,
            ),
            guided.Step(
                SEATS_FIRST, "Seats first", on_first, state.seats_gate(), first, guided.SEATS
            ),
            guided.Step(
                LINES, "Lengths", on_lines, state.lines_gate(),
                nests, len(state.plans) * len(bar.nests),
            ),
            guided.Step(
                SPHERES, "Spheres", on_spheres, state.spheres_gate(),
                touched, len(self._begun.spheres) * judging.SPHERE_POINTS,
            ),
            guided.Step(
                SEATS_AGAIN,
                "Seats again",
                on_again,
                state.again_gate(),
                guided.SEATS if again is None else again,
                guided.SEATS,
            ),
            guided.Step(
                RESULT,
                "Verdict",
                "Review the errors against their limits, and store the verdict.",
                guided.Gate(False, "This is the last step.", "Store the verdict."),
            ),
        )  # fmt: skip

    def _calculation(self) -> Callable[[], guided.VerificationOutcome]:
        # Fast enough to run within the state's lock.
        store, active = self._store, self._store.active()
        due = "" if active is None else active.valid_until_utc
        record = verdict(self._state, active, store.last_good_utc)
        failed = self._state.begun.limits.failing(record.checks)
        largest = judging.worst(record.checks)
        return lambda: guided.VerificationOutcome(record, largest, failed, (), due)

    def _put(self, outcome: guided.VerificationOutcome, decided: guided.Decided) -> None:
        now = datetime.fromisoformat(decided.utc)
        self._store.verify(outcome.record, now, self._log.path)


def _bare(corner: str) -> str:
    return "".join(corner.split()).upper()
