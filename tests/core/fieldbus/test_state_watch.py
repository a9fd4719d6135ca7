"""The watch over the cameras: its requests, and the port it blames."""

from __future__ import annotations

import pytest

from benchmarks.camera_faults import count_link_errors
from ocmm_core.fieldbus.cycle._watch import PORT_ERRORS_BYTES, PortTrouble, StateWatch, port_trouble
from ocmm_core.fieldbus.wire import decode_frame, encode_frame
from ocmm_sim.slave import Segment, SoftwareCamera, TestPattern
from ocmm_sim.slave import registers as reg

_STATIONS = (0x1001, 0x1002)


class _Line:
    """Two software cameras and their watch, without a network."""

    def __init__(self) -> None:
        self.cameras = [SoftwareCamera(n, 1001 + n, 1 + n, TestPattern()) for n in range(2)]
        self.segment = Segment([camera.esc for camera in self.cameras])
        for camera, station in zip(self.cameras, _STATIONS, strict=True):
            camera.esc.write(reg.STATION_ADDRESS, station.to_bytes(2, "little"))
        self.watch = StateWatch(_STATIONS)

    def cycles(self, count: int) -> None:
        for _ in range(count):
            jobs = list(self.watch.jobs())
            frame = bytearray(encode_frame(1, [job.datagram for job in jobs]))
            assert self.segment.process(frame, 10**12)
            for job, answer in zip(jobs, decode_frame(bytes(frame))[1], strict=True):
                job.answered(answer)


def counters(**ports: int) -> bytes:
    """Return the registers; ``rx0`` is at 0x0301, ``lost1`` at 0x0311, ``forwarded0`` at 0x0308."""
    places = {"invalid": 0, "rx": 1, "forwarded": 8, "lost": 16}
    image = bytearray(PORT_ERRORS_BYTES)
    for name, value in ports.items():
        port = int(name[-1])
        kind = name[:-1]
        image[places[kind] + (2 * port if kind in ("invalid", "rx") else port)] = value
    return bytes(image)


@pytest.mark.parametrize(
    ("before", "now", "expected"),
    [
        ({}, {"rx1": 3}, PortTrouble(1, 3, 0)),
        ({"rx0": 4}, {"rx0": 4, "lost1": 1}, PortTrouble(1, 0, 1)),
        ({"invalid0": 1, "rx0": 1}, {"invalid0": 3, "rx0": 5}, PortTrouble(0, 6, 0)),
        # Frames that others broke say nothing about this camera's cables.
        ({}, {"forwarded0": 200}, None),
        # Switched on again: its counters begin at zero.
        ({"rx0": 200}, {"rx0": 2}, PortTrouble(0, 2, 0)),
        # A full counter carries no further information.
        ({"rx0": 255}, {"rx0": 255, "lost0": 1}, PortTrouble(0, 255, 1)),
    ],
)
def test_the_port_is_the_one_that_counts(
    before: dict[str, int], now: dict[str, int], expected: PortTrouble | None
) -> None:
    assert port_trouble(counters(**before), counters(**now)) == expected


def test_what_was_counted_before_the_start_is_no_news() -> None:
    line = _Line()
    count_link_errors(line.cameras[1].esc, 0, 9)
    line.cycles(16)
    assert not line.watch.news
    assert [camera.link_errors for camera in line.watch.view.cameras] == [0, 9]


def test_a_growing_counter_is_told_once_and_explains_faults_for_a_while() -> None:
    line = _Line()
    line.cycles(16)
    count_link_errors(line.cameras[1].esc, 1, 4)
    line.watch.hurry()
    line.cycles(1)
    assert list(line.watch.news) == [(1, PortTrouble(1, 4, 0))]
    line.cycles(400)
    assert len(line.watch.news) == 1
    assert line.watch.view.cameras[1].trouble == PortTrouble(1, 4, 0)
    line.cycles(200)
    assert line.watch.view.cameras[1].trouble is None
    assert line.watch.view.cameras[1].link_errors == 4


def test_counters_are_compared_across_a_bring_up() -> None:
    line = _Line()
    line.cycles(16)
    count_link_errors(line.cameras[0].esc, 0, 2)
    line.watch = StateWatch(_STATIONS, line.watch)
    line.cycles(16)
    assert list(line.watch.news) == [(0, PortTrouble(0, 2, 0))]
