"""Files and lines that were spoiled: recordings of buses and of frames, reports, requests."""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ocmm_core.acquisition.bus_process import BusConfig, read_config
from ocmm_core.acquisition.bus_process._commands import LineBuffer
from ocmm_core.acquisition.recording import BusCapture
from ocmm_core.acquisition.recording._recording import (
    Recording,
    RecordingHead,
    encode_chunk,
    encode_head,
)
from ocmm_core.fieldbus.device import CameraIdentity
from ocmm_core.fieldbus.objects import (
    EepromRequest,
    ObjectReply,
    ObjectRequest,
    decode_reply,
    decode_request,
    encode_line,
)
from ocmm_core.fieldbus.report import BusPhase, BusReport, Histogram, decode_report, encode_report
from tests.core.acquisition.test_capture import bringup, steady, write_pcap, write_pcapng
from tests.core.fieldbus.fuzzing import outcomes, spoiled

LINES, FILES = 6_000, 1_500


@pytest.fixture(autouse=True)
def _bounded_memory() -> Iterator[None]:
    """Limit the memory: a length in a file must not be trusted before its bytes were read."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 100_000, f"{grown} KiB more"


def no_histogram() -> Histogram:
    return Histogram(edges_us=(1.0,), counts=(0, 0))


def make_report() -> BusReport:
    return BusReport(
        interface="wire0", phase=BusPhase.OPERATION, cameras=(), cycle_period_ns=1_000_000,
        frame_period_ns=125_000, lateness=no_histogram(), round_trip=no_histogram(),
    )  # fmt: skip


CONFIG = BusConfig(
    interface="wire0",
    ring_path="/dev/shm/ring",  # noqa: S108 - only a text here
    cameras=(CameraIdentity("left", 1, 2),),
)


@pytest.mark.parametrize(
    ("decode", "samples"),
    [
        (decode_request, [encode_line(ObjectRequest(1, "left", 0x1018, 4, bytes(40)))]),
        (decode_request, [encode_line(EepromRequest(2, "left", 8, 16))]),
        (decode_reply, [encode_line(ObjectReply(1, 4, 4, True, bytes(40), "a", "b", "c"))]),
        (decode_report, [encode_report(make_report())]),
        (read_config, [CONFIG.to_json()]),
    ],
)
def test_lines(decode: Callable[[bytes], object], samples: list[bytes]) -> None:
    for sample in samples:
        assert decode(sample) is not None
    taken, refused = outcomes(decode, spoiled(11, LINES, samples))
    assert taken + refused == LINES


def test_lines_come_whole_whatever_pieces_they_come_in() -> None:
    lines = LineBuffer(longest=500)
    whole = b"".join(spoiled(12, LINES, [b'{"number": 1}\n', b"\n", b"x" * 700]))
    found: list[bytes] = []
    for at in range(0, len(whole), 997):
        found += lines.push(whole[at : at + 997])
    *expected, _rest = whole.split(b"\n")
    assert found == [line for line in expected if len(line) <= 500]


def _captures(folder: Path) -> list[bytes]:
    path = folder / "sample"
    samples = []
    for order in "<>":
        write_pcap(path, bringup() + steady(3), order)
        samples.append(path.read_bytes())
        write_pcapng(path, bringup() + steady(3), order)
        samples.append(path.read_bytes())
    return samples


def test_recorded_buses(tmp_path: Path) -> None:
    path = tmp_path / "bus.pcap"

    def decode(content: bytes) -> None:
        path.write_bytes(content)
        capture = BusCapture(path)
        frames = sum(len(block) for block in capture.blocks())
        assert frames == capture.account.joined

    # Most changes hit the heads of the files; another test changes the frames.
    taken, refused = outcomes(decode, spoiled(13, FILES, _captures(tmp_path)))
    assert taken > FILES // 10
    assert refused > FILES // 10


def test_packets_of_recorded_buses(tmp_path: Path) -> None:
    path = tmp_path / "bus.pcap"
    good = bringup() + steady(3)

    def decode(content: bytes) -> None:
        place = len(content) % len(good)
        write_pcap(path, [*good[:place], content, *good[place + 1 :], content])
        capture = BusCapture(path)
        for block in capture.blocks():
            assert len(block) > 0

    taken, _refused = outcomes(decode, spoiled(14, FILES, good))
    assert taken > FILES // 2


def test_recordings(tmp_path: Path) -> None:
    path = tmp_path / "frames"
    head = RecordingHead(
        schema="ocmm.recording/1", source="test", rig_name="rig", rig_identity="0", started_utc="",
        camera_serials=(1, 2), frame_period_ns=125_000, cycle_period_ns=1_000_000,
    )  # fmt: skip
    frame = 20 + 2 * (2 + 8 * 2 * 8)
    sample = encode_head(head) + encode_chunk(0, bytes(3 * frame)) + encode_chunk(1, bytes(frame))

    def decode(content: bytes) -> None:
        path.write_bytes(content)
        with Recording(path) as recording:
            for start in range(min(len(recording), 10)):
                recording.read(start, 2)

    decode(sample)
    _taken, refused = outcomes(decode, spoiled(15, FILES, [sample]))
    assert refused > FILES // 10
