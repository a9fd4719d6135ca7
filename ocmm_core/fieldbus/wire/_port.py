"""Our raw sockets next to the master's: see every answer, carry service frames.

A redundancy cable closes the wire to a ring; this module follows our frames through it.

On a whole ring a frame leaves at the other end, processed by all cameras. With a broken cable it
returns at its own end, processed by the cameras before the break, and is sent again at the other
end: every camera processes it once, in wire order (ETG.1000.4: the processing unit of a slave
follows its port 0). The master library handles process data likewise.

Time of the master is that of this computer, or one that waits on a virtual wire.
"""

from __future__ import annotations

import contextlib
import select
import socket
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire._datagrams import Command, Datagram, decode_frame, frame_index
from ocmm_core.fieldbus.wire._interface import FEW, LISTEN_S, foreign_frames, is_foreign
from ocmm_core.fieldbus.wire._service import FIRST_INDEX, Job, ServiceChannel
from ocmm_core.fieldbus.wire._sockets import INDICES, LinkWatch, listen, transmit, waiting_on
from ocmm_core.fieldbus.wire._tally import N_INDICES, OWN_TOKEN, AnswerTally


class HostTime:
    """Monotonic clock of this computer; never waits.

    A virtual wire may use a subclass whose time stops while this computer is late.
    """

    stretched = False
    """The time can stop. Never true for real cameras."""
    patience = 1
    """Factor on time limits relative to real cameras."""
    pace: float | None = None
    """This time over real time during the last second or so; None if identical or unknown."""

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def wait_until(self, deadline_ns: int) -> int:
        """Wait until `deadline_ns`; return the lateness, ns."""
        left = deadline_ns - time.monotonic_ns()
        if left > 0:
            time.sleep(left * 1e-9)
        return time.monotonic_ns() - deadline_ns

    def passage(self, sent_ns: int, answered_ns: int) -> tuple[int, int]:
        """Convert send and answer times of this computer's clock."""
        return sent_ns, answered_ns

    def hold(self) -> None:
        """Advance from cycle to cycle from now on; stretched time only."""

    def flow(self) -> None:
        """Let time flow freely from now on, as on real hardware."""

    def mark(self) -> None:
        """Start counting frames in transit."""

    def on_their_way(self, sent: int, came: int) -> bool:
        """Return whether frames sent since `mark` are in transit."""
        del sent, came
        return False


_OPEN_FRAMES = 3
"""Consecutive frames that indicate an open ring."""
_KEPT = 64


class RingCable:
    """Tracks where frames leave, and whether the ring is whole."""

    def __init__(self) -> None:
        self.is_open = False
        """The redundancy cable, or another cable of the ring, is broken."""
        self.reached: int | None = None
        """If the ring is broken: number of cameras reached from the first end."""
        self._entered: dict[int, int] = {}
        self._row = 0

    def sent(self, index: int, end: int) -> None:
        """Record a frame sent at an end (0 or 1)."""
        self._entered.pop(index, None)
        self._entered[index] = end
        while len(self._entered) > _KEPT:
            self._entered.pop(next(iter(self._entered)))

    def is_whole(self, index: int, end: int, frame: bytes, *, other_has_link: bool) -> bool:
        """Return whether a frame is the answer; otherwise resend it at the other end."""
        came_back = self._entered.get(index) == end
        if came_back and other_has_link:
            # Its next return is the answer.
            del self._entered[index]
            self._note(broken=True, reached=_count(frame))
            return False
        if index in self._entered:
            self._note(broken=came_back, reached=None)
        return True

    def _note(self, *, broken: bool, reached: int | None) -> None:
        self._row = self._row + 1 if broken else 0
        self.is_open = self._row >= _OPEN_FRAMES
        if not broken:
            self.reached = None
        elif reached is not None:
            self.reached = reached


def _count(frame: bytes) -> int | None:
    """Return the number of cameras that answered a broadcast; None without one."""
    try:
        _, datagrams = decode_frame(frame)
    except BusError:
        return None
    read = (one.working_counter for one in datagrams if one.command == Command.BRD)
    return next(read, None)


_SERVICE_WAIT_NS = 250_000
"""Wait for the service answer after the process data are complete."""
_ASK_NS = 10_000_000
_ASK_TRIES = 3
_POLL_S = 0.005
_FORGOTTEN = 0.01
"""Frames with strange indices that each cycle forgets."""
_STALL_NS = 2_000_000_000
"""Software cameras without a frame for this long have stopped."""
_DL_INFORMATION = 0x0000


class Passage(NamedTuple):
    """Wire times and answers of one cycle."""

    working_counter: int
    """Of the process data; meaningless if incomplete."""
    whole: bool
    any_came: bool
    """At least one answer of any kind arrived."""
    sent_ns: int
    answered_ns: int
    """`sent_ns`, `answered_ns`: host times of the first frame sent, and of the last answer or the
    end of the wait."""
    untaken: bool = False
    """All answers arrived, but the master library had no time to receive all of them."""


class Port:
    """One end of the bus cable, or both with a redundancy cable.

    ``foreign`` counts frames of another master; not on a ring, where ours look alike.
    """

    def __init__(
        self,
        interfaces: Sequence[str],
        host_time: HostTime | None = None,
        token: tuple[int, int] = OWN_TOKEN,
    ) -> None:
        self._time = host_time or HostTime()
        self.tally = AnswerTally(token)
        self.links = [LinkWatch(name) for name in interfaces]
        self.ring = RingCable() if len(interfaces) > 1 else None
        """Ring tracking; None without redundancy."""
        self._channels: list[socket.socket] = []
        self._questions = ServiceChannel()
        self._service_came = False
        self._copies = 0
        self._came = self.foreign = 0
        self._strange = 0.0
        self._names = tuple(interfaces)
        try:
            if self.ring is None:
                # The service frame is sent last and has a socket of its own: waiting for its answer
                # first, one wake-up serves all answers of a cycle.
                for indices in (INDICES[:FIRST_INDEX], INDICES[FIRST_INDEX:]):
                    self._channels.append(listen(interfaces[0], indices))
            else:
                self._channels += map(listen, interfaces)
        except OSError as error:
            self.close()
            raise BusError(
                "bus.unusable",
                f"Interface '{' or '.join(interfaces)}' cannot be opened ({error.strerror}).",
                "Check the adapter and its driver.",
            ) from error

    def query(self, datagrams: Sequence[Datagram]) -> tuple[Datagram, ...] | None:
        """Send datagrams outside a cycle, for 30 ms at most; return their answers or None."""
        service = self._questions
        for _ in range(_ASK_TRIES):
            answers: list[Datagram] = []

            def keep(answer: Datagram | None, answers: list[Datagram] = answers) -> None:
                if answer is not None:
                    answers.append(answer)

            self.collect(service)
            frame = service.compose([Job(datagram, keep) for datagram in datagrams])
            if frame is None or not self._send(frame):
                return None
            self._wait(lambda: service.waits, service, self._time.patience * _ASK_NS)
            if len(answers) == len(datagrams):
                return tuple(answers)
            service.abandon()
        return None

    def refuse_other_masters(self) -> None:
        """Listen before the first transmission; raise BusError if another master sends."""
        if self.ring is not None:
            return
        self.foreign = 0
        deadline = time.monotonic() + LISTEN_S
        while (left := deadline - time.monotonic()) > 0.0:
            with contextlib.suppress(OSError, ValueError):
                select.select(self._channels, [], [], left)
            self.collect(self._questions)
        if self.foreign > FEW:
            raise foreign_frames(self._names[0], self.foreign)

    def count_devices(self) -> int:
        """Return the number of answering devices; blocks for 30 ms at most."""
        answers = self.query([Datagram(Command.BRD, 0, _DL_INFORMATION, bytes(1))])
        return 0 if answers is None else answers[0].working_counter

    def link_trouble(self) -> str:
        """Return why no frame can pass any interface; empty if one can."""
        troubles = [link.trouble() for link in self.links]
        return troubles[0] if all(troubles) else ""

    @property
    def has_both_ends(self) -> bool:
        """Return whether every interface has a link."""
        return not any(link.trouble() for link in self.links)

    def start_cycle(self, service: ServiceChannel, token: int) -> None:
        """Process late answers and expect those of the next cycle."""
        self.tally.expect(token)
        for frame in self.collect(service):
            if self.ring is None:
                self.tally.take_late(frame)
        self._service_came = False
        self._copies = self._came = 0
        self._strange = max(0.0, self._strange - _FORGOTTEN)
        self._time.mark()

    def send_service(self, frame: bytes | None) -> None:
        """Send the service frame of this cycle."""
        if frame is not None:
            self._send(frame)

    def await_answers(self, service: ServiceChannel, deadline_ns: int) -> tuple[bool, bool, int]:
        """Wait for this cycle's answers; return complete, any came, and end time."""
        tally = self.tally
        if self._time.stretched:
            self._wait_for_all(service)
            return tally.missing == 0, tally.any_came or self._service_came, time.monotonic_ns()
        if service.waits:
            rest = min(_SERVICE_WAIT_NS, deadline_ns - time.monotonic_ns())
            self._wait(lambda: service.waits, service, rest, first=1)
        self._wait(lambda: tally.missing > 0, service, deadline_ns - time.monotonic_ns())
        answered_ns = time.monotonic_ns()
        whole = tally.missing == 0
        if whole and service.waits:
            rest = min(_SERVICE_WAIT_NS, deadline_ns - answered_ns)
            self._wait(lambda: service.waits, service, rest)
        return whole, tally.any_came or self._service_came, answered_ns

    def await_copies(self, service: ServiceChannel, deadline_ns: int) -> tuple[bool, bool, int]:
        """Wait for all frames that return on a ring; as `await_answers`.

        The master library sends at both ends: its frame, and one that only marks the ring's end.
        """
        ends = sum(not link.trouble() for link in self.links)
        wanted = ends * self.tally.frames
        now_ns = time.monotonic_ns()
        self._wait(lambda: self._copies < wanted or service.waits, service, deadline_ns - now_ns)
        any_came = self._copies > 0 or self._service_came
        return self._copies >= self.tally.frames, any_came, time.monotonic_ns()

    def collect(self, service: ServiceChannel) -> list[bytes]:
        """Receive and dispatch all waiting frames; return the master's."""
        own: list[bytes] = []
        for end, channel in enumerate(self._channels):
            for frame in waiting_on(channel):
                self._came += 1
                index = frame_index(frame)
                if index is None:
                    continue
                if self.ring is None and is_foreign(frame):
                    self.foreign += 1
                    continue
                if index >= FIRST_INDEX:
                    if self._is_whole(end, index, frame):
                        self._service_came |= service.receive(frame)
                elif index < N_INDICES:
                    own.append(frame)
                elif self.ring is None:
                    # Never sent here; a single one may be damaged.
                    self._strange += 1.0
                    self.foreign += self._strange > FEW
        return own

    def close(self) -> None:
        """Close the sockets; idempotent."""
        for channel in self._channels:
            channel.close()
        for link in self.links:
            link.close()
        self._channels = []

    def _send(self, frame: bytes) -> bool:
        end = 0
        if self.ring is not None:
            end = int(bool(self.links[0].trouble()))
            self.ring.sent(frame_index(frame) or 0, end)
        return transmit(self._channels[end], frame)

    def _is_whole(self, end: int, index: int, frame: bytes) -> bool:
        """Return whether a frame is an answer; resend one that saw only part of the ring."""
        if self.ring is None:
            return True
        other = 1 - end
        has_link = not self.links[other].trouble()
        if self.ring.is_whole(index, end, frame, other_has_link=has_link):
            return True
        return not transmit(self._channels[other], frame)

    def _wait_for_all(self, service: ServiceChannel) -> None:
        """Wait until nothing is in transit; missing answers are then lost."""
        tally = self.tally
        sent = tally.missing + service.waits
        give_up_ns = time.monotonic_ns() + _STALL_NS
        while tally.missing or service.waits:
            ready = False
            with contextlib.suppress(OSError, ValueError):
                ready = bool(select.select(self._channels, [], [], _POLL_S)[0])
            if ready:
                for frame in self.collect(service):
                    tally.receive(frame)
                continue
            stands_still = self.link_trouble() or time.monotonic_ns() > give_up_ns
            if stands_still or not self._time.on_their_way(sent, self._came):
                return

    def _wait(
        self, waiting: Callable[[], bool], service: ServiceChannel, time_ns: int, first: int = 0
    ) -> None:
        """Wait for frames on the channels from `first` on; process those of all."""
        channels, deadline = self._channels[first:], time.monotonic_ns() + time_ns
        while waiting():
            rest = deadline - time.monotonic_ns()
            try:
                ready, _, _ = select.select(channels, [], [], max(0.0, rest * 1e-9))
            except (OSError, ValueError):
                return
            if not ready:
                return
            for frame in self.collect(service):
                # On a ring the master reassembles the answers itself, from copies.
                self._copies += 1
                if self.ring is None:
                    self.tally.receive(frame)
