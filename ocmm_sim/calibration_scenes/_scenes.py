"""Scenes of a calibration: targets, a waved probe, a bar, nests, a pivot cone, tip checks.

In the pivot scene a hand sweeps the probe about its ball; tips can be faulty.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

import msgspec
import numpy as np
import scipy

from ocmm_core.camera import CameraModel, Vector3
from ocmm_core.geometry import Float, RigidTransform, rotation_from_vector, unit
from ocmm_core.tracking import ProbeBody, satisfies_rules
from ocmm_sim.scene import kernels, segment_of

_LIFT_MM, _LIFT_S = 60.0, 0.5
_WAY_S = 0.55
"""Between turning points of the hand."""

_JUMP_S = 0.03
_PATCH_RAD = 0.3


class ScriptedJump(msgspec.Struct, frozen=True, kw_only=True):
    """A push of the cone."""

    at_s: float
    shift_mm: Vector3


class SeatFault(msgspec.Struct, frozen=True, kw_only=True):
    """A worn cone, or a ball that is not round."""

    worn_mm: Vector3 = (0.0, 0.0, 0.0)
    """Shift of the ball along X, Y and Z of the world per radian of tilt: across by the tilt about
    that axis, upwards by half its square."""
    wall_mm: float = 0.0
    """Play: the ball lies at this distance from the axis, on the side to which the probe leans."""
    dirt_mm: float = 0.0
    dirt_probe: Vector3 = (0.0, 0.0, -1.0)
    """`dirt_mm`, `dirt_probe`: height and direction of a patch 17 degrees wide on the ball."""
    lobes_mm: float = 0.0
    """Amplitude of three lobes about the handle, at 30 degrees from the pole."""

    def shifts(self, rotations: Float) -> Float:
        """Return the shift of the ball, (n, 3), mm, for rotations (n, 3, 3), world from probe."""
        tilt = rotations[:, :2, 2]
        lean = np.linalg.norm(tilt, axis=1)
        found: Float = np.column_stack([tilt, 0.5 * lean**2]) * np.array(self.worn_mm)
        found[:, :2] += self.wall_mm * tilt / np.maximum(lean, 1e-9)[:, None]
        # The place of the ball that rests in the cone is opposite to the world's vertical.
        down = -rotations[:, 2]
        angle = np.arccos(np.clip(down @ unit(np.array(self.dirt_probe)), -1.0, 1.0))
        found[:, 2] += self.dirt_mm * np.exp(-((angle / _PATCH_RAD) ** 2))
        around = np.arctan2(down[:, 1], down[:, 0])
        found[:, 2] += self.lobes_mm * np.cos(3.0 * around) * 2.0 * np.hypot(down[:, 0], down[:, 1])
        return found


class SweepProbe(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The ball is seated in a cone, the probe swept about it, and lifted off."""

    cone: Vector3
    """Ball centre, mm, world."""
    seconds: float
    seed: int
    reach_deg: Vector3 = (27.0, 27.0, 12.0)
    """Amplitudes of leaning about X and Y, and of turning about the handle (Z)."""
    lean_deg: Vector3 = (0.0, 0.0, 0.0)
    """Mean attitude, from upright."""
    slack_mm: float = 0.0
    """Standard deviation of the ball's wander in the cone, per axis."""
    jumps: tuple[ScriptedJump, ...] = ()
    tip_shift_mm: Vector3 = (0.0, 0.0, 0.0)
    """Ball offset of another stylus, probe frame."""
    seat: SeatFault = SeatFault()
    hidden: tuple[int, ...] = ()
    """LEDs, from 0, covered by a hand."""


def sweep_segments(scene: SweepProbe, body: ProbeBody) -> Float:
    """Return segments of tip and probe for `kernels.move`."""
    rng = np.random.default_rng([scene.seed, 51])
    place = np.array(scene.cone)
    above = np.array([0.0, 0.0, _LIFT_MM])
    turn = _attitude(np.array(scene.lean_deg))
    rows = [segment_of(0.0, _LIFT_S, kernels.MOVE, place + above, place, turn, turn)]
    jumps = list(scene.jumps)
    while (time := float(rows[-1][kernels.T1])) < scene.seconds + _LIFT_S:
        if jumps and time >= jumps[0].at_s:
            pushed = place + np.array(jumps.pop(0).shift_mm)
            rows.append(segment_of(time, _JUMP_S, kernels.MOVE, place, pushed, turn, turn))
            place = pushed
            continue
        aim = turn
        for _ in range(20):
            aim = _attitude(
                np.array(scene.lean_deg) + rng.uniform(-1.0, 1.0, 3) * np.array(scene.reach_deg)
            )
            if satisfies_rules(body, rotation_from_vector(aim)):
                break
        rows.append(segment_of(time, _WAY_S, kernels.MOVE, place, place, turn, aim))
        turn = aim
    rows.append(segment_of(time, _LIFT_S, kernels.MOVE, place, place + above, turn, turn))
    segments = np.array(rows)
    segments[:, [kernels.SWAY0, kernels.SWAY1]] = scene.slack_mm
    return segments


def _attitude(angles_deg: Float) -> Float:
    """Return the rotation vector (3,), rad, of a probe turned about Z, then leaned."""
    x, y, z = np.radians(angles_deg)
    leaned = rotation_from_vector(np.array([x, y, 0.0]))
    turned = leaned @ rotation_from_vector(np.array([0.0, 0.0, z]))
    vector: Float = scipy.spatial.transform.Rotation.from_matrix(turned).as_rotvec()
    return vector


class TipFault(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Faults of the mounted tip; none by default."""

    diameter_mm: float = 0.0
    length_mm: float = 0.0
    """Excess length away from the handle (probe frame, against z)."""
    sideways_mm: float = 0.0
    """Sideways offset (probe frame, along x)."""
    worn_mm: float = 0.0
    """Depth of a worn place on the side of the ball (probe frame, along x)."""

    @property
    def shift_probe(self) -> Float:
        """Return the ball offset, (3,), mm, probe frame."""
        return np.array([self.sideways_mm, 0.0, -self.length_mm])


class TouchWithTip(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The sphere is touched along outward normals, then the ball is held in the cone."""

    centre: Vector3
    diameter: float
    """`centre`, `diameter`: sphere, mm, world."""
    normals: tuple[Vector3, ...]
    cone: Vector3
    """Final ball centre, mm, world."""
    handles: tuple[Vector3, ...]
    """Directions from ball to handle, world, one per attitude."""
    seed: int
    fault: TipFault = TipFault()


_WORN_RAD = np.radians(35.0)


def reach_of(scene: TouchWithTip, radius: float, rotation: Float, normal: Float) -> float:
    """Return the distance of the ball centre from the sphere centre at a touch, mm.

    ``radius``: documented ball radius plus its true error, mm; ``rotation`` (3, 3), world from
    probe; ``normal`` (3,): outward, unit, world.
    """
    fault = scene.fault
    touching_probe = rotation.T @ -normal
    angle = float(np.arccos(np.clip(touching_probe[0], -1.0, 1.0)))
    worn = fault.worn_mm * max(0.0, 1.0 - (angle / _WORN_RAD) ** 2)
    return float(0.5 * (scene.diameter + fault.diameter_mm) + radius - worn)


def unit_vectors(vectors: tuple[Vector3, ...]) -> list[Float]:
    """Return directions of length one."""
    return [unit(np.array(one)) for one in vectors]


STREAM = 32
"""First random stream number used here, apart from those of other modules."""


class FrameMove(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The camera frame was moved, and each camera slightly knocked."""

    seed: int
    shift_mm: float = 8.0
    turn_rad: float = 8e-3
    """`shift_mm`, `turn_rad`: standard deviations of the frame's motion, per axis."""
    camera_shift_mm: float = 1.0
    camera_turn_rad: float = 2e-3
    """`camera_shift_mm`, `camera_turn_rad`: of each camera on it."""


class TargetScene(msgspec.Struct, frozen=True, kw_only=True, tag="ShowTarget"):
    """A machine brings one bright target to each position, mm, world."""

    positions: tuple[Vector3, ...]


class FreeMotionScene(msgspec.Struct, frozen=True, kw_only=True, tag="Wave"):
    """A hand waves the probe through the volume of the rig, from place to place."""

    ways: int
    seed: int


class ShowBar(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A bar with two LEDs on a stand; their positions per placement, mm, world."""

    ends: tuple[tuple[Vector3, Vector3], ...]


class TouchSeats(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """The ball is put into seats; its centre in each, mm, world."""

    tips: tuple[Vector3, ...]
    seed: int
    clamped_s: float = 0.0
    """Rest of a clamped probe; 0: a hand holds it."""


class TouchSphere(msgspec.Struct, frozen=True, kw_only=True, tag=True):
    """A sphere is touched along outward normals, world."""

    centre: Vector3
    diameter: float
    normals: tuple[Vector3, ...]
    seed: int


Scene: TypeAlias = (
    TargetScene | FreeMotionScene | ShowBar | TouchSeats | TouchSphere | SweepProbe | TouchWithTip
)


def move_cameras(cameras: tuple[CameraModel, ...], move: FrameMove) -> tuple[CameraModel, ...]:
    """Return the cameras after their frame was moved about its middle."""
    rng = np.random.default_rng([move.seed, STREAM])
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
