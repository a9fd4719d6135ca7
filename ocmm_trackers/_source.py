"""A tracker as a frame source, by any of its protocols, over a stream (TCP) or datagrams (UDP)."""

from __future__ import annotations

import select
import socket
import time

import numpy as np

from ocmm_core.acquisition.frames import (
    Cycle,
    CycleVerdict,
    FrameBlock,
    FrameFlag,
    SourceDescription,
)
from ocmm_core.camera import REACH_MM, Rig, TrackerDocument, project
from ocmm_core.errors import AcquisitionError
from ocmm_core.geometry import Float
from ocmm_trackers._frames import FrameBuilder, MarkerFrame
from ocmm_trackers._messages import Decoder, DeviceStatus, Message, Pose, SensorValues
from ocmm_trackers._proof import GeometryProof, judge_geometry, refuse

_CHUNK = 1 << 16
_MOST_WAITING = 64
"""Packets of one read."""


class TrackerLink:
    """A connection to one computer, whose datagrams alone are received; OSError if it fails."""

    def __init__(self, address: tuple[str, int], *, datagrams: bool, connect_s: float) -> None:
        self._datagrams, self._address = datagrams, address
        if datagrams:
            self._address = (socket.gethostbyname(address[0]), address[1])
            self._sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM)]
        else:
            self._sockets = [socket.create_connection(address, connect_s)]
            # Markers that arrive late are worth less than small packets.
            self._sockets[0].setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data: bytes) -> None:
        """Send bytes, as one datagram if it sends these."""
        if self._datagrams:
            self._sockets[0].sendto(data, self._address)
        else:
            self._sockets[0].sendall(data)

    def receive(self, wait_s: float) -> list[bytes]:
        """Return the bytes received within a wait, s; AcquisitionError at the end."""
        found: list[bytes] = []
        while len(found) < _MOST_WAITING:
            ready = select.select(self._sockets, [], [], 0.0 if found else wait_s)[0]
            if not ready:
                break
            for one in ready:
                data, why = b"", "closed"
                try:
                    data, sender = one.recvfrom(_CHUNK)
                except OSError as error:
                    why = error.strerror or str(error)
                if self._datagrams:
                    found.append(data if data and sender[0] == self._address[0] else b"")
                elif data:
                    found.append(data)
                else:
                    raise AcquisitionError(
                        "tracker.closed",
                        f"The tracker ended the connection ({why}).",
                        "Check its program, cable and power, then open the job again.",
                    )
        return found

    def join(self, group: str, port: int) -> None:
        """Receive datagrams to a multicast address also."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as route:
            # Of several interfaces, the one towards the tracker.
            route.connect(self._address)
            local = route.getsockname()[0]
        one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sockets.append(one)
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        one.bind((group, port))
        both = socket.inet_aton(group) + socket.inet_aton(local)
        one.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, both)

    def close(self) -> None:
        """End the connection; idempotent."""
        for one in self._sockets:
            one.close()


_OK = 1
_UNPROVEN = (
    "The markers do not prove unit and axes of the tracker yet: show it at least four markers of "
    "the probe, not in one plane."
)


class TrackerSource:
    """A `FrameSource` of the markers of one tracker.

    No frame passes before the markers of the probe, ``leds`` (L, 3), mm, prove unit and axes.
    """

    def __init__(
        self,
        description: SourceDescription,
        decoder: Decoder,
        address: tuple[str, int],
        document: TrackerDocument,
        rig: Rig,
        leds: Float,
        connect_s: float,
    ) -> None:
        self.description = description
        self._address, self._connect_s = address, connect_s
        self._document, self._rig, self._leds = document, rig, leds
        self._period_ns = description.frame_period_ns
        self.decoder, self.builder = decoder, FrameBuilder(document)
        self._link: TrackerLink | None = None
        self._proven = self._pressed = False
        self._reason = ""
        self._origin_ns = -1
        self._last: tuple[int, int] = (-1, 0)
        noise = document.noise
        self._sigma = float(np.hypot(noise.sigma_along, noise.rounding)) + noise.place_sigma

    def open(self) -> None:
        """Connect; AcquisitionError if no tracker answers."""
        deadline = time.monotonic() + self._connect_s
        try:
            self._link = TrackerLink(
                self._address, datagrams=self.decoder.datagrams, connect_s=self._connect_s
            )
            while not self.decoder.ready and time.monotonic() < deadline:
                self._receive()
            if self.decoder.group is not None:
                self._link.join(*self.decoder.group)
        except OSError as error:
            raise self._absent(error.strerror or str(error)) from error
        if not self.decoder.ready:
            raise self._absent("no reply")

    def read(self) -> Cycle:
        """Return the frames that have arrived; AcquisitionError if the tracker ends or is wrong."""
        frames: list[MarkerFrame] = []
        flags: list[int] = []
        for message in self._receive():
            frames += self._completed_frames(message)
            flags += [FrameFlag.BUTTON if self._pressed else 0] * (len(frames) - len(flags))
        if frames and self._origin_ns < 0:
            # Frames before the proof count as lost.
            self._origin_ns = frames[0].time_ns - self._period_ns
            self._last = (-1, self._origin_ns)
        kept = [(one, flag) for one, flag in zip(frames, flags, strict=True) if self._prove(one)]
        if not kept:
            return Cycle(CycleVerdict.LATE, self._reason or self._unproven(len(frames)))
        return self._cycle([one for one, _ in kept], [flag for _, flag in kept])

    def close(self) -> None:
        """End the connection; idempotent."""
        if self._link is not None:
            self._link.close()

    def _receive(self) -> list[Message]:
        """Send requests that are due, and return the messages received."""
        if self._link is None:
            raise AcquisitionError(
                "tracker.closed", "The tracker is not open.", "Open the job again."
            )
        request = self.decoder.requests(time.monotonic())
        if request:
            self._link.send(request)
        found: list[Message] = []
        for data in self._link.receive(self.decoder.wait_s):
            found += self.decoder.push(data)
        return found

    def _absent(self, why: str) -> AcquisitionError:
        return AcquisitionError(
            "tracker.connect",
            f"No tracker answers at {self._address[0]}:{self._address[1]} ({why}).",
            f"Start the tracker and its output by {self.decoder.name}; check host, port and "
            "firewall.",
        )

    def _completed_frames(self, message: Message) -> list[MarkerFrame]:
        content = message.content
        if isinstance(content, Pose):
            return self.builder.add(content, message.time_ns)
        if isinstance(content, SensorValues) and message.device == self._document.button:
            self._pressed = bool(content.values and content.values[0] > 0.5)
        if isinstance(content, DeviceStatus):
            self._reason = (
                ""
                if content.code == _OK
                else f"The tracker reports status {content.code}: {content.text}."
            )
        return []

    def _unproven(self, frames: int) -> str:
        if self._proven or not (frames or self.builder.strangers):
            return ""
        if self.builder.account.used or not self.builder.strangers:
            return _UNPROVEN
        return (
            "The tracker sends no marker named in its document; it sends "
            f"{', '.join(self.builder.strangers)}."
        )

    def _prove(self, frame: MarkerFrame) -> bool:
        if not self._proven:
            found = judge_geometry(frame.places, self._leds, self._sigma)
            refuse(found, self._document.device_unit)
            self._proven = found is GeometryProof.PROVEN
        return self._proven

    def _cycle(self, frames: list[MarkerFrame], flags: list[int]) -> Cycle:
        counters, lost = [], 0
        for one in frames:
            counter, before_ns = self._last
            step = max(1, round((one.time_ns - before_ns) / self._period_ns))
            lost += step - 1
            self._last = (counter + step, one.time_ns)
            counters.append(self._last[0])
        uv = np.full((len(frames), len(self._rig.cameras), self.description.n_slots, 2), np.nan)
        places = np.array([one.places for one in frames])
        where = self._within(places)
        for index, camera in enumerate(self._rig.cameras):
            uv[:, index, : places.shape[1]][where] = project(camera, places[where])
        bits = np.uint64(1) << np.arange(places.shape[1], dtype=np.uint64)
        valid = np.where(where, bits, np.uint64(0)).sum(axis=1, dtype=np.uint64)
        block = FrameBlock(
            counter=np.array(counters, np.int64),
            time_ns=np.array([one.time_ns for one in frames], np.int64) - self._origin_ns,
            flags=np.array(flags, np.uint32),
            valid=np.repeat(valid[:, None], len(self._rig.cameras), axis=1),
            uv=uv,
        )
        return Cycle(CycleVerdict.GOOD, frames=block, elapsed=len(frames), frames_lost=lost,
                     skipped=CycleVerdict.GOOD)  # fmt: skip

    def _within(self, places: Float) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Return the markers (n, M) about the volume, outside of which no noise is stated."""
        low, high = self._rig.volume_world
        with np.errstate(invalid="ignore"):
            inside = (places >= low - REACH_MM) & (places <= high + REACH_MM)
        return np.asarray(inside.all(axis=2))
