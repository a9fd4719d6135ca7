"""Camera states, read in every cycle through the service channel, and faulty cables.

A controller counts broken frames and lost links per port (ETG.1000.4, 6.5: registers 0x0300 to
0x0313). A frame counted as broken was damaged on the cable at that port; controllers behind it
count it as forwarded, which implies nothing about their own cables.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ocmm_core.fieldbus.wire import Command, Datagram, Job

PORT_ERRORS, PORT_ERRORS_BYTES = 0x0300, 20
"""Two bytes of broken frames per port, eight unused, one byte of lost links per port."""
_N_PORTS = 4
_LOST_LINKS = 16
_FULL = 255
"""Counters saturate here."""
_PORT_NAMES = ("IN", "OUT", "2", "3")


class PortTrouble(NamedTuple):
    """Errors at one port of one camera."""

    port: int
    """0 towards the computer, 1 towards the next camera."""
    broken: int
    lost: int
    """`broken`, `lost`: frames and links since the last sample; counter value if saturated."""

    def message(self, camera: str) -> str:
        parts = []
        if self.broken:
            parts.append(f"{self.broken} broken frame{'s' if self.broken > 1 else ''}")
        if self.lost:
            parts.append(f"{self.lost} lost link{'s' if self.lost > 1 else ''}")
        return (
            f"Camera '{camera}' counts {' and '.join(parts)} at its port "
            f"{_PORT_NAMES[self.port]} ({self.port})."
        )


def port_trouble(before: bytes, now: bytes) -> PortTrouble | None:
    """Return the port with the most new errors since `before`, or None.

    The registers have `PORT_ERRORS_BYTES`. A decreased counter was reset: its whole value is new.
    """
    found = [
        PortTrouble(
            port,
            sum(_grown(before[at], now[at]) for at in (2 * port, 2 * port + 1)),
            _grown(before[_LOST_LINKS + port], now[_LOST_LINKS + port]),
        )
        for port in range(_N_PORTS)
    ]
    worst = max(found, key=lambda each: (each.broken + each.lost, -each.port))
    return worst if worst.broken or worst.lost else None


def errors_at_ports(counters: bytes) -> int:
    """Return the error count of all ports of a camera."""
    return sum(counters[: 2 * _N_PORTS]) + sum(counters[_LOST_LINKS:])


def _grown(before: int, now: int) -> int:
    if now == _FULL:
        return _FULL
    return now - before if now >= before else now


AL_CONTROL = 0x0120
AL_STATUS = 0x0130
_AL_BYTES = 6
TIME_DIFFERENCE = 0x092C
_STATE, _ERROR = 0x0F, 0x10
_ACKNOWLEDGE = 0x10
_SAFEOP, _OP = 4, 8
_SLOW_CYCLES = 4
"""Error counters are read in turn, every this many cycles."""
_MOST_NEWS = 64
_FRESH_CYCLES = 500
"""Port errors explain a fault for this long."""


class CameraView(NamedTuple):
    """State of one camera from its own answers."""

    answers: int = 1
    """Devices answering at its address: 1 in good order, 0 if absent."""
    state: int = 0
    error: bool = False
    code: int = 0
    """`state`, `error`, `code`: AL state, error bit and AL status code."""
    clock_offset_ns: int | None = None
    """Offset from the reference clock; None if not yet read."""
    link_errors: int | None = None
    trouble: PortTrouble | None = None
    """Recent errors at its worst port."""


class WatchView(NamedTuple):
    """State of all cameras."""

    age: int
    """Cycles since the last answer."""
    devices: int
    cameras: tuple[CameraView, ...]


class StateWatch:
    """Reads the cameras' states, clocks and error counters, in rig order."""

    def __init__(self, stations: Sequence[int], before: StateWatch | None = None) -> None:
        self._stations = tuple(stations)
        self.news: deque[tuple[int, PortTrouble]] = deque(maxlen=_MOST_NEWS)
        """Port errors not yet fetched: rig index and errors."""
        self._counted: dict[int, bytes] = {} if before is None else before.counters
        self._counted_at: dict[int, int] = {}
        self._hurried = False
        self._cameras = [CameraView() for _ in stations]
        self._devices = len(stations)
        self._cycle = 0
        self._seen = 0
        self._newest = 0
        self._lifts: dict[int, int] = {}
        # Same in every cycle.
        self._whether = Datagram(Command.BRD, 0, AL_STATUS, bytes(2))
        self._states = [Datagram(Command.FPRD, at, AL_STATUS, bytes(_AL_BYTES)) for at in stations]
        self._clocks = [Datagram(Command.FPRD, at, TIME_DIFFERENCE, bytes(4)) for at in stations]
        self._counters = [
            Datagram(Command.FPRD, at, PORT_ERRORS, bytes(PORT_ERRORS_BYTES)) for at in stations
        ]

    @property
    def view(self) -> WatchView:
        return WatchView(self._cycle - self._seen, self._devices, tuple(self._cameras))

    @property
    def counters(self) -> dict[int, bytes]:
        """Return the last port counters by rig index."""
        return dict(self._counted)

    def lift(self, camera: int) -> None:
        """Request the next step towards OP from a camera in SAFEOP."""
        view = self._cameras[camera]
        self._lifts[camera] = _SAFEOP | _ACKNOWLEDGE if view.error else _OP

    def hurry(self) -> None:
        """Read all port counters in the next cycle, after a fault."""
        self._hurried = True

    def jobs(self) -> Iterator[Job]:
        self._cycle += 1
        cycle = self._cycle
        lifts, self._lifts = self._lifts, {}
        for camera, control in lifts.items():
            content = control.to_bytes(2, "little")
            yield Job(
                Datagram(Command.FPWR, self._stations[camera], AL_CONTROL, content),
                lambda _answer: None,
            )
        yield Job(self._whether, lambda answer: self._count(cycle, answer))
        for camera in range(len(self._stations)):
            yield Job(
                self._states[camera],
                lambda answer, camera=camera: self._state(camera, cycle, answer),  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
            )
            # In every cycle: frames exposed with a wrong clock must not be accepted.
            yield Job(
                self._clocks[camera],
                lambda answer, camera=camera: self._clock(camera, answer),  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
            )
        turn, rest = divmod(cycle, _SLOW_CYCLES)
        asked = [turn % len(self._stations)] if rest == 0 else []
        if self._hurried:
            asked, self._hurried = list(range(len(self._stations))), False
        for camera in asked:
            yield Job(
                self._counters[camera],
                lambda answer, camera=camera: self._errors(camera, answer),  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
            )

    def _count(self, cycle: int, answer: Datagram | None) -> None:
        if answer is not None and cycle >= self._newest:
            self._devices = answer.working_counter

    def _state(self, camera: int, cycle: int, answer: Datagram | None) -> None:
        # A late answer must not replace a newer one.
        if answer is None or cycle < self._newest:
            return
        self._newest = self._seen = cycle
        known = self._cameras[camera]
        status = int.from_bytes(answer.data[:2], "little") if answer.working_counter else 0
        code = int.from_bytes(answer.data[4:6], "little") if answer.working_counter else 0
        self._cameras[camera] = CameraView(
            answer.working_counter,
            status & _STATE,
            bool(status & _ERROR),
            code,
            known.clock_offset_ns,
            known.link_errors,
            known.trouble,
        )

    def _clock(self, camera: int, answer: Datagram | None) -> None:
        if answer is not None and answer.working_counter == 1:
            raw = int.from_bytes(answer.data, "little")
            # Sign bit.
            size = raw & 0x7FFFFFFF
            offset = -size if raw >> 31 else size
            known = self._cameras[camera]
            self._cameras[camera] = CameraView(
                known.answers, known.state, known.error, known.code, offset, known.link_errors,
                known.trouble,
            )  # fmt: skip

    def _errors(self, camera: int, answer: Datagram | None) -> None:
        if answer is None or answer.working_counter != 1:
            return
        counters = bytes(answer.data)
        before = self._counted.get(camera, counters)
        self._counted[camera] = counters
        trouble = port_trouble(before, counters) if counters != before else None
        if trouble is not None:
            self._counted_at[camera] = self._cycle
            self.news.append((camera, trouble))
        elif self._cycle - self._counted_at.get(camera, self._cycle) <= _FRESH_CYCLES:
            trouble = self._cameras[camera].trouble
        self._cameras[camera] = self._cameras[camera]._replace(
            link_errors=errors_at_ports(counters), trouble=trouble
        )
