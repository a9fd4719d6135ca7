"""Objects read and written through the master library, each by its own answer and no other.

The library takes whatever answer comes next and compares the index, not the entry. A camera that
answers after the library gave up is one answer behind from then on: entry 10 would be taken for
entry 11 of the same object, a wrong number that looks right (seen on a busy computer: a good camera
was told to be of another firmware). Mailboxes keep their order. So after a call without an answer
the camera is asked for its type, an object of another index, until that is answered: nothing older
is on its way then, and a later answer about the type is refused by its index.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from ocmm_core.errors import BusError

_TRIES = 2
_SETTLING_TRIES = 5


class ObjectCalls:
    """Calls of one master, and which cameras still owe it an answer.

    Parameters
    ----------
    ask_type
        Asks the camera at a position for an object of an index that `call` never has.
    failures
        What the library raises where no answer came, or not the one that was asked for.
    pause_s
        Before a camera that owes an answer is asked again: time for what is late to arrive, which
        the library throws away before it asks.
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

    def call(self, position: int, name: str, index: int, action: Callable[[], bytes]) -> bytes:
        """Return what ``action`` returns; what a lost frame may have spoiled is tried again.

        Parameters
        ----------
        position, name
            Which camera, and what to call it in messages.
        action
            One transfer; raises one of the failures, or BusError where the camera refuses.

        Raises
        ------
        BusError
            ``bus.no_answer``, or what ``action`` raised.
        """
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

    def _settled(self, position: int) -> bool:
        for _ in range(_SETTLING_TRIES):
            time.sleep(self._pause_s)
            try:
                self._ask_type(position)
            except self._failures:
                continue
            self._behind.discard(position)
            return True
        return False
