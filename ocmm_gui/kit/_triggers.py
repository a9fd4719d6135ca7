"""Keys and foot switches that command the measurement.

A foot switch is programmed to F13, F14 and F15, which no field takes as text. The probe's own
button comes over the bus and is handled by the core. A held or bouncing switch gives one command.
"""

from __future__ import annotations

import time
from collections.abc import Callable

DEBOUNCE_S = 0.15
"""Two presses closer than this are one: contacts bounce for some 20 ms, feet need 250 ms."""

TAKE_KEYS = ("Space", "F13")
UNDO_KEYS = ("Backspace", "F14")
FINISH_KEYS = ("Return", "Enter", "F15")


class Debounced:
    """Call ``command`` unless it was called less than `DEBOUNCE_S` ago."""

    def __init__(
        self, command: Callable[[], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._command = command
        self._clock = clock
        self._last = float("-inf")

    def __call__(self) -> None:
        """Give the command if it is due."""
        now = self._clock()
        if now - self._last >= DEBOUNCE_S:
            self._last = now
            self._command()
