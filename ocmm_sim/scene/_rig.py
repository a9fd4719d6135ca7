"""Virtual rig: cameras that observe an operator touching a part with a probe.

A camera's view is a pure function of the frame number, for any grouping of requests and any
process: every software camera builds the same rig from the same script and requests its own frames
only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag
from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int, RigidTransform
from ocmm_core.tracking import LedBody, ProbeBody, ReferenceBody, dark_bits
from ocmm_sim.scene import _kernels as kernels
from ocmm_sim.scene._artefacts import Part, TrueTouch, Truth
from ocmm_sim.scene._operator import Missing, Motion, Operator, Touches
from ocmm_sim.scene._world import WorldOptions, bumped, draw_world, hidden_leds, nudged, white_noise

_BLOW_NS = 1_000_000_000
"""Duration of a shock report."""

_AHEAD, _AHEAD_OF_A_CAMERA = 640, 64
"""Frames computed at once: a call costs as much as some hundred frames, and a software camera must
answer within its cycle."""

CameraFrames = tuple[NDArray[np.uint16], NDArray[np.uint16], Float]
"""Valid slots (n,), flags (n,) and spots (n, 8, 2), px, of one camera, as sent on the wire."""


@dataclass(frozen=True, slots=True)
class _Lights:
    """LEDs of one body: true places (L, 3), mm, documented data, and slots (L,)."""

    leds: Float
    body: LedBody
    slots: Int


class VirtualRig:
    """Cameras, probe, part and operator.

    Parameters
    ----------
    rig, body, part
        From their documents. True cameras and probe deviate by a draw from the documents'
        covariance.
    seed
        Of all random draws; 0 to 2^63 - 1.
    frame_rate_hz
        Exposures per second; default: that of the rig.
    reference
        Reference body, attached to the part as its document states; its LED numbers follow those of
        the probe.
    behind_body
        LEDs, from 0, permanently hidden by the probe's body.
    paths, scans
        As in `Operator`.
    """

    def __init__(
        self,
        rig: Rig,
        body: ProbeBody,
        part: Part,
        touches: Touches,
        seed: int,
        options: WorldOptions | None = None,
        frame_rate_hz: int | None = None,
        reference: ReferenceBody | None = None,
        behind_body: Sequence[int] = (),
        paths: Mapping[str, float] = MappingProxyType({}),
        scans: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        if not 0 <= seed < 2**63:
            raise InputError(
                "simulation.seed", f"The seed is {seed}.", "Give a seed from 0 to 2^63 - 1."
            )
        if frame_rate_hz is not None and not 1 <= frame_rate_hz <= 1_000_000:
            raise InputError(
                "simulation.frame_rate",
                f"The frame rate of the virtual rig is {frame_rate_hz} Hz.",
                "Give 1 to 1000000 frames a second.",
            )
        self.rig = rig
        self.body = body
        self.part = part
        self.seed = seed
        self.options = options or WorldOptions()
        self.frame_period_ns = round(1e9 / (frame_rate_hz or rig.frame_rate_hz))
        self.reference = reference
        self._behind_body = np.uint64(sum(1 << led for led in behind_body))
        self._T_world_from_reference = _place_of(part) if reference is not None else None
        self._world = draw_world(rig, body, seed, self.options, reference)
        self._operator = Operator(
            part, self._world.tip_radius, touches, seed, self.frame_period_ns * 1e-9, paths, scans
        )
        self._packed = [self._places_of(camera) for camera in range(len(rig.cameras))]
        self._ahead: dict[tuple[int, ...], tuple[object, int, FrameBlock]] = {}

    @property
    def n_slots(self) -> int:
        """Return the slots per camera: the number of LEDs, `USUAL_SLOTS` at least."""
        return self._world.n_slots

    @property
    def n_leds(self) -> int:
        """Return the number of LEDs of the probe and of the reference body."""
        return self.body.n_leds + len(self._world.leds_reference)

    @property
    def n_frames(self) -> int:
        return self._frame_at(self._operator.duration_s)

    @property
    def tip_radius(self) -> float:
        """Return the true radius of the ball, mm."""
        return self._world.tip_radius

    @property
    def truth(self) -> Truth:
        """Return the truth, with the touches of the script so far."""
        world = self._world
        return Truth(
            cameras=world.cameras,
            leds_probe=world.leds_probe,
            tip_probe=world.tip_probe,
            tip_radius=world.tip_radius,
            slots=world.slots,
            T_world_from_part=self.part.T_world_from_part,
            features_part=self.part.features_part(),
            features_world=self.part.features_world(),
            touches=tuple(
                TrueTouch(
                    feature=touch.feature,
                    contact_s=touch.contact_s,
                    first_frame=self._frame_at(touch.settled_s),
                    last_frame=self._frame_at(touch.retract_s) - 1,
                    surface_world=touch.surface_world,
                    normal_world=touch.normal_world,
                    tip_world=touch.tip_world,
                )
                for touch in self._operator.touches
            ),
            leds_reference=world.leds_reference,
            reference_slots=world.reference_slots,
            T_world_from_reference=self._T_world_from_reference,
        )

    def extend(self, touches: Touches, after_frame: int = 0) -> None:
        """Append touches after the script's end, or `after_frame` if later; thread-safe."""
        self._operator.extend(touches, after_frame * self.frame_period_ns * 1e-9)

    def complete(self, missing: Missing, after_frame: int) -> None:
        """Append the touches that gave no point, as `extend` does, at the same places."""
        self._operator.complete(missing, after_frame * self.frame_period_ns * 1e-9)

    def touch(self, surface_world: Float, normal_world: Float, after_frame: int) -> None:
        """Append one touch at a place (3,), mm, with a normal (3,), unit, as `extend` does."""
        self._operator.touch(surface_world, normal_world, after_frame * self.frame_period_ns * 1e-9)

    def motion(self, first: int, count: int) -> Motion:
        """Return the true probe motion in `count` frames from `first`."""
        return self._nudged(self.operator_motion(first, count), first)

    def operator_motion(self, first: int, count: int) -> Motion:
        """Return the operator's motion, in the world before any nudge."""
        return self._operator.motion(self._times(first, count))

    def interrupt(self, frame: int) -> None:
        """End the script at a frame: the operator releases the probe."""
        self._operator.interrupt(frame * self.frame_period_ns * 1e-9)

    def resume(self, tip_world: Float, attitude: Float, frame: int) -> None:
        """Return the probe at (3,), mm and rad, to the operator, who brings it home."""
        self._operator.resume(tip_world, attitude, frame * self.frame_period_ns * 1e-9)

    def led_frames(
        self, motion_at: Callable[[Float], Motion], first: int, count: int
    ) -> FrameBlock:
        """Return all cameras' frames of an externally moved probe.

        ``motion_at`` is called once, with the times (count,), s, of the frames from ``first``.
        """
        return self.frames_of(self._nudged(motion_at(self._times(first, count)), first), first)

    def _nudged(self, motion: Motion, first: int) -> Motion:
        if not self.options.nudges:
            return motion
        turn, shift = nudged(self.options.nudges, np.arange(first, first + len(motion.tip_world)))
        return replace(
            motion,
            rotation_world_from_probe=turn @ motion.rotation_world_from_probe,
            tip_world=np.einsum("nij,nj->ni", turn, motion.tip_world) + shift,
        )

    def reference_pose(self, first: int, count: int) -> tuple[Float, Float]:
        """Return the true reference body poses: (count, 3, 3) and (count, 3), mm, world."""
        pose = self._T_world_from_reference or RigidTransform.identity()
        turn, shift = nudged(self.options.nudges, np.arange(first, first + count))
        return turn @ pose.rotation, turn @ pose.translation + shift

    def camera_frames(self, camera: int, first: int, count: int) -> CameraFrames:
        seen = self._frames([camera], first, count, _AHEAD_OF_A_CAMERA)
        return seen.valid[:, 0].astype(np.uint16), seen.flags.astype(np.uint16), seen.uv[:, 0]

    def flags(self, motion: Motion, first: int) -> NDArray[np.uint32]:
        """Return the probe flags in the frames of a motion from frame `first`."""
        flags = np.where(motion.button, FrameFlag.BUTTON, 0).astype(np.uint32)
        frames = np.arange(first, first + len(flags))
        for drop in self.options.drops:
            felt = (frames >= drop) & (frames < drop + round(_BLOW_NS / self.frame_period_ns))
            flags[felt] |= np.uint32(FrameFlag.DROPPED)
        return flags

    def led_images(self, camera: int, first: int, count: int) -> tuple[NDArray[np.bool_], Float]:
        """Return the true LED images of a camera in `count` frames from `first`.

        Visible (count, L), and uv (count, L, 2), px, without white noise, with the optical pattern,
        NaN if not visible; by LED number, those of a reference body last.
        """
        slots = np.concatenate([self._world.slots[camera], self._world.reference_slots[camera]])
        white = np.zeros((count, len(slots), 2))
        _, uv = self._see(camera, self.motion(first, count), first, count, white)
        by_led = uv[:, slots]
        return np.isfinite(by_led[..., 0]), by_led

    def frames(self, first: int, count: int) -> FrameBlock:
        return self._frames(range(len(self._packed)), first, count, _AHEAD)

    def frames_of(
        self, motion: Motion, first: int, cameras: Sequence[int] | None = None
    ) -> FrameBlock:
        """Return the frames of all or some cameras of a probe motion from frame `first`."""
        count = len(motion.tip_world)
        seen = [
            self._see(camera, motion, first, count, self._white(camera, first, count))
            for camera in (range(len(self._packed)) if cameras is None else cameras)
        ]
        counter = np.arange(first, first + count, dtype=np.int64)
        return FrameBlock(
            counter=counter,
            time_ns=counter * self.frame_period_ns,
            flags=self.flags(motion, first),
            valid=np.stack([valid for valid, _ in seen], axis=1),
            uv=np.stack([uv for _, uv in seen], axis=1),
        )

    def _frames(self, cameras: Sequence[int], first: int, count: int, many: int) -> FrameBlock:
        """Return frames of the script, from those computed ahead unless it changed since."""
        if count >= many:
            return self.frames_of(self.motion(first, count), first, cameras)
        script, begin, ahead = self._ahead.get(tuple(cameras), (None, 0, None))
        at = first - begin
        if ahead is None or script is not self._operator.script or not 0 <= at <= many - count:
            # The script before the motion: frames of an older one are never kept for a newer one.
            script, at = self._operator.script, 0
            ahead = self.frames_of(self.motion(first, many), first, cameras)
            self._ahead[tuple(cameras)] = script, first, ahead
        return ahead.part(slice(at, at + count))

    def _white(self, camera: int, first: int, count: int) -> Float:
        """Return the noise of each frame (count, L, 2), px."""
        if not (self.options.white_noise and count):
            return np.zeros((count, self.n_leds, 2))
        drawn = white_noise(self.seed, camera, self.body.n_leds, first, count)
        if self.reference is not None:
            beside = white_noise(
                self.seed, camera, self.reference.n_leds, first, count, beside=True
            )
            drawn = np.concatenate([drawn, beside], axis=1)
        return drawn * self.rig.noise.white_px

    def _see(
        self, camera: int, motion: Motion, first: int, count: int, white: Float
    ) -> tuple[NDArray[np.uint64], Float]:
        world, n_probe = self._world, self.body.n_leds
        hidden = hidden_leds(
            self.options, self.seed, camera, self.n_leds, first, self._times(first, count)
        )
        hidden = hidden | self._behind_body
        valid, uv = self._image(
            camera, first, motion.rotation_world_from_probe, motion.origin_world(world.tip_probe),
            _Lights(world.leds_probe, self.body.led_body, world.slots[camera]),
            white[:, :n_probe], hidden,
        )  # fmt: skip
        if self.reference is None:
            return valid, uv
        also, beside = self._image(
            camera, first, *self.reference_pose(first, count),
            _Lights(world.leds_reference, self.reference.leds, world.reference_slots[camera]),
            white[:, n_probe:], hidden >> np.uint64(n_probe),
        )  # fmt: skip
        return valid | also, np.where(np.isfinite(uv), uv, beside)

    def _image(
        self, camera: int, first: int, rotation: Float, origin: Float, lights: _Lights,
        white: Float, hidden: NDArray[np.uint64],
    ) -> tuple[NDArray[np.uint64], Float]:  # fmt: skip
        """Return valid slots (n,) and spots (n, S, 2) of one body in a camera."""
        count = len(origin)
        valid, uv = np.empty(count, dtype=np.uint64), np.empty((count, self.n_slots, 2))
        white = np.ascontiguousarray(white)
        if lights.body.code is not None:
            hidden = hidden | dark_bits(lights.body.code, np.arange(first, first + count))
        starts = [start for start, _ in self._packed[camera]]
        ends = [*starts[1:], first + count]
        for (start, packed), end in zip(self._packed[camera], ends, strict=True):
            part = slice(max(start - first, 0), max(min(end - first, count), 0))
            if part.start >= part.stop:
                continue
            kernels.see(
                rotation[part],
                origin[part],
                lights.leds,
                lights.body.led_directions_body,
                float(np.cos(lights.body.emission_half_angle)),
                packed,
                lights.slots,
                self._world.patterns[camera].nodes,
                white[part],
                hidden[part],
                valid[part],
                uv[part],
            )
        return valid, uv

    def _places_of(self, camera: int) -> list[tuple[int, Float]]:
        """Return the poses of a camera for the kernel with their first frames."""
        model = self._world.cameras[camera]
        places = [(0, self._world.packed(camera, model))]
        for bump in self.options.bumps:
            if bump.camera == camera:
                model = bumped(model, bump)
                places.append((bump.first_frame, self._world.packed(camera, model)))
        return places

    def _times(self, first: int, count: int) -> Float:
        return np.arange(first, first + count, dtype=np.float64) * (self.frame_period_ns * 1e-9)

    def _frame_at(self, time_s: float) -> int:
        """Return the first frame at or after a time."""
        return int(np.ceil(time_s / (self.frame_period_ns * 1e-9) - 1e-6))


def _place_of(part: Part) -> RigidTransform:
    """Return the pose of a reference body attached to a part, world frame."""
    if part.T_part_from_reference is None:
        raise InputError(
            "part.reference",
            f"The part '{part.name}' has no place for a reference body.",
            "Give its document a section [reference], or measure without a reference body.",
        )
    return part.T_world_from_part.compose(part.T_part_from_reference)
