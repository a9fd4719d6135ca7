"""Trackers that stop, start again, lose their tool or are another program, on the network."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

import pytest

from ocmm_core.camera import TrackerDocument, load_rig, load_tracker
from ocmm_core.documents import resource
from ocmm_core.errors import AcquisitionError
from ocmm_sim.trackers import (
    IgtlEncoder,
    MarkerEncoder,
    NatNetEncoder,
    NdiEncoder,
    QtmEncoder,
    TrackerServer,
)
from ocmm_trackers import PROTOCOLS, TrackerSource
from tests.trackers.tracker_bench import LiveDevice, read, require_gap, source_to

# Devices send in real time; a computer that is busy with other tests cannot.
pytestmark = pytest.mark.timing

_MAKERS: dict[str, Callable[[TrackerDocument], MarkerEncoder]] = {
    "igtl": IgtlEncoder, "natnet": NatNetEncoder, "ndi": lambda one: NdiEncoder(one, "BX"),
    "qtm": QtmEncoder,
}  # fmt: skip
_PATHS = {
    name: resource("rigs", "tracker.toml" if name == "igtl" else f"tracker_{name}.toml")
    for name in _MAKERS
}
_WITHIN_S = 20.0


@contextmanager
def opened(
    protocol: str, monkeypatch: pytest.MonkeyPatch, stretch: tuple[float, ...] = (1.0,)
) -> Iterator[tuple[TrackerSource, LiveDevice]]:
    """Yield a source of a device in real time; it is silent after half a second."""
    monkeypatch.setattr(PROTOCOLS[protocol], "silence_s", 0.5)
    encoder = _MAKERS[protocol](load_tracker(_PATHS[protocol]))
    server = TrackerServer(encoder)
    device = LiveDevice(server, encoder)
    device.places = device.places * stretch
    source, ring = source_to(protocol, _PATHS[protocol], server, 1.0)
    with device.running():
        try:
            source.open()
            yield source, device
        finally:
            source.close()
            ring.close()


def reasons_until(source: TrackerSource, words: str) -> None:
    """Read until a reason has these words; no frame comes."""
    deadline, reason = monotonic() + _WITHIN_S, ""
    while words not in reason:
        cycle = source.read()
        assert cycle.frames is None
        assert monotonic() < deadline, reason
        reason = cycle.reason


@pytest.mark.parametrize("protocol", _MAKERS)
@pytest.mark.parametrize("fault", ["clock", "program"])
def test_a_device_that_was_started_again_comes_back(
    protocol: str, fault: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with opened(protocol, monkeypatch) as (source, device):
        before, _ = read(source, 10)
        start = monotonic()

        def restart() -> None:
            device.first_ns -= 3600 * 10**9
            if fault == "program":
                assert isinstance(device.server, TrackerServer)
                port = device.server.port
                device.server.close()
                device.encoder = _MAKERS[protocol](device.encoder.document)
                device.server = TrackerServer(device.encoder, port)

        device.order(restart)
        after, reasons = read(source, 10)
        passed_s = monotonic() - start
    assert reasons
    require_gap(before, after, passed_s)
    good, bad = device.judge(after, load_rig(_PATHS[protocol]))
    assert (good >= 9, bad) == (True, 0)


@pytest.mark.parametrize("protocol", _MAKERS)
def test_silence_is_a_sentence(protocol: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(protocol, monkeypatch) as (source, device):
        read(source, 5)
        rate_hz, device.rate_hz = device.rate_hz, 1e-3
        reasons_until(source, "The tracker has sent nothing")
        device.rate_hz = rate_hz
        read(source, 5)


@pytest.mark.parametrize("protocol", ["igtl", "natnet", "qtm"])
def test_time_stamps_that_stand_still_end_the_source(
    protocol: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Coordinates change, and no frame has the time of another one."""
    with opened(protocol, monkeypatch) as (source, device):
        read(source, 5)
        device.still = True
        device.first_ns += 10**9
        with pytest.raises(AcquisitionError) as found:
            assert len(read(source, 3)) < 2
    assert found.value.code == "tracker.no_time"
    assert "stand still" in found.value.what


def test_an_unplugged_tool_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    with opened("ndi", monkeypatch) as (source, device):
        encoder = device.encoder
        assert isinstance(encoder, NdiEncoder)
        read(source, 5)
        encoder.plugged = False
        reasons_until(source, "no tool is enabled")
        encoder.plugged = True
        read(source, 5)


@pytest.mark.parametrize("protocol", _MAKERS)
def test_another_tool_definition_is_named(protocol: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the proof no frame passes; after it, no tip is computed."""
    wrong = (1.3, 0.8, 1.1)
    with opened(protocol, monkeypatch, wrong) as (source, device):
        reasons_until(source, "the tool definition is another one")
        right = device.places / wrong
        device.places = right
        read(source, 5)
        device.places = right * wrong
        read(source, 20)
        blocks, _ = read(source, 20)
        assert device.judge(blocks, load_rig(_PATHS[protocol])) == (0, 0)


@pytest.mark.parametrize("protocol", _MAKERS)
def test_another_program_is_refused(protocol: str) -> None:
    """Bytes of a web server that answers everything, N = 1 each."""
    document = load_tracker(_PATHS[protocol])
    decoder = PROTOCOLS[protocol](document)
    decoder.requests(0.0)
    if decoder.datagrams:
        for _ in range(100):
            assert decoder.push(b"HTTP/1.1 400 Bad Request\r\n\r\n") == []
        assert not decoder.ready
        return

    def converse() -> None:
        for n in range(1_000):
            decoder.requests(float(n))
            decoder.push(b"HTTP/1.1 400 Bad Request\r\n\r\n")

    with pytest.raises(AcquisitionError) as found:
        converse()
    assert found.value.code == "tracker.stream"
