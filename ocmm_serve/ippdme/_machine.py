"""A measuring station as the machine of the server."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
from psygnal import SignalInstance

from ocmm_core.acquisition.frames import AcquisitionState
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import JobHeader, StatusWord, Target
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_core.station import MeasuringStation
from ocmm_serve.ippdme._grammar import DmeError
from ocmm_serve.ippdme._points import refusal_number
from ocmm_serve.ippdme._state import BallPose, CommandedTouch, DmeTool
from ocmm_serve.site import keep_open

_WARM_S, _POLL_S = 20.0, 0.02
"""s: longest wait for the first frames, and between two looks."""


class StationMachine:
    """DmeMachine of a running station; used by the thread of the server.

    `hand`: virtual hand; None for real probes. `header`: of the jobs. `tell`: shows a sentence to
    the operator.
    """

    def __init__(
        self, station: MeasuringStation, hand: Any, header: JobHeader, tell: Callable[[str], None]
    ) -> None:
        self._station, self._header, self.tell = station, header, tell
        self._body = body = station.instruments.probe_in_use.body
        low, high = body.leds_probe.min(axis=0), body.leds_probe.max(axis=0)
        ends = np.array([[-body.tip_radius] * 3, [body.tip_radius] * 3])
        corners = np.vstack([[low, high] - body.tip_probe, ends])
        self._box = np.array([corners.min(axis=0), corners.max(axis=0)])
        self._target: CommandedTouch | None = None
        self._guided_s = 0.0
        self._hand = hand
        self._connected: tuple[tuple[SignalInstance, Callable[..., None]], ...] = ()

    @property
    def simulated(self) -> bool:
        return self._station.instruments.simulated

    @property
    def volume(self) -> Float:
        return np.asarray(self._station.instruments.rig.volume_world)

    @property
    def asked(self) -> str:
        """Return the point that the program asks for, a sentence; empty if none."""
        target = self._target
        return "" if target is None else target.words

    @property
    def mounted(self) -> str:
        view = self._station.instruments.probe()
        return tool_name(view.tip or view.probe)

    @property
    def part_c(self) -> float | None:
        now = self._station.job.climate.part.now
        return None if now is None else now.celsius

    @property
    def tools(self) -> Sequence[DmeTool]:
        view = self._station.instruments.probe()
        store = self._station.instruments.probe_in_use.store
        others = [] if store is None else [one for one in store.tips if one != view.tip]
        origin = "SIMULATED " if self.simulated else ""
        qualified = view.records.qualification if view.records is not None else None
        made = "00000000T000000Z" if qualified is None else compact_time(qualified.made_utc)
        identity = f"{origin}{view.title} {view.identity[:12]}"
        mounted = DmeTool(self.mounted, identity, self._body.tip_radius, made)
        return [mounted, *(DmeTool(tool_name(one), f"{origin}{view.probe}, tip {one}") for one in
                           others)]  # fmt: skip

    def attach(
        self, touched: Callable[[MeasuredPoint], None], refused: Callable[[Refusal], None]
    ) -> None:
        """Receive the touches of the station until `detach`."""
        events = self._station.events
        slots: list[tuple[SignalInstance, Callable[..., None]]] = [
            (events.point_taken, keep_open(self._station)), (events.point_taken, touched),
            (events.point_refused, refused), (self._station.faults.failed, self._tell_fault),
        ]  # fmt: skip
        for signal, slot in slots:
            signal.connect(slot)
        self._connected = tuple(slots)

    def detach(self) -> None:
        """Leave the station as it is, running."""
        for signal, slot in self._connected:
            signal.disconnect(slot)
        self._connected = ()

    def start(self) -> None:
        """Start the station, and wait for its first frames; OcmmError if it cannot start."""
        faults = self._station.faults
        self._station.start()
        until = time.monotonic() + _WARM_S
        while time.monotonic() < until and self._station.looks.live().frame_counter < 0:
            failure = faults.why_failed()
            if failure is not None:
                raise failure
            time.sleep(_POLL_S)

    def mount(self, name: str) -> None:
        if name != self.mounted:
            raise DmeError(
                1500,
                detail=f"Mount the tip {name} and check it: in the window by Maintain, Mount tip "
                "and Check tip, else by ocmm calibrate mount-tip and check-tip. Then start the "
                "server again.",
            )

    def trouble(self) -> DmeError | None:
        fault = self._station.faults.measuring
        if fault is not None:
            return DmeError(503, "Rig", detail=str(fault.error))
        status = self._station.looks.acquisition()
        if status.state is AcquisitionState.STOPPED:
            detail = status.message or "The acquisition has ended. Start the server again."
            return DmeError(503, "Rig", detail=detail)
        code, blocker = self._station.instruments.blocking_reason()
        if blocker is None:
            return None
        return DmeError(refusal_number(code), "Rig", detail=str(blocker))

    def require_qualified(self) -> None:
        blocker = self._station.instruments.probe().blocking_reason
        if blocker is not None:
            raise DmeError(2000, detail=str(blocker))

    def pose(self) -> BallPose:
        live = self._station.looks.live()
        rotation = live.rotation_world_from_probe
        if live.tip_world is not None and rotation is not None:
            return BallPose(live.tip_world, rotation, self._box)
        number = {StatusWord.LOST: 1501, StatusWord.FAILED: 503}.get(live.status, 1000)
        raise DmeError(number, detail=f"{live.status.value}: {live.reason}")

    def end(self) -> None:
        self.expect(None)
        name, points = self._station.job.stored()
        if not points:
            return
        try:
            self._station.jobs.next_part(self._header)
        except OcmmError as error:
            raise DmeError(511, detail=str(error)) from error
        self.tell(f"Job {name}: {len(points)} points.")

    def keep(self, note: Mapping[str, object]) -> None:
        text = msgspec.json.encode(note).decode()
        self._change(lambda session: session.conditions.note_client(text))

    def discard(self, number: int, reason: str) -> None:
        self._change(lambda session: session.points.delete_point(number, reason))

    def expect(self, target: CommandedTouch | None) -> int:
        frame = self._station.looks.live().frame_counter
        self._target = target
        self._station.job.change(lambda session: session.guide(self._guided(target)))
        if target is not None:
            self.tell(target.words)
        self._guide()
        return frame

    def remind(self, after_s: float) -> None:
        # A touch during a gap of the frames gives neither a point nor a refusal.
        if self._target is not None and time.monotonic() - self._guided_s > after_s:
            self._guide()

    def way_words(self) -> str:
        """Return the way of the ball to the target, as the operator stands before the cameras."""
        live, target = self._station.looks.live(), self._target
        if target is None:
            return live.status.value
        if live.tip_world is None:
            return f"{live.status.value}: {live.reason}"
        ways = (("right", "left"), ("back", "forward"), ("up", "down"))
        steps = zip(ways, (self._ball(target) - live.tip_world).tolist(), strict=True)
        return ", ".join(f"{names[step < 0.0]} {abs(step):.0f} mm" for names, step in steps)

    def _ball(self, target: CommandedTouch) -> Float:
        """Return the centre of the ball in contact, (3,), mm."""
        if target.normal is None:
            return target.surface
        return target.surface + self._body.tip_radius * target.normal

    def _guided(self, target: CommandedTouch | None) -> Target | None:
        """Return a target as screens show it."""
        if target is None:
            return None
        normal = np.zeros(3) if target.normal is None else target.normal
        feature = self._station.job.plan.features[0].name
        return Target(feature, target.surface, normal, self._ball(target), words=target.words)

    def _tell_fault(self, error: OcmmError) -> None:
        self.tell(str(error))

    def lead(self, *, allowed: bool) -> None:
        if allowed:
            self.tell("The program records every touch.")
        if self._hand is not None:
            (self._hand.touch_part if allowed else self._hand.stop)()

    def _guide(self) -> None:
        """Let the virtual hand touch the target."""
        target, self._guided_s = self._target, time.monotonic()
        if self._hand is None:
            return
        self._hand.stop()
        if target is not None:
            up = np.array([0.0, 0.0, 1.0])
            self._hand.touch_place(target.surface, up if target.normal is None else target.normal)

    def _change(self, verb: Callable[[InspectionSession], object]) -> None:
        try:
            self._station.job.change(verb)
        except OcmmError as error:
            raise DmeError(511, detail=str(error)) from error


def tool_name(name: str) -> str:
    """Return a name of letters and digits, which every dialect and client can carry."""
    return re.sub("[^A-Za-z0-9]", "", name) or "Tip"


def compact_time(utc: str) -> str:
    """Return an ISO time as ``YYYYMMDDTHHMMSSZ``."""
    return re.sub("[-:]", "", utc[:19]) + "Z"
