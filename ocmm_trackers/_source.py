"""A tracker as a frame source, by OpenIGTLink over TCP."""

from __future__ import annotations

import socket

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
from ocmm_trackers._igtl import DeviceStatus, Message, Pose, SensorValues
from ocmm_trackers._proof import GeometryProof, judge_geometry, refuse
from ocmm_trackers._stream import MessageStream

_READ_S = 0.1
_CHUNK = 1 << 16
_OK = 1
_UNPROVEN = (
    "The markers do not prove unit and axes of the tracker yet: show it at least four markers of "
    "the probe, not in one plane."
)


class IgtlSource:
    """A `FrameSource` of the markers of one tracker.

    No frame passes before the markers of the probe, ``leds`` (L, 3), mm, prove unit and axes.
    """

    def __init__(
        self,
        description: SourceDescription,
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
        self.stream, self.builder = MessageStream(), FrameBuilder(document)
        self._socket: socket.socket | None = None
        self._proven = self._pressed = False
        self._reason = ""
        self._origin_ns = -1
        self._last: tuple[int, int] = (-1, 0)
        noise = document.noise
        self._sigma = float(np.hypot(noise.sigma_along, noise.rounding)) + noise.place_sigma

    def open(self) -> None:
        """Connect; AcquisitionError if no server answers."""
        try:
            self._socket = socket.create_connection(self._address, self._connect_s)
        except OSError as error:
            raise AcquisitionError(
                "igtl.connect",
                f"No tracker answers at {self._address[0]}:{self._address[1]} "
                f"({error.strerror or error}).",
                "Start the OpenIGTLink server of the tracker; check host, port and firewall.",
            ) from error
        self._socket.settimeout(_READ_S)
        # Markers that arrive late are worth less than small packets.
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self) -> Cycle:
        """Return the frames that have arrived; AcquisitionError if the tracker ends or is wrong."""
        data = self._receive()
        frames: list[MarkerFrame] = []
        flags: list[int] = []
        for message in self.stream.feed(data):
            frames += self._take(message)
            flags += [FrameFlag.BUTTON if self._pressed else 0] * (len(frames) - len(flags))
        if frames and self._origin_ns < 0:
            # Frames before the proof count as lost.
            self._origin_ns = frames[0].time_ns - self._period_ns
            self._last = (-1, self._origin_ns)
        kept = [(one, flag) for one, flag in zip(frames, flags, strict=True) if self._prove(one)]
        if not kept:
            why = self._reason or ("" if self._proven or not frames else _UNPROVEN)
            return Cycle(CycleVerdict.LATE, why)
        return self._cycle([one for one, _ in kept], [flag for _, flag in kept])

    def close(self) -> None:
        """End the connection; idempotent."""
        if self._socket is not None:
            self._socket.close()

    def _receive(self) -> bytes:
        if self._socket is None:
            raise AcquisitionError("igtl.closed", "The tracker is not open.", "Open the job again.")
        try:
            data = self._socket.recv(_CHUNK)
        except TimeoutError:
            return b""
        except OSError as error:
            data, why = b"", error.strerror or str(error)
        else:
            why = "closed"
        if not data:
            raise AcquisitionError(
                "igtl.closed",
                f"The tracker ended the connection ({why}).",
                "Check its program, cable and power, then open the job again.",
            )
        return data

    def _take(self, message: Message) -> list[MarkerFrame]:
        content = message.content
        if isinstance(content, Pose):
            return self.builder.take(content, message.time_ns)
        if isinstance(content, SensorValues) and message.device == self._document.button:
            self._pressed = bool(content.values and content.values[0] > 0.5)
        if isinstance(content, DeviceStatus):
            self._reason = (
                ""
                if content.code == _OK
                else f"The tracker reports status {content.code}: {content.text}."
            )
        return []

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
