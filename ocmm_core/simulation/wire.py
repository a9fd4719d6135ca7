"""The loop that lets a segment of software slaves answer on a network interface."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_core.errors import BusError
from ocmm_core.simulation.registers import OP
from ocmm_core.simulation.segment import ETHERTYPE, Segment
from ocmm_core.simulation.software_camera import SoftwareCamera

_FRAME_BYTES = 2048
_IDLE_S = 0.002
_HOUSEKEEPING_NS = 5_000_000


@dataclass(frozen=True, slots=True)
class Faults:
    """What goes wrong on the wire, on purpose and the same every time.

    Attributes
    ----------
    drop
        Part of the answers that get lost while the cameras are in operation, 0 to 1.
    seed
        Which ones.
    """

    drop: float = 0.0
    seed: int = 0


class Wire:
    """Software cameras on one end of an Ethernet link.

    Parameters
    ----------
    interface
        Network interface to answer on.
    cameras
        In the order in which a frame passes them.
    faults
        What goes wrong.
    """

    def __init__(
        self, interface: str, cameras: Sequence[SoftwareCamera], faults: Faults | None = None
    ) -> None:
        self.cameras = tuple(cameras)
        self._faults = faults or Faults()
        self._segment = Segment([camera.esc for camera in self.cameras])
        self._random = np.random.default_rng(self._faults.seed)
        self._socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETHERTYPE))
        try:
            self._socket.bind((interface, ETHERTYPE))
        except OSError as error:
            self._socket.close()
            raise BusError(
                "bus.software_camera",
                f"The software cameras cannot use interface '{interface}' ({error.strerror}).",
                "Give an interface that exists and that this user may open.",
            ) from error
        self._socket.setblocking(False)

    def run(self, stopping: Callable[[], bool]) -> None:
        """Answer until ``stopping``, asked every few milliseconds, says so."""
        housekeeping = 0
        while True:
            answered = self._answer_all()
            now = time.monotonic_ns()
            if now - housekeeping > _HOUSEKEEPING_NS:
                housekeeping = now
                for camera in self.cameras:
                    camera.esc.poll(now)
                if stopping():
                    return
            if answered:
                continue
            # One camera at a time, so that an answer never waits for more than one chunk.
            busy = any(camera.generate(now) for camera in self.cameras)
            if not busy:
                select.select([self._socket], [], [], _IDLE_S)

    def close(self) -> None:
        """Give the interface back."""
        self._socket.close()

    def _answer_all(self) -> bool:
        answered = False
        while True:
            try:
                content, origin = self._socket.recvfrom(_FRAME_BYTES)
            except BlockingIOError:
                return answered
            except OSError:
                # The link went down; it may come back.
                time.sleep(_IDLE_S)
                return answered
            if origin[2] == socket.PACKET_OUTGOING:
                continue
            answered = True
            frame = bytearray(content)
            if not self._segment.process(frame, time.monotonic_ns()):
                continue
            if self._lose():
                continue
            try:
                self._socket.send(frame)
            except OSError:
                time.sleep(_IDLE_S)

    def _lose(self) -> bool:
        if not self._faults.drop or any(camera.esc.state != OP for camera in self.cameras):
            return False
        return bool(self._random.random() < self._faults.drop)
