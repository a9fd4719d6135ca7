"""Scenarios with software GigE Vision cameras in a private network namespace; run as a program.

``python -m tests.genicam.genicam_scenarios SECONDS`` reads lines ``REPEATS NAME``, plays each in a
fork, and prints a line for each: its result as JSON, or nothing if it failed or took longer.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import io
import json
import multiprocessing
import os
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
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ocmm_cli.calibrate import take_pictures
from ocmm_core.acquisition.bus_process import ChildProcess
from ocmm_core.acquisition.frames import AcquisitionState, FrameRing, read_status
from ocmm_core.calibration.records import store_folder
from ocmm_core.camera import Window
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.wire import set_link
from ocmm_genicam import (
    AravisCameras,
    Expected,
    GenicamConfig,
    Viewfinder,
    ViewfinderProcess,
    black_path,
    genicam_command,
)
from ocmm_sim.genicam import Feature, packed
from tests.compiled import load_compiled
from tests.genicam.genicam_faults import FAULTS
from tests.genicam.genicam_rig import (
    CONFIG,
    HOST_PORT,
    PERIOD_NS,
    RADIUS,
    SECOND,
    SIZE,
    TURN,
    Rig,
    image_of,
    read_for,
    small_rig,
)  # fmt: skip
from tests.genicam.packet_edits import any_packet, some  # fmt: skip

_ALL_PACKETS, _RECEIVE_FORCED = 3, 33
"""ETH_P_ALL and SO_RCVBUFFORCE of Linux."""
_TUNSETIFF, _IFF_TAP = 0x400454CA, 2
_ETHTOOL, _SET_SETTINGS = 0x8946, 2
"""Of Linux."""


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
            rig.cameras[0].faults.edit = some(0.005 * (turn % 2), any_packet)
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
    """Return the error of an LED with a hot pixel, without and with a black image."""
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


def _foreign(_repeats: int) -> Any:
    """Read a camera of others (viva-genicam), which does not send two of its packets at first.

    Its document of features states a sensor that is larger than its images.
    """
    from viva_genicam.testing import FakeGigeCamera

    set_link("lo", up=True)
    told, images = "", list[tuple[int, ...]]()
    # It hears broadcasts at every address only.
    with FakeGigeCamera(
        width=SIZE, height=SIZE, fps=20, bind_ip="0.0.0.0",  # noqa: S104 - a private network
        drop_packets=[(5, 2), (7, 1)],
    ):  # fmt: skip
        cameras = AravisCameras()
        found = cameras.found()
        rig = [Expected("left", SIZE, SIZE, 50_000_000)]
        try:
            Viewfinder(cameras, [*found], rig).close()
        except OcmmError as error:
            told = f"{error.code}: {error}"
        with contextlib.closing(cameras.open(next(iter(found)))) as camera:
            camera.start()
            until = time.monotonic() + 20.0
            while len(images) < 12 and time.monotonic() < until:
                image = camera.next_image(0.5)
                if image is not None:
                    images.append((image.number, image.status, image.width, image.height))
    return {"wrong": 0, "found": list(found.values()), "told": told, "images": images}


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
            cameras=tuple(Expected(one, SIZE, SIZE, PERIOD_NS) for one in rig.serials),
            rig_serials=tuple(map(int, rig.serials)),
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
        rig.cameras[0].faults.edit = some(0.05, any_packet)
        for fault in ("swap", "double"):
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
    turns = np.arctan2(seen[:, 1], seen[:, 0]) * TURN / (2.0 * np.pi)
    return round(float((turns[1] - turns[0] + TURN / 2) % TURN - TURN / 2))


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
    away = [abs(float(np.linalg.norm(one - SIZE / 2)) - RADIUS) for one in places]
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
        printed = subprocess.run(
            [sys.executable, "-m", "ocmm_cli", "camera", "genicam"], capture_output=True, text=True,
            check=True,
        ).stdout  # fmt: skip
        source.open()
        memories = [camera.memory for camera in rig.cameras]
        kept = [
            (one.integer(Feature.GAMMA), one.integer(Feature.EXPOSURE_AUTO)) for one in memories
        ]
    finally:
        source.close()
        rig.close()
    return {"kept": kept, "printed": printed, "wrong": 0}


def _spot_in(path: Path) -> np.ndarray:
    picture = np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED), dtype=np.float64)
    light = np.clip(picture - 0.1 * picture.max(), 0.0, None)
    v, u = np.indices(light.shape)
    place: np.ndarray = np.array([(light * u).sum(), (light * v).sum()]) / light.sum()
    return place


SCENARIOS: dict[str, Callable[[int], Any]] = {
    **FAULTS,
    "pictures": _pictures,
    "untimed": _untimed,
    "dissected": _dissected,
    "killed": _killed,
    "foreign": _foreign,
    "many spots": _many_spots,
    "hot": _hot,
    "region": _region,
    "shared card": _shared_card,
    "set up": _set_up,
    "viewfinder": _viewfinder,
}  # fmt: skip


def _serve() -> None:
    """Play each requested scenario in a fork: imports and images are most of its work."""
    for exposure in range(TURN):
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
