"""The virtual rig: cameras that see an operator touch a part with a probe.

What a camera sees in a frame is a pure function of the frame number, whatever the blocks in
which it is asked for and whichever process asks: every software camera on the bus builds the
same rig from the same script and asks for its own frames only.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag
from ocmm_core.camera.model import CameraModel
from ocmm_core.camera.rig import MAX_SLOTS, Rig, load_rig
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, Int, RigidTransform
from ocmm_core.simulation import kernels
from ocmm_core.simulation.artefacts import Part, TrueFeature, load_part
from ocmm_core.simulation.operator import Motion, Operator, Touches
from ocmm_core.simulation.world import (
    WorldOptions,
    bumped,
    draw_world,
    hidden_leds,
    white_noise,
)
from ocmm_core.tracking.body import ProbeBody, load_probe

S = TypeVar("S", bound=msgspec.Struct)
"""Kinds of scripts."""

_BLOW_NS = 1_000_000_000
"""A blow is reported for so long."""

CameraFrames = tuple[NDArray[np.uint16], NDArray[np.uint16], Float]
"""Valid slots (n,), flags (n,) and spots (n, 8, 2), px, of one camera."""


@dataclass(frozen=True, slots=True)
class TrueTouch:
    """One touch as it truly happens.

    Attributes
    ----------
    feature
        Name of the feature.
    contact_s
        Bus time at which the ball first meets the surface, s.
    first_frame, last_frame
        Frames in which the ball rests in contact.
    surface_world
        (3,), mm: the point that is touched.
    normal_world
        (3,), unit: from the material towards the ball.
    tip_world
        (3,), mm: ball centre at rest.
    """

    feature: str
    contact_s: float
    first_frame: int
    last_frame: int
    surface_world: Float
    normal_world: Float
    tip_world: Float


@dataclass(frozen=True, slots=True)
class Truth:
    """Everything that is truly there; the measuring side never sees it.

    Attributes
    ----------
    cameras
        As they are.
    leds_probe, tip_probe
        (L, 3) and (3,), mm, probe frame.
    tip_radius
        mm.
    slots
        (C, L): the slot in which each camera follows each LED.
    T_world_from_part
        Where the part stands.
    features_part, features_world
        The surfaces by name, in both frames.
    touches
        In the order of the script.
    """

    cameras: tuple[CameraModel, ...]
    leds_probe: Float
    tip_probe: Float
    tip_radius: float
    slots: Int
    T_world_from_part: RigidTransform
    features_part: dict[str, TrueFeature]
    features_world: dict[str, TrueFeature]
    touches: tuple[TrueTouch, ...]


class VirtualRig:
    """Cameras, probe, part and operator.

    Parameters
    ----------
    rig, body, part
        What the documents say. The truth about cameras and probe differs from it by a draw from
        its covariance.
    touches
        What the operator touches: names of features of the part and numbers of touches.
    seed
        Of everything that is drawn; 0 to 2^63 - 1.
    options
        Which imperfections there are.
    frame_rate_hz
        Exposures a second; that of the rig unless given.
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
        self._world = draw_world(rig, body, seed, self.options)
        self._operator = Operator(part, self._world.tip_radius, touches, seed)
        self._packed = [self._places_of(camera) for camera in range(len(rig.cameras))]

    @property
    def n_frames(self) -> int:
        """Return the length of the script in frames."""
        return self._frame_at(self._operator.duration_s)

    @property
    def truth(self) -> Truth:
        """Return what is truly there, with the touches of the script so far."""
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
        )

    def extend(self, touches: Touches, after_frame: int = 0) -> None:
        """Append touches after the end of the script, or after ``after_frame`` if that is later.

        Any thread may call this while another one reads frames.
        """
        self._operator.extend(touches, after_frame * self.frame_period_ns * 1e-9)

    def motion(self, first: int, count: int) -> Motion:
        """Return where the probe truly is in ``count`` frames from ``first`` on."""
        return self._operator.motion(self._times(first, count))

    def camera_frames(self, camera: int, first: int, count: int) -> CameraFrames:
        """Return what one camera sees in ``count`` frames from ``first`` on."""
        motion = self.motion(first, count)
        valid, uv = self._see(camera, motion, first, count, self._white(camera, first, count))
        return valid, self.flags(motion, first).astype(np.uint16), uv

    def flags(self, motion: Motion, first: int) -> NDArray[np.uint32]:
        """Return the flags of the probe in the frames of a motion from frame ``first`` on."""
        flags = np.where(motion.button, FrameFlag.BUTTON, 0).astype(np.uint32)
        frames = np.arange(first, first + len(flags))
        for drop in self.options.drops:
            felt = (frames >= drop) & (frames < drop + round(_BLOW_NS / self.frame_period_ns))
            flags[felt] |= FrameFlag.DROPPED
        return flags

    def led_images(self, camera: int, first: int, count: int) -> tuple[NDArray[np.bool_], Float]:
        """Return where the LEDs truly shine on a sensor in ``count`` frames from ``first`` on.

        Returns
        -------
        visible
            (count, L) bool, by number of the LED.
        uv
            (count, L, 2), px: without white noise, with the pattern of the optics; NaN where not
            visible.
        """
        slots = self._world.slots[camera]
        white = np.zeros((count, len(slots), 2))
        _, uv = self._see(camera, self.motion(first, count), first, count, white)
        by_led = uv[:, slots]
        return np.isfinite(by_led[..., 0]), by_led

    def frames(self, first: int, count: int) -> FrameBlock:
        """Return what all cameras see in ``count`` frames from ``first`` on."""
        return self.frames_of(self.motion(first, count), first)

    def frames_of(self, motion: Motion, first: int) -> FrameBlock:
        """Return what all cameras see of a probe that moves like this from frame ``first`` on."""
        count = len(motion.tip_world)
        seen = [
            self._see(camera, motion, first, count, self._white(camera, first, count))
            for camera in range(len(self._packed))
        ]
        counter = np.arange(first, first + count, dtype=np.int64)
        return FrameBlock(
            counter=counter,
            time_ns=counter * self.frame_period_ns,
            flags=self.flags(motion, first),
            valid=np.stack([valid for valid, _ in seen], axis=1),
            uv=np.stack([uv for _, uv in seen], axis=1),
        )

    def _white(self, camera: int, first: int, count: int) -> Float:
        """Return the noise of each frame (count, L, 2), px."""
        n_leds = len(self._world.leds_probe)
        if not (self.options.white_noise and count):
            return np.zeros((count, n_leds, 2))
        return white_noise(self.seed, camera, n_leds, first, count) * self.rig.noise.white_px

    def _see(
        self, camera: int, motion: Motion, first: int, count: int, white: Float
    ) -> tuple[NDArray[np.uint16], Float]:
        world, leds = self._world, self._world.leds_probe
        hidden = hidden_leds(
            self.options, self.seed, camera, len(leds), first, self._times(first, count)
        )
        valid, uv = np.empty(count, dtype=np.uint16), np.empty((count, MAX_SLOTS, 2))
        model, pattern = world.cameras[camera], world.patterns[camera]
        origins = motion.origin_world(world.tip_probe)
        starts = [start for start, _ in self._packed[camera]]
        ends = [*starts[1:], first + count]
        for (start, packed), end in zip(self._packed[camera], ends, strict=True):
            part = slice(max(start - first, 0), max(min(end - first, count), 0))
            if part.start >= part.stop:
                continue
            kernels.see(
                motion.rotation_world_from_probe[part],
                origins[part],
                leds,
                self.body.led_directions_probe,
                float(np.cos(self.body.emission_half_angle)),
                packed,
                float(model.width),
                float(model.height),
                world.slots[camera],
                pattern.nodes,
                pattern.step_px,
                white[part],
                hidden[part],
                valid[part],
                uv[part],
            )
        return valid, uv

    def _places_of(self, camera: int) -> list[tuple[int, Float]]:
        """Return from which frame on a camera stands where, for the kernel; the first from 0 on."""
        model = self._world.cameras[camera]
        places = [(0, model.packed())]
        for bump in self.options.bumps:
            if bump.camera == camera:
                model = bumped(model, bump)
                places.append((bump.first_frame, model.packed()))
        return places

    def _times(self, first: int, count: int) -> Float:
        frames = np.arange(first, first + count, dtype=np.float64)
        return frames * (self.frame_period_ns * 1e-9)

    def _frame_at(self, time_s: float) -> int:
        """Return the first frame that is not before a time."""
        return int(np.ceil(time_s / (self.frame_period_ns * 1e-9) - 1e-6))


class RigScript(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A virtual rig in words: what a process needs to build the same one.

    Attributes
    ----------
    rig, probe, part
        Paths of the documents.
    touches
        Names of features and numbers of touches.
    seed, options, frame_rate_hz
        As in `VirtualRig`; a rate of zero is that of the rig document.
    """

    rig: str
    probe: str
    part: str
    touches: tuple[tuple[str, int], ...]
    seed: int
    options: WorldOptions = WorldOptions()
    frame_rate_hz: int = 0

    def to_json(self) -> str:
        """Return the script as text."""
        return msgspec.json.encode(self).decode("utf-8")

    def build(self) -> VirtualRig:
        """Load the documents and return the rig."""
        return VirtualRig(
            load_rig(Path(self.rig)),
            load_probe(Path(self.probe)),
            load_part(Path(self.part)),
            self.touches,
            self.seed,
            self.options,
            self.frame_rate_hz or None,
        )


def decode_script(text: str | bytes, kind: type[S]) -> S:
    """Return the script in ``text``.

    Raises
    ------
    InputError
        The text is no such script.
    """
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.DecodeError as error:
        raise InputError(
            "simulation.script",
            f"The script of the virtual rig cannot be read: {error}.",
            "Start the virtual rig again with the ocmm command.",
        ) from error
