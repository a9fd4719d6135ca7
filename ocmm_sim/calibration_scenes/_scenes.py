"""Scenes of a calibration: targets, a waved probe, a bar, nests."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeAlias

import msgspec
import numpy as np

from ocmm_core.camera import CameraModel, Vector3
from ocmm_core.geometry import RigidTransform, rotation_from_vector
from ocmm_sim.calibration_scenes._pivot_scenes import SweepProbe
from ocmm_sim.calibration_scenes._tip_scenes import TouchWithTip

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
