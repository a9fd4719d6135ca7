"""Hostile senders: bounded memory, no number that was not measured, and a sentence."""

from __future__ import annotations

import struct
import tracemalloc
from contextlib import suppress

import numpy as np
import pytest

from ocmm_core.camera import load_rig, load_tracker
from ocmm_core.documents import resource
from ocmm_core.errors import AcquisitionError
from ocmm_sim.trackers import IgtlEncoder, MarkerErrors, NdiEncoder, message
from ocmm_trackers import PROTOCOLS, Decoder, FrameBuilder, MarkerPlace, Pose, checksum_ndi
from tests.trackers.tracker_bench import FIRST_NS, TRACKER, measured, places_of, tips_near

NamedPlaces = dict[str, tuple[float, float, float] | None]
_NDI = resource("rigs", "tracker_ndi.toml")
_PERIOD_NS = 10_000_000
_MOST_HELD = 1 << 22
"""Bytes; a packet of the largest size, and one read of the network."""


def sealed(body: bytes, size: int | None = None) -> bytes:
    """Return a binary reply of NDI that states a size."""
    head = struct.pack("<HI", 0xA5C8, len(body) if size is None else size)
    return b"".join(one + struct.pack("<H", checksum_ndi(one)) for one in (head, body))


def polled() -> Decoder:
    """Return a decoder of NDI that has sent its first poll."""
    decoder, encoder = PROTOCOLS["ndi"](load_tracker(_NDI)), NdiEncoder(load_tracker(_NDI))
    now = 0.0
    while not encoder.ready:
        now += 2.0
        decoder.push(encoder.answer(decoder.requests(now)))
    return decoder


@pytest.mark.parametrize("coordinate", [np.nan, np.inf, -np.inf, 3e38, -3.697314e28])
def test_coordinates_that_are_no_numbers_are_hidden(coordinate: float) -> None:
    """A marker in each axis, of 100 frames."""
    document, rng = load_tracker(TRACKER), np.random.default_rng(1)
    builder = FrameBuilder(document)
    for n in range(100):
        places = places_of(rng)
        places[n % 6, n % 3] = coordinate
        elements = tuple(
            MarkerPlace(name, (x, y, z))
            for name, (x, y, z) in zip(document.markers, places.tolist(), strict=False)
        )
        (frame,) = builder.add(Pose(elements, whole=True), FIRST_NS + n * _PERIOD_NS)
        assert np.isnan(frame.places[n % 6]).all()
        assert np.isfinite(frame.places[:6]).all(axis=1).sum() == 5
    assert builder.account.missing == 100


def test_a_crowd_of_strays_has_a_bounded_number_of_names() -> None:
    """N = 60 frames of 4,000 markers anywhere, with the probe first."""
    decoder, rng = polled(), np.random.default_rng(2)
    names = set[str]()
    for n in range(60):
        crowd = rng.uniform(-1e3, 1e3, (4_000, 3))
        crowd[:6] = places_of(np.random.default_rng(3))
        markers = struct.pack("<HH", 0xFFFF, len(crowd)) + b"".join(
            struct.pack("<BBH3f", 0, 0, index, *place) for index, place in enumerate(crowd)
        )
        inner = struct.pack("<HHHIHI", 1, 1, 3, 12 + len(markers), 0, 1) + markers
        frame = struct.pack("<BBHIII", 2, 0, 0, n, 1000 + n // 60, n % 60 * 16_666_667) + inner
        body = struct.pack("<HHHIHI", 1, 1, 1, 12 + len(frame), 0, 1) + frame
        decoder.requests(1e6 + n)
        pose = decoder.push(sealed(body))[-1].content
        assert isinstance(pose, Pose)
        assert [one.name for one in pose.elements[:6]] == [f"S{k}" for k in range(1, 7)]
        assert len(pose.elements) <= 128
        names |= {one.name for one in pose.elements}
    assert len(names) <= 256


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_an_endless_packet_is_not_kept(protocol: str) -> None:
    """8 MB after a header that states more than any packet has."""
    decoder = PROTOCOLS[protocol](load_tracker(TRACKER))
    decoder.requests(0.0)
    header = {
        "igtl": message("TDATA", "T", FIRST_NS, b"")[:42] + struct.pack(">QQ", 1 << 27, 0),
        "natnet": struct.pack("<HH", 7, 0xFFFF),
        "ndi": sealed(b"", 1 << 30)[:8],
        "qtm": struct.pack("<II", 1 << 30, 3),
    }[protocol]
    tracemalloc.start()
    try:
        with suppress(AcquisitionError):
            for number in range(128):
                assert decoder.push((b"" if number else header) + bytes(1 << 16)) == []
        held = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert held < _MOST_HELD


@pytest.mark.parametrize("rate_hz", [200, 10_000])
def test_a_device_that_is_too_fast_ends_the_source(rate_hz: int) -> None:
    document, rng = load_tracker(TRACKER), np.random.default_rng(4)
    errors, places = MarkerErrors(document, 1), places_of(rng)
    frames = [
        (errors.reported(places), FIRST_NS + n * 10**9 // rate_hz) for n in range(rate_hz // 2)
    ]
    with pytest.raises(AcquisitionError) as found:
        measured("igtl", TRACKER, IgtlEncoder(document), frames)
    assert found.value.code == "tracker.rate"


@pytest.mark.parametrize("together", [True, False])
def test_two_devices_of_one_name_give_no_wrong_tip(together: bool) -> None:
    """Two senders of the same markers elsewhere, at one time or half a period apart."""
    document, rng = load_tracker(TRACKER), np.random.default_rng(5)
    errors, places = MarkerErrors(document, 1), places_of(rng)

    class Twice(IgtlEncoder):
        def _packets(self, named: NamedPlaces, time_ns: int, pressed: bool) -> bytes:
            other = {name: one and (one[1], one[0], one[2]) for name, one in named.items()}
            later = time_ns if together else time_ns + _PERIOD_NS // 2
            return super()._packets(named, time_ns, pressed) + super()._packets(
                other, later, pressed
            )

    frames = [(errors.reported(places), FIRST_NS + n * _PERIOD_NS) for n in range(60)]
    if not together:
        with pytest.raises(AcquisitionError) as found:
            measured("igtl", TRACKER, Twice(document), frames)
        assert found.value.code == "tracker.rate"
        return
    source, blocks = measured("igtl", TRACKER, Twice(document), frames)
    assert source.builder.account.doubled == 60 * 6
    good, bad = tips_near(blocks, load_rig(TRACKER), places)
    assert (good > 50, bad) == (True, 0)
