"""How fast spots become tips, as ratios taken in one run.

Eight LEDs in two cameras. Ours: undistortion, triangulation, rigid fit, one Gauss-Newton step on
all residuals, tip and its covariance, in batches of 80 frames (10 ms at 8 kHz) and one call a
frame. The peer: OpenCV's undistortPoints and triangulatePoints and a rigid fit in numpy, frame by
frame, which gives a tip and no covariance. And the whole pipeline (labels, status, tips) on the
virtual rig in blocks of 10 ms, in seconds of processor time: what one core would have to do. The
best of several rounds counts, peers in turn, so that what else the machine does falls on all alike.
Run: ``python benchmarks/tracking_speed.py``.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np

from ocmm_core.camera.model import CameraModel, project
from ocmm_core.camera.rig import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, rotation_xyz
from ocmm_core.simulation.artefacts import load_part
from ocmm_core.simulation.rig import VirtualRig
from ocmm_core.tracking.body import ProbeBody, load_probe, rigid_fit
from ocmm_core.tracking.pipeline import TrackingPipeline
from ocmm_core.tracking.pose import solve

FRAMES = 1600
BATCH = 80
FRAME_RATE_HZ = 8000
SPEED_LIMIT = 5.0
REAL_TIME_LIMIT = 20.0
SIGMA_PX = 0.03
LEDS = (
    (-50.0, 30.0, 118.0), (-50.0, -30.0, 228.0), (50.0, -30.0, 118.0), (55.0, 30.0, 228.0),
    (-20.0, 10.0, 150.0), (20.0, -10.0, 200.0), (0.0, 25.0, 130.0), (10.0, -20.0, 240.0),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Row:
    """One figure.

    Attributes
    ----------
    name
        What was measured.
    value, unit
        The figure.
    limit
        The value must be at least this; None if it is only told.
    """

    name: str
    value: float
    unit: str
    limit: float | None = None

    @property
    def holds(self) -> bool:
        """Return whether the limit is kept."""
        return self.limit is None or self.value >= self.limit


class OpenCvPeer:
    """What one would write with OpenCV: a tip for every frame."""

    def __init__(self, rig: Rig, body: ProbeBody) -> None:
        self._body = body
        self._lenses = [_opencv_lens(camera) for camera in rig.cameras]
        self._projections = [
            np.hstack([c.T_camera_from_world.rotation, c.T_camera_from_world.translation[:, None]])
            for c in rig.cameras
        ]

    def tip(self, uv: Float) -> Float:
        """Return the tip (3,), mm, of spots (2, L, 2), px."""
        ideal = [
            cv2.undistortPoints(spots[:, None], *lens)[:, 0].T
            for spots, lens in zip(uv, self._lenses, strict=True)
        ]
        homogeneous = cv2.triangulatePoints(*self._projections, *ideal)
        leds_world = (homogeneous[:3] / homogeneous[3]).T
        rotation, origin = rigid_fit(self._body.leds_probe, leds_world)
        tip: Float = rotation @ self._body.tip_probe + origin
        return tip


def measure(rounds: int = 5) -> list[Row]:
    """Return the figures; the first call of a function is never timed."""
    rig, body = load_rig(resource("rigs", "recommended.toml")), _eight_leds()
    uv, tips = _spots(rig, body)
    peer = OpenCvPeer(rig, body)

    def batches() -> Float:
        return np.concatenate(
            [
                solve(uv[i : i + BATCH], rig, body, SIGMA_PX).tip_world
                for i in range(0, FRAMES, BATCH)
            ]
        )

    def single() -> Float:
        return np.array(
            [solve(uv[i : i + 1], rig, body, SIGMA_PX).tip_world[0] for i in range(FRAMES)]
        )

    def opencv() -> Float:
        return np.array([peer.tip(frame) for frame in uv])

    for compute in (batches, single, opencv):
        # A comparison of speed holds only if all compute the same thing.
        assert np.linalg.norm(compute() - tips, axis=1).max() < 1.0
    ours, one_by_one, theirs = _best_of(rounds, (batches, single, opencv))
    scale = 1e6 / FRAMES
    return [
        Row("ours, batches of 80", scale * ours, "us/frame"),
        Row("ours, one call a frame", scale * one_by_one, "us/frame"),
        Row("OpenCV and rigid fit, frame by frame", scale * theirs, "us/frame"),
        Row("OpenCV / ours, batches of 80", theirs / ours, "x", SPEED_LIMIT),
        Row("OpenCV / ours, one call a frame", theirs / one_by_one, "x"),
        Row("pipeline, 8 kHz in 10 ms blocks", _real_time_factor(rounds), "x", REAL_TIME_LIMIT),
    ]


def main() -> int:
    """Print the figures; return 1 if a limit is broken."""
    rows = measure()
    for row in rows:
        limit = ""
        if row.limit is not None:
            limit = f"  (at least {row.limit:g}: {'ok' if row.holds else 'BROKEN'})"
        print(f"{row.name:40s} {row.value:8.2f} {row.unit}{limit}")
    return 0 if all(row.holds for row in rows) else 1


def _best_of(rounds: int, functions: tuple[Callable[[], Float], ...]) -> list[float]:
    best = [np.inf] * len(functions)
    for _ in range(rounds):
        for index, function in enumerate(functions):
            start = time.perf_counter()
            function()
            best[index] = min(best[index], time.perf_counter() - start)
    return best


def _real_time_factor(rounds: int) -> float:
    """Return how many seconds of frames the pipeline does in a second of processor time."""
    rig = load_rig(resource("rigs", "recommended.toml"))
    virtual = VirtualRig(
        rig,
        load_probe(resource("probes", "standard.toml")),
        load_part(resource("parts", "demo.toml")),
        (("SPHERE", 1),),
        seed=1,
        frame_rate_hz=FRAME_RATE_HZ,
    )
    blocks = [virtual.frames(first, BATCH) for first in range(0, 2 * FRAME_RATE_HZ, BATCH)]
    TrackingPipeline(rig, virtual.body).process(blocks[0])
    best = np.inf
    for _ in range(rounds):
        pipeline = TrackingPipeline(rig, virtual.body)
        start = time.process_time()
        tracked = [pipeline.process(block) for block in blocks]
        best = min(best, time.process_time() - start)
        assert not any(block.status.any() for block in tracked)
    return len(blocks) * BATCH / FRAME_RATE_HZ / float(best)


def _eight_leds() -> ProbeBody:
    leds = np.array(LEDS)
    return replace(
        load_probe(resource("probes", "standard.toml")),
        leds_probe=leds,
        led_directions_probe=np.tile([0.0, -1.0, 0.0], (len(leds), 1)),
        geometry_covariance=np.zeros((3 * len(leds) + 3,) * 2),
    )


def _spots(rig: Rig, body: ProbeBody) -> tuple[Float, Float]:
    rng = np.random.default_rng(1)
    rotations = np.stack([rotation_xyz(*row) for row in rng.uniform(-0.5, 0.5, (FRAMES, 3))])
    tips = rng.uniform(-100.0, 100.0, (FRAMES, 3))
    leds = np.einsum("nij,lj->nli", rotations, body.leds_probe - body.tip_probe) + tips[:, None]
    uv = np.stack([project(camera, leds) for camera in rig.cameras], axis=1)
    noisy: Float = uv + SIGMA_PX * rng.standard_normal(uv.shape)
    return noisy, tips


def _opencv_lens(camera: CameraModel) -> tuple[Float, Float]:
    """Return camera matrix and distortion for OpenCV, which counts in units of the focal length."""
    f = camera.focal
    matrix = np.array(
        [[f * camera.sx, 0.0, camera.u0], [0.0, f * camera.sy, camera.v0], [0.0, 0.0, 1.0]]
    )
    distortion = np.array([camera.k1 * f**2, camera.k2 * f**4, camera.p1 * f, camera.p2 * f])
    return matrix, distortion


if __name__ == "__main__":
    sys.exit(main())
