"""Measured checks of the station doctor: wake-ups and a bus over a virtual cable.

    python -m ocmm_core.composition._station_checks SECONDS

runs in a private network namespace, isolated from the network: it creates a virtual cable, sends a
frame per millisecond on one end and answers on the other.
"""

from __future__ import annotations

import gc
import os
import select
import socket
import struct
import sys
from typing import NoReturn

import msgspec

from ocmm_core import doctor
from ocmm_core.acquisition.bus_process import BUS_PRIORITY, CAMERA_PRIORITY, take_priority
from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus import wire

LONGEST_LOOP_S = 10.0
_MODULE = "ocmm_core.composition._station_checks"
_ETHERCAT = 0x88A4
_HEAD = bytes.fromhex("ffffffffffff 020000000001 88a4")
_NUMBER = struct.Struct("<I")
_CAMERAS_BYTES = 1072
"""Inputs of two cameras (528 bytes each) and their outputs: a full frame of a small station."""
_LAST_WAIT_NS = 200_000_000


def measured_checks(seconds: float) -> tuple[doctor.CheckSpec, ...]:
    """Return the checks that measure for `seconds`, the bus `LONGEST_LOOP_S` at most; 0: none."""

    def loop() -> doctor.LoopTimes:
        if seconds <= 0.0:
            raise doctor.NotAskedError("Not measured.", "Measure it: --seconds 60")
        length = min(seconds, LONGEST_LOOP_S)
        try:
            inside = wire.namespace_command()
        except OcmmError as error:
            raise doctor.NotAskedError(error.what, "Measure it as root.") from error
        return doctor.answer_of(
            [*inside, sys.executable, "-m", _MODULE, str(length)], length, doctor.LoopTimes
        )

    about = "at most 0.05 % of the frames are not answered in their cycle"
    return (
        doctor.wake_check(seconds),
        doctor.CheckSpec(
            "loop", "Bus on a virtual cable", about, lambda computer: doctor.judge_loop(loop())
        ),
    )


def main() -> None:
    """Measure inside the namespace and print JSON."""
    try:
        times = _measure(float(sys.argv[1]))
    except OcmmError as error:
        sys.stderr.write(f"{error.what}\n")
        sys.exit(2)
    sys.stdout.write(msgspec.json.encode(times).decode())


def _measure(seconds: float) -> doctor.LoopTimes:
    wire.make_link(wire.HOST_INTERFACE, wire.CAMERA_INTERFACE)
    with _end(wire.HOST_INTERFACE) as near, _end(wire.CAMERA_INTERFACE) as far:
        # The mirror process ends when this process ends and its pipe closes.
        ends, held = os.pipe()
        mirror = os.fork()
        if mirror == 0:
            os.close(held)
            _reflect(far, ends)
        try:
            return _cycle(near, max(1, round(seconds * 1e9 / doctor.PERIOD_NS)))
        finally:
            os.close(held)
            os.waitpid(mirror, 0)
            os.close(ends)


def _end(interface: str) -> socket.socket:
    end = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ETHERCAT))
    end.bind((interface, _ETHERCAT))
    end.setblocking(False)
    return end


def _reflect(far: socket.socket, ends: int) -> NoReturn:
    """Answer every frame, as cameras do, until the other end of a pipe closes."""
    take_priority(CAMERA_PRIORITY)
    try:
        while ends not in select.select([far.fileno(), ends], [], [])[0]:
            far.send(far.recv(2048))
    finally:
        os._exit(0)


def _cycle(near: socket.socket, count: int) -> doctor.LoopTimes:
    real_time = take_priority(BUS_PRIORITY) is None
    clock = wire.HostTime()
    sent, came = [0] * count, [0] * count
    rest = bytes(_CAMERAS_BYTES - _NUMBER.size)
    gc.disable()
    deadline = clock.now_ns() + doctor.PERIOD_NS
    for number in range(count):
        clock.wait_until(deadline)
        sent[number] = clock.now_ns()
        # A late cycle keeps its whole millisecond: only the transit of the frame is measured.
        deadline = max(deadline, sent[number] - doctor.PERIOD_NS) + doctor.PERIOD_NS
        near.send(_HEAD + _NUMBER.pack(number) + rest)
        _await(near, clock, came, number, sent[number] + doctor.PERIOD_NS)
    for number in range(count):
        if not came[number]:
            _await(near, clock, came, number, clock.now_ns() + _LAST_WAIT_NS)
    gc.enable()
    ways = sorted(there - begin for begin, there in zip(sent, came, strict=True) if there)
    if not ways:
        raise doctor.NotAskedError("No frame came back.")
    return doctor.LoopTimes(
        cycles=count, lost=count - len(ways), late=sum(one > doctor.PERIOD_NS for one in ways),
        p50_us=doctor.part(ways, 0.5), p999_us=doctor.part(ways, 0.999),
        max_us=doctor.part(ways, 1.0), real_time=real_time,
    )  # fmt: skip


def _await(
    near: socket.socket, clock: wire.HostTime, came: list[int], number: int, until_ns: int
) -> None:
    """Receive frames until the answer arrives or its time is over."""
    while not came[number] and (left := until_ns - clock.now_ns()) > 0:
        if not select.select([near], [], [], left * 1e-9)[0]:
            return
        frame = near.recv(2048)
        there = clock.now_ns()
        (which,) = _NUMBER.unpack_from(frame, len(_HEAD))
        if which < len(came) and not came[which]:
            came[which] = there


if __name__ == "__main__":
    main()
