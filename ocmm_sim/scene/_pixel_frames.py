"""Rendered cameras of the virtual rig: light, sensor, windows, spots.

Implements `pattern.CameraFrames` and `pattern.SensorControl` for software cameras. Only the windows
and the search lines are rendered.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag
from ocmm_core.camera import NO_BLACK, FinderState, SpotBlock, SpotFinder, SpotOptions, Window
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.device import CameraConfig
from ocmm_core.geometry import Float
from ocmm_sim.scene import _exposure as exposure
from ocmm_sim.scene._rig import VirtualRig
from ocmm_sim.scene._sensor import Sensor, SensorOptions, normal_table
from ocmm_sim.scene._source import RigScript
from ocmm_sim.slave import Frames

CHUNK_FRAMES = 80
"""Frames per chunk, the distance between stored states."""

_KEPT_CHUNKS = 128
_MILESTONE = 100
"""Every this many chunks a state is kept permanently: one per second at 8 kHz."""
_CACHED_CHUNKS = 4
_CATCH_UP_CHUNKS = 200
"""A camera that must skip more chunks than this was idle and restarts."""
_FACTORY_FRAMES = 64


@dataclass(slots=True)
class _Camera:
    sensor: Sensor
    finder: SpotFinder
    exposure_ns: int
    lit: NDArray[np.bool_]
    black: NDArray[np.uint16]
    states: dict[int, FinderState] = field(default_factory=dict)
    starts: set[int] = field(default_factory=set)
    chunks: dict[int, SpotBlock] = field(default_factory=dict)
    frame: int = 0

    def forget(self) -> None:
        """Restart the camera with the next frames."""
        self.states.clear()
        self.starts.clear()
        self.chunks.clear()


class PixelFrames:
    """Cameras of a virtual rig with rendered pixels; for one thread.

    A camera starts searching with the first frames requested after it was made or configured, and
    after long gaps. From there its frames are a function of script, options and settings, for any
    grouping of requests. Noise, scale and times of ``spots`` follow from sensor and rig.
    """

    def __init__(
        self,
        rig: VirtualRig,
        options: SensorOptions | None = None,
        spots: SpotOptions | None = None,
    ) -> None:
        self.rig = rig
        self.options = options or SensorOptions()
        self._spots = _matched(spots or SpotOptions(), self.options)
        defaults = CameraConfig()
        normal = normal_table()
        self._cameras = []
        for index, model in enumerate(rig.truth.cameras):
            sensor = Sensor(rig.seed, index, model.width, model.height, self.options, normal)
            factory = sensor.black_image(_FACTORY_FRAMES, defaults.exposure_ns)
            self._cameras.append(
                _Camera(
                    sensor=sensor,
                    finder=self._finder(sensor, defaults.threshold, ()),
                    exposure_ns=defaults.exposure_ns,
                    lit=np.ones(rig.n_leds, np.bool_),
                    black=factory if self.options.factory_black else NO_BLACK,
                )
            )

    def camera_frames(self, camera: int, first: int, count: int) -> Frames:
        """Return `count` frames of a camera from `first`; see `CameraFrames`."""
        block = self.spots(camera, first, count)
        probe = self.rig.flags(self.rig.motion(first, count), first)
        saturated = np.where(block.saturated, FrameFlag.SATURATED, 0)
        return block.valid.astype(np.uint16), (probe | saturated).astype(np.uint16), block.uv

    def frames(self, first: int, count: int) -> FrameBlock:
        """Return the frames of all cameras, joined as on the host."""
        seen = [self.camera_frames(camera, first, count) for camera in range(len(self._cameras))]
        counter = np.arange(first, first + count, dtype=np.int64)
        return FrameBlock(
            counter=counter,
            time_ns=counter * self.rig.frame_period_ns,
            flags=np.bitwise_or.reduce([flags for _, flags, _ in seen]).astype(np.uint32),
            valid=np.stack([valid for valid, _, _ in seen], axis=1).astype(np.uint64),
            uv=np.stack([uv for _, _, uv in seen], axis=1),
        )

    def spots(self, camera: int, first: int, count: int) -> SpotBlock:
        """Return the spots of one camera with variance and status."""
        unit = self._cameras[camera]
        if count < 1:
            return SpotBlock.empty(0)
        unit.frame = first + count - 1
        numbers = range(first // CHUNK_FRAMES, unit.frame // CHUNK_FRAMES + 1)
        pieces = [self._chunk(camera, number) for number in numbers]
        start = first - numbers[0] * CHUNK_FRAMES
        part = slice(start, start + count)
        return SpotBlock(
            valid=np.concatenate([piece.valid for piece in pieces])[part],
            saturated=np.concatenate([piece.saturated for piece in pieces])[part],
            status=np.concatenate([piece.status for piece in pieces])[part],
            uv=np.concatenate([piece.uv for piece in pieces])[part],
            variance=np.concatenate([piece.variance for piece in pieces])[part],
        )

    def configure(self, camera: int, config: CameraConfig) -> None:
        """Configure a camera, which restarts searching; see `SensorControl`.

        InputError if exposure exceeds the period, threshold is zero, or a window is off.
        """
        unit = self._cameras[camera]
        if not 0 < config.exposure_ns <= self.rig.frame_period_ns:
            raise InputError(
                "camera.exposure",
                f"The exposure time is {config.exposure_ns} ns, but a frame lasts "
                f"{self.rig.frame_period_ns} ns.",
                "Set an exposure time above zero and within the frame period.",
            )
        windows = tuple(Window(*window) for window in config.windows)
        unit.finder = self._finder(unit.sensor, config.threshold, windows)
        unit.exposure_ns = config.exposure_ns
        lit = (config.strobe >> np.arange(len(unit.lit))) & 1 == 1
        unit.lit = np.asarray(lit) if config.strobe else np.ones_like(unit.lit)
        unit.forget()

    def image(
        self, camera: int, left: int, top: int, width: int, height: int
    ) -> NDArray[np.uint16]:
        """Return a region of the camera's last frame; raise InputError if off the sensor."""
        unit = self._cameras[camera]
        sensor = unit.sensor
        if (
            min(left, top) < 0
            or min(width, height) < 1
            or left + width > sensor.width
            or top + height > sensor.height
        ):
            raise InputError(
                "camera.image",
                f"The region of {width} x {height} px at ({left}, {top}) does not lie on the "
                f"sensor of {sensor.width} x {sensor.height} px.",
                "Ask for a region that lies on the sensor.",
            )
        lights = self._lights(camera, unit.frame, 1)[0]
        return sensor.picture(unit.frame, lights, unit.exposure_ns, left, top, width, height)

    def black_image(self, camera: int, frames: int) -> NDArray[np.uint16]:
        """Return the mean of `frames` frames of the whole sensor with the LEDs off."""
        unit = self._cameras[camera]
        return unit.sensor.black_image(frames, unit.exposure_ns)

    def set_black_image(self, camera: int, image: NDArray[np.uint16] | None) -> None:
        """Subtract this image, or none, and restart the search; InputError for wrong size."""
        unit = self._cameras[camera]
        shape = (unit.sensor.height, unit.sensor.width)
        if image is not None and image.shape != shape:
            raise InputError(
                "camera.black_image",
                f"The black image has {image.shape} pixels (rows, columns), the sensor {shape}.",
                "Take the black image with this camera.",
            )
        unit.black = NO_BLACK if image is None else np.array(image, np.uint16, order="C")
        unit.forget()

    def temperature_c(self, camera: int) -> float:
        """Return the sensor temperature, degrees Celsius; the same for all cameras."""
        return self._cameras[camera].sensor.options.temperature_c

    def _finder(self, sensor: Sensor, threshold: int, start: tuple[Window, ...]) -> SpotFinder:
        options = replace(self._spots, threshold=float(threshold))
        options = options.at_period(self.rig.frame_period_ns, sensor.width)
        return SpotFinder(sensor.width, sensor.height, options, start)

    def _lights(self, camera: int, first: int, count: int) -> Float:
        unit = self._cameras[camera]
        _, uv = self.rig.led_images(camera, first, count)
        return unit.sensor.lights(uv, unit.lit, unit.exposure_ns)

    def _chunk(self, camera: int, number: int) -> SpotBlock:
        unit = self._cameras[camera]
        if number not in unit.chunks:
            begin = number
            while begin not in unit.states and 0 < begin > number - _CATCH_UP_CHUNKS:
                begin -= 1
            if begin not in unit.states:
                begin = number
                unit.states[begin] = FinderState.fresh()
                unit.starts.add(begin)
            for chunk in range(begin, number + 1):
                self._make(camera, chunk)
        return unit.chunks[number]

    def _make(self, camera: int, number: int) -> None:
        """Make a chunk from its stored state, and store the state after it."""
        unit = self._cameras[camera]
        finder, sensor = unit.finder, unit.sensor
        first = number * CHUNK_FRAMES
        state = unit.states[number].copy()
        block = SpotBlock.empty(CHUNK_FRAMES)
        exposure.run(
            first, self._lights(camera, first, CHUNK_FRAMES), sensor.packed(unit.exposure_ns),
            sensor.pattern_key, sensor.frame_stream, sensor.normal, unit.black,
            state.slots, state.cursor, finder.regions, finder.anywhere, finder.packed,
            sensor.height, block.valid, block.saturated, block.status, block.uv, block.variance,
        )  # fmt: skip
        unit.states.setdefault(number + 1, state)
        unit.chunks[number] = block
        if len(unit.chunks) > _CACHED_CHUNKS:
            del unit.chunks[next(iter(unit.chunks))]
        old = number - _KEPT_CHUNKS
        if old % _MILESTONE and old not in unit.starts:
            unit.states.pop(old, None)


class PixelScript(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Serialisable description of `PixelFrames`."""

    pixels: SensorOptions
    script: RigScript

    def to_json(self) -> str:
        return msgspec.json.encode(self).decode("utf-8")

    def build(self) -> PixelFrames:
        """Load the documents and return the cameras."""
        return PixelFrames(self.script.build(), self.pixels)


def _matched(spots: SpotOptions, sensor: SensorOptions) -> SpotOptions:
    """Return spot options matched to the noise and gain of the sensor."""
    gain = sensor.electrons_per_count
    return replace(
        spots,
        read_noise=sensor.read_noise_electrons / gain,
        dark_spread=sensor.dark_spread_electrons / gain,
        black_frames=_FACTORY_FRAMES,
        response_spread=sensor.response_spread,
        electrons_per_count=gain,
        full_scale=float(sensor.full_scale),
    )
