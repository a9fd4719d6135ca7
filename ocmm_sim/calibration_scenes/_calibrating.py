"""Virtual rig during calibration: targets, a waved probe, a bar, nests; as a frame source.

Scenes are shown in sequence. A camera's view is a pure function of the frame number, and a script
lets another process build the same rig. Cameras, errors and noise are those of `world.draw_world`
for the same rig and seed, so a calibration made here is valid for parts measured there.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import Cycle, CycleVerdict, FrameBlock, SourceDescription
from ocmm_core.camera import Rig, TrackerDocument, load_rig
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody, load_probe
from ocmm_sim.calibration_scenes import _motions as motions
from ocmm_sim.calibration_scenes import _scenes
from ocmm_sim.calibration_scenes._motions import tremor
from ocmm_sim.scene import CameraFrames, WorldOptions, draw_world, kernels, white_noise


@dataclass(frozen=True, slots=True)
class _Shown:
    """A prepared scene: LEDs (L, 3) and directions in a body that moves by segments."""

    leds: Float
    directions: Float
    cos_emission: float
    origin: Float
    segments: Float
    tremor: Float
    first: int
    frames: int
    hidden: int
    seat: _scenes.SeatFault | None = None


class CalibrationScenesRig:
    """The virtual rig with its scenes; `moved` displaces the documented cameras."""

    def __init__(
        self,
        rig: Rig,
        body: ProbeBody,
        scenes: tuple[_scenes.Scene, ...],
        seed: int,
        options: WorldOptions | None = None,
        moved: _scenes.FrameMove | None = None,
    ) -> None:
        self.rig, self.body, self.seed = rig, body, seed
        self.options = options or WorldOptions()
        self.frame_period_ns = round(1e9 / rig.frame_rate_hz)
        self.world = draw_world(rig, body, seed, self.options)
        if moved is not None:
            cameras = _scenes.move_cameras(self.world.cameras, moved)
            self.world = replace(self.world, cameras=cameras)
        self._packed = [self.world.packed(*one) for one in enumerate(self.world.cameras)]
        self._shown: list[_Shown] = []
        first = 0
        for scene in scenes:
            shown = self._prepared(scene, first)
            self._shown.append(shown)
            first += shown.frames
        self.n_frames = first

    def camera_frames(self, camera: int, first: int, count: int) -> CameraFrames:
        valid, uv = self._spots(camera, first, count)
        return valid.astype(np.uint16), np.zeros(count, dtype=np.uint16), uv

    def _spots(self, camera: int, first: int, count: int) -> tuple[NDArray[np.uint64], Float]:
        valid = np.zeros(count, dtype=np.uint64)
        uv = np.full((count, self.world.n_slots, 2), np.nan)
        for shown in self._shown:
            begin = max(first, shown.first)
            end = min(first + count, shown.first + shown.frames)
            if begin < end:
                part = slice(begin - first, end - first)
                valid[part], uv[part] = self._see(camera, shown, begin, end - begin)
        return valid, uv

    def frames(self, first: int, count: int) -> FrameBlock:
        seen = [self._spots(camera, first, count) for camera in range(len(self._packed))]
        counter = np.arange(first, first + count, dtype=np.int64)
        return FrameBlock(
            counter=counter,
            time_ns=counter * self.frame_period_ns,
            flags=np.zeros(count, dtype=np.uint32),
            valid=np.stack([valid for valid, _ in seen], axis=1),
            uv=np.stack([uv for _, uv in seen], axis=1),
        )

    def leds(self, first: int, count: int) -> tuple[Float, Float]:
        """Return the places (n, L, 3), mm, and directions (n, L, 3) of the LEDs of a body."""
        places, lights = [], []
        for shown in self._shown:
            begin = max(first, shown.first)
            end = min(first + count, shown.first + shown.frames)
            if begin < end:
                turns, tips = self._moved(shown, begin, end - begin)
                turned = turns.transpose(0, 2, 1)
                places.append((shown.leds - shown.origin) @ turned + tips[:, None])
                lights.append(shown.directions @ turned)
        return np.concatenate(places), np.concatenate(lights)

    def _moved(self, shown: _Shown, first: int, count: int) -> tuple[Float, Float]:
        """Return rotations (n, 3, 3) and places (n, 3), mm, of the origin of a shown body."""
        rotation, tip = np.empty((count, 3, 3)), np.empty((count, 3))
        unused = np.empty((2, count), dtype=np.bool_)
        frames = np.arange(count, dtype=np.float64) + (first - shown.first)
        times = frames * (self.frame_period_ns * 1e-9)
        kernels.move(times, shown.segments, shown.tremor, rotation, tip, unused[0], unused[1])
        if shown.seat is not None:
            tip += shown.seat.shifts(rotation)
        return rotation, tip

    def _see(
        self, camera: int, shown: _Shown, first: int, count: int
    ) -> tuple[NDArray[np.uint64], Float]:
        rotation, tip = self._moved(shown, first, count)
        white = np.zeros((count, len(shown.leds), 2))
        if self.options.white_noise:
            white = white_noise(self.seed, camera, len(shown.leds), first, count)
            white = white * self.rig.noise.white_px
        valid = np.empty(count, dtype=np.uint64)
        uv = np.empty((count, self.world.n_slots, 2))
        kernels.see(
            rotation,
            tip - rotation @ shown.origin,
            shown.leds,
            shown.directions,
            shown.cos_emission,
            self._packed[camera],
            self.world.slots[camera],
            self.world.patterns[camera].nodes,
            white,
            np.full(count, shown.hidden, dtype=np.uint64),
            valid,
            uv,
        )
        return valid, uv

    def _prepared(self, scene: _scenes.Scene, first: int) -> _Shown:
        world, body = self.world, self.body
        still_s = motions.rest_s(motions.STILL_S, self.rig)
        leds, directions = world.leds_probe, body.led_directions_probe
        cos_emission, origin = float(np.cos(body.emission_half_angle)), world.tip_probe
        shaking, hidden, seat = tremor(self.seed), 0, None
        if isinstance(scene, _scenes.TargetScene | _scenes.ShowBar):
            still = np.zeros(3)
            leds, origin, shaking = np.zeros((1, 3)), still, np.zeros_like(shaking)
            directions, cos_emission = np.array([[0.0, -1.0, 0.0]]), -2.0
        if isinstance(scene, _scenes.TargetScene):
            segments = motions.visits(
                [np.array(place) for place in scene.positions], still_s=still_s
            )
        elif isinstance(scene, _scenes.ShowBar):
            bar = np.linalg.norm(np.subtract(scene.ends[0][1], scene.ends[0][0]))
            leds = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, float(bar)]])
            directions = np.repeat(directions, 2, axis=0)
            segments = motions.visits(
                [np.array(begin) for begin, _ in scene.ends],
                [motions.turn_to(np.subtract(end, begin)) for begin, end in scene.ends],
                still_s,
            )
        elif isinstance(scene, _scenes.FreeMotionScene):
            segments = motions.waves(self.rig.volume_world, scene, body)
        elif isinstance(scene, _scenes.SweepProbe):
            segments = _scenes.sweep_segments(scene, body)
            hidden = sum(1 << led for led in scene.hidden)
            seat = scene.seat if scene.seat != _scenes.SeatFault() else None
            origin = origin + np.array(scene.tip_shift_mm)
        elif isinstance(scene, _scenes.TouchWithTip):
            segments = motions.touches_with_tip(scene, world, body, self.rig)
            origin = origin + scene.fault.shift_probe
        else:
            segments = motions.touches(scene, world, body, self.rig)
            if isinstance(scene, _scenes.TouchSeats) and scene.clamped_s:
                shaking = np.zeros_like(shaking)
        duration = float(segments[-1, kernels.T1])
        return _Shown(
            leds, directions, cos_emission, origin, segments, shaking, first,
            int(np.ceil(duration * 1e9 / self.frame_period_ns)), hidden, seat,
        )  # fmt: skip


class CalibratingScript(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Serialisable description of a `CalibrationScenesRig`."""

    calibrating: tuple[_scenes.Scene, ...]
    rig: str
    probe: str
    seed: int
    options: WorldOptions = WorldOptions()
    moved: _scenes.FrameMove | None = None
    """`seed`, `options`, `moved`: see `CalibrationScenesRig`."""
    tracker: TrackerDocument | None = None
    """By which a tracker is read; None: by the document of the rig."""

    def to_json(self) -> str:
        return msgspec.json.encode(self).decode("utf-8")

    def build(self) -> CalibrationScenesRig:
        return CalibrationScenesRig(
            load_rig(Path(self.rig)),
            load_probe(Path(self.probe)),
            self.calibrating,
            self.seed,
            self.options,
            self.moved,
        )


BLOCK_NS = 10_000_000


class CalibratingSource:
    """A `FrameSource` that shows the scenes once and ends; rig time waits for slow readers."""

    def __init__(self, rig: CalibrationScenesRig, speed: float = 0.0) -> None:
        self._rig = rig
        self._speed = speed
        self._block = max(1, BLOCK_NS // rig.frame_period_ns)
        self._next = 0
        self._due_s = 0.0

    @property
    def description(self) -> SourceDescription:
        rig = self._rig
        return SourceDescription(
            name=f"simulated calibration ({rig.rig.name}, seed {rig.seed})",
            camera_serials=tuple(camera.serial for camera in rig.rig.cameras),
            frame_period_ns=rig.frame_period_ns,
            cycle_period_ns=self._block * rig.frame_period_ns,
            live=False,
            simulated=True,
            n_slots=rig.world.n_slots,
        )

    def open(self) -> None:
        self._next = 0
        self._due_s = time.monotonic()

    def read(self) -> Cycle:
        count = min(self._block, self._rig.n_frames - self._next)
        frames = self._rig.frames(self._next, count) if count > 0 else None
        self._next += max(count, 0)
        if self._speed:
            self._due_s += count * self._rig.frame_period_ns * 1e-9 / self._speed
            time.sleep(max(0.0, self._due_s - time.monotonic()))
        finished = self._next >= self._rig.n_frames
        return Cycle(CycleVerdict.GOOD, frames=frames, finished=finished)

    def close(self) -> None:
        """Do nothing: the source holds no resources."""
