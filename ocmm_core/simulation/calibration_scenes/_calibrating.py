"""The virtual rig while it is calibrated: a target at known points, a waved probe, a bar, nests.

Scenes are shown one after the other. What a camera sees in a frame is a pure function of the frame
number, as everywhere in the virtual rig, and a script in words lets another process build the same.
The cameras, their errors and their noise are those that `world.draw_world` draws for the same rig
and seed, so that a calibration made here holds for parts measured there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import CameraModel, Rig, Vector3, load_rig, on_sensor, project
from ocmm_core.geometry import Float, RigidTransform, perpendicular_pair, rotation_from_vector, unit
from ocmm_core.simulation.calibration_scenes._pivot_scenes import (
    SweepProbe,
    hidden_bits,
    sweep_segments,
)
from ocmm_core.simulation.calibration_scenes._tip_scenes import TouchWithTip, reach_of, unit_vectors
from ocmm_core.simulation.scene import (
    CameraFrames,
    World,
    WorldOptions,
    attitude_at,
    draw_world,
    kernels,
    white_noise,
)
from ocmm_core.tracking import ProbeBody, load_probe, satisfies_rules

STILL_S, SEATED_S, TRAVEL_S, WAY_S = 0.045, 0.14, 0.06, 0.6
_STILL_FRAMES = 300
"""A rest has so many frames at least, however slow the cameras are: two averages of a hundred, as a
step compares them, and the block of eighty in which it may begin."""
_TREMOR = np.array([2e-3, 1.0])
"""Amplitude of a hand in attitude (rad) and place (mm), where a segment lets the ball sway at all:
else it is held by its seat."""

_LEAN_ERROR_RAD = np.radians(2.0)
"""So well a hand holds the probe as it is told."""

_MOVE = 32
_ATTEMPTS = 60
_CELLS = 3
_TILT_RAD, _TURN_RAD = np.radians(40.0), np.radians(25.0)


class FrameMove(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Somebody moved the frame with its cameras, and knocked these a little.

    Attributes
    ----------
    seed
        Of what is drawn.
    shift_mm, turn_rad
        Standard deviations of the motion of the frame, per axis.
    camera_shift_mm, camera_turn_rad
        Of each camera on it.
    """

    seed: int
    shift_mm: float = 8.0
    turn_rad: float = 8e-3
    camera_shift_mm: float = 1.0
    camera_turn_rad: float = 2e-3


class TargetScene(msgspec.Struct, frozen=True, kw_only=True, tag="ShowTarget"):
    """A machine brings one bright target to each position, mm, world."""

    positions: tuple[Vector3, ...]


class FreeMotionScene(msgspec.Struct, frozen=True, kw_only=True, tag="Wave"):
    """A hand waves the probe through the volume of the rig, from place to place."""

    ways: int
    seed: int


class ShowBar(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A bar with two LEDs on a stand; for each placement where they are, mm, world."""

    ends: tuple[tuple[Vector3, Vector3], ...]


class TouchSeats(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The ball is put into seats; for each where its centre is then, mm, world."""

    tips: tuple[Vector3, ...]
    seed: int


class TouchSphere(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A sphere is touched along the outward normals that are given, world."""

    centre: Vector3
    diameter: float
    normals: tuple[Vector3, ...]
    seed: int


Scene: TypeAlias = (
    TargetScene | FreeMotionScene | ShowBar | TouchSeats | TouchSphere | SweepProbe | TouchWithTip
)


@dataclass(frozen=True, slots=True)
class _Shown:
    """One scene made ready: LEDs (L, 3) and their directions in a body that moves by segments."""

    leds: Float
    directions: Float
    cos_emission: float
    origin: Float
    segments: Float
    tremor: Float
    first: int
    frames: int
    hidden: int


class CalibrationScenesRig:
    """The virtual rig with its scenes.

    Parameters
    ----------
    rig, body
        What the documents say.
    scenes
        In order.
    seed, options
        As in `rig.VirtualRig`.
    moved
        What happened to the frame since the cameras were where the documents say.
    """

    def __init__(
        self,
        rig: Rig,
        body: ProbeBody,
        scenes: tuple[Scene, ...],
        seed: int,
        options: WorldOptions | None = None,
        moved: FrameMove | None = None,
    ) -> None:
        self.rig, self.body, self.seed = rig, body, seed
        self.options = options or WorldOptions()
        self.frame_period_ns = round(1e9 / rig.frame_rate_hz)
        self.world = draw_world(rig, body, seed, self.options)
        if moved is not None:
            cameras = move_cameras(self.world.cameras, moved)
            self.world = replace(self.world, cameras=cameras)
        self._packed = [camera.packed() for camera in self.world.cameras]
        self._shown: list[_Shown] = []
        first = 0
        for scene in scenes:
            shown = self._prepared(scene, first)
            self._shown.append(shown)
            first += shown.frames
        self.n_frames = first

    def camera_frames(self, camera: int, first: int, count: int) -> CameraFrames:
        """Return what one camera sends of ``count`` frames from ``first`` on."""
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
        """Return what all cameras see in ``count`` frames from ``first`` on."""
        seen = [self._spots(camera, first, count) for camera in range(len(self._packed))]
        counter = np.arange(first, first + count, dtype=np.int64)
        return FrameBlock(
            counter=counter,
            time_ns=counter * self.frame_period_ns,
            flags=np.zeros(count, dtype=np.uint32),
            valid=np.stack([valid for valid, _ in seen], axis=1),
            uv=np.stack([uv for _, uv in seen], axis=1),
        )

    def _see(
        self, camera: int, shown: _Shown, first: int, count: int
    ) -> tuple[NDArray[np.uint64], Float]:
        rotation, tip = np.empty((count, 3, 3)), np.empty((count, 3))
        unused = np.empty((2, count), dtype=np.bool_)
        frames = np.arange(count, dtype=np.float64) + (first - shown.first)
        times = frames * (self.frame_period_ns * 1e-9)
        kernels.move(times, shown.segments, shown.tremor, rotation, tip, unused[0], unused[1])
        white = np.zeros((count, len(shown.leds), 2))
        if self.options.white_noise:
            white = white_noise(self.seed, camera, len(shown.leds), first, count)
            white = white * self.rig.noise.white_px
        valid = np.empty(count, dtype=np.uint64)
        uv = np.empty((count, self.world.n_slots, 2))
        model, pattern = self.world.cameras[camera], self.world.patterns[camera]
        kernels.see(
            rotation,
            tip - rotation @ shown.origin,
            shown.leds,
            shown.directions,
            shown.cos_emission,
            self._packed[camera],
            float(model.width),
            float(model.height),
            self.world.slots[camera],
            pattern.nodes,
            pattern.step_px,
            white,
            np.full(count, shown.hidden, dtype=np.uint64),
            valid,
            uv,
        )
        return valid, uv

    def _prepared(self, scene: Scene, first: int) -> _Shown:
        world, body = self.world, self.body
        still_s = _rest_s(STILL_S, self.rig)
        leds, directions = world.leds_probe, body.led_directions_probe
        cos_emission, origin = float(np.cos(body.emission_half_angle)), world.tip_probe
        tremor, hidden = _tremor(self.seed), 0
        if isinstance(scene, TargetScene | ShowBar):
            still = np.zeros(3)
            leds, origin, tremor = np.zeros((1, 3)), still, np.zeros_like(tremor)
            directions, cos_emission = np.array([[0.0, -1.0, 0.0]]), -2.0
        if isinstance(scene, TargetScene):
            segments = _visits([np.array(place) for place in scene.positions], still_s=still_s)
        elif isinstance(scene, ShowBar):
            bar = np.linalg.norm(np.subtract(scene.ends[0][1], scene.ends[0][0]))
            leds = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, float(bar)]])
            directions = np.repeat(directions, 2, axis=0)
            segments = _visits(
                [np.array(begin) for begin, _ in scene.ends],
                [_turn_to(np.subtract(end, begin)) for begin, end in scene.ends],
                still_s,
            )
        elif isinstance(scene, FreeMotionScene):
            segments = _waves(self.rig.volume_world, scene, body)
        elif isinstance(scene, SweepProbe):
            segments, hidden = sweep_segments(scene, body), hidden_bits(scene)
            origin = origin + np.array(scene.tip_shift_mm)
        elif isinstance(scene, TouchWithTip):
            segments = _touches_with_tip(scene, world, body, self.rig)
            origin = origin + scene.fault.shift_probe
        else:
            segments = _touches(scene, world, body, self.rig)
        duration = float(segments[-1, kernels.T1])
        return _Shown(
            leds, directions, cos_emission, origin, segments, tremor, first,
            int(np.ceil(duration * 1e9 / self.frame_period_ns)), hidden,
        )  # fmt: skip


class CalibratingScript(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A rig that is calibrated, in words: what a process needs to build the same one.

    Attributes
    ----------
    calibrating
        The scenes.
    rig, probe
        Paths of the documents.
    seed, options, moved
        As in `CalibrationScenesRig`.
    """

    calibrating: tuple[Scene, ...]
    rig: str
    probe: str
    seed: int
    options: WorldOptions = WorldOptions()
    moved: FrameMove | None = None

    def to_json(self) -> str:
        """Return the script as text."""
        return msgspec.json.encode(self).decode("utf-8")

    def build(self) -> CalibrationScenesRig:
        """Load the documents and return the rig."""
        return CalibrationScenesRig(
            load_rig(Path(self.rig)),
            load_probe(Path(self.probe)),
            self.calibrating,
            self.seed,
            self.options,
            self.moved,
        )


def move_cameras(cameras: tuple[CameraModel, ...], move: FrameMove) -> tuple[CameraModel, ...]:
    """Return the cameras after their frame was moved about its middle."""
    rng = np.random.default_rng([move.seed, _MOVE])
    middle = np.mean([camera.centre_world for camera in cameras], axis=0)
    rotation = rotation_from_vector(move.turn_rad * rng.standard_normal(3))
    shift = move.shift_mm * rng.standard_normal(3)
    frame = RigidTransform(rotation, middle + shift - rotation @ middle)
    moved = []
    for camera in cameras:
        turn = rotation_from_vector(move.camera_turn_rad * rng.standard_normal(3))
        step = move.camera_shift_mm * rng.standard_normal(3)
        pose = camera.T_camera_from_world.compose(frame.inverse())
        pose = RigidTransform(turn @ pose.rotation, turn @ (pose.translation - step))
        moved.append(replace(camera, T_camera_from_world=pose))
    return tuple(moved)


def _rest_s(usual_s: float, rig: Rig) -> float:
    """Return how long something is held still for a rig to take it."""
    return max(usual_s, _STILL_FRAMES / rig.frame_rate_hz)


def _visits(
    places: list[Float], attitudes: list[Float] | None = None, still_s: float = STILL_S
) -> Float:
    """Return segments that bring a body to each place and let it rest there."""
    turns = attitudes or [np.zeros(3)] * len(places)
    rows: list[Float] = []
    time, place, turn = 0.0, places[0], turns[0]
    for aim, aim_turn in zip(places, turns, strict=True):
        for length, kind in ((TRAVEL_S, kernels.MOVE), (still_s, kernels.REST)):
            rows.append(_segment(time, length, kind, place, aim, turn, aim_turn))
            time, place, turn = time + length, aim, aim_turn
    return np.array(rows)


def _waves(volume_world: Float, scene: FreeMotionScene, body: ProbeBody) -> Float:
    """Return segments from one place and attitude of the volume to the next.

    Each way ends in another cell of the volume, so that all of it is crossed.
    """
    rng = np.random.default_rng([scene.seed, _MOVE + 1])
    low, high = volume_world
    cells = np.array(list(np.ndindex(_CELLS, _CELLS, _CELLS)))
    rows: list[Float] = []
    place, turn, time = 0.5 * (low + high), np.zeros(3), 0.0
    for number in range(scene.ways):
        if number % len(cells) == 0:
            rng.shuffle(cells)
        cell = cells[number % len(cells)]
        aim = low + (cell + rng.random(3)) / _CELLS * (high - low)
        tilt = rng.uniform(-1.0, 1.0, 3) * np.array([_TILT_RAD, _TILT_RAD, _TURN_RAD])
        # High up the handle points down, so that the LEDs stay in the volume.
        over = np.array([0.0, np.pi if 2 * cell[2] >= _CELLS and not body.rules else 0.0, 0.0])
        attitude = rotation_from_vector(over) @ rotation_from_vector(tilt)
        aim_turn = Rotation.from_matrix(attitude).as_rotvec()
        rows.append(_segment(time, WAY_S, kernels.MOVE, place, aim, turn, aim_turn))
        place, turn, time = aim, aim_turn, time + WAY_S
    return np.array(rows)


def _touches(scene: TouchSeats | TouchSphere, world: World, body: ProbeBody, rig: Rig) -> Float:
    rng = np.random.default_rng([scene.seed, _MOVE + 2])
    if isinstance(scene, TouchSeats):
        # A seat on a stand can be reached from all around.
        places: list[tuple[Float, Float | None]] = [(np.array(tip), None) for tip in scene.tips]
    else:
        reach = 0.5 * scene.diameter + world.tip_radius
        normals = [unit(np.array(normal)) for normal in scene.normals]
        places = [(np.array(scene.centre) + reach * normal, normal) for normal in normals]
    turns = [best_seen(tip, normal, world, body, rig.volume_world, rng) for tip, normal in places]
    return _visits([tip for tip, _ in places], turns, _rest_s(SEATED_S, rig))


def _touches_with_tip(scene: TouchWithTip, world: World, body: ProbeBody, rig: Rig) -> Float:
    rng = np.random.default_rng([scene.seed, _MOVE + 4])
    places, turns = [], []
    for normal in unit_vectors(scene.normals):
        tip = np.array(scene.centre) + 0.5 * scene.diameter * normal
        turn = best_seen(tip, normal, world, body, rig.volume_world, rng)
        reach = reach_of(scene, world.tip_radius, rotation_from_vector(turn), normal)
        places.append(np.array(scene.centre) + reach * normal)
        turns.append(turn)
    for handle in unit_vectors(scene.handles):
        places.append(np.array(scene.cone))
        turns.append(_turn_to(handle + rng.normal(0.0, _LEAN_ERROR_RAD, 3)))
    return _visits(places, turns, _rest_s(SEATED_S, rig))


def best_seen(
    tip: Float,
    normal: Float | None,
    world: World,
    body: ProbeBody,
    volume_world: Float,
    rng: np.random.Generator,
) -> Float:
    """Return a way to hold the probe, as a rotation vector (3,), rad.

    The cameras should see all of it, and the LEDs should stay in the calibrated volume.
    """
    low, high = volume_world
    best, least = np.zeros(3), np.inf
    for _ in range(_ATTEMPTS):
        lean, yaw = rng.uniform(-0.2, 0.2, 2), float(rng.uniform(-0.2, 0.2))
        roll = 0.0 if normal is not None else float(rng.uniform(-np.pi, np.pi))
        if least == 0.0:
            # None is better than one that all cameras see; only the draws go on as ever.
            continue
        upwards = np.array([0.0, 0.0, 1.0]) if normal is None else normal
        rotation = rotation_from_vector(attitude_at(upwards, lean, yaw, bore=False))
        if normal is None:
            rotation = rotation_from_vector(np.array([0.0, roll, 0.0])) @ rotation
        if not satisfies_rules(body, rotation):
            continue
        leds = tip + (world.leds_probe - world.tip_probe) @ rotation.T
        light = body.led_directions_probe @ rotation.T
        hidden = 0
        for camera in world.cameras:
            towards = unit(camera.centre_world - leds)
            shines = np.sum(towards * light, axis=1) > np.cos(body.emission_half_angle)
            hidden += int(np.count_nonzero(~shines | ~on_sensor(camera, project(camera, leds))))
        outside = float(np.maximum(low - leds, leds - high).max(initial=0.0))
        if 1e3 * hidden + outside < least:
            best, least = Rotation.from_matrix(rotation).as_rotvec(), 1e3 * hidden + outside
    return best


def _segment(
    start_s: float, length_s: float, kind: int, begin: Float, end: Float, w0: Float, w1: Float
) -> Float:
    segment = np.zeros(kernels.N_COLUMNS)
    segment[kernels.T0], segment[kernels.T1] = start_s, start_s + length_s
    segment[kernels.KIND], segment[kernels.TOP] = kind, np.nan
    segment[kernels.P0 : kernels.P0 + 3], segment[kernels.P1 : kernels.P1 + 3] = begin, end
    segment[kernels.W0 : kernels.W0 + 3], segment[kernels.W1 : kernels.W1 + 3] = w0, w1
    return segment


def _turn_to(direction: Float) -> Float:
    """Return the rotation vector (3,) that takes the axis of a bar, z, to a direction."""
    aim = unit(direction)
    axis = np.cross([0.0, 0.0, 1.0], aim)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.pi * perpendicular_pair(aim)[0] if aim[2] < 0.0 else np.zeros(3)
    turned: Float = axis / sine * np.arctan2(sine, aim[2])
    return turned


def _tremor(seed: int) -> Float:
    """Return waves (2, 3, K, 3) of a hand whose ball rests in a seat; see `kernels.move`."""
    rng = np.random.default_rng([seed, _MOVE + 3])
    shape = (2, 3, 4)
    tremor = np.empty((*shape, 3))
    tremor[..., 0] = (np.sqrt(2.0 / shape[2]) * _TREMOR)[:, None, None]
    tremor[..., 1] = 2.0 * np.pi * np.exp(rng.uniform(np.log(0.6), np.log(5.0), shape))
    tremor[..., 2] = rng.uniform(0.0, 2.0 * np.pi, shape)
    return tremor
