"""Tip relative to a reference body, independent of moves of camera frame or table.

The reference body is fixed to the part. Its pose at the start of the job is its *home*; the world
of the job is the frame of the cameras at that time. After any motion between cameras and part, the
present pose of the reference body transforms the tip back to that world:

    tip_world = T_rig_from_reference(home) . T_rig_from_reference(now)^-1 . tip_rig

Both poses of a frame come from the same exposure, so there is no lag. Trail and live position use a
pose averaged while the body rests (`_reference_body`); measured points use the poses of their own
frames (`simultaneous`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int, RigidTransform
from ocmm_core.tracking import _body_tracker as body_tracker
from ocmm_core.tracking import _sensitivity as sensitivity
from ocmm_core.tracking._body import ProbeBody
from ocmm_core.tracking._pose import arm_jacobian, reprojection
from ocmm_core.tracking._reference_body import ReferenceBody, ReferenceFilter
from ocmm_core.tracking._result import (
    INTERRUPTION_NS,
    FrameStatus,
    ReferenceHome,
    ReferenceTrack,
    TrackBlock,
)

HOME_NS = 250_000_000
"""Bus time of the averaged home."""

HOME_WANDER_PX = 0.1
"""Largest wander of spots while the home is recorded, beyond noise: 50 um at one metre."""

_BATCHES = 10
_SIGMAS = 5.0


class HomeRecorder:
    """Records the first place of rest of a reference body; for one thread."""

    def __init__(self, rig: Rig, reference: ReferenceBody) -> None:
        self.reason = "its position is being taken"
        """Why there is no home yet."""
        self._rig = rig
        self._reference = reference
        self._spots: list[Float] = []
        self._began_ns = self._before_ns = self._count = 0
        self._seen = np.zeros(0, dtype=np.uint64)

    def push(self, body: TrackBlock) -> tuple[int, ReferenceHome] | None:
        """Add frames and return the home, with the index of the first frame after it."""
        for index in range(len(body)):
            now_ns = int(body.time_ns[index])
            good = body.status[index] == FrameStatus.OK
            gap = now_ns - self._before_ns > INTERRUPTION_NS or now_ns <= self._before_ns
            self._before_ns = now_ns
            more = np.bitwise_count(body.seen[index]).sum() > np.bitwise_count(self._seen).sum()
            if not good or gap or more:
                self._start(body, index)
            if not good:
                continue
            self._count += 1
            # An LED may be dark in some frames: average those with most LEDs.
            if np.array_equal(body.seen[index], self._seen):
                self._spots.append(body.uv[index])
            if now_ns - self._began_ns < HOME_NS:
                continue
            spots = np.array(self._spots)
            enough = len(spots) >= max(2 * _BATCHES, self._count // 2)
            self._start(body, index)
            if enough and self._rests(spots):
                return index + 1, home_of(
                    spots.mean(axis=0), len(spots), self._rig, self._reference
                )
            if enough:
                self.reason = "it is not at rest, so its position cannot be taken"
        return None

    def _start(self, body: TrackBlock, index: int) -> None:
        self._spots.clear()
        self._count = 0
        self._began_ns, self._seen = int(body.time_ns[index]), body.seen[index]

    def _rests(self, spots: Float) -> bool:
        means = np.array([part.mean(axis=0) for part in np.array_split(spots, _BATCHES)])
        noise = _SIGMAS * body_tracker.spot_sigma_px(self._rig) / np.sqrt(len(spots) / _BATCHES)
        wander = float(np.nanmax(np.abs(means - means.mean(axis=0))))
        return wander < max(HOME_WANDER_PX, float(noise))


def home_of(spots: Float, n_frames: int, rig: Rig, reference: ReferenceBody) -> ReferenceHome:
    """Return the home from mean spots (C, R, 2), px; TrackingError without a pose."""
    pose = sensitivity.pose_sensitivity(spots, rig, reference.leds.leds_body)
    return ReferenceHome(spots, n_frames, RigidTransform(pose.rotation, pose.origin))


_SETTLED = 64
"""Frames of the averaged pose from which a motion is reported."""
_NEAR_MM, _NEAR_RAD = 5.0, 0.01
"""The covariance of the pose is recomputed if the body has moved further."""


@dataclass(frozen=True, slots=True)
class ReferencePoses:
    """Poses of a reference body that tips are related to."""

    rotation: Float
    origin: Float
    """`rotation`, `origin`: (n, 3, 3) and (n, 3), mm, rig frame."""
    covariance: Float
    """(n, 6, 6), for the increments of `pose.reprojection`, rig frame."""


class ReferenceTracker:
    """Track a reference body, and relate the probe to it; for one thread.

    ``home`` is the pose at the start of the job; None to use the first place of rest.
    """

    def __init__(
        self,
        rig: Rig,
        reference: ReferenceBody,
        options: body_tracker.TrackingOptions,
        home: ReferenceHome | None = None,
    ) -> None:
        self.tracker = body_tracker.BodyTracker(rig, reference.leds, reference.middle, options)
        self.home = home
        self.motion: tuple[float, float] | None = None
        """Distance of the middle of its LEDs from home, mm, and rotation, rad; None until the mean
        of the pose has settled."""
        self._rig = rig
        self._reference = reference
        self._taker = HomeRecorder(rig, reference)
        self._filter = ReferenceFilter()
        self._anchors: dict[bytes, _Anchor] = {}

    @property
    def reason(self) -> str:
        """Return why relative positions are unavailable, or empty text."""
        if self.tracker.slot_of_led is None:
            return self.tracker.reason
        return self._taker.reason if self.home is None else ""

    def process(self, block: FrameBlock) -> ReferenceTrack:
        """Return the track of the reference body; the probe is added later."""
        body = self.tracker.process(block)
        return ReferenceTrack(body, body, self._covariances(body), self.home)

    def relate(self, probe: TrackBlock, seen: ReferenceTrack, left: FrameBlock) -> TrackBlock:
        """Return the tracked probe (rig frame) in the world of the job.

        ``left`` are the same frames without the spots of the probe.
        """
        begin = 0
        doubt = seen.body.status == FrameStatus.UNIDENTIFIED
        # Spots explained by the probe are not the reference body: it is not visible.
        seen.body.status[doubt & ~body_tracker.enough_spots(left.uv)] = FrameStatus.LOST
        if self.home is None:
            taken = self._taker.push(seen.body)
            begin = len(probe) if taken is None else taken[0]
            self.home = taken[1] if taken is not None else None
        poses = ReferencePoses(*self._filter.push(seen.body, seen.covariance))
        if self.home is None or not self._filter.n_frames:
            self.motion = None
        elif self._filter.n_frames >= _SETTLED:
            self.motion = self._motion(self.home, poses.rotation[-1], poses.origin[-1])
        seen = replace(seen, probe=probe, home=self.home)
        return related(seen, poses, begin)

    def _motion(self, home: ReferenceHome, rotation: Float, origin: Float) -> tuple[float, float]:
        turn, shift = motion_to_world(home, rotation[None], origin[None])
        middle = rotation @ self._reference.middle + origin
        moved = turn[0] @ middle + shift[0] - middle
        sine = 0.5 * np.array(
            [turn[0, 2, 1] - turn[0, 1, 2], turn[0, 0, 2] - turn[0, 2, 0],
             turn[0, 1, 0] - turn[0, 0, 1]]
        )  # fmt: skip
        return float(np.linalg.norm(moved)), float(np.arcsin(min(float(np.linalg.norm(sine)), 1.0)))

    def _covariances(self, body: TrackBlock) -> Float:
        """Return the covariance (n, 6, 6) of every pose, NaN without a pose."""
        covariance = np.full((len(body), 6, 6), np.nan)
        good = np.flatnonzero(body.status == FrameStatus.OK)
        while len(good):
            pattern = body.seen[good[0]]
            alike = (body.seen[good] == pattern).all(axis=1)
            left, good = good[alike], good[~alike]
            key = pattern.tobytes()
            while len(left):
                anchor = self._anchors.get(key)
                if anchor is None or not anchor.is_near(body, left[:1])[0]:
                    anchor = self._anchors[key] = self._anchor_at(body, int(left[0]))
                near = anchor.is_near(body, left)
                stop = len(left) if near.all() else int(np.argmin(near))
                covariance[left[:stop]] = anchor.covariance
                left = left[stop:]
        return covariance

    def _anchor_at(self, body: TrackBlock, frame: int) -> _Anchor:
        rotation, origin = body.rotation_world_from_probe[frame], body.origin_world[frame]
        leds = self._reference.leds.leds_body
        _, rows = reprojection(self._rig, leds, body.uv[frame], rotation, origin)
        inverse = np.linalg.inv(rows.T @ rows).astype(np.float64)
        return _Anchor(rotation, origin, body_tracker.spot_sigma_px(self._rig) ** 2 * inverse)


@dataclass(frozen=True, slots=True)
class _Anchor:
    rotation: Float
    origin: Float
    covariance: Float

    def is_near(self, body: TrackBlock, frames: Int) -> NDArray[np.bool_]:
        shift = np.linalg.norm(body.origin_world[frames] - self.origin, axis=1)
        turn = np.abs(body.rotation_world_from_probe[frames] - self.rotation).max(axis=(1, 2))
        return np.asarray((shift < _NEAR_MM) & (turn < _NEAR_RAD))


def related(seen: ReferenceTrack, poses: ReferencePoses, begin: int = 0) -> TrackBlock:
    """Return the probe in the world of the job, from frame ``begin`` with a home on.

    The covariance of the tip includes the spot noise of both poses; the effect of the camera
    calibration is common to many points (`relative_sensitivity`). ``poses`` are the assumed ones of
    the reference body in each frame.
    """
    probe, home = seen.probe, seen.home
    lost = seen.body.status != FrameStatus.OK
    lost[: len(probe) if home is None else begin] = True
    status = np.where(lost, FrameStatus.REFERENCE_LOST, probe.status).astype(np.uint8)
    if home is None:
        turn, shift = np.full((len(probe), 3, 3), np.nan), np.full((len(probe), 3), np.nan)
    else:
        turn, shift = motion_to_world(home, poses.rotation, poses.origin)
        turn[lost], shift[lost] = np.nan, np.nan
    by_pose = arm_jacobian(probe.tip_world - poses.origin)
    covariance = probe.tip_covariance + by_pose @ poses.covariance @ by_pose.transpose(0, 2, 1)
    return replace(
        probe,
        status=status,
        tip_world=_moved(turn, shift, probe.tip_world),
        tip_covariance=turn @ covariance @ turn.transpose(0, 2, 1),
        rotation_world_from_probe=turn @ probe.rotation_world_from_probe,
        origin_world=_moved(turn, shift, probe.origin_world),
        reference=seen,
    )


def simultaneous(track: TrackBlock) -> TrackBlock:
    """Return tracked frames relative to the reference body's pose in the same frame."""
    seen = track.reference
    if seen is None:
        return track
    body = seen.body
    poses = ReferencePoses(body.rotation_world_from_probe, body.origin_world, seen.covariance)
    found = related(seen, poses)
    # Frames before the home stay without a tip.
    return replace(found, status=track.status)


def motion_to_world(home: ReferenceHome, rotation: Float, origin: Float) -> tuple[Float, Float]:
    """Return the transformation from the present rig frame to the job's world.

    (n, 3, 3) and (n, 3), mm, from the home of the reference body and its present pose, rig frame.
    """
    at_home = home.T_rig_from_reference
    turn: Float = at_home.rotation @ rotation.transpose(0, 2, 1)
    return turn, at_home.translation - (turn @ origin[:, :, None])[:, :, 0]


def relative_sensitivity(
    spots: Float,
    reference_spots: Float,
    home: ReferenceHome,
    rig: Rig,
    body: ProbeBody,
    reference: ReferenceBody,
) -> sensitivity.TipSensitivity:
    """Return the tip in the world of the job and its derivatives.

    It depends on three poses of the same cameras: probe, reference body now, and at home. If the
    reference body has not moved, camera errors affect its two poses equally and cancel; otherwise
    they cancel in part. Spots (C, L, 2), px, of all three are listed, those of the reference body
    now, of the same frames, with the opposite sign. TrackingError without a pose.
    """
    return relative_sensitivities(spots[None], reference_spots[None], home, rig, body, reference)[0]


def relative_sensitivities(
    spots: Float,
    reference_spots: Float,
    home: ReferenceHome,
    rig: Rig,
    body: ProbeBody,
    reference: ReferenceBody,
) -> tuple[sensitivity.TipSensitivity, ...]:
    """Return `relative_sensitivity` for n points: (n, C, L, 2) and (n, C, R, 2), px."""
    leds = reference.leds.leds_body
    tips = sensitivity.tip_sensitivities(spots, rig, body)
    poses = sensitivity.pose_sensitivities(reference_spots, rig, leds)
    then = sensitivity.pose_sensitivity(home.spots, rig, leds)
    leds_sigma: Float = np.linalg.cholesky(reference.geometry_covariance).astype(np.float64)
    spots_sigma = rig.noise.white_px / np.sqrt(home.n_frames)
    return tuple(
        _relative(tip, now, then, leds_sigma, spots_sigma)
        for tip, now in zip(tips, poses, strict=True)
    )


def _relative(
    tip: sensitivity.TipSensitivity,
    now: sensitivity.PoseSensitivity,
    then: sensitivity.PoseSensitivity,
    leds_sigma: Float,
    spots_sigma: float,
) -> sensitivity.TipSensitivity:
    """Return a tip in the world of the job, by the reference body now and then.

    ``leds_sigma @ leds_sigma.T`` is the covariance of its LEDs, ``spots_sigma`` that of home spots.
    """
    back = RigidTransform(then.rotation, then.origin).compose(
        RigidTransform(now.rotation, now.origin).inverse()
    )
    tip_world = back.apply(tip.tip_world)
    by_now = -back.rotation @ arm_jacobian(tip.tip_world - now.origin)
    by_then = arm_jacobian(tip_world - then.origin)
    by_home_spots = by_then @ then.by_spots
    by_leds = by_now @ now.by_leds + by_then @ then.by_leds
    return sensitivity.TipSensitivity(
        tip_world=tip_world,
        camera=np.concatenate([tip.camera, now.camera, then.camera]),
        uv=np.concatenate([tip.uv, now.uv, then.uv]),
        by_spots=np.concatenate(
            [
                np.einsum("ij,jmk->imk", back.rotation, tip.by_spots),
                (by_now @ now.by_spots).reshape(3, -1, 2),
                by_home_spots.reshape(3, -1, 2),
            ],
            axis=1,
        ),
        by_cameras=back.rotation @ tip.by_cameras
        + by_now @ now.by_cameras
        + by_then @ then.by_cameras,
        by_geometry=back.rotation @ tip.by_geometry,
        by_common=np.hstack([by_leds @ leds_sigma, spots_sigma * by_home_spots]),
    )


def _moved(turn: Float, shift: Float, points: Float) -> Float:
    return (turn @ points[:, :, None])[:, :, 0] + shift
