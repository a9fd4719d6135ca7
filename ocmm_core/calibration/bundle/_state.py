"""State, column order and observations of a bundle adjustment."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.bundle._kernel import retract_poses
from ocmm_core.calibration.cameras import LensCamera
from ocmm_core.camera import N_PARAMETERS, CameraModel
from ocmm_core.geometry import Float, Int, Pixels, Points3, RigidTransform, skew

LENS = slice(6, N_PARAMETERS)
"""Columns of the lens among those of a camera."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Order of the common unknowns: cameras, LEDs, tip, seats, lengths of bars."""

    cameras: int
    leds: int
    seats: int
    bars: int

    def camera(self, index: int) -> slice:
        """Return the columns of a camera, in the order of `camera.model.PARAMETERS`."""
        return slice(N_PARAMETERS * index, N_PARAMETERS * (index + 1))

    @property
    def of_cameras(self) -> slice:
        return slice(0, N_PARAMETERS * self.cameras)

    @property
    def of_leds(self) -> slice:
        return slice(self.of_cameras.stop, self.of_cameras.stop + 3 * self.leds)

    @property
    def of_tip(self) -> slice:
        return slice(self.of_leds.stop, self.of_leds.stop + 3)

    @property
    def of_seats(self) -> slice:
        return slice(self.of_tip.stop, self.of_tip.stop + 3 * self.seats)

    @property
    def of_lengths(self) -> slice:
        return slice(self.of_seats.stop, self.of_seats.stop + self.bars)

    @property
    def count(self) -> int:
        return int(self.of_lengths.stop)

    def all_leds(self) -> Int:
        return np.arange(self.of_leds.start, self.of_leds.stop)

    def of_lenses(self) -> Int:
        """Return the columns of all lenses, camera by camera."""
        per_camera = np.arange(LENS.start, LENS.stop)
        return (N_PARAMETERS * np.arange(self.cameras)[:, None] + per_camera).ravel()

    def of_extrinsics(self) -> Int:
        """Return the columns of the camera poses, camera by camera."""
        return (N_PARAMETERS * np.arange(self.cameras)[:, None] + np.arange(6)).ravel()


@dataclass(frozen=True, slots=True)
class BundleState:
    """All unknowns of a bundle."""

    cameras: tuple[CameraModel, ...]
    leds: Points3
    tip: Float
    """`leds`, `tip`: (L, 3) and (3,), mm, probe frame."""
    seats: Points3
    """(S, 3), mm, world: centres of the ball."""
    lengths: Float
    """(B,), mm."""
    rotations: Float
    origins: Points3
    """`rotations`, `origins`: (n, 3, 3) and (n, 3), mm: poses of the frames, world from probe."""
    bar_rotations: Float
    bar_origins: Points3
    """`bar_rotations`, `bar_origins`: (m, 3, 3), (m, 3), mm: bars along their x, world from bar."""

    @property
    def columns(self) -> Columns:
        return Columns(len(self.cameras), len(self.leds), len(self.seats), len(self.lengths))

    @property
    def leds_world(self) -> Float:
        """Return the LEDs in all frames, (n, L, 3), mm, world."""
        placed: Float = np.einsum("nij,lj->nli", self.rotations, self.leds)
        return placed + self.origins[:, None]

    def packed(self) -> Float:
        """Return the cameras in kernel form, (C, 24)."""
        return np.stack([LensCamera(camera).packed() for camera in self.cameras])

    def values(self) -> Float:
        """Return the values a prior may constrain; zero for cameras' and seats' positions."""
        columns = self.columns
        values = np.zeros(columns.count)
        for index, camera in enumerate(self.cameras):
            values[columns.camera(index)][LENS] = (
                camera.focal, camera.aspect, camera.u0, camera.v0,
                camera.k1, camera.k2, camera.p1, camera.p2,
            )  # fmt: skip
        values[columns.of_leds] = self.leds.ravel()
        values[columns.of_tip] = self.tip
        values[columns.of_lengths] = self.lengths
        return values

    def bar_leds(self, bar: int) -> Points3:
        """Return the LEDs (2, 3), mm, of a bar in its own frame."""
        half = 0.5 * self.lengths[bar]
        return np.array([[-half, 0.0, 0.0], [half, 0.0, 0.0]])

    def moved(self, step: Float, pose_steps: Float, bar_steps: Float) -> BundleState:
        """Return the state after steps of the common columns and of all poses, (n, 6), (m, 6)."""
        columns = self.columns
        rotations, origins = self.rotations.copy(), self.origins.copy()
        bar_rotations, bar_origins = self.bar_rotations.copy(), self.bar_origins.copy()
        retract_poses(rotations, origins, pose_steps)
        retract_poses(bar_rotations, bar_origins, bar_steps)
        return BundleState(
            cameras=tuple(
                camera.perturbed(step[columns.camera(index)])
                for index, camera in enumerate(self.cameras)
            ),
            leds=self.leds + step[columns.of_leds].reshape(-1, 3),
            tip=self.tip + step[columns.of_tip],
            seats=self.seats + step[columns.of_seats].reshape(-1, 3),
            lengths=self.lengths + step[columns.of_lengths],
            rotations=rotations,
            origins=origins,
            bar_rotations=bar_rotations,
            bar_origins=bar_origins,
        )

    def in_world(self, T_new_from_old: RigidTransform) -> BundleState:
        """Return the same state in another world frame."""
        back = T_new_from_old.inverse()
        return replace(
            self,
            cameras=tuple(
                replace(camera, T_camera_from_world=camera.T_camera_from_world.compose(back))
                for camera in self.cameras
            ),
            seats=T_new_from_old.apply(self.seats),
            rotations=T_new_from_old.rotation @ self.rotations,
            origins=T_new_from_old.apply(self.origins),
            bar_rotations=T_new_from_old.rotation @ self.bar_rotations,
            bar_origins=T_new_from_old.apply(self.bar_origins),
        )

    def world_motions(self) -> Float:
        """Return derivatives (k, 6) by small world rotations (rad) and shifts (mm) of all."""
        columns = self.columns
        motions = np.zeros((columns.count, 6))
        for index, camera in enumerate(self.cameras):
            rotation = camera.T_camera_from_world.rotation
            part = motions[columns.camera(index)]
            part[0:3, 0:3] = -rotation
            part[3:6, 3:6] = -rotation
        seats = motions[columns.of_seats]
        for index, seat in enumerate(self.seats):
            seats[3 * index : 3 * index + 3, :3] = -skew(seat)
            seats[3 * index : 3 * index + 3, 3:] = np.eye(3)
        return motions

    def body_motions(self) -> Float:
        """Return derivatives (k, 6) by motions of LEDs and tip that the poses compensate."""
        columns = self.columns
        motions = np.zeros((columns.count, 6))
        body = motions[columns.of_leds.start : columns.of_tip.stop]
        for index, point in enumerate([*self.leds, self.tip]):
            body[3 * index : 3 * index + 3, :3] = -skew(point)
            body[3 * index : 3 * index + 3, 3:] = np.eye(3)
        return motions


@dataclass(frozen=True, slots=True)
class BundleData:
    """Observations; frames with a seat follow those without, placements are sorted by bar."""

    uv: Pixels
    weights: Float
    """`uv`, `weights`: (n, C, L, 2), px, and (n, C, L), 1/px: inverse sigma, zero if unused."""
    seats: Int
    """(n,): index of the seat, -1 for none."""
    waved: int
    seat_sigma: float
    """mm per axis: seating repeatability of the ball."""
    bar_uv: Pixels
    bar_weights: Float
    """`bar_uv`, `bar_weights`: (m, C, 2, 2), px, and (m, C, 2), 1/px."""
    bars: Int
    """(m,): bar index of each placement, ascending."""
    touched: Int
    """(t, 3): the two end seats of a bar, and that bar."""
    touched_sigma: float
    """mm: tolerance between the distance of those seats and the length of the bar."""

    def scaled(self, factors: Float, bar_factors: Float) -> BundleData:
        return replace(
            self, weights=self.weights * factors, bar_weights=self.bar_weights * bar_factors
        )

    def placements(self, bar: int) -> slice:
        first, behind = np.searchsorted(self.bars, (bar, bar + 1))
        return slice(int(first), int(behind))

    @property
    def active(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return masks of the frames (n,) and placements (m,) in use."""
        counts = (np.count_nonzero(w, axis=(1, 2)) for w in (self.weights, self.bar_weights))
        frames, placements = (np.greater(count, 0) for count in counts)
        return frames, placements

    @property
    def excess(self) -> int:
        """Return the number of observations less that of frame and placement unknowns."""
        spots = np.count_nonzero(self.weights) + np.count_nonzero(self.bar_weights)
        frames, placements = self.active
        seated = np.count_nonzero(frames & (self.seats >= 0))
        conditions = 3 * seated + len(self.touched)
        return int(2 * spots + conditions - 6 * frames.sum() - 5 * placements.sum())


@dataclass(frozen=True, slots=True)
class Prior:
    """Prior of the common unknowns."""

    values: Float
    """(k,), as `BundleState.values`."""
    information: Float
    """(k, k): inverse of their covariance; zero without prior."""
    free: Int
    """Free columns; the others stay fixed."""
    rows: int
    """Number of prior observations among them."""
    body_floats: bool = False
    """No prior for the LEDs, so the probe's position in its own frame is free."""
    thermal: Float | None = None
    """(k,): growth by one kelvin of error of the thermometer, already in `information`."""

    @property
    def gauge(self) -> int:
        """Return the number of unobservable motions."""
        return 12 if self.body_floats else 6
