"""Recordings of the bus, read back by a reader that was written from the pcapng specification."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.fieldbus.wire import (
    Command,
    Datagram,
    decode_frame,
    encode_frame,
    pcapng_end,
    pcapng_frame,
    pcapng_head,
)
from tests.host import HANG_S, private_network

_ROOT = Path(__file__).resolve().parents[3]


@dataclass
class Read:
    """Content of a file: IETF draft-ietf-opsawg-pcapng, sections 3 and 4."""

    application: str = ""
    name: str = ""
    link_type: int = -1
    frames: list[tuple[int, str, bytes, int]] = field(default_factory=list)
    received: int = -1
    dropped: int = -1


def options(content: bytes) -> dict[int, bytes]:
    found, at = {}, 0
    while at < len(content):
        code, size = struct.unpack_from("<HH", content, at)
        if code == 0:
            assert size == 0
            break
        found[code] = content[at + 4 : at + 4 + size]
        at += 4 + size + -size % 4
    return found


def read(content: bytes) -> Read:
    found, at, first = Read(), 0, True
    resolution = 0
    while at < len(content):
        kind, size = struct.unpack_from("<II", content, at)
        assert size % 4 == 0
        assert struct.unpack_from("<I", content, at + size - 4)[0] == size
        body = content[at + 8 : at + size - 4]
        at += size
        assert first == (kind == 0x0A0D0D0A)
        first = False
        if kind == 0x0A0D0D0A:
            magic, major, _minor, _length = struct.unpack_from("<IHHq", body)
            assert (magic, major) == (0x1A2B3C4D, 1)
            found.application = options(body[16:])[4].decode()
        elif kind == 1:
            found.link_type = struct.unpack_from("<H", body)[0]
            found.name = options(body[8:])[2].decode()
            resolution = options(body[8:])[9][0]
        elif kind == 6:
            interface, high, low, kept, length = struct.unpack_from("<IIIII", body)
            assert (interface, resolution) == (0, 9)
            end = 20 + kept + -kept % 4
            flags = struct.unpack("<I", options(body[end:])[2])[0]
            way = {1: "in", 2: "out"}[flags & 3]
            found.frames.append((high << 32 | low, way, body[20 : 20 + kept], length))
        elif kind == 5:
            told = options(body[12:])
            found.received, found.dropped = (struct.unpack("<Q", told[n])[0] for n in (4, 5))
    return found


def test_frames_are_read_back_byte_for_byte() -> None:
    random = np.random.default_rng(8)
    frames = [random.bytes(int(size)) for size in random.integers(14, 1514, 50)]
    times = [1_790_000_000_123_456_789 + 125_000 * n for n in range(len(frames))]
    content = pcapng_head("enp3s0", "OCMM ä 1") + b"".join(
        pcapng_frame(frame, time_ns, outgoing=bool(n % 2))
        for n, (frame, time_ns) in enumerate(zip(frames, times, strict=True))
    )
    content += pcapng_end(times[-1], 51, 1)
    found = read(content)
    assert (found.application, found.name, found.link_type) == ("OCMM ä 1", "enp3s0", 1)
    assert [frame for _t, _w, frame, _l in found.frames] == frames
    assert [time_ns for time_ns, *_ in found.frames] == times
    assert [way for _t, way, *_ in found.frames] == ["in", "out"] * 25
    assert (found.received, found.dropped) == (51, 1)


def test_a_frame_that_is_too_long_is_cut_and_keeps_its_length() -> None:
    content = pcapng_head("a", "b") + pcapng_frame(bytes(3000), 1, outgoing=True)
    ((_time, _way, frame, length),) = read(content).frames
    assert (len(frame), length) == (2048, 3000)


def in_network(folder: Path, script: str) -> subprocess.CompletedProcess[str]:
    """Run a script in a private network with a virtual cable near0 - far0 and software cameras."""
    file = folder / "script.sh"
    file.write_text(
        "set -e\n"
        "ip link add near0 type veth peer name far0\n"
        "ip link set near0 up; ip link set far0 up\n" + script
    )
    return subprocess.run(
        [*private_network(), "sh", str(file)],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
        cwd=_ROOT,
        env={**os.environ, "PATH": f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin"},
    )


_CAMERA = (
    "mkfifo '{0}/end'\n"
    "'{1}' -m tests.second_camera.second_camera far0 2001 < '{0}/end' > '{0}/ready' &\n"
    "exec 7> '{0}/end'\n"
    "while ! grep -q ready '{0}/ready'; do sleep 0.05; done\n"
)


@pytest.mark.timing
def test_records_both_directions_while_a_command_uses_the_bus(tmp_path: Path) -> None:
    ocmm = f"'{sys.executable}' -m ocmm_cli"
    done = in_network(
        tmp_path,
        _CAMERA.format(tmp_path, sys.executable)
        # A shell lets its background ignore Ctrl-C. Once it records it has a packet socket.
        + "before=$(wc -l < /proc/net/packet)\n"
        f"env --default-signal=INT {ocmm} bus record '{tmp_path}/bus.pcapng' "
        "--source ethercat:near0 --seconds 3000 &\nrecorder=$!\n"
        "while kill -0 $recorder && [ $(wc -l < /proc/net/packet) -le $before ]; do\n"
        f"sleep 0.05; done\n{ocmm} bus scan --source ethercat:near0 || true\n"
        "kill -INT $recorder; wait $recorder\n",
    )
    file = tmp_path / "bus.pcapng"
    assert file.exists(), done.stdout + done.stderr
    found = read(file.read_bytes())
    assert found.name == "near0"
    ways = {way for _t, way, *_ in found.frames}
    assert ways == {"in", "out"}, done.stdout + done.stderr
    times = [time_ns for time_ns, *_ in found.frames]
    assert times == sorted(times)
    # The first request leaves with a counter of zero and returns with one for each camera.
    asked = [decode_frame(frame)[1][0] for _t, way, frame, _l in found.frames if way == "out"]
    answered = [decode_frame(frame)[1][0] for _t, way, frame, _l in found.frames if way == "in"]
    assert asked[0].command == answered[0].command == Command.BRD
    assert (asked[0].working_counter, answered[0].working_counter) == (0, 1)
    assert found.dropped == 0
    again = in_network(
        tmp_path, f"{ocmm} bus record '{tmp_path}/bus.pcapng' --source ethercat:near0 --seconds 1\n"
    )
    assert again.returncode == 2
    assert "is there already" in again.stderr


@pytest.mark.timing
def test_refuses_a_second_program_on_the_interface(tmp_path: Path) -> None:
    holder = tmp_path / "holder.py"
    holder.write_text(
        "import socket, sys, time\n"
        "s = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x88A4))\n"
        "s.bind(('near0', 0x88A4))\n"
        "open(sys.argv[1], 'w').close()\ntime.sleep(3000)\n"
    )
    scan = f"'{sys.executable}' -m ocmm_cli bus scan --source ethercat:near0"
    done = in_network(
        tmp_path,
        _CAMERA.format(tmp_path, sys.executable)
        + f"'{sys.executable}' '{holder}' '{tmp_path}/held' & holder=$!\n"
        f"while [ ! -e '{tmp_path}/held' ]; do sleep 0.05; done\n"
        f"{scan} || echo code $?\nkill $holder; wait $holder || true\n"
        f"{scan} || echo code $?\n",
    )
    words = " ".join(done.stderr.split())
    assert "uses interface 'near0' as an EtherCAT master" in words, done.stdout + done.stderr
    # The scan succeeds after the other program has ended.
    assert "2001" in done.stdout


def test_only_what_passed_no_camera_is_foreign() -> None:
    from ocmm_core.fieldbus.wire._interface import is_foreign

    own = encode_frame(3, [Datagram(Command.BRD, 0, 0, b"\x00")])
    passed = own[:6] + bytes([own[6] | 2]) + own[7:]
    other = own[:6] + b"\x01" * 6 + own[12:]
    assert not is_foreign(own)
    assert not is_foreign(passed)
    assert is_foreign(other)
    assert not is_foreign(other[:6] + b"\x03" + other[7:])
    assert not is_foreign(other[:12] + b"\x08\x00" + other[14:])
