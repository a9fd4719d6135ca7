"""Processor time to receive an image of a GigE Vision camera and to find its spots.

    python -m benchmarks.genicam [--seconds S] [--rate HZ]
    python -m benchmarks.genicam --faults N

Two software cameras of 1280 x 1024 px (Mono8) in a process of their own send images with four LEDs
in a private network; another process reads them by Aravis, as a station does: whole images, then
the part of the sensor that shows the LEDs. It passes or fails nothing.

``--faults``: each fault of the software camera N times; ends with 1 if a wrong frame was accepted,
frames did not come again within 3 s, or another sentence was reported.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np

from ocmm_core.acquisition.frames import SourceDescription
from ocmm_core.camera import Window
from ocmm_core.fieldbus.wire import set_link
from ocmm_genicam import AravisCameras, Expected, GenicamSource
from ocmm_sim.genicam import Feature, GigeCamera, GigeConfig
from tests.genicam.genicam_faults import AT_START, IN_USE, OF_PACKETS
from tests.host import private_network

_WIDTH, _HEIGHT = 1280, 1024
_LEDS = ((600.3, 480.2), (650.7, 470.6), (612.1, 530.9), (668.4, 520.5))
_REGION = Window(560, 432, 192, 160)
_SERIALS = ("101", "102")


def main() -> None:
    """Read whole images, then regions, and print what each costs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--rate", type=float, default=50.0)
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--faults", type=int, default=0)
    asked = parser.parse_args()
    if asked.faults:
        sys.exit(_play_faults(asked.faults))
    if not asked.inside:
        command = [*private_network(), sys.executable, "-m", "benchmarks.genicam", "--inside"]
        os.execvp(command[0], [*command, *sys.argv[1:]])  # noqa: S606 - this program
    set_link("lo", up=True)
    cameras = os.fork()
    if cameras == 0:
        _expose(asked.rate)
    try:
        for name, window in (("whole images", None), ("regions", _REGION)):
            count, cpu_s, spots = _read(asked.rate, asked.seconds, window)
            size = window or Window(0, 0, _WIDTH, _HEIGHT)
            sys.stdout.write(
                f"{name:13} {size.width} x {size.height} px: {count} images, {spots:.1f} spots, "
                f"{1e3 * cpu_s / max(count, 1):.3f} ms of processor an image\n"
            )
    finally:
        os.kill(cameras, signal.SIGKILL)
        os.waitpid(cameras, 0)


def _play_faults(repeats: int) -> int:
    """Play all faults, print a line for each, and return whether one was wrong."""
    wrong = 0
    for name in (*OF_PACKETS, *IN_USE, *AT_START):
        done = subprocess.run(  # noqa: S603 - this program
            [*private_network(), sys.executable, "-m", "tests.genicam.genicam_scenarios", "3600"],
            input=f"{repeats} {name}\n", capture_output=True, text=True, check=False,
        )  # fmt: skip
        found = json.loads(done.stdout.strip() or '{"wrong": -1}')
        code = IN_USE.get(name) or AT_START.get(name)
        if "counts" in found:
            ends = [seconds if after >= 20 else 99.0 for _, after, seconds in found["counts"]]
            good = max(ends) < 3.0
        else:
            ends = [seconds for _, _, seconds in found.get("told", [])]
            good = [one[0] for one in found.get("told", [])] == [code] * repeats
        good = good and found["wrong"] == 0
        wrong += not good
        sys.stdout.write(
            f"{name:24} {code or 'back by itself':22} {found['wrong']} wrong frames, at most "
            f"{max(ends, default=99.0):.2f} s{'' if good else '  WRONG'}\n"
        )
        sys.stdout.flush()
    return int(wrong > 0)


def _read(rate_hz: float, seconds: float, window: Window | None) -> tuple[int, float, float]:
    """Return images, processor time and mean spots of an image."""
    period_ns = round(1e9 / rate_hz)
    described = SourceDescription("test", (101, 102), period_ns, period_ns, True, True)
    expected = [Expected(one, _WIDTH, _HEIGHT, period_ns, window=window) for one in _SERIALS]
    source = GenicamSource(described, AravisCameras(), _SERIALS, expected, 2.0)
    source.open()
    try:
        _frames(source, 2.0)
        begun = time.process_time()
        valid = np.concatenate([np.zeros((0, 2), np.uint64), *_frames(source, seconds)])
        cpu_s = time.process_time() - begun
    finally:
        source.close()
        # The cameras are free again after their heartbeat.
        time.sleep(4.0)
    return valid.size, cpu_s, float(np.bitwise_count(valid).mean())


def _frames(source: GenicamSource, seconds: float) -> list[np.ndarray]:
    until, found = time.monotonic() + seconds, []
    while time.monotonic() < until:
        frames = source.read().frames
        if frames is not None:
            found.append(frames.valid)
    return found


def _expose(rate_hz: float) -> None:
    cameras = [
        GigeCamera(GigeConfig(one, f"127.0.0.{n}", _WIDTH, _HEIGHT, formats=("Mono8",)))
        for n, one in enumerate(_SERIALS, 2)
    ]
    light = np.full((_HEIGHT, _WIDTH), 8.0)
    v, u = np.indices(light.shape)
    for at_u, at_v in _LEDS:
        light += 180.0 * np.exp(-0.5 * ((u - at_u) ** 2 + (v - at_v) ** 2))
    image = light.astype(np.uint8)
    due = time.monotonic()
    for number in range(10**9):
        for camera in cameras:
            left, top, width, height = (
                camera.memory.integer(one)
                for one in (Feature.OFFSET_X, Feature.OFFSET_Y, Feature.WIDTH, Feature.HEIGHT)
            )
            part = np.ascontiguousarray(image[top : top + height, left : left + width])
            camera.send(part.data.cast("B"), 10**18 + round(number / rate_hz * 1e9))
        due = max(due + 1.0 / rate_hz, time.monotonic())
        threading.Event().wait(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    main()
