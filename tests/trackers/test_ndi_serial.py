"""NDI devices on a serial line: speeds, faults of the line, and the way back."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep

import pytest

from ocmm_core.camera import load_rig, load_tracker
from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.errors import AcquisitionError, InputError
from ocmm_sim.trackers import NdiEncoder, Newest
from ocmm_trackers import TrackerSource, tracker_config
from tests.trackers.tracker_bench import (
    PROBE,
    TRACKER,
    LiveDevice,
    SerialTracker,
    read,
    require_gap,
    source_to,
)
from tests.waiting import wait_until

# Devices send in real time; a computer that is busy with other tests cannot.
pytestmark = pytest.mark.timing

_NDI = resource("rigs", "tracker_ndi.toml")
_RIG = load_rig(_NDI)
_WITHIN_S = 20.0


class Listed(NdiEncoder):
    """Keeps the commands that it received."""

    commands = b""

    def answer(self, data: bytes) -> bytes:
        self.commands += data
        return super().answer(data)


@contextmanager
def opened(
    folder: Path, newest: Newest = "BX2", fastest: int = 921600, *, hears_break: bool = True,
    baud: int = 9600,
) -> Iterator[tuple[TrackerSource, LiveDevice, Listed, SerialTracker]]:  # fmt: skip
    encoder = Listed(load_tracker(_NDI), newest)
    encoder.fastest, encoder.baud = fastest, baud
    tracker = SerialTracker(encoder, folder / "tty", hears_break=hears_break)
    device = LiveDevice(tracker, encoder)
    source, ring = source_to("ndi", _NDI, tracker.path, 0.5)
    with device.running():
        try:
            source.open()
            yield source, device, encoder, tracker
        finally:
            source.close()
            ring.close()


@pytest.mark.parametrize(
    ("newest", "fastest", "poll"),
    [("BX2", 921600, "BX2"), ("BX2", 115200, "BX"), ("TX", 921600, "TX"), ("BX", 9600, "BX")],
)
def test_markers_arrive_at_the_highest_speed_of_both(
    newest: Newest, fastest: int, poll: str, tmp_path: Path
) -> None:
    """N = 60 frames each."""
    with opened(tmp_path, newest, fastest) as (source, device, encoder, _):
        blocks, _ = read(source, 60)
        assert (source.decoder.baud, encoder.baud) == (fastest, fastest)
        assert encoder.commands.split(b"\r")[-2].startswith(f"{poll}:".encode())
    good, bad = device.judge(blocks, _RIG)
    assert (good > 50, bad) == (True, 0)


def test_a_device_at_another_speed_is_found_without_a_break(tmp_path: Path) -> None:
    with opened(tmp_path, fastest=57600, hears_break=False, baud=115200) as (source, *_):
        read(source, 5)
        assert source.decoder.baud == 115200


def test_lost_bytes_lose_frames_and_give_no_wrong_tip(tmp_path: Path) -> None:
    """N = 60 frames, every 500th byte lost: a sixth of the replies."""
    with opened(tmp_path, "BX") as (source, device, _, tracker):
        tracker.lose = 2e-3
        blocks, _ = read(source, 60)
        assert source.builder.account.frames_lost > 3
    good, bad = device.judge(blocks, _RIG)
    assert (good > 50, bad) == (True, 0)


@pytest.mark.parametrize(
    ("fault", "fastest", "words"),
    [
        ("restart", 921600, "has sent nothing for 1 s"),
        ("restart", 9600, "answered BX with RESET"),
        ("close", 921600, "has ended"),
    ],
)
def test_the_line_comes_back(fault: str, fastest: int, words: str, tmp_path: Path) -> None:
    """A device is switched off and on, or its cable is pulled out and plugged in again."""
    with opened(tmp_path, fastest=fastest) as (source, device, _, tracker):
        before, _ = read(source, 10)
        device.order(getattr(tracker, fault))
        start, reasons = monotonic(), [""]
        while fault == "close" and "There is no serial line" not in reasons[-1]:
            cycle = source.read()
            assert cycle.frames is None
            assert monotonic() < start + _WITHIN_S
            reasons.append(cycle.reason)
        if fault == "close":
            device.order(tracker.plug)
        after, more = read(source, 10)
        passed_s = monotonic() - start
    assert words in " ".join([*reasons, *more])
    require_gap(before, after, passed_s)
    good, bad = device.judge(after, _RIG)
    assert (good >= 9, bad) == (True, 0)


def test_the_readout_is_empty_and_comes_back(tmp_path: Path) -> None:
    """The whole station, with the reader in its own process."""
    encoder = NdiEncoder(load_tracker(_NDI))
    tracker = SerialTracker(encoder, tmp_path / "tty")
    device = LiveDevice(tracker, encoder)
    with device.running():
        built = build_station(
            StationRequest(
                plan=resource("plans", "demo.toml"), out=tmp_path, rig=_NDI, uncalibrated=True,
                source=f"ndi:{tracker.path}", calibrations=tmp_path, probes=tmp_path,
            )
        )  # fmt: skip
        station = built.station
        try:
            station.start()
            wait_until(lambda: station.looks.live().tip_world is not None)
            device.order(tracker.restart)
            reasons, gone = set[str](), False
            while not gone or station.looks.live().tip_world is None:
                sent_s, view = device.sent_s, station.looks.live()
                gone = gone or view.tip_world is None
                # After 0.3 s; the rest is for a busy computer.
                assert view.tip_world is None or monotonic() - sent_s < 1.0
                assert monotonic() - device.sent_s < _WITHIN_S
                reasons.add(view.reason)
                sleep(5e-3)
        finally:
            station.close()
    assert any("has sent nothing for 1 s" in one for one in reasons), reasons


def refusal(path: Path) -> AcquisitionError:
    """Return the error of opening a line."""
    source, ring = source_to("ndi", _NDI, path, 0.2)
    try:
        with pytest.raises(AcquisitionError) as found:
            source.open()
    finally:
        source.close()
        ring.close()
    assert str(path) in found.value.what
    return found.value


def test_lines_that_cannot_be_opened_have_a_sentence_each(tmp_path: Path) -> None:
    path = tmp_path / "tty"
    assert refusal(path).what.startswith("There is no serial line")
    tracker = SerialTracker(NdiEncoder(load_tracker(_NDI)), path)
    try:
        assert refusal(path).code == "tracker.line_silent"
        other = os.open(path, os.O_RDWR | os.O_NOCTTY)
        fcntl.flock(other, fcntl.LOCK_EX)
        assert refusal(path).code == "tracker.line_held"
        os.close(other)
        path.chmod(0)
        if os.geteuid():
            assert refusal(path).code == "tracker.line_rights"
    finally:
        tracker.close()
    path.write_text("")
    assert "Inappropriate ioctl" in refusal(path).what


def test_only_ndi_devices_are_on_serial_lines() -> None:
    with pytest.raises(InputError, match="no host with a port"):
        tracker_config("qtm", PROBE, load_rig(TRACKER), "/dev/ttyUSB0", "test")
