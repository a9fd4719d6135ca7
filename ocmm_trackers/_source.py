"""A tracker as a frame source, by any of its protocols, over the network or a serial line."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np

from ocmm_core.acquisition.bus_process import ProcessConfig
from ocmm_core.acquisition.frames import (
    Cycle,
    CycleVerdict,
    FrameBlock,
    FrameFlag,
    SourceDescription,
)
from ocmm_core.camera import REACH_MM, TrackerDocument, Vector3, project, tracker_rig
from ocmm_core.errors import AcquisitionError
from ocmm_core.geometry import Float
from ocmm_trackers._frames import (
    LEAST_MARKERS,
    FrameBuilder,
    GeometryProof,
    MarkerFrame,
    judge_geometry,
    refuse,
)  # fmt: skip
from ocmm_trackers._igtl import IgtlDecoder
from ocmm_trackers._link import SerialLink, TrackerLink
from ocmm_trackers._messages import Decoder, DeviceStatus, Message, Pose, SensorValues
from ocmm_trackers._motion_capture import NatNetDecoder, QtmDecoder
from ocmm_trackers._ndi import NdiDecoder

_OK = 1
_UNPROVEN = (
    "The markers do not prove unit and axes of the tracker yet: show it at least four markers of "
    "the probe, not in one plane."
)
_UNLIKE = (
    "No four markers have the distances of the probe: the tool definition is another one, or the "
    "probe is."
)
_CONNECTION = frozenset({
    "ndi.no_tool", "ndi.refused", "qtm.refused", "tracker.clock_step", "tracker.closed",
    "tracker.connect", "tracker.line_absent", "tracker.line_held", "tracker.line_rights",
    "tracker.line_silent", "tracker.silent", "tracker.stream",
})  # fmt: skip
"""Errors that end while a job is open: the connection is made again. Others are of documents."""
_RETRY_S, _RECONNECT_S = 0.2, 1.0


PROTOCOLS: dict[str, type[Decoder]] = {
    "igtl": IgtlDecoder, "natnet": NatNetDecoder, "ndi": NdiDecoder, "qtm": QtmDecoder,
}  # fmt: skip
"""By the prefixes of their sources."""


class TrackerConfig(ProcessConfig, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A tracker, the probe that proves its unit and axes, and the ring for its frames."""

    name: str
    protocol: str
    """Name in `PROTOCOLS`."""
    ring_path: str
    host: str
    port: int
    """`host`, `port`: of its computer, or a serial line and 0."""
    document: TrackerDocument
    """As calibrated."""
    leds: tuple[Vector3, ...]
    serials: tuple[int, ...]
    period_ns: int
    n_slots: int
    stretched: bool = False
    """A virtual tracker, whose time waits for this computer."""
    connect_s: float


def tracker_description(config: TrackerConfig) -> SourceDescription:
    return SourceDescription(
        name=config.name,
        camera_serials=config.serials,
        frame_period_ns=config.period_ns,
        cycle_period_ns=config.period_ns,
        live=True,
        simulated=config.stretched,
        stretched=config.stretched,
        n_slots=config.n_slots,
    )


class TrackerSource:
    """A `FrameSource` of the markers of one tracker; it connects again after an interruption.

    No frame passes before the markers of the probe prove unit and axes, also after an interruption.
    """

    def __init__(self, config: TrackerConfig) -> None:
        self.description = tracker_description(config)
        self._address, self._connect_s = (config.host, config.port), config.connect_s
        self._document, self._leds = config.document, np.array(config.leds)
        self._rig = tracker_rig(config.document, "")
        protocol, noise = PROTOCOLS[config.protocol], config.document.noise
        self._period_ns = config.period_ns
        self.decoder, self.builder = protocol(config.document), FrameBuilder(config.document)
        self._link: TrackerLink | SerialLink | None = None
        self._connecting: Iterator[None] | None = None
        self._proven = self._pressed = self._unlike = False
        self._reason = self._interrupted = ""
        self._origin_ns: int | None = None
        self._last: tuple[int, int] = (-1, 0)
        """Counter and time of the last frame, ns."""
        self._last_s = self._heard_s = 0.0
        self._heard = 0
        self._silence_s = math.inf if config.stretched else protocol.silence_s
        self._sigma = float(np.hypot(noise.sigma_along, noise.rounding)) + noise.place_sigma

    def open(self) -> None:
        """Connect; AcquisitionError if no tracker answers."""
        for _ in self._connect(self._connect_s):
            pass

    def read(self) -> Cycle:
        """Return the frames that have arrived.

        AcquisitionError if the tracker is wrong; if it ends, no frames until it is there again.
        """
        try:
            if self._connecting is None:
                return self._read()
            next(self._connecting)
        except StopIteration:
            self._connecting = None
        except AcquisitionError as error:
            if error.code not in _CONNECTION:
                raise
            self._interrupted = error.what
            self._connecting = self._connect(min(self._connect_s, _RECONNECT_S), _RETRY_S)
        return Cycle(CycleVerdict.LATE, self._interrupted)

    def close(self) -> None:
        if self._link is not None:
            self._link.close()

    def _connect(self, network_s: float, after_s: float = 0.0) -> Iterator[None]:
        """Connect, in steps of at most a second; AcquisitionError if no tracker answers."""
        self.close()
        time.sleep(after_s)
        account = self.decoder.account
        self.decoder = type(self.decoder)(self._document)
        self.decoder.account = account
        self.builder.restart()
        self._proven, self._origin_ns, self._pressed = False, None, False
        try:
            if self._address[1]:
                self._link = TrackerLink(
                    self._address, datagrams=self.decoder.datagrams, connect_s=network_s
                )
            else:
                self._link = SerialLink(self._address[0], self._connect_s)
                yield from self._link.start()
                self.decoder.baud = self._link.baud
            deadline = time.monotonic() + self._connect_s
            while not self.decoder.ready and time.monotonic() < deadline:
                self._receive()
                yield
            if self.decoder.group is not None and isinstance(self._link, TrackerLink):
                self._link.join(*self.decoder.group)
        except OSError as error:
            raise self._absent(error.strerror or str(error)) from error
        if not self.decoder.ready:
            raise self._absent("no reply")
        self._heard_s = time.monotonic()

    def _read(self) -> Cycle:
        frames: list[MarkerFrame] = []
        flags: list[int] = []
        for message in self._receive():
            frames += self._completed_frames(message)
            flags += [FrameFlag.BUTTON if self._pressed else 0] * (len(frames) - len(flags))
        self._require_messages()
        if frames and self._origin_ns is None:
            # Frames before the proof count as lost, as do those of an interruption.
            passed_ns = round(1e9 * (time.monotonic() - self._last_s)) if self._last_s else 0
            passed_ns = max(passed_ns, self._period_ns)
            self._origin_ns = frames[0].time_ns - self._last[1] - passed_ns
        kept = [(one, flag) for one, flag in zip(frames, flags, strict=True) if self._prove(one)]
        if not kept:
            return Cycle(CycleVerdict.LATE, self._reason or self._unproven(len(frames)))
        self._last_s = time.monotonic()
        return self._cycle([one for one, _ in kept], [flag for _, flag in kept])

    def _receive(self) -> list[Message]:
        """Send requests that are due, and return the messages received."""
        assert self._link is not None  # noqa: S101 - opened before
        request = self.decoder.requests(time.monotonic())
        if request:
            self._link.send(request)
        found: list[Message] = []
        for data in self._link.receive(self.decoder.wait_s):
            found += self.decoder.push(data)
        return found

    def _require_messages(self) -> None:
        heard = self.decoder.account.decoded + self.decoder.account.unread
        if heard != self._heard:
            self._heard, self._heard_s = heard, time.monotonic()
        elif time.monotonic() - self._heard_s > self._silence_s:
            raise AcquisitionError(
                "tracker.silent",
                f"The tracker has sent nothing for {self._silence_s:.0f} s.",
                f"Check its cable and power, and its output by {self.decoder.name}.",
            )

    def _absent(self, why: str) -> AcquisitionError:
        place = "{}:{}".format(*self._address) if self._address[1] else self._address[0]
        return AcquisitionError(
            "tracker.connect",
            f"No tracker answers at {place} ({why}).",
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
        if self._unlike:
            return _UNLIKE
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
            self._unlike = np.isfinite(frame.places[:, 0]).sum() >= LEAST_MARKERS
        return self._proven

    def _cycle(self, frames: list[MarkerFrame], flags: list[int]) -> Cycle:
        counters, times, lost = [], [], 0
        for one in frames:
            counter, before_ns = self._last
            time_ns = one.time_ns - (self._origin_ns or 0)
            step = max(1, round((time_ns - before_ns) / self._period_ns))
            lost += step - 1
            self._last = (counter + step, time_ns)
            counters.append(counter + step)
            times.append(time_ns)
        uv = np.full((len(frames), len(self._rig.cameras), self.description.n_slots, 2), np.nan)
        places = np.array([one.places for one in frames])
        where = self._within(places)
        for index, camera in enumerate(self._rig.cameras):
            uv[:, index, : places.shape[1]][where] = project(camera, places[where])
        bits = np.uint64(1) << np.arange(places.shape[1], dtype=np.uint64)
        valid = np.where(where, bits, np.uint64(0)).sum(axis=1, dtype=np.uint64)
        block = FrameBlock(
            counter=np.array(counters, np.int64),
            time_ns=np.array(times, np.int64),
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
