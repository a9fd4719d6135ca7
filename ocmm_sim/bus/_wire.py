"""Main loop of software slaves on one interface, or on both of a ring.

Also the camera side of the virtual bus time, and the count of frames in transit.
"""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable

from ocmm_core.acquisition.frames import FrameRing, RingHeaderField
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.wire import LinkWatch
from ocmm_sim.bus._chain import Chain
from ocmm_sim.slave import ETHERTYPE


class CameraTime:
    """Clock of this computer, for a wire in real time."""

    stretched = False

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def taken(self, *, answered: bool) -> None:
        """Record that a frame was received, and whether an answer left."""

    def close(self) -> None:
        """Release resources; idempotent."""


class SteppedCameraTime(CameraTime):
    """Time set by the bus process in its ring file, see `SteppedTime`."""

    stretched = True

    def __init__(self, path: str) -> None:
        self._ring = FrameRing.attach(path)
        self._counts = [
            self._ring.word(RingHeaderField.FRAMES_TAKEN),
            self._ring.word(RingHeaderField.FRAMES_ANSWERED),
        ]

    def now_ns(self) -> int:
        if self._ring.word(RingHeaderField.BUS_STEPS):
            return self._ring.word(RingHeaderField.BUS_NOW_NS)
        return time.monotonic_ns() + self._ring.word(RingHeaderField.BUS_OFFSET_NS)

    def taken(self, *, answered: bool) -> None:
        counts = self._counts
        if answered:
            counts[1] += 1
            self._ring.set_word(RingHeaderField.FRAMES_ANSWERED, counts[1])
        # Last: a reader that sees the frame received finds its answer counted.
        counts[0] += 1
        self._ring.set_word(RingHeaderField.FRAMES_TAKEN, counts[0])

    def close(self) -> None:
        """Unmap the ring; idempotent."""
        self._ring.close()


_FRAME_BYTES = 2048
_SOL_PACKET, _PACKET_IGNORE_OUTGOING = 263, 23
_IDLE_S = 0.002
_HOUSEKEEPING_NS = 5_000_000
_LOOK_ROUNDS = 4
"""Watchdogs are checked every round, links and interface names every this many rounds."""


class LinkPort:
    """Raw socket on an interface that may vanish and return; BusError if not opened."""

    def __init__(self, interface: str) -> None:
        self.interface = interface
        self.link = LinkWatch(interface)
        try:
            self._index = socket.if_nametoindex(interface)
            self._socket = _open(interface)
        except OSError as error:
            self.link.close()
            raise BusError(
                "bus.software_camera",
                f"The software cameras cannot use interface '{interface}' ({error.strerror}).",
                "Give an interface that exists and that this user may open.",
            ) from error

    def fileno(self) -> int:
        return self._socket.fileno()

    def receive(self) -> bytearray | None:
        try:
            return bytearray(self._socket.recv(_FRAME_BYTES))
        except OSError:
            # Empty, or the link is down; it may return.
            return None

    def send(self, frame: bytearray | bytes) -> bool:
        """Send a frame; return whether it left; failed frames are lost, as on a cable."""
        try:
            self._socket.send(frame)
            return True
        except OSError:
            # A link that is down refuses at once; the pause prevents spinning.
            time.sleep(1e-4)
            return False

    def renew(self) -> None:
        """Reopen the interface if another one has its name now."""
        try:
            index = socket.if_nametoindex(self.interface)
            if index == self._index:
                return
            renewed = _open(self.interface)
        except OSError:
            return
        self._socket.close()
        self._socket, self._index = renewed, index

    def close(self) -> None:
        self._socket.close()
        self.link.close()


class Wire:
    """Software cameras on an Ethernet link, or between the two ends of a ring."""

    def __init__(
        self,
        interface: str,
        chain: Chain,
        second_interface: str = "",
        camera_time: CameraTime | None = None,
    ) -> None:
        self._time = camera_time or CameraTime()
        self.chain = chain
        self._ports = [LinkPort(interface)]
        if second_interface:
            try:
                self._ports.append(LinkPort(second_interface))
            except BaseException:
                self.close()
                raise

    def run(self, stopping: Callable[[], bool]) -> None:
        """Answer until `stopping`, polled every few milliseconds, returns True."""
        housekeeping = rounds = 0
        while True:
            now = time.monotonic_ns()
            if now - housekeeping > _HOUSEKEEPING_NS:
                housekeeping = now
                for unit in self.chain.units:
                    unit.slave.esc.poll(self._time.now_ns())
                rounds += 1
                if rounds % _LOOK_ROUNDS == 0:
                    for port in self._ports:
                        port.renew()
                    self._look_at_links()
                if stopping():
                    return
            at_ns = self._time.now_ns()
            # One camera at a time, so that an answer waits for one chunk at most.
            if any(unit.powered and unit.slave.generate(at_ns) for unit in self.chain.units):
                self._answer_all()
                continue
            ready, _, _ = select.select(self._ports, [], [], _IDLE_S)
            if ready and not self._answer_all():
                # A port without link is always ready and never has data.
                time.sleep(_IDLE_S)

    def close(self) -> None:
        self._time.close()
        for port in self._ports:
            port.close()

    def _look_at_links(self) -> None:
        """Let the end cameras return frames if their link is down."""
        links = [not port.link.trouble() for port in self._ports]
        if len(links) > 1 and links != self.chain.links:
            self.chain.links = links
            self.chain.lay()

    def _answer_all(self) -> bool:
        if self._time.stretched:
            return self._answer_together()
        answered = False
        for number, port in enumerate(self._ports):
            while (frame := port.receive()) is not None:
                answered = True
                leaves = self._work_on(frame, number, time.monotonic_ns())
                if leaves is not None:
                    self._ports[leaves].send(frame)
        return answered

    def _answer_together(self) -> bool:
        """Answer all waiting frames together: the master wakes up once."""
        done: list[tuple[bytearray, int | None]] = []
        for number, port in enumerate(self._ports):
            while (frame := port.receive()) is not None:
                now_ns = self._time.now_ns()
                if not done:
                    # All exposed frames must be included, however slow this computer is.
                    for unit in self.chain.units:
                        unit.slave.keep_up(now_ns)
                done.append((frame, self._work_on(frame, number, now_ns)))
        for frame, leaves in done:
            sent = leaves is not None and self._ports[leaves].send(frame)
            self._time.taken(answered=sent)
        return bool(done)

    def _work_on(self, frame: bytearray, number: int, now_ns: int) -> int | None:
        """Process a frame; return the port where it leaves, or None."""
        way = self.chain.ways[number]
        if not way.segment.process(frame, now_ns):
            return None
        return way.leaves


def _open(interface: str) -> socket.socket:
    made = socket.socket(
        socket.AF_PACKET, socket.SOCK_RAW | socket.SOCK_NONBLOCK, socket.htons(ETHERTYPE)
    )
    try:
        # Querying the origin of each frame would cost another system call.
        made.setsockopt(_SOL_PACKET, _PACKET_IGNORE_OUTGOING, 1)
        made.bind((interface, ETHERTYPE))
    except OSError:
        made.close()
        raise
    return made
