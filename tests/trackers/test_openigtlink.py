"""OpenIGTLink: messages, accounts, hostile packets, faults of a device, and the public client."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag
from ocmm_core.camera import load_rig, load_tracker
from ocmm_core.errors import AcquisitionError, InputError, OcmmError
from ocmm_sim.trackers import IgtlEncoder, Kind, MarkerErrors, TrackerFaults, TrackerServer, message
from ocmm_trackers import (
    FrameBuilder,
    GeometryProof,
    IgtlDecoder,
    Pose,
    TrackerSource,
    checksum,
    judge_geometry,
    tracker_config,
)
from tests.host import amount, not_run
from tests.trackers.tracker_bench import (
    BODY,
    FIRST_NS,
    PROBE,
    TRACKER,
    places_of,
    source_to,
    tips_near,
    written,
)

PERIOD_NS = 10_000_000
_KINDS: tuple[Kind, ...] = ("TDATA", "QTDATA", "POSITION", "TRANSFORM", "POINT")
_SIGMA_MM = 0.05
_HOSTILE, _MIXED = amount(3_000, 10_000), amount(40, 100)


_DOCUMENT = load_tracker(TRACKER)


def frames_in(data: bytes, path: Path = TRACKER) -> list[np.ndarray]:
    document = _DOCUMENT if path == TRACKER else load_tracker(path)
    stream, builder, found = IgtlDecoder(document), FrameBuilder(document), []
    for one in stream.push(data):
        if isinstance(one.content, Pose):
            found += [frame.places for frame in builder.add(one.content, one.time_ns)]
    return found


@contextmanager
def opened(path: Path) -> Iterator[tuple[TrackerSource, TrackerServer, IgtlEncoder]]:
    """Yield a source that is connected to a server on this computer."""
    encoder = IgtlEncoder(load_tracker(path))
    server = TrackerServer(encoder)
    source, ring = source_to("igtl", path, server)
    try:
        source.open()
        while not server.accepted():
            pass
        yield source, server, encoder
    finally:
        source.close()
        server.close()
        ring.close()


def read_all(source: TrackerSource, server: TrackerServer, data: list[bytes]) -> list[FrameBlock]:
    """Return the frames that a source makes of data; AcquisitionError as it raises."""
    blocks = []
    for one in data:
        server.send(one)
        block = source.read().frames
        blocks += [] if block is None else [block]
    return blocks


def test_checksum_is_that_of_the_standard() -> None:
    # Check value of CRC-64/ECMA-182 (catalogue of parametrised CRC algorithms).
    assert checksum(b"123456789") == 0x6C40DF5F0B497347


@pytest.mark.parametrize("version", [1, 3])
@pytest.mark.parametrize("kind", _KINDS)
def test_markers_arrive_as_sent(kind: Kind, version: int) -> None:
    rng = np.random.default_rng(1)
    encoder = IgtlEncoder(load_tracker(TRACKER), kind, version)
    sent = [places_of(rng) for _ in range(20)]
    sent[3][2] = np.nan
    data = b"".join(encoder.frame(p, FIRST_NS + n * PERIOD_NS) for n, p in enumerate(sent))
    # Bytes arrive in any portions.
    document = load_tracker(TRACKER)
    stream, builder = IgtlDecoder(document), FrameBuilder(document)
    found = []
    for start in range(0, len(data), 37):
        for one in stream.push(data[start : start + 37]):
            if isinstance(one.content, Pose):
                found += builder.add(one.content, one.time_ns)
    # A frame of single messages is complete with the first one of the next.
    whole = len(sent) if kind in ("TDATA", "QTDATA", "POINT") else len(sent) - 1
    assert len(found) == whole
    for n, frame in enumerate(found):
        assert frame.time_ns == FIRST_NS + n * PERIOD_NS
        # float32 of 100 mm.
        np.testing.assert_allclose(frame.places[:6], sent[n], atol=2e-5)
    account = stream.account
    assert account.received == account.decoded + account.unread + account.damaged + (
        account.malformed
    )


@pytest.mark.parametrize("missing", ["absent", "zero", "frozen"])
def test_a_hidden_marker_is_no_number(missing: str, tmp_path: Path) -> None:
    path = written(tmp_path, missing=missing)
    encoder, rng = IgtlEncoder(load_tracker(path)), np.random.default_rng(2)
    first, second = places_of(rng), places_of(rng)
    second[1] = np.nan
    data = encoder.frame(first, FIRST_NS) + encoder.frame(second, FIRST_NS + PERIOD_NS)
    found = frames_in(data, path)
    np.testing.assert_allclose(found[1][:6], second, atol=2e-5)


def test_a_frame_that_repeats_the_last_one_is_not_measured() -> None:
    encoder, places = IgtlEncoder(load_tracker(TRACKER)), places_of(np.random.default_rng(3))
    data = b"".join(encoder.frame(places, FIRST_NS + n * PERIOD_NS) for n in range(3))
    found = frames_in(data)
    assert np.isfinite(found[0][:6]).all()
    assert np.isnan(found[1]).all()
    assert np.isnan(found[2]).all()


def test_hostile_packets_are_counted_or_end_with_a_sentence() -> None:
    """N = 3,000 (10,000) packets."""
    rng = np.random.default_rng(4)
    document = _DOCUMENT
    wrong, ended, frames = 0, 0, 0
    for number in range(_HOSTILE):
        places = places_of(rng)
        kind = _KINDS[number // 5 % len(_KINDS)]
        data = bytearray(IgtlEncoder(document, kind, 1 + 2 * (number % 2)).frame(places, FIRST_NS))
        match number % 5:
            case 0:
                for at in rng.integers(0, len(data), 1 + number % 7):
                    data[at] ^= 1 << int(rng.integers(8))
            case 1:
                del data[int(rng.integers(len(data))) :]
                data += rng.bytes(200)
            case 2:
                data = bytearray(rng.bytes(int(rng.integers(1, 400))))
            case 3:
                body = rng.bytes(int(rng.integers(0, 6)) * 70 + int(rng.integers(2)))
                data = bytearray(message(kind, "M1", FIRST_NS, body, 1 + 2 * (number % 2)))
            case 4:
                data[42:50] = int(rng.integers(1 << 40)).to_bytes(8, "big")
        try:
            for found in frames_in(bytes(data)):
                frames += 1
                seen = np.isfinite(found[:, 0])
                true = np.vstack([places, np.full((2, 3), np.nan)])
                good = np.abs(found[seen] - true[seen]).max(initial=0.0) < 1e-3
                proven = judge_geometry(found, BODY.leds_probe, _SIGMA_MM) is GeometryProof.PROVEN
                wrong += proven and not good
        except OcmmError:
            ended += 1
    assert wrong == 0
    # Both ways occur: sentences, and frames of packets whose damage is elsewhere.
    assert ended > 100
    assert frames > 20


@pytest.mark.parametrize(
    ("fault", "code"),
    [("metres", "tracker.unit"), ("mirrored", "tracker.handedness"), ("poses", "tracker.poses")],
)
def test_mixed_up_units_axes_and_poses_are_named(fault: str, code: str, tmp_path: Path) -> None:
    """N = 40 (100) each; half of the documents state metres, or left-handed axes."""
    rng, codes, given = np.random.default_rng(5), [], 0
    unit = written(tmp_path, device_unit="m" if fault == "metres" else "mm")
    for number in range(_MIXED):
        path = unit if number % 2 and fault == "metres" else TRACKER
        with opened(path) as (source, server, encoder):
            setattr(encoder.faults, fault, True)
            errors = MarkerErrors(load_tracker(path), number)
            places = places_of(rng)
            data = [
                encoder.frame(errors.reported(places), FIRST_NS + n * PERIOD_NS) for n in range(3)
            ]
            try:
                given += len(read_all(source, server, data))
            except AcquisitionError as error:
                codes.append(error.code)
    assert codes == [code] * _MIXED
    assert given == 0


@pytest.mark.parametrize("handedness", ["right", "left"])
@pytest.mark.parametrize("device_unit", ["mm", "m"])
def test_stated_units_and_axes_are_proven(
    handedness: str, device_unit: str, tmp_path: Path
) -> None:
    path = written(tmp_path, handedness=handedness, device_unit=device_unit)
    rng = np.random.default_rng(6)
    with opened(path) as (source, server, encoder):
        errors = MarkerErrors(load_tracker(path), 1)
        places = places_of(rng)
        data = [encoder.frame(errors.reported(places), FIRST_NS + n * PERIOD_NS) for n in range(5)]
        assert len(read_all(source, server, data)) == 5


@pytest.mark.parametrize("kind", ["QTDATA", "POSITION"])
def test_quaternions_in_another_order_are_named(kind: Kind) -> None:
    with opened(TRACKER) as (source, server, _):
        encoder = IgtlEncoder(load_tracker(TRACKER), kind)
        encoder.faults.scalar_first = True
        server.send(encoder.frame(places_of(np.random.default_rng(12)), FIRST_NS))
        with pytest.raises(AcquisitionError) as found:
            source.read()
    assert found.value.code == "tracker.poses"


def test_no_frame_passes_before_the_proof() -> None:
    with opened(TRACKER) as (source, server, encoder):
        places = places_of(np.random.default_rng(7))
        places[3:] = np.nan
        server.send(encoder.frame(places, FIRST_NS))
        cycle = source.read()
        assert cycle.frames is None
        assert "at least four markers" in cycle.reason


@pytest.mark.parametrize(
    ("faults", "limits"),
    [
        ({"lose": 0.1}, (0, 0)),
        ({"late": 0.1}, (1, 0)),
        ({"double": 0.2}, (0, 1)),
        ({"damage": 0.1}, (0, 0)),
        ({"swap": 0.2}, (0, 0)),
    ],
    ids=lambda one: str(one),
)
def test_faults_lose_frames_and_give_no_wrong_tip(
    faults: dict[str, float], limits: tuple[int, int]
) -> None:
    """N = 300 frames; a tip within seven standard deviations of the true one."""
    rng, count = np.random.default_rng(8), 300
    with opened(TRACKER) as (source, server, encoder):
        for name, value in faults.items():
            setattr(encoder.faults, name, value)
        errors, places = MarkerErrors(load_tracker(TRACKER), 2), places_of(rng)
        data = [
            encoder.frame(errors.reported(places), FIRST_NS + n * PERIOD_NS, pressed=n == 50)
            for n in range(count)
        ]
        blocks = read_all(source, server, data)
        good, bad = tips_near(blocks, load_rig(TRACKER), places)
        account = source.builder.account
    assert bad == 0
    assert good > count * 0.5
    assert account.markers == sum(
        getattr(account, one.name) for one in fields(account)
        if one.name not in ("markers", "frames", "frames_lost")
    )  # fmt: skip
    assert (account.late > 0, account.doubled > 0) == tuple(map(bool, limits))
    if "lose" in faults or "damage" in faults:
        assert account.frames_lost > 0
    assert any(block.flags.any() for block in blocks) or "lose" in faults
    assert all(int(block.flags.max()) in (0, FrameFlag.BUTTON) for block in blocks)


def test_markers_without_time_end_the_source() -> None:
    with opened(TRACKER) as (source, server, encoder):
        errors, places = MarkerErrors(load_tracker(TRACKER), 3), places_of(np.random.default_rng(9))
        server.send(encoder.frame(errors.reported(places), FIRST_NS))
        source.read()
        encoder.faults = TrackerFaults(unstamped=True)
        server.send(encoder.frame(errors.reported(places), FIRST_NS + PERIOD_NS))
        with pytest.raises(AcquisitionError) as found:
            source.read()
        assert found.value.code == "tracker.no_time"


def test_another_rate_than_stated_ends_the_source() -> None:
    with opened(TRACKER) as (source, server, encoder):
        errors = MarkerErrors(load_tracker(TRACKER), 4)
        places = places_of(np.random.default_rng(10))
        data = [
            encoder.frame(errors.reported(places), FIRST_NS + 2 * n * PERIOD_NS) for n in range(60)
        ]
        with pytest.raises(AcquisitionError) as found:
            read_all(source, server, data)
    assert found.value.code == "tracker.rate"
    assert "50.0 frames a second" in found.value.what


def test_cameras_flat_probes_and_addresses_are_refused(tmp_path: Path) -> None:
    cameras = TRACKER.parent / "recommended.toml"
    with pytest.raises(InputError, match="one of cameras"):
        tracker_config("igtl", PROBE, load_rig(cameras), "host:1", "test")
    text = PROBE.read_text("utf-8").replace(", -30.0, ", ", 0.0, ").replace(", 30.0, ", ", 0.1, ")
    flat = tmp_path / "flat.toml"
    flat.write_text(text, "utf-8")
    with pytest.raises(InputError, match="of a plane"):
        tracker_config("igtl", flat, load_rig(TRACKER), "host:1", "test")
    for wrong in ("host:", "host:99999", ":18944"):
        with pytest.raises(InputError, match="no host with a port"):
            tracker_config("igtl", PROBE, load_rig(TRACKER), wrong, "test")


@pytest.mark.parametrize("kind", ["TRANSFORM", "POINT"])
def test_the_public_client_reads_the_same(kind: Kind) -> None:
    """Both ways: pyigtl reads our messages, and we read its."""
    if find_spec("pyigtl") is None:
        not_run("pyigtl is not installed")
    theirs_of = import_module("pyigtl.messages")
    head_of, message_of = theirs_of.MessageBase.parse_header, theirs_of.MessageBase.create_message

    rng = np.random.default_rng(11)
    for _ in range(100):
        places = places_of(rng)
        data = IgtlEncoder(load_tracker(TRACKER), kind).frame(places, FIRST_NS)
        data = data[58 + 18 :]  # Without the button, which it does not read.
        found = []
        while data:
            head = head_of(data[:58])
            theirs = message_of(head["message_type"])
            theirs.unpack(head, data[58 : 58 + head["body_size"]])
            data = data[58 + head["body_size"] :]
            assert theirs.timestamp == pytest.approx(FIRST_NS * 1e-9, abs=1e-6)
            found += (
                [theirs.matrix[:3, 3]] if kind == "TRANSFORM" else list(np.array(theirs.positions))
            )
        np.testing.assert_allclose(found, places, atol=2e-5)
        sent = b""
        if kind == "POINT":
            names = [f"M{n + 1}" for n in range(len(places))]
            sent = theirs_of.PointMessage(places, names, timestamp=1.7e9, device_name="T").pack()
        for n, place in enumerate(places) if kind == "TRANSFORM" else ():
            matrix = np.eye(4)
            matrix[:3, 3] = place
            sent += theirs_of.TransformMessage(
                matrix, timestamp=1.7e9, device_name=f"M{n + 1}"
            ).pack()
        if kind == "TRANSFORM":
            sent += theirs_of.TransformMessage(np.eye(4), timestamp=1.8e9, device_name="M1").pack()
        np.testing.assert_allclose(frames_in(sent)[0][:6], places, atol=2e-5)
