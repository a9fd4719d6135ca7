"""Objects read and written through the master library, with matched answers.

The library accepts the next answer and compares the index, not the entry. A camera that answers
after the library gave up is one answer behind from then on: entry 10 would be accepted as entry 11
of the same object, a plausible wrong value (seen on a busy computer: a good camera was reported
with other firmware). Mailboxes keep their order. So before the first call, which may follow one
that an earlier master gave up, and after an unanswered one the camera's type, an object of another
index, is read until answered: nothing older is in transit then, and a later type answer is refused
by its index.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from ocmm_core.errors import BusError

_TRIES = 2
_SETTLING_TRIES = 5


class ObjectCalls:
    """Calls of one master, and the cameras that still owe an answer.

    ``ask_type`` reads an object of the camera with an index that `call` never uses; ``failures``:
    library exceptions for a missing or mismatched answer; ``pause_s``: delay before a camera in
    arrears is queried again, for late answers, which the library discards before a query.
    """

    def __init__(
        self,
        ask_type: Callable[[int], object],
        failures: tuple[type[Exception], ...],
        pause_s: float,
    ) -> None:
        self._ask_type = ask_type
        self._failures = failures
        self._pause_s = pause_s
        self._behind: set[int] = set()
        self._met: set[int] = set()

    def call(self, position: int, name: str, index: int, action: Callable[[], bytes]) -> bytes:
        """Return the result of `action`, one transfer; retry after lost frames.

        BusError ``bus.no_answer``, or an exception of `action`, as if the camera refuses.
        """
        if position not in self._met:
            self._met.add(position)
            self._settled(position, pause=False)
        for _ in range(_TRIES):
            if position in self._behind and not self._settled(position):
                break
            try:
                return action()
            except self._failures:
                self._behind.add(position)
        raise BusError(
            "bus.no_answer",
            f"Camera {name} gives an unexpected answer (object {index:#06x}).",
            "Check its cable; power-cycle the camera.",
        )

    def _settled(self, position: int, *, pause: bool = True) -> bool:
        for number in range(_SETTLING_TRIES):
            if pause or number:
                time.sleep(self._pause_s)
            try:
                self._ask_type(position)
            except self._failures:
                continue
            self._behind.discard(position)
            return True
        return False
