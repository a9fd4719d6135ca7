"""NatNet, NDI and QTM: markers as sent, hostile packets, mix-ups, faults of a device."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.camera import Rig, TrackerDocument, load_rig, load_tracker, project
from ocmm_core.documents import resource
from ocmm_core.errors import AcquisitionError, OcmmError
from ocmm_sim.trackers import (
    MarkerEncoder,
    MarkerErrors,
    NatNetEncoder,
    NdiEncoder,
    QtmEncoder,
    datagrams_of,
)
from ocmm_trackers import (
    PROTOCOLS,
    Decoder,
    FrameBuilder,
    MarkerFrame,
    Pose,
    SensorValues,
    checksum_ndi,
)
from tests.host import amount
from tests.trackers.tracker_bench import FIRST_NS, measured, places_of, tips_near

_HOSTILE, _MIXED, _FAULTY = amount(2_000, 10_000), amount(40, 100), 300
_OPTITRACK, _NDI, _QTM = (
    resource("rigs", f"tracker_{one}.toml") for one in ("natnet", "ndi", "qtm")
)


@dataclass(frozen=True)
class Device:
    protocol: str
    path: Path
    make: Callable[[TrackerDocument], MarkerEncoder]
    atol: float
    """mm, of a marker of 100 mm by its coding."""

    @cached_property
    def document(self) -> TrackerDocument:
        return load_tracker(self.path)

    @cached_property
    def rig(self) -> Rig:
        return load_rig(self.path)

    def encoder(self) -> MarkerEncoder:
        return self.make(self.document)

    def times(self, count: int) -> list[int]:
        return [FIRST_NS + round(n * 1e9 / self.document.frame_rate_hz) for n in range(count)]


def _natnet(version: tuple[int, int]) -> Device:
    # float32 of 0.1 m.
    return Device("natnet", _OPTITRACK, lambda one: NatNetEncoder(one, version), 2e-5)


DEVICES = {
    "natnet 3.0": _natnet((3, 0)),
    "natnet 3.1": _natnet((3, 1)),
    "natnet 4.0": _natnet((4, 0)),
    "natnet 4.1": _natnet((4, 1)),
    "ndi BX2": Device("ndi", _NDI, NdiEncoder, 2e-5),
    "ndi BX": Device("ndi", _NDI, lambda one: NdiEncoder(one, "BX"), 2e-5),
    # Rounded to 0.01 mm.
    "ndi TX": Device("ndi", _NDI, lambda one: NdiEncoder(one, "TX"), 5.1e-3),
    "qtm": Device("qtm", _QTM, QtmEncoder, 2e-5),
}
NEWEST = ("natnet 4.1", "ndi BX2", "qtm")


def started(device: Device) -> tuple[Decoder, MarkerEncoder]:
    """Return both ends of a dialogue after all requests of the receiver."""
    encoder, now = device.encoder(), 0.0
    decoder = PROTOCOLS[device.protocol](device.document)
    if encoder.greeting:
        decoder.push(encoder.greeting)
    while not (decoder.ready and encoder.ready):
        answer(decoder, encoder, now)
        now += 2.0
        assert now < 100.0
    return decoder, encoder


def answer(decoder: Decoder, encoder: MarkerEncoder, now: float) -> None:
    data = encoder.answer(decoder.requests(now))
    if data:
        decoder.push(data)


def frames_in(
    decoder: Decoder, encoder: MarkerEncoder, builder: FrameBuilder, data: bytes
) -> list[MarkerFrame]:
    found = []
    for one in datagrams_of(data) if encoder.datagrams else [data]:
        for message in decoder.push(one):
            if isinstance(message.content, Pose):
                found += builder.add(message.content, message.time_ns)
    return found


@pytest.mark.parametrize("name", DEVICES)
def test_markers_arrive_as_sent(name: str) -> None:
    device, rng = DEVICES[name], np.random.default_rng(1)
    decoder, encoder = started(device)
    builder = FrameBuilder(device.document)
    first = places_of(rng)
    sent = [first + n * rng.uniform(-0.5, 0.5, 3) for n in range(20)]
    sent[3][2] = np.nan
    found: list[MarkerFrame] = []
    for places, time_ns in zip(sent, device.times(len(sent)), strict=True):
        answer(decoder, encoder, 1e3 + len(found))
        found += frames_in(decoder, encoder, builder, encoder.frame(places, time_ns))
    assert len(found) == len(sent)
    for places, frame in zip(sent, found, strict=True):
        np.testing.assert_allclose(frame.places[:6], places, atol=device.atol)
        assert np.isnan(frame.places[6:]).all()
    steps = np.diff([frame.time_ns for frame in found])
    np.testing.assert_allclose(steps, np.diff(device.times(len(sent))), atol=1000)
    for account, whole in ((decoder.account, "received"), (builder.account, "markers")):
        parts = [one.name for one in fields(account) if not one.name.startswith("frames")]
        assert getattr(account, whole) * 2 == sum(getattr(account, one) for one in parts)


def test_markers_of_an_ndi_tool_have_its_names(tmp_path: Path) -> None:
    text = _NDI.read_text("utf-8").replace('["S1", "S2", "S3", "S4", "S5", "S6", "S7", "S8"]',
                                           str([f"01:{n}" for n in range(6)]))  # fmt: skip
    path = tmp_path / "tool.toml"
    path.write_text(text, "utf-8")
    makers: list[Callable[[TrackerDocument], MarkerEncoder]] = [
        lambda one: NdiEncoder(one, "BX2", as_tool=True),
        lambda one: NdiEncoder(one, "BX", as_tool=True),
    ]
    for make in makers:
        device = Device("ndi", path, make, 2e-5)
        decoder, encoder = started(device)
        places = places_of(np.random.default_rng(2))
        places[1] = np.nan
        (frame,) = frames_in(
            decoder, encoder, FrameBuilder(device.document), encoder.frame(places, FIRST_NS)
        )
        np.testing.assert_allclose(frame.places, places, atol=device.atol)


def test_stray_markers_keep_their_names() -> None:
    """N = 300 frames of a moving probe whose markers come in any order, and hide."""
    device, rng = DEVICES["ndi BX2"], np.random.default_rng(3)
    decoder, encoder = started(device)
    builder = FrameBuilder(device.document)
    start, way = places_of(rng), np.array([300.0, 0.0, 200.0])
    names: dict[int, set[int]] = {led: set() for led in range(6)}
    for n, time_ns in enumerate(device.times(300)):
        places = start + way * np.sin(2.0 * np.pi * n / 300)
        # Ten frames in twenty, less than the time for which a name is kept.
        places[(n // 20) % 6] = np.nan if n % 20 < 10 else places[(n // 20) % 6]
        order = rng.permutation(6)
        answer(decoder, encoder, 1e3 + n)
        (frame,) = frames_in(decoder, encoder, builder, encoder.frame(places[order], time_ns))
        for led in np.flatnonzero(np.isfinite(places[:, 0])).tolist():
            away = np.linalg.norm(frame.places - places[led], axis=1)
            names[led].add(int(np.nanargmin(away)))
    assert all(len(one) == 1 for one in names.values())
    assert len(set.union(*names.values())) == 6


def block_of(frame: MarkerFrame, device: Device) -> FrameBlock:
    rig = device.rig
    uv = np.full((1, len(rig.cameras), 8, 2), np.nan)
    seen = np.isfinite(frame.places[:, 0])
    for index, camera in enumerate(rig.cameras):
        uv[0, index, seen] = project(camera, frame.places[seen])
    valid = np.full((1, 3), sum(1 << int(n) for n in np.flatnonzero(seen)), np.uint64)
    return FrameBlock(
        np.zeros(1, np.int64), np.ones(1, np.int64), np.zeros(1, np.uint32), valid, uv
    )


def damaged(data: bytes, kind: int, rng: np.random.Generator) -> bytes:
    """Return a packet with flipped bits, a wrong end, other bytes inside, or another size."""
    packet = bytearray(data)
    if kind == 0:
        for at in rng.integers(0, len(packet), 1 + int(rng.integers(7))):
            packet[at] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del packet[int(rng.integers(len(packet))) :]
        packet += rng.bytes(200) if rng.random() < 0.5 else b""
    elif kind == 2:
        packet = bytearray(rng.bytes(int(rng.integers(1, 400))))
    elif kind == 3:
        at = int(rng.integers(8, len(packet) - 4))
        packet[at : at + 4] = rng.bytes(4)
    else:
        packet[2:4] = int(rng.integers(1 << 16)).to_bytes(2, "little")
    return bytes(packet)


def resealed(packet: bytes) -> bytes:
    """Return a binary reply of NDI with the checksums of its content."""
    parts = [packet[:4], packet[6:-2]]
    return b"".join(one + struct.pack("<H", checksum_ndi(one)) for one in parts)


@pytest.mark.parametrize("name", NEWEST)
def test_hostile_packets_are_counted_or_end_with_a_sentence(name: str) -> None:
    """N = 2,000 (10,000) packets; a tip within seven standard deviations of the true one, or none.

    No protocol but NDI has checksums: a number that is damaged is a displaced marker, refused by
    the known distances.
    """
    device, rng = DEVICES[name], np.random.default_rng(4)
    ended = refused = frames = right = wrong = 0
    for number in range(_HOSTILE):
        decoder, encoder = started(device)
        places = places_of(rng)
        answer(decoder, encoder, 1e3)
        packet = damaged(encoder.frame(places, FIRST_NS), number % 5, rng)
        if device.protocol == "ndi" and number % 2:
            packet = resealed(packet)
        try:
            messages = decoder.push(packet)
            for pose in [one for one in messages if isinstance(one.content, Pose)]:
                assert isinstance(pose.content, Pose)
                for found in FrameBuilder(device.document).add(pose.content, pose.time_ns):
                    frames += 1
                    good, bad = tips_near([block_of(found, device)], device.rig, places)
                    right, wrong = right + good, wrong + bad
        except OcmmError:
            ended += 1
        refused += decoder.account.damaged + decoder.account.malformed
    assert wrong == 0
    # All ways occur: sentences, refused packets, and frames whose damage is elsewhere.
    assert ended + refused > _HOSTILE / 10
    assert right > _HOSTILE / 100


@pytest.mark.parametrize("name", NEWEST)
@pytest.mark.parametrize(
    ("fault", "code"), [("metres", "tracker.unit"), ("mirrored", "tracker.handedness")]
)
def test_mixed_up_units_and_axes_are_named(name: str, fault: str, code: str) -> None:
    """N = 40 (100) each."""
    device, rng, codes = DEVICES[name], np.random.default_rng(5), []
    for number in range(_MIXED):
        encoder, places = device.encoder(), places_of(rng)
        setattr(encoder.faults, fault, True)
        errors = MarkerErrors(device.document, number)
        frames = [(errors.reported(places), time_ns) for time_ns in device.times(3)]
        try:
            measured(device.protocol, device.path, encoder, frames)
        except AcquisitionError as error:
            codes.append(error.code)
    assert codes == [code] * _MIXED


@pytest.mark.parametrize("name", NEWEST)
@pytest.mark.parametrize(
    "fault", [{"lose": 0.02}, {"late": 0.02}, {"double": 0.2}, {"swap": 0.2}], ids=str
)
def test_faults_lose_frames_and_give_no_wrong_tip(name: str, fault: dict[str, float]) -> None:
    """N = 300 frames; a tip within seven standard deviations of the true one."""
    device, places = DEVICES[name], places_of(np.random.default_rng(8))
    encoder, errors = device.encoder(), MarkerErrors(device.document, 2)
    for part, value in fault.items():
        setattr(encoder.faults, part, value)
    frames = [(errors.reported(places), time_ns) for time_ns in device.times(_FAULTY)]
    source, blocks = measured(device.protocol, device.path, encoder, frames)
    good, bad = tips_near(blocks, device.rig, places)
    assert bad == 0
    assert good > 0.5 * _FAULTY
    if "lose" in fault:
        assert source.builder.account.frames_lost > 0


@pytest.mark.parametrize("name", DEVICES)
def test_the_button_is_that_of_the_document(name: str) -> None:
    device = DEVICES[name]
    decoder, encoder = started(device)
    pressed = []
    for n, time_ns in enumerate(device.times(4)):
        answer(decoder, encoder, 1e3 + n)
        places = places_of(np.random.default_rng(n))
        data = encoder.frame(places, time_ns, pressed=n in (1, 2))
        for one in decoder.push(data):
            if isinstance(one.content, SensorValues) and one.device == device.document.button:
                pressed.append(one.content.values[0] > 0.5)
    assert pressed == [False, True, True, False]


@pytest.mark.parametrize("name", ["ndi BX2", "ndi BX", "ndi TX"])
def test_half_a_reply_does_not_spoil_its_repetition(name: str) -> None:
    device, places = DEVICES[name], places_of(np.random.default_rng(10))
    decoder, encoder = started(device)
    first, second = device.times(2)
    answer(decoder, encoder, 1e3)
    assert decoder.push(encoder.frame(places, first)[:40]) == []
    answer(decoder, encoder, 1e3 + 1.0)
    assert decoder.push(encoder.frame(places, second))[-1].kind == "frame"
    assert (decoder.account.damaged, decoder.account.malformed) == (0, 0)
