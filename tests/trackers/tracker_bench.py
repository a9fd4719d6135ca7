"""Touches with a software tracker, without network: documents, windows of frames, and their U."""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import struct
import termios
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from ocmm_core.acquisition.frames import FrameBlock, FrameRing
from ocmm_core.camera import Rig, TrackerDocument, load_rig, load_tracker, project
from ocmm_core.documents import resource
from ocmm_core.geometry import rigid_fit
from ocmm_core.measuring import PointOptions, Refusal, StablePoint, average, systematic_covariance
from ocmm_core.tracking import FrameStatus, ProbeBody, TrackingPipeline, load_probe, tip_sensitivity
from ocmm_sim.trackers import MarkerEncoder, MarkerErrors, NdiEncoder, TrackerServer
from ocmm_trackers import TrackerSource, tracker_config

TRACKER = resource("rigs", "tracker.toml")
PROBE = resource("probes", "standard.toml")
BODY = load_probe(PROBE)
FRAMES = 25
_CHI2_95 = 7.815
_SLOTS = 8


def written(folder: Path, **values: object) -> Path:
    """Return the shipped document with other values, as TOML texts or numbers."""
    text = TRACKER.read_text("utf-8")
    for name, value in values.items():
        lines = [one for one in text.splitlines() if one.startswith(f"{name} = ")]
        assert len(lines) == 1, name
        shown = f'"{value}"' if isinstance(value, str) else value
        text = text.replace(lines[0], f"{name} = {shown}")
    path = folder / "tracker.toml"
    path.write_text(text, "utf-8")
    return path


def places_of(rng: np.random.Generator) -> np.ndarray:
    """Return the LEDs (6, 3) of a probe somewhere in the volume, mm."""
    turn = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3)).as_matrix()
    return BODY.leds_probe @ turn.T + rng.uniform(-80.0, 80.0, 3)


def source_to(
    protocol: str, path: Path, server: TrackerServer | Path, connect_s: float = 5.0
) -> tuple[TrackerSource, FrameRing]:
    """Return a source of a server, or of a serial line, not opened."""
    address = str(server) if isinstance(server, Path) else f"127.0.0.1:{server.port}"
    config, ring = tracker_config(protocol, PROBE, load_rig(path), address, "test")
    return TrackerSource(msgspec.structs.replace(config, connect_s=connect_s)), ring


@contextlib.contextmanager
def playing(
    server: TrackerServer, encoder: MarkerEncoder, frames: Sequence[tuple[np.ndarray, int]]
) -> Iterator[tuple[Event, Event]]:
    """Answer the client of a server; yield events that start the frames and report their end."""
    ended, opened, played = Event(), Event(), Event()

    def play() -> None:
        left = deque(frames)
        while not ended.is_set():
            if not server.accepted() or not left or not opened.is_set():
                sleep(1e-4)
                continue
            server.send(encoder.frame(*left.popleft()))
            if encoder.datagrams:
                # As fast as a device: the receive buffer of the system holds some 130 of them.
                sleep(3e-3)
            if not left:
                played.set()

    thread = Thread(target=play)
    thread.start()
    try:
        yield opened, played
    finally:
        ended.set()
        thread.join()


def measured(
    protocol: str,
    path: Path,
    encoder: MarkerEncoder,
    frames: Sequence[tuple[np.ndarray, int]],
    reasons: list[str] | None = None,
) -> tuple[TrackerSource, list[FrameBlock]]:
    """Return a source after all frames of a software tracker; errors as it raises them.

    ``reasons`` gets those of reads without frames.
    """
    server, blocks = TrackerServer(encoder), []
    source, ring = source_to(protocol, path, server)
    try:
        with playing(server, encoder, frames) as (opened, played):
            source.open()
            opened.set()
            while True:
                last = played.is_set()
                cycle = source.read()
                block = cycle.frames
                if reasons is not None and cycle.reason:
                    reasons.append(cycle.reason)
                blocks += [] if block is None else [block]
                if last and block is None:
                    return source, blocks
    finally:
        source.close()
        server.close()
        ring.close()


FIRST_NS = 1_764_500_000_000_000_000
_FAR = 49.0
"""Square of seven standard deviations: a tip farther away is wrong."""
_WITHIN_S = 20.0
_FLUSHED, _BYTES = 3, 1 << 12
"""Bits of a packet of a pseudo-terminal: its queues were flushed."""


class SerialTracker:
    """A device of NDI at the end of a serial line ``path``, in place of a `TrackerServer`.

    Pseudo-terminals carry no break; a line that is flushed both ways stands in for it. Bytes of
    another speed arrive as other ones. ``lose``: share of the bytes that it sends and are lost.
    """

    def __init__(self, encoder: NdiEncoder, path: Path, *, hears_break: bool = True) -> None:
        self._encoder, self.path, self._hears_break = encoder, path, hears_break
        self.lose = 0.0
        self._baud = encoder.baud
        self._ends: tuple[int, ...] = ()
        self.plug()

    def plug(self) -> None:
        """Connect the line, as after a cable was pulled out."""
        self._ends = os.openpty()
        fcntl.ioctl(self._ends[0], termios.TIOCPKT, struct.pack("i", 1))
        self.path.symlink_to(os.ttyname(self._ends[1]))

    def close(self) -> None:
        """Pull the cable out; idempotent."""
        self.path.unlink(missing_ok=True)
        for one in self._ends:
            os.close(one)
        self._ends = ()

    def restart(self) -> None:
        """Switch the device off and on."""
        greeting = self._encoder.restart()
        self._baud = self._encoder.baud
        self.send(greeting)

    def accepted(self) -> bool:
        """Answer requests; return whether a client waits for a frame. It does not wait."""
        while self._ends and select.select([self._ends[0]], [], [], 0.0)[0]:
            data = os.read(self._ends[0], _BYTES)
            if data[0] & _FLUSHED == _FLUSHED and self._hears_break:
                self.restart()
            if data[0] or not self._alike():
                continue
            self.send(self._encoder.answer(data[1:]))
            self._baud = self._encoder.baud
        return bool(self._ends) and self._encoder.ready

    def send(self, data: bytes) -> bool:
        """Return whether the line took the data."""
        rng = self._encoder.rng
        if not self._alike():
            data = rng.bytes(len(data))
        if self.lose:
            data = bytes(one for one, lost in zip(data, rng.random(len(data)) < self.lose,
                                                  strict=True) if not lost)  # fmt: skip
        with contextlib.suppress(OSError, IndexError):
            os.write(self._ends[0], data)
            return True
        return False

    def _alike(self) -> bool:
        """Return whether both ends have one speed; the other end is set by the client."""
        other = termios.tcgetattr(self._ends[0])[4] if self._ends else 0
        return bool(other == getattr(termios, f"B{self._baud}"))


class LiveDevice:
    """A device that runs in real time, with a probe at rest."""

    def __init__(self, server: TrackerServer | SerialTracker, encoder: MarkerEncoder) -> None:
        self.server, self.encoder, self.first_ns = server, encoder, FIRST_NS
        self.places: np.ndarray = places_of(np.random.default_rng(1))
        self.still = False
        """Its time stamps stand still."""
        self.sent_s = 0.0
        """When its last frame left, on the monotonic clock."""
        self.rate_hz: float = encoder.document.frame_rate_hz
        self._errors = MarkerErrors(encoder.document, 1)
        self._orders: list[Callable[[], object]] = []
        self._ended = Event()
        self._thread = Thread(target=self._run)

    def _run(self) -> None:
        start, sent = monotonic(), -1
        while not self._ended.is_set():
            while self._orders:
                self._orders[0]()
                self._orders.pop(0)
            number = int(self.rate_hz * (monotonic() - start))
            if self.server.accepted() and number > sent:
                time_ns = self.first_ns + (0 if self.still else round(number * 1e9 / self.rate_hz))
                self.server.send(self.encoder.frame(self._errors.reported(self.places), time_ns))
                sent, self.sent_s = number, monotonic()
            sleep(min(1e-3, 0.3 / self.rate_hz))

    def order(self, act: Callable[[], object]) -> None:
        """Let something happen between two frames."""
        self._orders.append(act)
        while self._orders:
            sleep(1e-3)

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        self._thread.start()
        try:
            yield
        finally:
            self._ended.set()
            self._thread.join()
            self.server.close()

    def judge(self, blocks: list[FrameBlock], rig: Rig) -> tuple[int, int]:
        """Return the numbers of right and wrong tips."""
        return tips_near(blocks, rig, self.places)


def tips_near(blocks: Sequence[FrameBlock], rig: Rig, places: np.ndarray) -> tuple[int, int]:
    """Return the numbers of right and wrong tips."""
    turn, shift = rigid_fit(BODY.leds_probe, places)
    tip = turn @ BODY.tip_probe + shift
    track, good, bad = TrackingPipeline(rig, BODY), 0, 0
    for block in blocks:
        found = track.process(block)
        for n in np.flatnonzero(found.status == FrameStatus.OK).tolist():
            away = found.tip_world[n] - tip
            far = away @ np.linalg.solve(found.tip_covariance[n], away)
            good, bad = good + (far <= _FAR), bad + (far > _FAR)
    return good, bad


def read(source: TrackerSource, frames: int) -> tuple[list[FrameBlock], list[str]]:
    """Return that many frames, and the reasons of the reads without any."""
    blocks: list[FrameBlock] = []
    reasons: list[str] = []
    deadline = monotonic() + _WITHIN_S
    while sum(map(len, blocks)) < frames:
        assert monotonic() < deadline, reasons[-1:]
        cycle = source.read()
        blocks += [] if cycle.frames is None else [cycle.frames]
        reasons += [cycle.reason] if cycle.reason and cycle.reason not in reasons else []
    return blocks, reasons


def require_gap(before: list[FrameBlock], after: list[FrameBlock], passed_s: float) -> None:
    """Require that frames after an interruption are those of their time."""
    counters, times = (
        np.concatenate([getattr(one, name) for one in before + after])
        for name in ("counter", "time_ns")
    )
    assert (np.diff(counters) > 0).all()
    assert (np.diff(times) > 0).all()
    # Those after it are ten, of 0.17 s at most.
    gap_s = float(after[0].time_ns[0] - before[-1].time_ns[-1]) * 1e-9
    assert passed_s - 1.0 < gap_s < passed_s + 0.1


@dataclass(slots=True)
class Bench:
    """A tracker by its document, and the real one."""

    rig: Rig
    document: TrackerDocument
    body: ProbeBody = BODY

    @classmethod
    def of(cls, path: Path) -> Bench:
        return cls(load_rig(path), load_tracker(path))

    def window(
        self, errors: MarkerErrors, rng: np.random.Generator
    ) -> tuple[FrameBlock, np.ndarray]:
        """Return frames of a probe that rests somewhere, and its true ball (3,)."""
        low, high = self.rig.volume_world
        tip = rng.uniform(low, high)
        turn = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3)).as_matrix()
        places = (self.body.leds_probe - self.body.tip_probe) @ turn.T + tip
        seen = np.array([errors.reported(places) for _ in range(FRAMES)])
        uv = np.full((FRAMES, 3, _SLOTS, 2), np.nan)
        for index, camera in enumerate(self.rig.cameras):
            shape = seen.shape[:2]
            uv[:, index, : shape[1]] = project(camera, seen.reshape(-1, 3)).reshape(*shape, 2)
        period = round(1e9 / self.rig.frame_rate_hz)
        counter = np.arange(FRAMES, dtype=np.int64)
        valid = np.full((FRAMES, 3), (1 << self.body.n_leds) - 1, np.uint64)
        block = FrameBlock(counter, (counter + 1) * period, np.zeros(FRAMES, np.uint32), valid, uv)
        return block, tip

    def point(self, block: FrameBlock) -> StablePoint | Refusal:
        track = TrackingPipeline(self.rig, self.body).process(block)
        return average(track, FRAMES, self.rig, PointOptions())

    def covariance(self, point: StablePoint) -> np.ndarray:
        """Return the covariance of a ball by noise, places and scale of the tracker.

        Without motion of the hand, of which there is none here.
        """
        exact = replace(self.body, geometry_covariance=np.zeros_like(self.body.geometry_covariance))
        of = tip_sensitivity(point.spots, self.rig, exact)
        systematic = systematic_covariance([of], self.rig, exact)
        found: np.ndarray = point.random_covariance - point.motion_covariance + systematic
        return found

    def touches(
        self, devices: int, each: int, seed: int, truth: TrackerDocument | None = None
    ) -> Iterator[tuple[StablePoint | Refusal, np.ndarray]]:
        """Yield points and true balls; ``truth``: the device as it is, if other than stated."""
        rng = np.random.default_rng([seed, 7])
        for device in range(devices):
            errors = MarkerErrors(truth or self.document, 1000 * seed + device)
            for _ in range(each):
                errors.restart()
                block, tip = self.window(errors, rng)
                yield self.point(block), tip


def inside(bench: Bench, point: StablePoint, tip: np.ndarray) -> bool:
    """Return whether a true ball lies in the stated 95 % ellipsoid."""
    error = point.tip_world - tip
    return bool(error @ np.linalg.solve(bench.covariance(point), error) <= _CHI2_95)
