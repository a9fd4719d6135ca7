"""Requests to trackers and their answers: refusals, silence, labels, multicast."""

from __future__ import annotations

import socket
import struct

import numpy as np
import pytest

from ocmm_core.camera import load_tracker
from ocmm_core.documents import resource
from ocmm_core.errors import AcquisitionError
from ocmm_sim.trackers import NatNetEncoder, NdiEncoder, QtmEncoder, TrackerServer
from ocmm_trackers import PROTOCOLS, Decoder, Pose, TrackerLink, checksum_ndi
from tests.trackers.tracker_bench import TRACKER, measured, places_of, source_to

_FIRST_NS = 1_764_500_000_000_000_000
_GROUP = "239.255.42.99"
_OPTITRACK, _NDI = resource("rigs", "tracker_natnet.toml"), resource("rigs", "tracker_ndi.toml")


def decoder_of(protocol: str) -> Decoder:
    return PROTOCOLS[protocol](load_tracker(TRACKER))


def text(reply: str) -> bytes:
    return f"{reply}{checksum_ndi(reply.encode()):04X}\r".encode()


def qtm(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", 8 + len(content), kind) + content


def refusal(protocol: str, data: bytes, requests: int = 1) -> AcquisitionError:
    """Return the error at an answer to the first requests."""
    decoder = decoder_of(protocol)
    for number in range(requests):
        decoder.requests(10.0 * number)
    with pytest.raises(AcquisitionError) as found:
        decoder.push(data)
    return found.value


def test_checksum_of_ndi_is_that_of_the_catalogue() -> None:
    # Check value of CRC-16/ARC (catalogue of parametrised CRC algorithms).
    assert checksum_ndi(b"123456789") == 0xBB3D


@pytest.mark.parametrize("version", [(2, 10), (5, 0)])
def test_other_versions_of_natnet_are_refused(version: tuple[int, int]) -> None:
    encoder = NatNetEncoder(load_tracker(_OPTITRACK), version)
    error = refusal("natnet", encoder.answer(struct.pack("<HH", 0, 5) + b"Ping\0"))
    assert error.code == "natnet.version"
    assert f"NatNet {version[0]}.{version[1]}" in error.what


def test_rigid_bodies_without_markers_are_refused() -> None:
    encoder = NatNetEncoder(load_tracker(_OPTITRACK))
    encoder.faults.poses = True
    frames = [(places_of(np.random.default_rng(1)), _FIRST_NS)]
    with pytest.raises(AcquisitionError) as found:
        measured("natnet", _OPTITRACK, encoder, frames)
    assert found.value.code == "natnet.markers"


def test_markers_filled_in_by_motive_are_hidden() -> None:
    encoder, places = NatNetEncoder(load_tracker(_OPTITRACK)), places_of(np.random.default_rng(2))
    places[2] = np.nan
    decoder = decoder_of("natnet")
    decoder.push(encoder.answer(decoder.requests(0.0)))
    *_, message = decoder.push(encoder.frame(places, _FIRST_NS))
    assert isinstance(message.content, Pose)
    # The encoder sends a place for it, flagged as occluded and from the model.
    assert [np.isfinite(one.place[0]) for one in message.content.elements] == [
        True, True, False, True, True, True,
    ]  # fmt: skip


def test_multicast_frames_are_received() -> None:
    link = TrackerLink(("127.0.0.1", 1), datagrams=True, connect_s=1.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.bind(("127.0.0.1", 0))
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
        try:
            link.join(_GROUP, 21511)
            sender.sendto(b"frame", (_GROUP, 21511))
            assert link.receive(5.0) == [b"frame"]
        finally:
            link.close()


def test_a_refused_request_of_qtm_is_a_sentence() -> None:
    error = refusal("qtm", qtm(0, b"No measurement open\0"))
    assert error.code == "qtm.refused"
    assert "No measurement open" in error.what


def test_new_labels_of_qtm_are_requested_again() -> None:
    document = load_tracker(TRACKER)
    decoder, encoder = decoder_of("qtm"), QtmEncoder(document)
    places = places_of(np.random.default_rng(3))
    decoder.push(encoder.answer(decoder.requests(0.0)))
    encoder.answer(decoder.requests(0.0))
    assert decoder.push(encoder.frame(places, _FIRST_NS))[-1].kind == "frame"
    part = struct.pack("<IHH4f", 1, 0, 0, 1.0, 2.0, 3.0, 0.1)
    data = struct.pack("<QIIII", 1, 1, 1, 8 + len(part), 9) + part
    assert decoder.push(qtm(3, data)) == []
    assert decoder.account.malformed == 1
    assert b"GetParameters" in decoder.requests(0.0)
    # Once, until they have come.
    assert decoder.push(qtm(3, data)) == []
    assert decoder.requests(0.0) == b""


def test_a_hostile_list_of_labels_is_refused() -> None:
    bomb = (
        b'<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;">]>'
        b"<a><The_3D><Label><Name>&b;</Name></Label></The_3D></a>\0"
    )
    for content in (bomb, b"<a>\0", b"\0", b"<a><The_3D><Label><Name>\xff</Name></Label></a>"):
        decoder = decoder_of("qtm")
        assert decoder.push(qtm(2, content)) == []
        assert decoder.account.malformed == 1
        assert not decoder.ready


@pytest.mark.parametrize("protocol", ["ndi", "qtm"])
def test_bytes_of_another_protocol_are_refused(protocol: str) -> None:
    error = refusal(protocol, b"HTTP/1.1 400 Bad Request\n" * 500)
    assert error.code == "tracker.stream"


def test_a_device_of_ndi_in_another_state_is_named() -> None:
    decoder = decoder_of("ndi")
    for reply in ("ERROR0C", "OKAY", "00", "00", "OKAY"):
        assert decoder.requests(0.0)
        decoder.push(text(reply))
    assert decoder.ready
    assert decoder.requests(0.0).startswith(b"BX2:")
    with pytest.raises(AcquisitionError) as found:
        decoder.push(text("ERROR0C"))
    assert found.value.code == "ndi.refused"
    assert "BX2 with ERROR0C" in found.value.what


def test_a_command_without_a_good_reply_is_sent_again() -> None:
    decoder = decoder_of("ndi")
    first = decoder.requests(0.0)
    assert decoder.requests(0.5) == b""
    assert decoder.requests(1.5) == first
    decoder.push(b"OKAY0000\r")
    assert decoder.account.damaged == 1
    assert decoder.requests(1.6) == first


def test_strays_of_ndi_without_a_tool_have_no_time() -> None:
    decoder = decoder_of("ndi")
    for reply in ("OKAY", "OKAY", "00", "00", "OKAY"):
        decoder.requests(0.0)
        decoder.push(text(reply))
    decoder.requests(0.0)
    decoder.push(text("ERROR01"))
    assert decoder.requests(0.0).startswith(b"BX:1009")
    body = struct.pack("<BBB3fH", 0, 1, 0, 1.0, 2.0, 3.0, 0)
    head = struct.pack("<HH", 0xA5C4, len(body))
    sealed = b"".join(one + struct.pack("<H", checksum_ndi(one)) for one in (head, body))
    with pytest.raises(AcquisitionError) as found:
        decoder.push(sealed)
    assert found.value.code == "ndi.no_tool"


@pytest.mark.parametrize("protocol", ["natnet", "ndi", "qtm"])
def test_no_answer_is_a_sentence(protocol: str) -> None:
    server = TrackerServer(QtmEncoder(load_tracker(TRACKER)))
    source, ring = source_to(protocol, TRACKER, server, connect_s=0.3)
    try:
        with pytest.raises(AcquisitionError) as found:
            source.open()
    finally:
        source.close()
        server.close()
        ring.close()
    assert found.value.code == "tracker.connect"
    assert "no reply" in found.value.what


def test_names_that_the_document_lacks_are_shown() -> None:
    encoder = NdiEncoder(load_tracker(_NDI), as_tool=True)
    frames = [(places_of(np.random.default_rng(4)), _FIRST_NS)]
    reasons: list[str] = []
    source, blocks = measured("ndi", _NDI, encoder, frames, reasons)
    assert not blocks
    assert "it sends 01:0, 01:1, 01:2, 01:3, 01:4, 01:5." in " ".join(reasons)
    assert source.builder.account.unknown == 6
