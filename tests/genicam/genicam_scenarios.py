"""Scenarios with software GigE Vision cameras in a private network namespace; run as a program.

``python -m tests.genicam.genicam_scenarios SECONDS`` reads lines ``REPEATS NAME``, plays each in a
fork, and prints a line for each: its result as JSON, or nothing if it failed or took longer. A spot
runs along a circle in the images, so that the place of a spot tells which exposure an image is of.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import io
import json
import multiprocessing
import os
import random
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ocmm_cli.bus import camera_app
from ocmm_cli.calibrate import take_pictures
from ocmm_core.acquisition.bus_process import ChildProcess
from ocmm_core.acquisition.frames import (
    AcquisitionState,
    FrameBlock,
    FrameRing,
    SourceDescription,
    read_status,
)
from ocmm_core.calibration.records import store_folder
from ocmm_core.camera import USUAL_SLOTS, Window
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.wire import set_link
from ocmm_genicam import (
    AravisCameras,
    Expected,
    GenicamConfig,
    GenicamSource,
    ViewfinderProcess,
    black_path,
    genicam_command,
)
from ocmm_sim.genicam import Feature, GigeCamera, GigeConfig, Memory, packed
from tests.compiled import load_compiled

SIZE, PERIOD_NS, FIRST_NS = 256, 10_000_000, 10**18
_TURN, _RADIUS = 400, 60.0
_SILENCE_S = 1.0
HOST_PORT = 0x0D00
"""Register of GigE Vision: where the first stream goes."""
_ALL_PACKETS, _RECEIVE_FORCED = 3, 33
"""ETH_P_ALL and SO_RCVBUFFORCE of Linux."""
_TUNSETIFF, _IFF_TAP = 0x400454CA, 2
_ETHTOOL, _SET_SETTINGS = 0x8946, 2
"""Of Linux."""
_CLEAR_PX = 0.1
"""The spot moves 0.94 px from one exposure to the next."""
CONFIG = GigeConfig(
    serial="101", address="127.0.0.2", width=SIZE, height=SIZE, formats=("Mono12p",),
    packet_size=1500,
)  # fmt: skip
SECOND = replace(CONFIG, serial="102", address="127.0.0.3")


def place_at(exposure: int) -> np.ndarray:
    """Return the place (2,) of the spot, px."""
    angle = 2.0 * np.pi * (exposure % _TURN) / _TURN
    return SIZE / 2 + _RADIUS * np.array([np.cos(angle), np.sin(angle)])


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
        self._images = [image_of(exposure) for exposure in range(_TURN)]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._expose)
        self._thread.start()

    def show(self, *images: memoryview) -> None:
        """Send the same images from now on."""
        self._images = list(images) * (_TURN // len(images))

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
                image = part_of(self._images[self.exposure % _TURN], camera.memory)
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


def _packets(fault: str, value: object, *, resent: bool = True) -> Callable[[int], Any]:
    """Return a scenario of packets that do not arrive as sent."""

    def play(repeats: int) -> Any:
        rig = Rig(CONFIG, SECOND)
        source = rig.source()
        try:
            source.open()
            clean = read_for(rig, source, 0.5)
            counts = []
            for _ in range(repeats):
                for camera in rig.cameras:
                    camera.faults.refuse_resend = not resent
                    setattr(camera.faults, fault, value)
                during = read_for(rig, source, 0.5)
                for camera in rig.cameras:
                    setattr(camera.faults, fault, None if callable(value) else type(value)())
                began = time.monotonic()
                after = 0
                while after < 20 and time.monotonic() - began < 3.0:
                    after += read_for(rig, source, 0.05)
                counts.append((during, after, time.monotonic() - began))
            accounts = [
                [one.exposures - one.delivered - one.lost, one.lost, one.incomplete]
                for one in source.accounts.values()
            ]
            return {"clean": clean, "counts": counts, "wrong": rig.wrong, "right": rig.right,
                    "accounts": accounts}  # fmt: skip
        finally:
            source.close()
            rig.close()

    return play


def _sentence(
    deed: Callable[[Rig], None], *configs: GigeConfig, opens: bool = True
) -> Callable[[int], Any]:
    """Return a scenario that ends with a sentence: at the opening, or after a deed."""

    def play(repeats: int) -> Any:
        told = []
        wrong = 0
        for _ in range(repeats):
            rig = Rig(*(configs or (CONFIG, SECOND)))
            source = rig.source()
            began = time.monotonic()
            try:
                if not opens:
                    deed(rig)
                source.open()
                if opens:
                    read_for(rig, source, 0.5)
                    deed(rig)
                    began = time.monotonic()
                read_for(rig, source, 6.0)
                told.append(["", "", 0.0])
            except OcmmError as error:
                source.close()
                told.append([error.code, str(error), time.monotonic() - began])
            finally:
                source.close()
                rig.close()
            wrong += rig.wrong
        return {"told": told, "wrong": wrong}

    return play


def _first(**changes: object) -> Callable[[Rig], None]:
    def deed(rig: Rig) -> None:
        for name, value in changes.items():
            setattr(rig.cameras[0].faults, name, value)

    return deed


def _controlled(repeats: int) -> Any:
    """Open cameras that another program controls, then again after it has ended."""
    rig = Rig(CONFIG, SECOND)
    first, told = rig.source(), []
    try:
        first.open()
        for _ in range(repeats):
            second = rig.source()
            try:
                second.open()
                told.append(["", "", 0.0])
            except OcmmError as error:
                told.append([error.code, str(error), 0.0])
            finally:
                second.close()
        frames = read_for(rig, first, 0.5)
    finally:
        first.close()
        rig.close()
    return {"told": told, "wrong": rig.wrong, "frames": frames}


def _untimed(repeats: int) -> Any:
    """Read cameras without PTP, clocks 7 s apart, while images of the first one are lost.

    The same exposures must stay together: the spots of a frame are a constant number of exposures
    apart.
    """
    rig = Rig(replace(CONFIG, ptp=""), replace(SECOND, ptp=""))
    rig.cameras[1].faults.clock_step_ns = 7 * 10**9
    source = rig.source(untimed=True)
    apart: list[int] = []
    try:
        source.open()
        for turn in range(4 * repeats):
            rig.cameras[0].faults.refuse_resend = True
            rig.cameras[0].faults.lose = 0.005 * (turn % 2)
            until = time.monotonic() + 1.0
            while time.monotonic() < until:
                block = source.read().frames
                if block is not None:
                    apart += [_exposures_apart(uv) for uv in block.uv if _both_seen(uv)]
    finally:
        source.close()
        rig.close()
    usual = max(set(apart), key=apart.count)
    lost = [one.lost for one in source.accounts.values()]
    return {"wrong": sum(one != usual for one in apart), "frames": len(apart), "usual": usual,
            "lost": lost}  # fmt: skip


def _many_spots(_repeats: int) -> Any:
    """Return how many of 64 spots are found over the wire, and how far off they are at most."""
    places = [(17.4 + 31.0 * i, 16.8 + 31.0 * j) for i in range(8) for j in range(8)]
    x = np.arange(SIZE)
    each = [np.outer(np.exp(-0.5 * (x - v) ** 2), np.exp(-0.5 * (x - u) ** 2)) for u, v in places]
    light = np.sum(each, axis=0)
    rig = Rig(CONFIG, SECOND)
    rig.show(packed((100 + 2800 * light).astype(np.uint16)).data.cast("B"))
    source = rig.source(n_slots=64)
    try:
        source.open()
        until, uv = time.monotonic() + 20.0, np.zeros((0, 2, 64, 2))
        while time.monotonic() < until and not (len(uv) and np.isfinite(uv[-1]).all()):
            block = source.read().frames
            uv = block.uv if block is not None else uv
    finally:
        source.close()
        rig.close()
    apart = np.linalg.norm(uv[-1][:, :, None] - np.array(places), axis=3)
    found = [len(set(np.argmin(one, axis=1))) for one in apart]
    return {"wrong": 0, "found": found, "off": float(apart.min(axis=2).max())}


def _hot(_repeats: int) -> Any:
    """Return how far off an LED with a hot pixel is, without and with a black image."""
    draws = np.random.default_rng(7)
    noise = draws.normal(100.0, 3.0, (4, SIZE, SIZE))
    # They are restless, so that their mean is not their signal.
    blinking = np.array([1500.0, 300.0, 1500.0, 300.0])
    noise[:, 131, 130] = noise[:, 20, 30] = noise[:, 200, 201] = blinking
    x = np.arange(SIZE)
    u, v = 128.3, 129.6
    spot = 2000.0 * np.outer(np.exp(-0.5 * (x - v) ** 2), np.exp(-0.5 * (x - u) ** 2))
    rig = Rig(CONFIG, SECOND)

    def show(light: float) -> None:
        images = [packed((one + light * spot).astype(np.uint16)).data.cast("B") for one in noise]
        rig.show(*images)

    def off_px(window: Window | None = None) -> float:
        source = rig.source(blacks=tuple(str(black_path(folder, one)) for one in rig.serials),
                            window=window)  # fmt: skip
        try:
            source.open()
            until, found = time.monotonic() + 20.0, np.zeros((0, 2))
            while len(found) < 40 and time.monotonic() < until:
                block = source.read().frames
                if block is not None:
                    found = np.concatenate([found, block.uv[np.isfinite(block.uv[..., 0])]])
        finally:
            source.close()
        return float(np.linalg.norm(found - [u, v], axis=1).max(initial=0.0))

    def take() -> subprocess.CompletedProcess[str]:
        words = ["camera", "black", "--source", "genicam:101,102", "--rig", str(document)]
        return subprocess.run(
            [sys.executable, "-m", "ocmm_cli", *words, "--calibrations", document.parent],
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    try:
        with tempfile.TemporaryDirectory() as name:
            document, folder = small_rig(Path(name)), store_folder(Path(name), "recommended")
            show(1.0)
            before, refused = off_px(), take()
            left = len(list(Path(name).rglob("black-*")))
            show(0.0)
            taken = take()
            show(1.0)
            after, region = off_px(), off_px(Window(100, 100, 64, 64))
            black_path(folder, "102").write_bytes(b"{}")
            try:
                off_px()
                damaged = ""
            except OcmmError as error:
                damaged = error.code
    finally:
        rig.close()
    return {"wrong": 0, "before": before, "refused": refused.stderr, "left": left, "after": after,
            "region": region, "damaged": damaged, "taken": taken.stdout}  # fmt: skip


def _region(_repeats: int) -> Any:
    """Read the part of the sensors that has the circle of the spot; return it and its frames."""
    rig = Rig(CONFIG, SECOND)
    source = rig.source(window=Window(61, 59, 135, 139))
    try:
        source.open()
        frames = read_for(rig, source, 2.0)
        memory = rig.cameras[1].memory
        part = [memory.integer(one) for one in
                (Feature.OFFSET_X, Feature.OFFSET_Y, Feature.WIDTH, Feature.HEIGHT)]  # fmt: skip
    finally:
        source.close()
        rig.close()
    return {"wrong": rig.wrong, "right": rig.right, "frames": frames, "part": part}


def _shared_card(_repeats: int) -> Any:
    """Open cameras that one network card of 10 Mbit/s reaches, at once and by parts; with loads."""
    card = os.open("/dev/net/tun", os.O_RDWR)
    fcntl.ioctl(card, _TUNSETIFF, struct.pack("16sH", b"cameras", _IFF_TAP))
    for words in ("addr add 10.9.0.1/24 dev cameras", "addr add 10.9.0.2/24 dev cameras",
                  "link set cameras up"):  # fmt: skip
        subprocess.run(["ip", *words.split()], check=True)
    settings = ctypes.create_string_buffer(44)
    struct.pack_into("<IIIH", settings, 0, _SET_SETTINGS, 0, 0, 10)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        fcntl.ioctl(link, _ETHTOOL, struct.pack("16sP16x", b"cameras", ctypes.addressof(settings)))
    here = [
        replace(one, address=f"10.9.0.{n}", packet_size=1400)
        for n, one in enumerate((CONFIG, SECOND), 1)
    ]
    rig, told = Rig(*here), []
    cameras = [Expected(one, SIZE, SIZE, PERIOD_NS) for one in rig.serials]
    try:
        with contextlib.closing(ViewfinderProcess(rig.serials, cameras)) as finder:
            loads = [one.load for one in finder.look()]
        for window in (None, Window(120, 120, 16, 16)):
            source = rig.source(window=window)
            try:
                source.open()
                told.append("")
            except OcmmError as error:
                told.append(f"{error.code}: {error}")
            finally:
                source.close()
    finally:
        rig.close()
        os.close(card)
    return {"wrong": 0, "told": told, "loads": loads}


def _killed(repeats: int) -> Any:
    """Kill the camera process, then start another one until frames arrive again.

    Returns message and seconds of each end, and of each return; cameras stay reserved for 3 s.
    """
    rig, ends, returns = Rig(CONFIG, SECOND), [], []
    began = time.monotonic()
    try:
        for _ in range(repeats + 1):
            process, ring = _reading(rig)
            returns.append(time.monotonic() - began)
            began = time.monotonic()
            os.kill(process.pid or 0, signal.SIGKILL)
            while read_status(ring).state is not AcquisitionState.STOPPED:
                time.sleep(1e-3)
            ends.append((read_status(ring).message, time.monotonic() - began))
            process.join(5.0)
            ring.close()
    finally:
        rig.close()
    return {"wrong": 0, "ends": ends, "returns": returns[1:]}


def _reading(rig: Rig) -> tuple[ChildProcess, FrameRing]:
    """Return a camera process that delivers frames; tried again while the cameras are reserved."""
    while True:
        ring = FrameRing.create(2)
        config = GenicamConfig(
            name="test", ring_path=str(ring.path), serials=rig.serials,
            cameras=tuple((one, SIZE, SIZE) for one in rig.serials),
            rig_serials=tuple(map(int, rig.serials)), period_ns=PERIOD_NS,
        )  # fmt: skip
        process = ChildProcess(genicam_command(), config.to_json(), ring)
        process.start()
        while read_status(ring).state is not AcquisitionState.STOPPED:
            if read_status(ring).frames > 0:
                return process, ring
            time.sleep(1e-3)
        process.join(5.0)
        assert "controlled by another program" in read_status(ring).message
        ring.close()


def _dissected(_repeats: int) -> Any:
    """Return what another dissector (tshark) finds in the packets of cameras that fail."""
    rig = Rig(CONFIG, SECOND)
    source = rig.source()
    tap = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ALL_PACKETS))
    tap.bind(("lo", 0))
    tap.setsockopt(socket.SOL_SOCKET, _RECEIVE_FORCED, 1 << 26)
    tap.setblocking(False)
    frames: list[bytes] = []
    try:
        source.open()
        for fault in ("lose", "swap", "double"):
            setattr(rig.cameras[0].faults, fault, 0.05)
            read_for(rig, source, 0.5)
            with contextlib.suppress(BlockingIOError):
                while True:
                    frames.append(tap.recv(65536))
        ports = {one.memory.u32(HOST_PORT) for one in rig.cameras}
    finally:
        tap.close()
        source.close()
        rig.close()
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "cameras.pcap"
        head = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65536, 1)
        records = [struct.pack("<IIII", 0, 0, len(one), len(one)) + one for one in frames]
        path.write_bytes(head + b"".join(records))
        decode = [word for port in ports for word in ("-d", f"udp.port=={port},gvsp")]
        told = subprocess.run(
            ["tshark", "-r", str(path), "-d", "udp.port==3956,gvcp", *decode, "-T", "fields",
             "-e", "frame.protocols", "-e", "_ws.malformed"],
            capture_output=True, text=True, check=True,
        ).stdout.splitlines()  # fmt: skip
    return {"wrong": rig.wrong, "malformed": sum("alformed" in one for one in told),
            "gvcp": sum("gvcp" in one for one in told),
            "gvsp": sum("gvsp" in one for one in told)}  # fmt: skip


def _both_seen(uv: np.ndarray) -> bool:
    return bool((np.isfinite(uv[..., 0]).sum(axis=1) == 1).all())


def _exposures_apart(uv: np.ndarray) -> int:
    """Return how many exposures the second camera is ahead, by the places of its spot (2, 8, 2)."""
    seen = np.nanmean(uv, axis=1) - SIZE / 2
    turns = np.arctan2(seen[:, 1], seen[:, 0]) * _TURN / (2.0 * np.pi)
    return round(float((turns[1] - turns[0] + _TURN / 2) % _TURN - _TURN / 2))


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


def _pictures(repeats: int) -> Any:
    """Take views with the command, then return how far the spots of each lie apart, px."""
    rig = Rig(CONFIG, SECOND)
    try:
        with tempfile.TemporaryDirectory() as name, contextlib.redirect_stdout(io.StringIO()):
            document, folder = small_rig(Path(name)), Path(name) / "views"
            for _ in range(2):
                take_pictures(
                    folder=folder, source="genicam:101,102", rig=document, views=repeats, every=0.3,
                    board=None,
                )  # fmt: skip
            files = sorted(folder.iterdir())
            places = [_spot_in(one) for one in files]
    finally:
        rig.close()
    apart = [float(np.linalg.norm(a - b)) for a, b in zip(places[::2], places[1::2], strict=True)]
    away = [abs(float(np.linalg.norm(one - SIZE / 2)) - _RADIUS) for one in places]
    return {"files": [one.name for one in files], "apart": apart, "away": max(away), "wrong": 0}


def _viewfinder(_repeats: int) -> Any:
    """Set exposure and gain of cameras whose spot gets brighter with both."""
    rig, ended, strength = Rig(CONFIG, SECOND), threading.Event(), [1.0]

    def shine() -> None:
        x = np.arange(SIZE)
        light = np.exp(-0.5 * ((x[:, None] - 90.0) ** 2 + (x - 150.0) ** 2) / 1.5**2)
        while not ended.is_set():
            memory = rig.cameras[0].memory
            gain = 10.0 ** (memory.real(Feature.GAIN) / 20.0)
            share = strength[0] * memory.real(Feature.EXPOSURE) / 1000.0 * gain
            counts = np.minimum(100.0 + 4095.0 * share * light, 4095.0).astype(np.uint16)
            rig.show(packed(counts).data.cast("B"))
            time.sleep(0.005)

    thread = threading.Thread(target=shine)
    thread.start()
    cameras = [Expected(one, SIZE, SIZE, PERIOD_NS) for one in rig.serials]
    told, found = [], []
    try:
        with contextlib.closing(ViewfinderProcess(rig.serials, cameras)) as finder:
            deeds: tuple[Callable[[], object], ...] = (
                partial(finder.expose, 100.0), partial(finder.expose, 3000.0), finder.settle,
                partial(finder.gain, 6.0), finder.settle,
                partial(strength.__setitem__, 0, 0.02), finder.settle,
            )  # fmt: skip
            for deed in deeds:
                deed()
                found.append([
                    [one.brightness, one.brightest, one.exposure_us, one.gain, one.width_px,
                     *np.ravel(one.spots_px), *one.picture.shape]
                    for one in finder.look()
                ])  # fmt: skip
            pictures = finder.pictures()
            for wrong in (partial(finder.expose, 1e6), partial(finder.expose, 50_000.0),
                          partial(finder.gain, 99.0)):  # fmt: skip
                try:
                    wrong()
                    told.append("")
                except OcmmError as error:
                    told.append(f"{error.code}: {error}")
            kept = [one.exposure_us for one in finder.look()]
            finder.store()
        stored = [one.memory.integer(Feature.USER_SET_DEFAULT) for one in rig.cameras]
        with contextlib.closing(ViewfinderProcess(rig.serials, cameras)) as finder:
            os.kill(multiprocessing.active_children()[0].pid or 0, signal.SIGKILL)
            try:
                finder.look()
            except OcmmError as error:
                told.append(f"{error.code}: {error}")
    finally:
        ended.set()
        thread.join()
        rig.close()
    return {"wrong": 0, "found": found, "told": told, "kept": kept, "stored": stored,
            "picture": [int(one.max()) for one in pictures], "shape": pictures[0].shape,
            "left": len(multiprocessing.active_children())}  # fmt: skip


def _set_up(_repeats: int) -> Any:
    """Open cameras that process their images, and list what they lack before that."""
    rig = Rig(CONFIG, replace(SECOND, ptp=""))
    source = rig.source(untimed=True)
    try:
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            camera_app(["genicam"], standalone_mode=False)
        source.open()
        memories = [camera.memory for camera in rig.cameras]
        kept = [
            (one.integer(Feature.GAMMA), one.integer(Feature.EXPOSURE_AUTO)) for one in memories
        ]
    finally:
        source.close()
        rig.close()
    return {"kept": kept, "printed": printed.getvalue(), "wrong": 0}


def _spot_in(path: Path) -> np.ndarray:
    picture = np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), dtype=np.float64)
    light = np.clip(picture - 0.1 * picture.max(), 0.0, None)
    v, u = np.indices(light.shape)
    place: np.ndarray = np.array([(light * u).sum(), (light * v).sum()]) / light.sum()
    return place


_Edit = Callable[[bytes], bytes]
_Which = Callable[[bytes], bool]


def _any(_packet: bytes) -> bool:
    return True


def _leader(packet: bytes) -> bool:
    return packet[4] == 1


def _payload(packet: bytes) -> bool:
    return packet[4] == 3


def _edited(which: _Which, edit: _Edit) -> Callable[[Rig], None]:
    """Return a deed that changes packets of the first camera."""

    def deed(rig: Rig) -> None:
        rig.cameras[0].faults.edit = lambda one: edit(one) if which(one) else one

    return deed


def _some(share: float, which: _Which, edit: _Edit = lambda _one: b"") -> _Edit:
    """Return an edit of a share of some packets; they are lost if nothing else is said."""
    draws = random.Random(3)  # noqa: S311 - faults, repeatable
    return lambda one: edit(one) if which(one) and draws.random() < share else one


def _put(place: int, form: str, value: int) -> _Edit:
    """Return an edit that writes a number into a packet."""

    def edit(packet: bytes) -> bytes:
        end = place + struct.calcsize(form)
        return packet[:place] + struct.pack(form, value) + packet[end:]

    return edit


def _old_time() -> _Edit:
    """Return an edit that gives leaders the time of the exposure before."""
    before: list[bytes] = []

    def edit(packet: bytes) -> bytes:
        before.append(packet[12:20])
        return packet[:12] + before[max(len(before) - 2, 0)] + packet[20:]

    return edit


def _renumbered(packet: bytes, more: int) -> bytes:
    (block,) = struct.unpack_from(">H", packet, 2)
    return packet[:2] + struct.pack(">H", (block + more - 1) % 0xFFFF + 1) + packet[4:]


def _from_one() -> _Edit:
    """Return an edit that numbers images from one again."""
    first: list[int] = []

    def edit(packet: bytes) -> bytes:
        first.append(struct.unpack_from(">H", packet, 2)[0])
        return _renumbered(packet, 1 - first[0])

    return edit


def _every_second() -> _Edit:
    """Return an edit that leaves out every second image, numbered without a gap."""
    first: list[int] = []

    def edit(packet: bytes) -> bytes:
        (block,) = struct.unpack_from(">H", packet, 2)
        first.append(block)
        since = block - first[0]
        return b"" if since % 2 else _renumbered(packet, -(since // 2))

    return edit


def _both(**changes: object) -> Callable[[Rig], None]:
    def deed(rig: Rig) -> None:
        for camera in rig.cameras:
            for name, value in changes.items():
                setattr(camera.faults, name, value)

    return deed


def _register(place: int, value: int) -> Callable[[Rig], None]:
    return lambda rig: rig.cameras[0].memory.set_u32(place, value)


def _blanked(rig: Rig) -> None:
    rig.cameras[0].memory.write(0x2_0400, bytes(0x8000))


def _exposed(exposure_us: float, *, both: bool = False) -> Callable[[Rig], None]:
    def deed(rig: Rig) -> None:
        for camera in rig.cameras[: 2 if both else 1]:
            camera.memory.write(Feature.EXPOSURE, struct.pack(">d", exposure_us))
            camera.memory.settle()

    return deed


def _nothing(_rig: Rig) -> None:
    pass


def _ptp(**changes: Any) -> Callable[[Rig], None]:
    def deed(rig: Rig) -> None:
        rig.cameras[0].reconfigure(**changes)

    return deed


SCENARIOS: dict[str, Callable[[int], Any]] = {
    "lost": _packets("lose", 0.05),
    "swapped": _packets("swap", 0.3),
    "doubled": _packets("double", 0.3),
    "damaged": _packets("damage", 0.05),
    "resend refused": _packets("lose", 0.005, resent=False),
    "controlled": _controlled,
    "unplugged": _sentence(_first(unplugged=True)),
    "nothing complete": _sentence(_first(lose=0.5, refuse_resend=True)),
    "clock step": _sentence(_first(clock_step_ns=10**9)),
    "clock step back": _sentence(_first(clock_step_ns=-(10**9))),
    "small clock step": _sentence(_first(clock_step_ns=100_000)),
    "old time": _sentence(_edited(_leader, _old_time())),
    "wrong format": _sentence(_edited(_leader, _put(20, ">I", 0x0108_0001))),
    "half as wide": _sentence(_edited(_leader, _put(24, ">I", SIZE // 2))),
    "higher": _sentence(_edited(_leader, _put(28, ">I", 2 * SIZE))),
    "another part": _sentence(_edited(_leader, _put(32, ">I", 8))),
    "no time": _sentence(_edited(_leader, _put(12, ">Q", 0))),
    "far time": _sentence(_edited(_leader, _put(12, ">Q", 1 << 62))),
    "same number": _sentence(_edited(_any, _put(2, ">H", 7))),
    "numbers jump": _sentence(_edited(_any, lambda packet: _renumbered(packet, 500))),
    "numbers of a restart": _sentence(_edited(_any, _from_one())),
    "half the rate": _sentence(_edited(_any, _every_second())),
    "large packets lost": _sentence(_edited(_any, lambda one: one if len(one) < 1000 else b"")),
    "every leader lost": _sentence(_edited(_leader, lambda _: b"")),
    "every packet cut": _sentence(_edited(_payload, lambda one: one[:200])),
    "commands not heard": _sentence(_first(deaf=True)),
    "control taken": _sentence(lambda rig: rig.cameras[0].release()),
    "both unplugged": _sentence(_both(unplugged=True)),
    "ticks of a microsecond": _sentence(_register(0x0940, 1_000_000), opens=False),
    "no ticks": _sentence(_register(0x0940, 0), opens=False),
    "no description": _sentence(_register(0x0200, 0), opens=False),
    "description cut": _sentence(_blanked, opens=False),
    "long exposure": _sentence(_exposed(50_000.0, both=True), opens=False),
    "other exposure": _sentence(_exposed(200.0), opens=False),
    "PTP uncalibrated": _sentence(_nothing, CONFIG, replace(SECOND, ptp="Uncalibrated"),
                                  opens=False),
    "PTP far off": _sentence(_nothing, CONFIG, replace(SECOND, ptp_offset_ns=-50_000), opens=False),
    "other numbers of rows": _sentence(_nothing, CONFIG, replace(SECOND, height=128), opens=False),
    "leaders lost": _packets("edit", _some(0.1, _leader)),
    "trailers lost": _packets("edit", _some(0.1, lambda one: one[4] == 2)),
    "cut packets": _packets("edit", _some(0.02, _payload, lambda one: one[:100])),
    "headers only": _packets("edit", _some(0.02, _payload, lambda one: one[:8])),
    "foreign packets": _packets("edit", _some(0.02, _payload, lambda one: _renumbered(one, 9000))),
    "unknown kinds": _packets("edit", _some(0.02, _payload, lambda one: one[:4] + b"\7" + one[5:])),
    "PTP lost": _sentence(_ptp(ptp="Uncalibrated")),
    "PTP offset": _sentence(_ptp(ptp_offset_ns=5_000)),
    "other master": _sentence(_ptp(grandmaster=7)),
    "two masters": _sentence(_nothing, replace(CONFIG, ptp="Master"),
                             replace(SECOND, ptp="Master"), opens=False),
    "no PTP": _sentence(_nothing, CONFIG, replace(SECOND, ptp=""), opens=False),
    "late exposures": _sentence(_first(late_ns=2_000_000), opens=False),
    "pictures": _pictures,
    "untimed": _untimed,
    "dissected": _dissected,
    "killed": _killed,
    "many spots": _many_spots,
    "hot": _hot,
    "region": _region,
    "shared card": _shared_card,
    "absent": _sentence(lambda rig: rig.cameras.pop().close(), opens=False),
    "other size": _sentence(_nothing, CONFIG, replace(SECOND, width=128), opens=False),
    "gamma stays": _sentence(
        _nothing, CONFIG, replace(SECOND, keeps_gamma=True), opens=False
    ),
    "slow link": _sentence(_nothing, CONFIG, replace(SECOND, link_hz=80.0), opens=False),
    "set up": _set_up,
    "viewfinder": _viewfinder,
    "colour": _sentence(_nothing, CONFIG, replace(SECOND, formats=("RGB8",)), opens=False),
    "other model": _sentence(_nothing, CONFIG, replace(SECOND, model="Other"), opens=False),
}  # fmt: skip


def _serve() -> None:
    """Play each requested scenario in a fork: imports and images are most of its work."""
    for exposure in range(_TURN):
        image_of(exposure)
    load_compiled("ocmm_core.camera.", "ocmm_genicam.")
    for line in sys.stdin:
        repeats, _, name = line.strip().partition(" ")
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            signal.alarm(int(sys.argv[1]))
            result = json.dumps(SCENARIOS[name](int(repeats)))
            sys.stdout.write(result)
            return
        os.waitpid(child, 0)
        sys.stdout.write("\n")
        sys.stdout.flush()


if __name__ == "__main__":
    _serve()
