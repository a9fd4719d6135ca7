"""Answers that come late are never taken for those of the next question."""

from __future__ import annotations

from collections import deque

from ocmm_core.fieldbus.wire._object_calls import ObjectCalls


class _Camera:
    """A camera as seen by the library: the first answer is compared by its index alone.

    The library discards pending answers before a question; late answers come after it.
    """

    def __init__(self, late: tuple[tuple[int, bytes], ...] = ()) -> None:
        self.late = deque(late)

    def read(self, index: int, value: bytes) -> bytes:
        came, found = self.late.popleft() if self.late else (index, value)
        if came != index:
            raise TimeoutError
        return found


def _calls(camera: _Camera) -> ObjectCalls:
    return ObjectCalls(lambda _: camera.read(0x1000, b"type"), (TimeoutError,), 0.0)


def test_an_answer_that_an_earlier_master_gave_up_is_not_taken() -> None:
    for late in range(4):
        camera = _Camera(((0x8000, b"old"),) * late)

        def read(camera: _Camera = camera) -> bytes:
            return camera.read(0x8000, b"new")

        assert _calls(camera).call(0, "a", 0x8000, read) == b"new", late


def test_an_answer_that_comes_too_late_is_not_taken() -> None:
    camera = _Camera()
    calls = _calls(camera)
    assert calls.call(0, "a", 0x8000, lambda: camera.read(0x8000, b"one")) == b"one"
    # Nothing came in time; the answer comes after the next question.
    camera.late.extend(((0, b""), (0x8000, b"two")))
    assert calls.call(0, "a", 0x8000, lambda: camera.read(0x8000, b"three")) == b"three"
