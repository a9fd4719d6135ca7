"""Guided relocation without a CMM: seats, waved probe, bar, seats again.

Two seats fixed to the table, visited first and last, reveal motion. Coverage of the volume and the
predicted uncertainty of a length decide when the data suffice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import guided, records
from ocmm_core.calibration.cameras import KnownPoints
from ocmm_core.calibration.relocation._data import RelocationResult
from ocmm_core.calibration.relocation._relocation import relocate
from ocmm_core.calibration.relocation._request import RelocationRequest
from ocmm_core.calibration.relocation._state import (
    BarTaken,
    PoseTaken,
    RelocationBegun,
    RelocationEvent,
    RelocationState,
    SeatTaken,
)
from ocmm_core.calibration.relocation._steps import (
    BAR,
    PREPARE,
    RESULT,
    SEATS_AGAIN,
    SEATS_FIRST,
    WAVE,
    WORLD,
    bar_ends,
    findings_of,
    seat_findings,
    steps_of,
)
from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.geometry import Float

_POSE_APART_MM, _POSE_TURN_RAD = 15.0, 0.08
_SEAT_APART_MM = 5.0
_LENGTH_OF_VOLUME = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class RelocationSetup(guided.SessionSetup):
    bar: records.LengthBar
    """With LEDs it is shown, otherwise its end nests are touched."""
    control: KnownPoints | None = None
    """Points that define the world frame."""
    request: RelocationRequest = field(default_factory=RelocationRequest)
    valid_days: int = 365


class RelocationProcedure(
    guided.CameraProcedure[
        RelocationEvent, guided.CalibrationOutcome, RelocationBegun, RelocationSetup
    ]
):
    """See `procedure`; the rig has its previous poses."""

    kind = guided.ProcedureKind.RELOCATION
    sessions = guided.SessionFormat(kind, guided.SessionLine[RelocationEvent], RelocationBegun)
    step_names = (PREPARE, SEATS_FIRST, WAVE, BAR, WORLD, SEATS_AGAIN, RESULT)

    def __init__(
        self,
        site: guided.SessionSite,
        chain: ChainFile[guided.SessionLine[RelocationEvent]],
        begun: RelocationBegun,
    ) -> None:
        super().__init__(site, chain, begun)
        rig, body = site.rig, site.body
        guided.require_probe(chain.path, begun.probe_identity, body)
        self._state = RelocationState(rig, body, begun)
        self._length_sigma: float | None = None
        self._predicted = -1
        self._wave = guided.ProbeSpotAverager(
            rig, body, guided.waved_frames(rig), resting=False, distance_mm=_POSE_APART_MM,
            turn_rad=_POSE_TURN_RAD, moved=True,
        )  # fmt: skip
        self._seat = guided.ProbeSpotAverager(
            rig, body, guided.STILL_FRAMES, resting=True, distance_mm=_SEAT_APART_MM, moved=True
        )
        self._bar = guided.StaticSpotAverager(rig, 2)
        self._fold()
        if begun.seats is None:
            self._refuse_older("visited no seats first and last")

    @classmethod
    def _first_line(
        cls, site: guided.SessionSite, setup: RelocationSetup, now: datetime
    ) -> dict[str, object]:
        bar, request = setup.bar, setup.request
        length = bar.nests[-1] - bar.nests[0]
        records.let_pass(bar.artefact.judge(length, np.inf, now, setup.temperature), force=False)
        known = setup.control if request.world == "points" else None
        if request.world == "points" and (known is None or len(known.names) < 3):
            raise CalibrationError(
                "relocation.control",
                "A world frame from control points needs at least three known ones.",
                "Give a list of control points, or fix the world frame to the cameras.",
            )
        diagonal = float(np.linalg.norm(np.ptp(site.rig.volume_world, axis=0)))
        return {
            "probe_identity": site.body.identity, "bar": bar, "poses_wanted": request.poses,
            "bars_wanted": request.placements,
            "length_mm": min(400.0, _LENGTH_OF_VOLUME * diagonal), "length_limit_mm": request.limit,
            "lens": request.lens, "geometry": request.geometry, "world": request.world,
            "control_names": known.names if known else (),
            "control_positions": tuple(
                (x, y, z) for x, y, z in (known.positions_world.tolist() if known else [])
            ),
            "control_sigma": known.sigma if known else 0.0, "valid_days": setup.valid_days,
            "seats": guided.SEATS if request.seats else 0,
        }  # fmt: skip

    @property
    def bar(self) -> records.LengthBar:
        return self._begun.bar

    @property
    def control(self) -> KnownPoints | None:
        begun = self._begun
        if not begun.control_names:
            return None
        positions = np.array(begun.control_positions)
        return KnownPoints(begun.control_names, positions, begun.control_sigma, begun.rig)

    @property
    def view(self) -> guided.RelocationView:
        with self._lock:
            state = self._state
            return guided.RelocationView(
                base=self.base, poses=len(state.poses), coverage=state.coverage(),
                length_sigma_mm=self._length_sigma, length_mm=self._begun.length_mm,
                length_limit_mm=self._begun.length_limit_mm, bar_placements=state.placements,
                bars_wanted=self._begun.bars_wanted,
                world_points=tuple(one.seat for one in state.seats),
                world_wanted=state.wanted_seats, visits=len(state.visits),
                seats_world=tuple(state.known_seats()),
                next_seat=(
                    state.unvisited_seat if self._step == SEATS_FIRST else state.seat_to_repeat
                ),
                outcome=self._outcome,
            )  # fmt: skip

    def watch(self, block: FrameBlock) -> None:
        with self._lock:
            self._collector().push(block)

    def predict(self) -> None:
        """Predict the uncertainty of a length, in a second or more, if observations suffice."""
        with self._lock:
            version = self._version
            if version == self._predicted:
                return
            observed, options = self._state.observations(), self._state.options()
            rig, body, begun = self.rig, self._state.body, self._begun
        try:
            found = relocate(rig, body, observed, options, force=True)
            after = found.applied_to(rig, rig.identity)
            sigma = guided.length_sigma(after, found.volume_world, begun.length_mm)
        except OcmmError:
            sigma = None
        with self._lock:
            self._length_sigma, self._predicted = sigma, version

    def take_pose(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Add recorded spots (C, L, 2), px, of the waved probe."""
        with self._lock:
            self._append(
                PoseTaken(utc=guided.utc_text(now), uv=guided.to_spots(uv), sigma_px=sigma_px)
            )

    def take_bar(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Add recorded spots (C, 2, 2), px, of the bar's LEDs in one placement."""
        with self._lock:
            self._append(
                BarTaken(utc=guided.utc_text(now), uv=guided.to_spots(uv), sigma_px=sigma_px)
            )

    def take_seat(self, seat: str, uv: Float, sigma_px: float, now: datetime) -> None:
        """Add recorded spots (C, L, 2), px, of the probe in a seat; no name: an end of the bar."""
        with self._lock:
            self._append(
                SeatTaken(
                    utc=guided.utc_text(now), seat=seat, uv=guided.to_spots(uv), sigma_px=sigma_px
                )
            )

    def take_visit(self, uv: Float, sigma_px: float, now: datetime) -> None:
        """Add spots (C, L, 2), px, in the next of both seats; CalibrationError if none is due."""
        with self._lock:
            state = self._state
            seat = state.unvisited_seat
            seat = state.seat_to_repeat if seat is None else seat
            if seat is None:
                raise CalibrationError(
                    "relocation.visits",
                    "Both seats were visited at the start and at the end.",
                    "Skip this visit, or first take what belongs between the visits.",
                )
            self._append(
                guided.SeatVisited(
                    utc=guided.utc_text(now), seat=seat, uv=guided.to_spots(uv), sigma_px=sigma_px
                )
            )

    def _collector(self) -> guided.ProbeSpotAverager | guided.StaticSpotAverager:
        if self._step == BAR and self._state.shown:
            return self._bar
        at_rest = (SEATS_FIRST, BAR, WORLD, SEATS_AGAIN)
        return self._seat if self._step in at_rest else self._wave

    def _seen(self) -> guided.Live:
        live = self._collector().live()
        visiting = self._step in (SEATS_FIRST, SEATS_AGAIN)
        ends = self._step == BAR and not self._state.shown
        if not live.ready or not (visiting or ends):
            return live
        average, state = self._seat.average(), self._state
        if visiting:
            again = self._step == SEATS_AGAIN
            hint = state.judge_visit(average.uv, average.sigma_px, again=again)
        else:
            hint = state.judge_end(average.uv, average.sigma_px)
        return replace(live, ready=False, hint=hint) if hint else live

    def _wants(self) -> bool:
        if self._step == WORLD:
            return self._state.next_seat is not None
        if self._step == SEATS_FIRST:
            return self._state.unvisited_seat is not None
        if self._step == SEATS_AGAIN:
            return self._state.seat_to_repeat is not None
        return self._step in (WAVE, BAR)

    def _observation(self, utc: str) -> PoseTaken | BarTaken | SeatTaken | guided.SeatVisited:
        average = self._collector().average()
        sigma = average.sigma_px
        if self._step == WAVE:
            return PoseTaken(utc=utc, uv=guided.to_spots(average.uv), sigma_px=sigma)
        if self._step == BAR and self._state.shown:
            places = self._begun.bar.leds
            uv = bar_ends(self.rig, average.uv, places[1] - places[0])
            return BarTaken(utc=utc, uv=guided.to_spots(uv), sigma_px=sigma)
        if self._step in (SEATS_FIRST, SEATS_AGAIN):
            state, first = self._state, self._step == SEATS_FIRST
            visited = state.unvisited_seat if first else state.seat_to_repeat
            assert visited is not None  # noqa: S101 - a visit is wanted
            uv = average.uv
            return guided.SeatVisited(utc=utc, seat=visited, uv=guided.to_spots(uv), sigma_px=sigma)
        seat = (self._state.next_seat or "") if self._step == WORLD else ""
        return SeatTaken(utc=utc, seat=seat, uv=guided.to_spots(average.uv), sigma_px=sigma)

    def _observe(self, event: RelocationEvent) -> None:
        if isinstance(event, RelocationBegun):
            return
        self._state.add(event)
        average = guided.Average(guided.from_spots(event.uv), event.sigma_px)
        if isinstance(event, PoseTaken):
            self._wave.taken(average)
        elif isinstance(event, BarTaken):
            self._bar.taken(average)
        else:
            self._seat.taken(average)

    def _taken(
        self, step: str
    ) -> list[PoseTaken] | list[BarTaken] | list[SeatTaken] | list[guided.SeatVisited]:
        state = self._state
        if step == BAR:
            return state.bars if state.shown else state.bar_ends
        if step == WORLD:
            return state.seats
        others = (state.poses, state.bars, state.bar_ends, state.seats)
        if step == SEATS_FIRST and not any(others):
            # Later observations depend on it; a visit at the end is a result.
            return state.visits
        return state.poses if step == WAVE else []

    def _has_observation(self, step: str) -> bool:
        return bool(self._taken(step))

    def _undo(self, step: str) -> None:
        if step == WAVE:
            self._state.remove_pose()
        else:
            self._taken(step).pop()

    def _steps_rest_on(self) -> object:
        return (self._length_sigma,)

    def _steps(self) -> tuple[guided.Step, ...]:
        return steps_of(self._state, self._length_sigma)

    def _calculation(self) -> Callable[[], guided.CalibrationOutcome]:
        state, begun, rig, force = self._state, self._begun, self.rig, self._forced
        for step in self._steps()[:-1]:
            gate = step.gate
            seats = step.name in (SEATS_FIRST, SEATS_AGAIN)
            if not gate.open and (seats or not force):
                raise CalibrationError("relocation.incomplete", gate.reason, gate.remedy)
        observed, options, body = state.observations(), state.options(), state.body
        running = self._store.active()
        before = None if running is None else records.rig_from_record(running)
        visits = tuple(state.visits)
        last: list[PoseTaken | BarTaken | SeatTaken | guided.SeatVisited] = [
            *state.poses, *state.bars, *state.bar_ends, *state.seats, *visits
        ]  # fmt: skip
        shown = [one.uv for one in observed.shown_bars]
        rested = [guided.from_spots(one.uv) for one in visits]
        how = guided.CalibrationContext(
            method="relocation",
            made=datetime.fromisoformat(max(one.utc for one in last) if last else begun.utc),
            valid_days=begun.valid_days, who=begun.who, software=begun.software,
            temperature_c=begun.temperature_c, sensor_temperatures_c=self._sensors_c,
            data_sha256=guided.hash_of(observed.frames.uv, *shown, *rested),
            artefacts=(begun.bar.artefact.use,), previous=begun.running,
        )  # fmt: skip

        def calculate() -> guided.CalibrationOutcome:
            found = relocate(rig, body, observed, options, force)
            seats = records.let_pass(seat_findings(rig, body, found, visits), force)
            found = replace(found, warnings=found.warnings + seats)
            summary = replace(findings_of(rig, observed, found), thermal=_term(begun, found))
            return guided.build_outcome(rig, summary, how, before)

        return calculate

    def _put(self, outcome: guided.CalibrationOutcome, decided: guided.Decided) -> None:
        now = datetime.fromisoformat(decided.utc)
        self._store.accept(outcome.record, self._begun.who, decided.reason, now, self._log.path)


def _term(begun: RelocationBegun, found: RelocationResult) -> records.ThermalTerm | None:
    if found.thermal is None or begun.temperature_u is None:
        return None
    sigma_k, by_k = found.thermal
    return records.ThermalTerm(
        thermometer=begun.thermometer, expanded_k=begun.temperature_u, sigma_k=sigma_k,
        by_k=tuple(by_k.tolist()),
    )  # fmt: skip
