"""Recorded buses, written here packet by packet: every format, and everything that can be wrong."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.acquisition.recording import BusCapture
from ocmm_core.acquisition.recording._packets import PacketFile
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.device import (
    DATA_CRC,
    DATA_CRC_AT,
    FRAMES_PER_CYCLE,
    INPUT_DTYPE,
    INPUT_START,
    MAILBOX_IN_START,
    NEWEST_LAYOUT,
    OUTPUT_DTYPE,
    OUTPUT_START,
    CameraStatus,
    Header,
    encode_frames,
)
from ocmm_core.fieldbus.wire import Command, Datagram, encode_frame
from ocmm_sim.slave import TestPattern

START_NS, PERIOD_NS = 7_000_000_000, 125_000
STATIONS, SERIALS = (0x1001, 0x1002), (77, 78)
RUNNING = CameraStatus.OPERATIONAL | CameraStatus.SYNCHRONISED
OUTPUTS = OUTPUT_DTYPE.itemsize
FULL = 6
"""Working counter of two cameras: one each for reading and two for writing."""

PATTERN = TestPattern()


def make_input(camera: int, first: int, count: int, cycle: int, **changes: int) -> bytes:
    """Return a camera's process data as it sends them; ``changes`` are fields of the header."""
    header = Header(
        first % (1 << 32), START_NS + first * PERIOD_NS, PERIOD_NS, count, cycle % 256, RUNNING,
        1, 1, 0,
    )  # fmt: skip
    header = header._replace(**changes)
    valid, flags, uv = PATTERN.camera_frames(camera, first, FRAMES_PER_CYCLE)
    content = bytearray(NEWEST_LAYOUT.encode(header) + encode_frames(valid, flags, uv).tobytes())
    assert len(content) == INPUT_DTYPE.itemsize
    DATA_CRC.pack_into(content, DATA_CRC_AT, NEWEST_LAYOUT.crc(content, SERIALS[camera]))
    return bytes(content)


def passed(frame: bytes) -> bytes:
    """Return a frame as it looks behind the cameras."""
    return frame[:6] + bytes([frame[6] | 2]) + frame[7:]


def bringup() -> list[bytes]:
    """Return the frames of a master that maps two cameras and reads their serial numbers."""
    frames = []
    for place, station in enumerate(STATIONS):
        inputs = 2 * OUTPUTS + place * INPUT_DTYPE.itemsize
        fmmus = struct.pack("<IHBBHBBB3x", place * OUTPUTS, OUTPUTS, 0, 7, OUTPUT_START, 0, 2, 1)
        fmmus += struct.pack(
            "<IHBBHBBB3x", inputs, INPUT_DTYPE.itemsize, 0, 7, INPUT_START, 0, 1, 1
        )
        body = struct.pack("<HBHBI", 0x3000, 0x43, 0x1018, 4, SERIALS[place])
        mailbox = struct.pack("<HHBB", len(body), 0, 0, 0x13) + body
        frames += [
            encode_frame(1, [Datagram(Command.FPWR, station, 0x0600, fmmus, 1)]),
            encode_frame(
                2, [Datagram(Command.FPRD, station, MAILBOX_IN_START, mailbox.ljust(256), 1)]
            ),
        ]
    return [passed(frame) for frame in frames]


def cycle(inputs: Sequence[bytes], working_counter: int = FULL) -> list[bytes]:
    """Return the frames of a bus cycle: one for the first camera, one for the second."""
    size = 2 * OUTPUTS + INPUT_DTYPE.itemsize
    sent = encode_frame(3, [Datagram(Command.LRW, 0, 0, bytes(size))])
    sent_second = encode_frame(4, [Datagram(Command.LRW, size, 0, bytes(INPUT_DTYPE.itemsize))])
    first = Datagram(Command.LRW, 0, 0, bytes(2 * OUTPUTS) + inputs[0], working_counter - 1)
    second = Datagram(Command.LRW, size, 0, inputs[1], 1)
    return [
        sent, sent_second, passed(encode_frame(3, [first])), passed(encode_frame(4, [second]))
    ]  # fmt: skip


def steady(cycles: int, begin: int = 0) -> list[bytes]:
    """Return cycles in which both cameras send eight frames each."""
    frames = []
    for turn in range(cycles):
        first = begin + 8 * turn
        frames += cycle([make_input(camera, first, 8, turn) for camera in (0, 1)])
    return frames


def write_pcap(path: Path, packets: Sequence[bytes], order: str = "<", tick_ns: int = 1) -> None:
    magic = {1: 0xA1B23C4D, 1000: 0xA1B2C3D4}[tick_ns]
    content = struct.pack(order + "IHHIIII", magic, 2, 4, 0, 0, 65535, 1)
    for number, packet in enumerate(packets):
        size, ticks = len(packet), number * 1_000_000 // tick_ns
        content += struct.pack(order + "IIII", 100, ticks, size, size) + packet
    path.write_bytes(content)


def write_pcapng(path: Path, packets: Sequence[bytes], order: str = "<") -> None:
    def block(kind: int, body: bytes) -> bytes:
        body += bytes(-len(body) % 4)
        size = struct.pack(order + "I", len(body) + 12)
        return struct.pack(order + "I", kind) + size + body + size

    content = block(0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
    # A comment, then the resolution of nanoseconds.
    options = struct.pack(order + "HH4sHHB3x", 1, 4, b"test", 9, 1, 9) + bytes(4)
    content += block(1, struct.pack(order + "HHI", 1, 0, 0) + options)
    content += block(5, bytes(20))
    for number, packet in enumerate(packets):
        time_ns = 100_000_000_000 + number * 1_000_000
        head = struct.pack(
            order + "IIIII", 0, time_ns >> 32, time_ns & 0xFFFFFFFF, len(packet), len(packet)
        )
        content += block(6, head + packet)
    path.write_bytes(content)


def decode(
    path: Path, packets: Sequence[bytes], n_cameras: int = 0
) -> tuple[BusCapture, list[FrameBlock]]:
    write_pcap(path, packets)
    capture = BusCapture(path, n_cameras)
    return capture, list(capture.blocks())


def counters(blocks: Sequence[FrameBlock]) -> list[int]:
    return [int(counter) for block in blocks for counter in block.counter]


def check_content(blocks: Sequence[FrameBlock]) -> None:
    """Check that every frame shows the pattern at its exposure."""
    for block in blocks:
        np.testing.assert_array_equal(block.time_ns, START_NS + block.counter * PERIOD_NS)
        for camera in (0, 1):
            for at, counter in enumerate(block.counter):
                valid, _flags, uv = PATTERN.camera_frames(camera, int(counter), 1)
                assert block.valid[at, camera] == valid[0]
                seen = (valid[0] >> np.arange(8)) & 1 == 1
                found = block.uv[at, camera][seen]
                # Half a step of the wire.
                np.testing.assert_allclose(found, uv[0][seen], atol=0.5 / 65536)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", ["us", "ns", "ng"])
def test_every_format_gives_the_same_packets(tmp_path: Path, kind: str, order: str) -> None:
    path = tmp_path / "bus.pcap"
    packets = [bytes([n]) * (60 + n) for n in range(5)]
    if kind == "ng":
        write_pcapng(path, packets, order)
    else:
        write_pcap(path, packets, order, 1000 if kind == "us" else 1)
    found = list(PacketFile(path).packets())
    assert [packet.content for packet in found] == packets
    assert [packet.time_ns for packet in found] == [100_000_000_000 + n * 10**6 for n in range(5)]
    assert all(packet.whole for packet in found)


def test_a_recording_from_the_start_on_explains_itself(tmp_path: Path) -> None:
    capture, blocks = decode(tmp_path / "a", bringup() + steady(20))
    assert counters(blocks) == list(range(160))
    check_content(blocks)
    account = capture.account
    assert capture.serials == SERIALS
    assert [camera.name for camera in account.cameras] == ["serial 77", "serial 78"]
    assert (account.cycles, account.answered, account.short) == (20, 20, 0)
    assert (account.joined, account.unjoined) == (160, 0)
    assert (account.packets, account.other, account.malformed) == (84, 0, 0)
    assert account.sent == {"LRW": 40}
    assert account.returned == {"LRW": 40, "FPWR": 2, "FPRD": 2}
    assert account.last_ns - account.first_ns == 83_000_000


def test_a_recording_from_the_middle_needs_the_number_of_cameras(tmp_path: Path) -> None:
    packets = steady(20, begin=1_000_000)
    with pytest.raises(
        InputError, match="start-up of the cameras is missing or incomplete in the recording"
    ):
        decode(tmp_path / "a", packets)
    capture, blocks = decode(tmp_path / "b", packets, n_cameras=2)
    # The owner of the inputs is clear once a second frame agrees.
    assert counters(blocks) == list(range(1_000_008, 1_000_160))
    check_content(blocks)
    assert capture.account.unjoined == 0
    assert capture.serials == (None, None)
    assert [(one.unproven, one.damaged) for one in capture.account.cameras] == [(1, 0), (1, 0)]


def test_the_data_of_another_camera_are_not_taken_from_a_recording(tmp_path: Path) -> None:
    packets = bringup() + steady(10)
    for turn in range(10, 20):
        packets += cycle([make_input(camera, 8 * turn, 8, turn) for camera in (1, 0)])
    capture, blocks = decode(tmp_path / "a", packets)
    assert counters(blocks) == list(range(80))
    check_content(blocks)
    assert [one.damaged for one in capture.account.cameras] == [10, 10]


def test_frames_are_joined_by_exposure_also_where_one_camera_is_behind(tmp_path: Path) -> None:
    packets = bringup()
    for turn in range(20):
        behind = max(0, 8 * turn - 40)
        packets += cycle([make_input(0, 8 * turn, 8, turn), make_input(1, behind, 8, turn)])
    capture, blocks = decode(tmp_path / "a", packets)
    assert counters(blocks) == list(range(120))
    check_content(blocks)
    # It sent the first eight frames six times.
    assert capture.account.cameras[1].known == 40


def test_what_is_missing_is_counted_and_never_made_up(tmp_path: Path) -> None:
    packets = steady(20)
    del packets[4 * 10 : 4 * 12]
    capture, blocks = decode(tmp_path / "a", bringup() + packets)
    assert counters(blocks) == [*range(80), *range(96, 160)]
    assert [camera.missing for camera in capture.account.cameras] == [16, 16]
    assert capture.account.unjoined == 16


def test_answers_that_must_not_be_used_are_counted_by_what_is_wrong(tmp_path: Path) -> None:
    good = make_input(1, 8, 8, 1)
    damaged = bytearray(good)
    damaged[100] ^= 4
    wrong = {
        "damaged": bytes(damaged),
        "idle": make_input(1, 8, 8, 1, status=CameraStatus.OPERATIONAL),
        "repeated": make_input(1, 0, 8, 0),
        "contradicting": make_input(1, 8, 13, 1),
    }
    for field, content in wrong.items():
        packets = bringup() + steady(1) + cycle([make_input(0, 8, 8, 1), content])
        capture, blocks = decode(tmp_path / field, packets)
        assert counters(blocks) == list(range(8)), field
        account = capture.account.cameras[1]
        fields = {name: getattr(account, name) for name in wrong}
        assert fields == {name: int(name == field) for name in wrong}


def test_a_low_working_counter_makes_the_answer_unusable(tmp_path: Path) -> None:
    short = cycle([make_input(camera, 8, 8, 1) for camera in (0, 1)], FULL - 1)
    capture, blocks = decode(tmp_path / "a", bringup() + steady(1) + short)
    assert capture.account.short == 1
    assert counters(blocks) == list(range(8))


def test_cameras_that_are_started_again_begin_a_new_count(tmp_path: Path) -> None:
    again = [
        frame
        for turn in range(3)
        for frame in cycle(
            [
                make_input(
                    camera, 8 * turn, 8, turn + 50, start_ns=START_NS + 10**9 + 8 * turn * PERIOD_NS
                )
                for camera in (0, 1)
            ]
        )
    ]
    capture, blocks = decode(tmp_path / "a", bringup() + steady(3) + again)
    assert counters(blocks) == [*range(24), *range(24)]
    assert [camera.restarts for camera in capture.account.cameras] == [1, 1]
    assert int(blocks[-1].time_ns[-1]) == START_NS + 10**9 + 23 * PERIOD_NS


def test_what_is_no_whole_ethercat_frame_is_counted(tmp_path: Path) -> None:
    good = steady(1)
    broken = bytearray(good[2])
    struct.pack_into("<H", broken, 14 + 2 + 6, 0x07FF)
    capture, _ = decode(
        tmp_path / "a", [*bringup(), bytes(60), bytes(broken), b"\xff" * 12 + b"\x88\xa4", *good]
    )
    account = capture.account
    assert (account.other, account.malformed) == (2, 1)


def test_a_file_that_was_cut_off_is_read_up_to_there(tmp_path: Path) -> None:
    path = tmp_path / "bus.pcap"
    write_pcap(path, bringup() + steady(5))
    whole = path.read_bytes()
    path.write_bytes(whole[:-10])
    capture = BusCapture(path)
    assert counters(list(capture.blocks())) == list(range(32))
    assert capture.account.cut_off
    path.write_bytes(whole)
    capture = BusCapture(path)
    assert counters(list(capture.blocks())) == list(range(40))
    assert not capture.account.cut_off


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "not a network recording"),
        (b"OCMM", "not a network recording"),
        (struct.pack("<IHHIIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 113), "link type 113"),
        (
            struct.pack("<IHHIIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1) + b"\xff" * 16,
            "claims 4294967295 bytes",
        ),
        (struct.pack("<III", 0x0A0D0D0A, 28, 0), "no byte order"),
        (struct.pack("<IIIHHq", 0x0A0D0D0A, 28, 0x1A2B3C4D, 1, 0, -1) + bytes(4), "two lengths"),
        (struct.pack("<III", 0x0A0D0D0A, 30, 0x1A2B3C4D), "claims 30 bytes"),
    ],
)
def test_a_file_that_is_no_recording_is_refused(tmp_path: Path, content: bytes, why: str) -> None:
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(InputError, match=why):
        list(PacketFile(path).packets())


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"gone\.pcap: cannot be opened"):
        list(BusCapture(tmp_path / "gone.pcap").blocks())
