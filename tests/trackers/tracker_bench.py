"""Touches with a software tracker, without network: documents, windows of frames, and their U."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event, Thread
from time import sleep

import numpy as np
from scipy.spatial.transform import Rotation

from ocmm_core.acquisition.frames import FrameBlock, FrameRing
from ocmm_core.camera import Rig, TrackerDocument, load_rig, load_tracker, project
from ocmm_core.documents import resource
from ocmm_core.measuring import PointOptions, Refusal, StablePoint, average, systematic_covariance
from ocmm_core.tracking import ProbeBody, TrackingPipeline, load_probe, tip_sensitivity
from ocmm_sim.trackers import MarkerEncoder, MarkerErrors, TrackerServer
from ocmm_trackers import PROTOCOLS, TrackerSource, tracker_config, tracker_description

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
    protocol: str, path: Path, server: TrackerServer, connect_s: float = 5.0
) -> tuple[TrackerSource, FrameRing]:
    """Return a source of a server, not opened."""
    address = f"127.0.0.1:{server.port}"
    config, ring = tracker_config(protocol, PROBE, load_rig(path), address, "test")
    document = load_tracker(path)
    source = TrackerSource(
        tracker_description(config), PROTOCOLS[protocol](document), (config.host, config.port),
        document, load_rig(path), np.array(config.leds), connect_s,
    )  # fmt: skip
    return source, ring


@contextmanager
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
