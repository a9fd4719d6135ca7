"""The virtual rig seen by GigE Vision cameras, in a private network namespace.

The program of this module runs the cameras and starts their reader. Images are those of the virtual
sensor: the surroundings of every spot are rendered for each frame, the dark pixels elsewhere come
from some frames that are rendered once.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.bus_process import read_first_line
from ocmm_core.acquisition.frames import FrameFlag, FrameRing
from ocmm_core.camera import Rig
from ocmm_core.composition import Feed
from ocmm_core.fieldbus.wire import set_link
from ocmm_core.geometry import Float
from ocmm_genicam import (
    GenicamConfig,
    expected_cameras,
    genicam_command,
    genicam_description,
    slots_for,
)  # fmt: skip
from ocmm_sim.bus import VirtualWire, paced, run_both, run_inside
from ocmm_sim.genicam._device import GigeCamera
from ocmm_sim.genicam._registers import Feature, GigeConfig
from ocmm_sim.scene import RigScript, Sensor, SensorOptions, VirtualRig, normal_table

GENICAM_RATE_HZ = 100
_MODULE = "ocmm_sim.genicam._virtual"
_FORMAT = "Mono12p"
_SENSOR = SensorOptions(
    read_noise_electrons=6.0, dark_spread_electrons=6.0, dark_level_counts=100.0,
    electrons_per_count=2.5, bits=12, hot_electrons=100.0,
)  # fmt: skip
"""An industrial sensor: 10,000 electrons in 12 bits."""
_EXPOSURE_NS = 100_000
_LED_ELECTRONS = 44_000.0
"""In a spot of 1 px (sigma): 7,000 in its middle."""
_DARK_FRAMES = 4
_REACH = 8
"""Rendered on each side of a spot, px."""
_PACKET_SIZE = 32_768
_FIRST_NS = 1_764_500_000_000_000_000
_PRESSED_FRAMES = 12
"""The line of the button is read between images, and the virtual hand presses for 40 ms."""
_SILENCE_S = 60.0
"""The cameras wait for a station that compiles."""


def virtual_genicam_feed(script: RigScript, rig: Rig, name: str, n_leds: int) -> Feed:
    """Return the cameras of a script and their reader, ready to start."""
    ring = FrameRing.create(len(rig.cameras), n_slots=slots_for(n_leds))
    at_rate = replace(rig, frame_rate_hz=script.frame_rate_hz)
    first, *others = expected_cameras(at_rate, ring.n_slots)
    serials = tuple(one.serial for one in rig.cameras)
    config = GenicamConfig(
        name=name, ring_path=str(ring.path), serials=tuple(map(str, serials)),
        cameras=(replace(first, button_line=0), *others), rig_serials=serials, stretched=True,
        silence_s=_SILENCE_S,
    )  # fmt: skip
    lines = script.to_json().encode() + b"\n" + str(ring.path).encode() + b"\n" + config.to_json()
    return Feed(VirtualWire(_MODULE, lines, ring), ring, genicam_description(config), live=True)


class RenderedCamera:
    """Images of one camera of a virtual rig, packed as they are sent."""

    def __init__(self, rig: VirtualRig, index: int, normal: Float) -> None:
        model = rig.truth.cameras[index]
        self._rig, self._index = rig, index
        self._sensor = Sensor(rig.seed, index, model.width, model.height, _SENSOR, normal)
        none = np.zeros((0, 3))
        self._dark = [
            packed(self._sensor.picture(frame, none, _EXPOSURE_NS, 0, 0, model.width, model.height))
            for frame in range(_DARK_FRAMES)
        ]

    def image(self, frame: int) -> memoryview:
        """Return the image of a frame as Mono12p."""
        sensor = self._sensor
        data = self._dark[frame % _DARK_FRAMES].copy()
        _, uv = self._rig.led_images(self._index, frame, 1)
        lights = np.column_stack([uv[0], np.full(len(uv[0]), _LED_ELECTRONS)])
        for u, v in uv[0][np.isfinite(uv[0]).all(axis=1)]:
            # Two pixels share three bytes.
            left = 2 * (min(max(int(u) - _REACH, 0), sensor.width - 2 * _REACH) // 2)
            top = min(max(int(v) - _REACH, 0), sensor.height - 2 * _REACH)
            data[top : top + 2 * _REACH, left * 3 // 2 : (left + 2 * _REACH) * 3 // 2] = packed(
                sensor.picture(frame, lights, _EXPOSURE_NS, left, top, 2 * _REACH, 2 * _REACH)
            )
        return data.data.cast("B")


def packed(counts: NDArray[np.uint16]) -> NDArray[np.uint8]:
    """Return counts (h, w), w even, as Mono12p (h, 3 w / 2)."""
    first, second = counts[:, 0::2], counts[:, 1::2]
    out = np.empty((len(counts), first.shape[1], 3), np.uint8)
    out[..., 0] = first & 0xFF
    out[..., 1] = first >> 8 | (second & 0xF) << 4
    out[..., 2] = second >> 4
    return out.reshape(len(counts), -1)


def main() -> None:
    """Inside the namespace: run the cameras, and start what reads them."""
    run_inside(_run)


def _run() -> int:
    descriptor = sys.stdin.fileno()
    rig = msgspec.json.decode(read_first_line(descriptor), type=RigScript).build()
    ring = FrameRing.attach(read_first_line(descriptor).decode().strip())
    set_link("lo", up=True)
    normal = normal_table()
    images = [RenderedCamera(rig, index, normal) for index in range(len(rig.rig.cameras))]
    for one in images:
        # Compiled before a reader waits.
        one.image(0)
    cameras = [
        GigeCamera(
            GigeConfig(
                serial=str(model.serial), address=f"127.0.0.{index + 2}", width=model.width,
                height=model.height, formats=(_FORMAT,), packet_size=_PACKET_SIZE,
            )
        )
        for index, model in enumerate(rig.rig.cameras)
    ]  # fmt: skip

    def serve(ended: Callable[[], bool]) -> None:
        released = 0
        for frame in paced(ring, ended, lambda: all(one.acquiring.is_set() for one in cameras)):
            if rig.flags(rig.motion(frame, 1), frame)[0] & FrameFlag.BUTTON:
                released = frame + _PRESSED_FRAMES
            cameras[0].memory.set_integer(Feature.LINES, int(frame < released))
            for camera, image in zip(cameras, images, strict=True):
                camera.send(image.image(frame), _FIRST_NS + frame * rig.frame_period_ns)

    try:
        return run_both(genicam_command(), rig, serve)
    finally:
        for camera in cameras:
            camera.close()
        ring.close()


if __name__ == "__main__":
    main()
