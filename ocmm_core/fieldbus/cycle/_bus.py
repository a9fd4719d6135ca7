"""The camera bus: brings the rig's cameras to OP and runs cycles.

Its clock locks the master's cycle to the bus clock: pure arithmetic on times, ns.
The bus clock is read in every cycle; the moment of reading is only bounded by the send and answer
times. A proportional-integral filter maps host to bus time; its slope is the drift. A reading
outside these bounds indicates a jump of the bus clock.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle._bringup import BusSettings, Session, bring_up
from ocmm_core.fieldbus.cycle._health import CycleAnswer, Schedule
from ocmm_core.fieldbus.cycle._watch import PortTrouble, StateWatch, WatchView
from ocmm_core.fieldbus.device import COUNTER_MODULUS
from ocmm_core.fieldbus.objects import ObjectService
from ocmm_core.fieldbus.report import BusPhase
from ocmm_core.fieldbus.wire import SAFEOP, HostTime, Master, Passage, ServiceChannel

_GAIN = 0.02
"""Phase gain per reading once settled; averages about 50 readings."""
_RATE_GAIN = _GAIN * _GAIN / 4.0
"""Slope gain: critically damped."""
_SETTLED = 50
"""Readings with a larger gain after a start."""
_ERROR_LIMIT_NS = 50_000.0
"""A larger error is a stall of this computer; it must not wind up the integral."""
_CERTAIN_NS = 100_000
"""Longer round trips have proportionally less weight."""
_RATE_LIMIT = 1e-3
"""Crystals are a hundred times better."""
_MARGIN_NS = 250_000.0
_UNSETTLED_MARGIN_NS = 2_000_000.0
_MARGIN_RATE = 5e-4
_SLEW_NS = 20_000
"""Limit of the shift of one cycle towards the bus clock."""
_REPORT_GAIN = 1.0 / 500.0


class BusClock:
    """Bus clock as observed by this computer."""

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._readings = 0
        self._host_ns = self._bus_ns = 0
        self._fraction_ns = 0.0
        self._rate = self._slow_rate = 0.0

    @property
    def known(self) -> bool:
        """Return whether there was a reading since the start."""
        return self._readings > 0

    @property
    def drift_ppm(self) -> float:
        """Return the bus clock's rate minus this computer's, smoothed over seconds."""
        return self._slow_rate * 1e6

    def restart(self) -> None:
        """Forget the time but not the drift, after the clocks were set."""
        self._readings = 0

    def bus_time(self, host_ns: int) -> int:
        since = host_ns - self._host_ns
        return self._bus_ns + since + round(since * self._rate + self._fraction_ns)

    def host_time(self, bus_ns: int) -> int:
        since = bus_ns - self._bus_ns - self._fraction_ns
        return self._host_ns + round(since - since * self._rate / (1.0 + self._rate))

    def observe(self, sent_ns: int, answered_ns: int, bus_ns: int) -> bool:
        """Record a clock reading between two host times; return False if implausible."""
        middle = (sent_ns + answered_ns) // 2
        if not self._readings:
            self._host_ns, self._bus_ns, self._fraction_ns = middle, bus_ns, 0.0
            self._readings = 1
            return True
        settled = self._readings >= _SETTLED
        margin = _MARGIN_NS if settled else _UNSETTLED_MARGIN_NS
        margin += _MARGIN_RATE * max(0, middle - self._host_ns)
        early, late = self.bus_time(sent_ns), self.bus_time(answered_ns)
        if not early - margin <= bus_ns <= late + margin:
            return False
        error = float(bus_ns - self.bus_time(middle))
        if settled:
            error = min(_ERROR_LIMIT_NS, max(-_ERROR_LIMIT_NS, error))
        trust = min(1.0, _CERTAIN_NS / max(1, answered_ns - sent_ns))
        gain = trust * max(_GAIN, 1.0 / (self._readings + 1))
        since = middle - self._host_ns
        exact = since * self._rate + self._fraction_ns + gain * error
        whole = round(exact)
        self._host_ns, self._bus_ns = middle, self._bus_ns + since + whole
        self._fraction_ns = exact - whole
        if settled:
            rate = self._rate + trust * _RATE_GAIN * error / self._period_ns
            self._rate = min(_RATE_LIMIT, max(-_RATE_LIMIT, rate))
            self._slow_rate += _REPORT_GAIN * (self._rate - self._slow_rate)
        self._readings += 1
        return True


class CyclePacer:
    """Start times of the cycles, by this computer's clock without a bus clock, and their count."""

    def __init__(self, period_ns: int, now_ns: int) -> None:
        self._period_ns = period_ns
        self.deadline_ns = now_ns
        self.phase_ns = 0.0
        """Smoothed deviation of the cycle starts from their target on the bus clock."""

    def start_cycle(self, now_ns: int) -> int:
        """Start the due cycle; return the elapsed cycles, 1 if none was missed."""
        elapsed = 1 + max(0, now_ns - self.deadline_ns) // self._period_ns
        self.deadline_ns += elapsed * self._period_ns
        return elapsed

    def passed(self, now_ns: int) -> int:
        """Return the number of cycles that passed without an exchange."""
        elapsed = max(0, now_ns - self.deadline_ns) // self._period_ns
        self.deadline_ns += elapsed * self._period_ns
        return elapsed

    def follow(self, clock: BusClock, target_ns: int) -> None:
        """Move the next cycle towards the bus time `target_ns` modulo the period."""
        bus_ns = clock.bus_time(self.deadline_ns)
        cycles = (bus_ns - target_ns + self._period_ns // 2) // self._period_ns
        wanted = clock.host_time(target_ns + cycles * self._period_ns)
        off = self.deadline_ns - wanted
        self.phase_ns += 0.02 * (off - self.phase_ns)
        self.deadline_ns -= min(_SLEW_NS, max(-_SLEW_NS, off))


__all__ = ["BusSettings", "CameraBus"]

_LIFT_CYCLES = 5
"""Cycles between requests for the next step towards OP."""
_LATE_CYCLES = 100
"""Late answers are part of a fault message for this many cycles."""


class CameraBus:
    """Bus with its cameras; one thread owns it from open to close."""

    def __init__(
        self,
        settings: BusSettings,
        objects: ObjectService | None = None,
        host_time: HostTime | None = None,
    ) -> None:
        self._time = host_time or HostTime()
        self._settings = settings
        names = tuple(camera.name for camera in settings.cameras)
        self._objects = objects or ObjectService(None, names)
        self._session = Session()
        self._service = ServiceChannel()
        self._watch = StateWatch(())
        self.clock = BusClock(settings.cycle_period_ns)
        self.passage: Passage | None = None
        """Wire times of the last cycle; None before the first."""
        self._cycles = 0
        self._silent = 0
        self._late_at = -_LATE_CYCLES
        self._stray_before = 0

    @property
    def session(self) -> Session:
        """Return the result of the last bring-up."""
        return self._session

    @property
    def schedule(self) -> Schedule:
        """Return the exposure schedule; available once the bus is open."""
        if self._session.schedule is None:
            raise _closed()
        return self._session.schedule

    @property
    def view(self) -> WatchView:
        """Return the last reported states of the cameras."""
        return self._watch.view

    def look_closer(self) -> None:
        """Read the cameras' port error counters in the next cycle."""
        self._watch.hurry()

    def port_news(self) -> list[tuple[str, PortTrouble]]:
        """Return new port errors since the last call, with camera names."""
        news = self._watch.news
        return [
            (self._settings.cameras[place].name, trouble)
            for place, trouble in iter(lambda: news.popleft() if news else None, None)
        ]

    @property
    def stray_answers(self) -> int:
        master = self._session.master
        now = 0 if master is None else master.port.tally.stray
        return self._stray_before + now + self._service.stray

    @property
    def foreign_frames(self) -> int:
        """Return the number of frames of another master in this session."""
        master = self._session.master
        return 0 if master is None else master.port.foreign

    @property
    def redundancy_broken(self) -> bool:
        """Return whether a redundancy cable exists and the ring is open."""
        session = self._session
        ring = None if session.master is None else session.master.port.ring
        return session.ring_is_line or (ring is not None and ring.is_open)

    def open(self) -> None:
        """Bring the cameras to OP; BusError as `bring_up`."""
        for _ in self.open_steps():
            pass

    def open_steps(self) -> Iterator[BusPhase]:
        """Open or reopen step by step; see `bring_up`."""
        self.close()
        self._time.flow()
        session = self._session = Session(serials=self._session.serials)
        watched, self._watch = self._watch, StateWatch((), self._watch)
        try:
            yield from bring_up(self._settings, session, self._time)
        except BaseException:
            self.close()
            raise
        self._service.abandon()
        self._watch = StateWatch(session.stations, watched)
        self._objects.attach(
            {
                camera.name: (station, areas)
                for camera, station, areas in zip(
                    self._settings.cameras, session.stations, session.areas, strict=True
                )
            }
        )
        self.clock.restart()
        self._silent = 0

    def exchange(self, next_frames: Sequence[int], timeout_ns: int) -> CycleAnswer:
        """Send outputs, wait for the answers and return them unjudged.

        ``next_frames``: first frame still needed of each camera; acknowledges all before it.
        """
        session, master = self._session, self._session.master
        if master is None:
            raise _closed()
        self._cycles += 1
        token = self._cycles % COUNTER_MODULUS
        for place, frame in zip(session.places, next_frames, strict=True):
            master.set_output(place, session.outputs(frame, token))
        self._lift()
        self._objects.work(self._time.now_ns())
        late_before = master.port.tally.late
        passage = self.passage = master.cycle(
            token,
            timeout_ns,
            self._service,
            itertools.chain(self._watch.jobs(), self._objects.jobs()),
        )
        self._silent = 0 if passage.any_came else self._silent + 1
        if master.port.tally.late != late_before:
            self._late_at = self._cycles
        return self._answer(master, passage, next_frames)

    def link_trouble(self) -> str:
        """Return why no frame can pass the interface; empty if it can."""
        master = self._session.master
        return "" if master is None else master.port.link_trouble()

    def close(self) -> None:
        """Leave the cameras in INIT and release the interface; idempotent."""
        master = self._session.master
        if master is not None:
            self._stray_before += master.port.tally.stray
        self._session.close()

    def _answer(self, master: Master, passage: Passage, next_frames: Sequence[int]) -> CycleAnswer:
        session = self._session
        inputs: tuple[bytes, ...] = ()
        clock_ns = master.clock_ns
        if session.own_time:
            # Without a common clock, this computer's time is used.
            clock_ns = self._time.passage(passage.sent_ns, passage.answered_ns)[0]
        expected = master.expected_working_counter
        plausible = True
        if passage.whole and passage.working_counter > 0:
            inputs = master.inputs(self._session.places)
        if inputs and session.translators:
            inputs = tuple(
                [
                    each.translate(content, clock_ns, wanted)
                    for each, content, wanted in zip(
                        session.translators, inputs, next_frames, strict=True
                    )
                ]
            )
        if passage.whole and passage.working_counter == expected:
            plausible = self.clock.observe(
                *self._time.passage(passage.sent_ns, passage.answered_ns), clock_ns
            )
        return CycleAnswer(
            whole=passage.whole,
            working_counter=passage.working_counter,
            expected_working_counter=expected,
            clock_ns=clock_ns,
            clock_plausible=plausible,
            view=self._watch.view,
            inputs=inputs,
            headers=tuple(
                [
                    layout.decode(content)
                    for layout, content in zip(self._session.layouts, inputs, strict=False)
                ]
            ),
            link="" if passage.whole else self.link_trouble(),
            silent_cycles=self._silent,
            late=self._cycles - self._late_at < _LATE_CYCLES,
            untaken=passage.untaken,
        )

    def _lift(self) -> None:
        """Request OP from cameras that fell back to SAFEOP."""
        if self._cycles % _LIFT_CYCLES:
            return
        for camera, view in enumerate(self._watch.view.cameras):
            if view.state == SAFEOP:
                self._watch.lift(camera)


def _closed() -> BusError:
    return BusError("bus.closed", "The camera bus is not open.", "Open it first.")
