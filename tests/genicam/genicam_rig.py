"""Two software GigE Vision cameras that expose together, and the source that reads them.

A spot runs along a circle in the images, so that the place of a spot tells which exposure an image
is of.
"""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from ocmm_core.acquisition.frames import FrameBlock, SourceDescription
from ocmm_core.camera import USUAL_SLOTS, Window
from ocmm_core.documents import resource
from ocmm_core.fieldbus.wire import set_link
from ocmm_genicam import AravisCameras, Expected, GenicamSource
from ocmm_sim.genicam import Feature, GigeCamera, GigeConfig, Memory, packed

SIZE, PERIOD_NS, FIRST_NS = 256, 10_000_000, 10**18
TURN, RADIUS = 400, 60.0
HOST_PORT = 0x0D00
"""Register of GigE Vision: where the first stream goes."""
_SILENCE_S = 1.0
_CLEAR_PX = 0.1
"""The spot moves 0.94 px from one exposure to the next."""
CONFIG = GigeConfig(
    serial="101", address="127.0.0.2", width=SIZE, height=SIZE, formats=("Mono12p",),
    packet_size=1500,
)  # fmt: skip
SECOND = replace(CONFIG, serial="102", address="127.0.0.3")


def place_at(exposure: int) -> np.ndarray:
    """Return the place (2,) of the spot, px."""
    angle = 2.0 * np.pi * (exposure % TURN) / TURN
    return SIZE / 2 + RADIUS * np.array([np.cos(angle), np.sin(angle)])


@cache
def image_of(exposure: int) -> memoryview:
    """Return the image of an exposure, Mono12p."""
    u, v = place_at(exposure)
    x = np.arange(SIZE)
    spot = np.outer(np.exp(-0.5 * (x - v) ** 2), np.exp(-0.5 * (x - u) ** 2))
    return packed((100 + 2800 * spot).astype(np.uint16)).data.cast("B")


def part_of(image: memoryview, memory: Memory) -> memoryview:
    """Return the part of an image of `SIZE` that a camera is set to, Mono12p."""
    left, top, width, height = (
        memory.integer(one)
        for one in (Feature.OFFSET_X, Feature.OFFSET_Y, Feature.WIDTH, Feature.HEIGHT)
    )
    if (width, height) == (SIZE, SIZE):
        return image
    rows = np.frombuffer(image, np.uint8).reshape(SIZE, SIZE * 3 // 2)[top : top + height]
    part = rows[:, left * 3 // 2 : (left + width) * 3 // 2]
    return np.ascontiguousarray(part).data.cast("B")


class Rig:
    """Two cameras that expose together, and the source that reads them."""

    def __init__(self, *configs: GigeConfig) -> None:
        set_link("lo", up=True)
        self.cameras = [GigeCamera(one, seed) for seed, one in enumerate(configs)]
        self.exposure = 0
        self.wrong = self.right = 0
        self.serials = tuple(one.serial for one in configs)
        self._images = [image_of(exposure) for exposure in range(TURN)]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._expose)
        self._thread.start()

    def show(self, *images: memoryview) -> None:
        """Send the same images from now on."""
        self._images = list(images) * (TURN // len(images))

    def source(
        self,
        *,
        untimed: bool = False,
        n_slots: int = USUAL_SLOTS,
        window: Window | None = None,
        blacks: tuple[str, ...] = ("", ""),
    ) -> GenicamSource:
        serials = tuple(int(one) for one in self.serials)
        description = SourceDescription("test", serials, PERIOD_NS, PERIOD_NS, True, True)
        expected = [
            Expected(one, SIZE, SIZE, PERIOD_NS, n_slots=n_slots, window=window, black=black)
            for one, black in zip(self.serials, blacks, strict=False)
        ]
        return GenicamSource(
            description, AravisCameras(), self.serials, expected, _SILENCE_S, untimed=untimed
        )

    def check(self, frames: FrameBlock, first_ns: int) -> None:
        """Count frames whose spots are, or are not, at the place of their time."""
        for time_ns, valid, uv in zip(frames.time_ns, frames.valid, frames.uv, strict=True):
            place = place_at((int(time_ns) + first_ns - FIRST_NS) // PERIOD_NS)
            for each, spots in zip(valid, uv, strict=True):
                found = spots[[bool(int(each) >> slot & 1) for slot in range(8)]]
                away = np.linalg.norm(found - place, axis=1)
                self.wrong += int(np.count_nonzero(away > _CLEAR_PX))
                self.right += int(np.count_nonzero(away <= _CLEAR_PX))

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        for one in self.cameras:
            one.close()

    def _expose(self) -> None:
        due = time.monotonic()
        while not self._ended.is_set():
            for camera in self.cameras:
                image = part_of(self._images[self.exposure % TURN], camera.memory)
                camera.send(image, FIRST_NS + self.exposure * PERIOD_NS)
            self.exposure += 1
            due = max(due + PERIOD_NS * 1e-9, time.monotonic() - 0.1)
            time.sleep(max(0.0, due - time.monotonic()))


def read_for(rig: Rig, source: GenicamSource, seconds: float) -> int:
    """Read and check frames; return their number."""
    count, until = 0, time.monotonic() + seconds
    while time.monotonic() < until:
        block = source.read().frames
        if block is not None:
            count += len(block)
            rig.check(block, source.origin_ns or 0)
    return count


def small_rig(folder: Path) -> Path:
    """Return the document of a rig of two small cameras with the numbers of `CONFIG`."""
    text = resource("rigs", "recommended.toml").read_text(encoding="utf-8")
    for old, new in (
        ("frame_rate_hz = 8000", "frame_rate_hz = 100"),
        ("206000", "1"),
        ("width_px = 2048", f"width_px = {SIZE}"), ("height_px = 2048", f"height_px = {SIZE}"),
        ("pitch = 0.012", "pitch = 0.096"), ("0_px = 1024.0", f"0_px = {SIZE / 2}"),
        ("0_px = 1023.5", f"0_px = {SIZE / 2}"),
    ):  # fmt: skip
        text = text.replace(old, new)
    document = folder / "rig.toml"
    document.write_text(text, encoding="utf-8")
    return document
