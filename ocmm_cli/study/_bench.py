"""``ocmm bench``: speed of the hot path, and memory of a long run.

Speeds are ratios of CPU times, immune to a busy machine. The long run is the whole chain, with the
virtual rig at full speed.
"""

from __future__ import annotations

import importlib
import importlib.util
import itertools
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import Progress

from ocmm_cli.terminal import PlainConsole, print_grid
from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import USUAL_SLOTS, CameraModel, Rig, load_rig, project
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, rotation_xyz
from ocmm_core.host import HOST
from ocmm_core.tracking import ProbeBody, TrackingPipeline, load_probe, solve

PEER_LIMIT = 10.0
REAL_TIME_LIMIT = 20.0
_FRAME_RATE_HZ = 8000
_BLOCK = 80


@dataclass(frozen=True, slots=True)
class BenchRow:
    """One figure: name, value, comparison, and the ratio with its limit."""

    name: str
    value: str
    against: str
    ratio: float
    limit: float


def run_bench(seconds: float, console: PlainConsole) -> None:
    rows = measure_speed(seconds)
    cells = [
        (row.name, row.value, row.against, f"{row.ratio:.1f}", f"at least {row.limit:g}")
        for row in rows
    ]
    columns = ("Figure", "Value", "Against", "Ratio", "Wanted")
    print_grid(console, columns, cells, "Hot path of this machine, one core")
    if not _has_opencv():
        console.print(
            "The OpenCV comparison needs opencv-python-headless, a development dependency."
        )


def measure_speed(seconds: float) -> list[BenchRow]:
    """Return the figures, each measured for about ``seconds``."""
    rig = load_rig(resource("rigs", "thesis.toml"))
    body = eight_leds(load_probe(resource("probes", "standard.toml")))
    frames = random_frames(rig, body, 4 * _BLOCK, seed=1)
    sigma = rig.noise.white_px
    ours = _per_call(lambda: solve(frames[:_BLOCK], rig, body, sigma), seconds) / _BLOCK
    rows = []
    if _has_opencv():
        chain = _opencv_chain(rig, body)
        peer = _per_call(lambda: chain(frames[:_BLOCK]), seconds) / _BLOCK
        rows.append(
            BenchRow(
                "8 LEDs x 2 cameras: tip, covariance, chi-square",
                f"{ours * 1e6:.2f} us per frame",
                f"OpenCV and numpy, all frames at once, no covariance: {peer * 1e6:.1f} us",
                peer / ours,
                PEER_LIMIT,
            )
        )
    single = _per_call(lambda: solve(frames[:1], rig, body, sigma), seconds)
    rows.append(
        BenchRow(
            "The same, one frame a call",
            f"{single * 1e6:.1f} us a call",
            f"{1e6 / _FRAME_RATE_HZ:.0f} us between two frames",
            1.0 / (_FRAME_RATE_HZ * single),
            REAL_TIME_LIMIT,
        )
    )
    track = _per_block(rig, body, frames, seconds)
    rows.append(
        BenchRow(
            "Tracking in blocks of 10 ms at 8 kHz",
            f"{track * 1e3:.3f} ms per block",
            "10 ms of real time",
            _BLOCK / _FRAME_RATE_HZ / track,
            REAL_TIME_LIMIT,
        )
    )
    return rows


def eight_leds(body: ProbeBody) -> ProbeBody:
    """Return the body with LEDs added up to eight, the largest case."""
    more = np.array([[-18.0, -24.0, 236.0], [24.0, 28.0, 132.0]])
    leds = np.concatenate([body.leds_probe, more])
    return replace(
        body,
        leds_probe=leds,
        led_directions_probe=np.tile([0.0, -1.0, 0.0], (len(leds), 1)),
        geometry_covariance=np.zeros((3 * len(leds) + 3,) * 2),
    )


def random_frames(rig: Rig, body: ProbeBody, count: int, seed: int) -> Float:
    """Return spots (n, C, L, 2), px, of random poses, tilt up to 45 degrees, with white noise."""
    rng = np.random.default_rng(seed)
    uv = np.empty((count, len(rig.cameras), body.n_leds, 2))
    for frame in range(count):
        angles = rng.uniform(-1.0, 1.0, 3) * np.radians([45.0, 45.0, 10.0])
        origin = rng.uniform(-1.0, 1.0, 3) * np.array([150.0, 80.0, 100.0])
        leds_world = body.leds_probe @ rotation_xyz(*angles).T + origin
        for c, camera in enumerate(rig.cameras):
            uv[frame, c] = project(camera, leds_world)
    return uv + rig.noise.white_px * rng.standard_normal(uv.shape)


def _per_call(work: Callable[[], object], seconds: float) -> float:
    """Return the CPU time of one call: median of ten groups, after a warm-up call."""
    work()
    start = time.thread_time()
    work()
    repeat = max(1, int(seconds / 10.0 / max(time.thread_time() - start, 1e-7)))
    times = []
    for _ in range(10):
        start = time.thread_time()
        for _ in range(repeat):
            work()
        times.append((time.thread_time() - start) / repeat)
    return float(np.median(times))


def _per_block(rig: Rig, body: ProbeBody, frames: Float, seconds: float) -> float:
    uv = np.full((_BLOCK, len(rig.cameras), USUAL_SLOTS, 2), np.nan)
    # One pose held with noise: labels are found once, as in real use.
    noise = rig.noise.white_px * np.random.default_rng(2).standard_normal(frames[:_BLOCK].shape)
    uv[:, :, : body.n_leds] = frames[0] + noise
    block = FrameBlock(
        counter=np.arange(_BLOCK, dtype=np.int64),
        time_ns=np.arange(_BLOCK, dtype=np.int64) * 125_000,
        flags=np.zeros(_BLOCK, dtype=np.uint32),
        valid=np.full((_BLOCK, len(rig.cameras)), 0xFF, dtype=np.uint64),
        uv=uv,
    )
    pipeline = TrackingPipeline(rig, body)
    turn = itertools.count()

    def track() -> None:
        # Times must advance: a repeated block would be an interruption, and labels be searched.
        first = next(turn) * _BLOCK
        pipeline.process(
            replace(block, counter=block.counter + first, time_ns=block.time_ns + first * 125_000)
        )

    return _per_call(track, seconds)


def _has_opencv() -> bool:
    return importlib.util.find_spec("cv2") is not None


def _opencv_chain(rig: Rig, body: ProbeBody) -> Callable[[Float], Float]:
    """Return a competent OpenCV and numpy implementation: spots (n, 2, L, 2) to tips (n, 3).

    One call undistorts all spots of a camera, another triangulates all points of all frames, and
    one stacked singular value decomposition gives the rigid fits (Kabsch, determinant +1). It has
    neither covariance nor refinement: less than the code it is compared with.
    """
    cv2: Any = importlib.import_module("cv2")
    cv2.setNumThreads(1)
    matrices, lenses, projections = [], [], []
    for camera in rig.cameras[:2]:
        matrices.append(_camera_matrix(camera))
        f = camera.focal
        lenses.append(np.array([camera.k1 * f**2, camera.k2 * f**4, camera.p1 * f, camera.p2 * f]))
        pose = camera.T_camera_from_world
        projections.append(np.hstack([pose.rotation, pose.translation[:, None]]))
    middle = body.leds_probe.mean(axis=0)
    arms = body.leds_probe - middle

    def chain(spots: Float) -> Float:
        n, _, n_leds, _ = spots.shape
        ideal = [
            cv2.undistortPoints(spots[:, c].reshape(-1, 1, 2), matrices[c], lenses[c])[:, 0].T
            for c in (0, 1)
        ]
        homogeneous = cv2.triangulatePoints(projections[0], projections[1], *ideal)
        points = (homogeneous[:3] / homogeneous[3]).T.reshape(n, n_leds, 3)
        centres = points.mean(axis=1)
        left, _, right = np.linalg.svd(arms.T @ (points - centres[:, None]))
        # R = V diag(1, 1, det) U', never a reflection.
        right[:, 2] *= np.linalg.det(left @ right)[:, None]
        tips: Float = (left @ right).transpose(0, 2, 1) @ (body.tip_probe - middle) + centres
        return tips

    return chain


def _camera_matrix(camera: CameraModel) -> Float:
    fx, fy = camera.focal * camera.sx, camera.focal * camera.sy
    return np.array([[fx, 0.0, camera.u0], [0.0, fy, camera.v0], [0.0, 0.0, 1.0]])


_SAMPLES = 10
_POLL_S = 0.05
_MIB = 1024.0 * 1024.0


@dataclass(frozen=True, slots=True)
class MemoryRun:
    frames: int
    wall_s: float
    memory_mib: tuple[float, ...]
    """Resident memory at ten equal steps of bus time, MiB; the first after one tenth, when
    everything is loaded and the script has been measured. Excludes the last 30 s of frames, which
    are kept on purpose and bounded (decision 21)."""

    @property
    def growth_mib(self) -> float:
        """Return the growth from the first to the last sample, MiB."""
        return self.memory_mib[-1] - self.memory_mib[0]


def run_for(bus_time_s: float, console: PlainConsole) -> MemoryRun:
    """Run the station on the virtual rig at 8 kHz for ``bus_time_s``.

    The operator measures a short plan; then the probe stays in view and is tracked.
    """
    with tempfile.TemporaryDirectory() as folder:
        request = StationRequest(
            plan=resource("plans", "quick.toml"), out=Path(folder), stay=True, speed=0.0,
            rest_speed=0.0,
        )  # fmt: skip
        station = build_station(request).station
        memory: list[float] = []
        start = time.monotonic()
        with Progress(console=console, transient=True) as progress:
            task = progress.add_task(f"{bus_time_s:.0f} s of bus time", total=_SAMPLES)
            try:
                station.start()
                while len(memory) < _SAMPLES:
                    if station.wait_finished(_POLL_S):
                        break
                    if station.looks.live().time_s >= bus_time_s * (len(memory) + 1) / _SAMPLES:
                        kept = 0 if station.history is None else station.history.size_bytes
                        memory.append((HOST.resident_bytes() - kept) / _MIB)
                        progress.advance(task)
                frames = station.looks.acquisition().frames
            finally:
                station.close()
    return MemoryRun(frames, time.monotonic() - start, tuple(memory))


def print_run(run: MemoryRun, bus_time_s: float, console: PlainConsole) -> None:
    samples = "  ".join(f"{value:.0f}" for value in run.memory_mib)
    console.print(f"{bus_time_s:.0f} s of bus time, {run.frames} frames at 8 kHz")
    console.print(f"Memory at ten steps, MiB: {samples}")
    console.print(f"Growth from first to last: {run.growth_mib:+.1f} MiB")
    console.print(
        f"Real-time factor of the whole chain, virtual rig included: {bus_time_s / run.wall_s:.1f}"
    )
