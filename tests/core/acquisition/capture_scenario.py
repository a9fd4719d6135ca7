"""A run of the bus, recorded from its first frame; run as a program, not collected.

``python capture_scenario.py FOLDER WRITER`` plays it in the present network namespace and leaves
``bus.pcap`` and ``frames.npy``, the frames of the application, in the folder. WRITER is ``pcap`` (a
writer in this file) or ``tcpdump``.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acquisition.bus_process import BusConfig, ChildProcess
from ocmm_core.acquisition.frames import AcquisitionState, FrameRing, read_status, to_records
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.fieldbus.wire import CAMERA_INTERFACE, HOST_INTERFACE
from ocmm_sim.bus import SegmentConfig

CAMERAS = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))
FRAMES = 6000
_LIMIT_S = 240.0
_SIOCGIFFLAGS, _IFF_UP = 0x8913, 1
_ETH_P_ALL = 3


def record(path: Path, ended: threading.Event) -> None:
    """Write what passes the interface to a pcap file of nanoseconds."""
    with _socket(ended) as channel, path.open("wb") as stream:
        stream.write(struct.pack("<IHHIIII", 0xA1B23C4D, 2, 4, 0, 0, 65535, 1))
        while not ended.is_set():
            try:
                content = channel.recv(65535)
            except OSError:
                # Nothing came for a while, or the cable is made but not up yet.
                continue
            seconds, rest = divmod(time.time_ns(), 1_000_000_000)
            stream.write(struct.pack("<IIII", seconds, rest, len(content), len(content)) + content)


def _socket(ended: threading.Event) -> socket.socket:
    channel = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ETH_P_ALL))
    channel.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 24)
    channel.settimeout(0.1)
    while not ended.is_set():
        with contextlib.suppress(OSError):
            channel.bind((HOST_INTERFACE, _ETH_P_ALL))
            break
        time.sleep(0.002)
    return channel


def _is_up() -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        try:
            answer = fcntl.ioctl(asked, _SIOCGIFFLAGS, struct.pack("256s", HOST_INTERFACE.encode()))
        except OSError:
            return False
    return bool(struct.unpack_from("<H", answer, 16)[0] & _IFF_UP)


def _tcpdump(path: Path, bus: int) -> subprocess.Popen[bytes]:
    """Start tcpdump on the cable; the bus waits until it listens, however busy the computer is."""
    while not _is_up():
        time.sleep(0.0005)
    os.kill(bus, signal.SIGSTOP)
    # Short slots: the buffer would hold 64 packets of the usual ones, and a bring-up is a burst.
    options = ["-Z", "root", "-q", "--immediate-mode", "-s", "2048", "-B", "16384"]
    dump = subprocess.Popen(
        ["tcpdump", *options, "-i", HOST_INTERFACE, "-w", str(path)], stderr=subprocess.PIPE
    )
    assert dump.stderr is not None
    while b"listening on" not in dump.stderr.readline() and dump.poll() is None:
        pass
    os.kill(bus, signal.SIGCONT)
    return dump


def main(folder: Path, writer: str) -> None:
    """Play; see the module."""
    ring = FrameRing.create(len(CAMERAS))
    segment = SegmentConfig(
        interface=CAMERA_INTERFACE, cameras=CAMERAS[::-1], sees=(1, 0),
        provider=msgspec.Raw(b'{"pattern": "test"}'),
    )  # fmt: skip
    bus = BusConfig(interface=HOST_INTERFACE, ring_path=str(ring.path), cameras=CAMERAS)
    child = ChildProcess(
        [sys.executable, "-m", "ocmm_sim.bus._virtual_bus"], segment.to_json() + bus.to_json(), ring
    )
    ended = threading.Event()
    path = folder / "bus.pcap"
    listener = threading.Thread(target=record, args=(path, ended))
    dump = None
    if writer == "pcap":
        listener.start()
    child.start()
    if writer == "tcpdump":
        assert child.pid is not None
        dump = _tcpdump(path, child.pid)
    blocks, count, deadline = [], 0, time.monotonic() + _LIMIT_S
    while count < FRAMES and time.monotonic() < deadline:
        block = ring.read(800)
        if block is not None:
            blocks.append(to_records(block))
            count += len(block)
        elif read_status(ring).state is AcquisitionState.STOPPED:
            break
        else:
            time.sleep(0.005)
    child.request_stop()
    child.join(_LIMIT_S)
    ended.set()
    if writer == "pcap":
        listener.join()
    if dump is not None:
        dump.terminate()
        dump.wait(_LIMIT_S)
    status = read_status(ring)
    ring.close()
    if not blocks:
        sys.exit(f"no frames: {status.message}")
    np.save(folder / "frames.npy", np.concatenate(blocks))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
