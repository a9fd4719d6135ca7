"""Cameras with arbitrary answers: a scan over a corrupting line, and lying objects.

As in `test_fuzz_wire`: an answer is accepted or refused with an `OcmmError`; no other exception is
raised.
"""

from __future__ import annotations

import random
import socket
from collections import Counter
from collections.abc import Callable

import pytest

from ocmm_core.errors import OcmmError
from ocmm_core.fieldbus.objects import _camera_client as client
from ocmm_core.fieldbus.objects import _camera_client as pictures
from ocmm_core.fieldbus.objects._camera_client import ObjectAccess, Progress
from ocmm_core.fieldbus.wire import Command, Datagram, _scan, check_mapping, encode_frame
from ocmm_sim.slave import Segment, SoftwareCamera, TestPattern
from tests.core.fieldbus import camera_statements as statements
from tests.core.fieldbus.fuzzing import spoiled

SCANS, LIES = 400, 500
SHARE = 0.15
"""Share of corrupted answers: a scan takes about thirty, so that some succeed."""


class Wire(socket.socket):
    """A cable to software cameras as `_scan.listen` returns one; answers every frame at once."""

    def attach(self, answer: Callable[[bytes], bytes], far: socket.socket) -> None:
        """Let ``answer`` produce the reply, through the other end of this socket."""
        self._answer, self._far = answer, far

    def send(self, frame: bytes, flags: int = 0) -> int:  # type: ignore[override]
        """Answer a frame; an empty one never arrives."""
        answer = self._answer(frame)
        if answer:
            self._far.send(answer)
        return len(frame)


@pytest.fixture
def scan(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[bytes], bytes]], int]:
    """Return a function that scans over a line whose answers a function may change."""
    cameras = [SoftwareCamera(place, 1001 + place, 1, TestPattern()).esc for place in range(2)]
    # What does not come is waited for; there is nothing else on this line.
    monkeypatch.setattr(_scan, "_ANSWER_S", 0.002)

    def run(change: Callable[[bytes], bytes]) -> int:
        segment = Segment(cameras)
        time_ns = 0

        def answer(frame: bytes) -> bytes:
            nonlocal time_ns
            content = bytearray(frame)
            time_ns += 1000
            segment.process(content, time_ns)
            return change(bytes(content))

        near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        with Wire(fileno=near.detach()) as wire, far:
            wire.setblocking(False)
            wire.attach(answer, far)
            monkeypatch.setattr(_scan, "listen", lambda _interface: wire)
            return len(_scan.scan_devices(_scan.RawLine("none0").exchange))

    return run


def test_a_scan_over_a_line_that_spoils_answers(
    scan: Callable[[Callable[[bytes], bytes]], int],
) -> None:
    assert scan(lambda frame: frame) == 2
    ended: Counter[str] = Counter()
    for seed in range(SCANS):
        chance = random.Random(seed)  # noqa: S311 - reproducible, not secret

        def change(frame: bytes, chance: random.Random = chance) -> bytes:
            if chance.random() >= SHARE:
                return frame
            return next(spoiled(chance.randrange(2**32), 1, [frame]))

        try:
            scan(change)
            ended["listed"] += 1
        except OcmmError as error:
            ended[error.code] += 1
    assert ended["listed"] > SCANS // 4
    assert ended.keys() <= {"listed", "bus.scan", "bus.silent"}


@pytest.mark.parametrize("size", [0, 1, 3, 40])
def test_an_answer_of_another_length_is_no_answer(
    scan: Callable[[Callable[[bytes], bytes]], int], size: int
) -> None:
    """It was unpacked as if it had the right one, which ended the scan in a failure."""
    wrong = 0

    def change(frame: bytes) -> bytes:
        nonlocal wrong
        # The second question: the state of the first camera.
        wrong += 1
        if wrong != 2:
            return frame
        return encode_frame(frame[17], [Datagram(Command.APRD, 1, 0x0130, bytes(size), 1)])

    assert scan(change) == 2
    assert wrong > 2


class _Lying:
    """A camera whose values have any size and content."""

    def __init__(self, seed: int) -> None:
        self._chance = random.Random(seed)  # noqa: S311 - reproducible, not secret

    def read(
        self, index: int, sub: int, *, room: int = 64, progress: Progress | None = None
    ) -> bytes:
        chance = self._chance
        size = room if chance.random() < 0.7 else chance.choice((0, 1, 2, 4, room + 1))
        kind = chance.random()
        if kind < 0.3:
            return bytes(size)
        if kind < 0.5:
            # States and counts are small numbers.
            return bytes([chance.randrange(10)]).ljust(size, b"\x00")[:size]
        return chance.randbytes(size)

    def write(
        self, index: int, sub: int, value: bytes, *, progress: Progress | None = None
    ) -> None:
        return


_READERS: dict[str, Callable[[ObjectAccess], object]] = {
    "texts": statements.read_identity_text,
    "firmware": statements.read_firmware,
    "temperature": statements.read_temperature,
    "counters": statements.read_counters,
    "history": client.read_error_history,
    "intrinsics": client.read_intrinsics,
    "black image": client.read_black_image,
    "measured black image": lambda access: client.measure_black_image(access, 4),
    "stored black image": client.store_black_image,
    "picture": client.take_snapshot,
    "part of a picture": lambda access: client.take_snapshot(access, (0, 0, 2, 2)),
    "mapping": lambda access: list(check_mapping("left", access.read)),
}


@pytest.mark.parametrize("name", _READERS)
def test_objects_that_lie(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "_POLL_S", 0.0)
    monkeypatch.setattr(pictures, "_STALL_S", 0.001)
    ended: Counter[str] = Counter()
    for seed in range(LIES):
        try:
            _READERS[name](_Lying(seed))
            ended["read"] += 1
        except OcmmError as error:
            ended[error.code] += 1
    assert sum(ended.values()) == LIES
    assert ended.keys() - {"read"}
