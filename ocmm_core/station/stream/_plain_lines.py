"""Points as lines of a chosen format, for programs that only read.

Receivers neither acknowledge such a line nor can annul it, so each point is sent once, when it is
durable. The operator is informed of events that the receiving program cannot learn.
"""

from __future__ import annotations

from collections.abc import Callable

from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobStep


class PlainLines:
    """Make one line of each new point.

    `line`: bytes of a point with their line end. `note`: receives a sentence for the operator.
    """

    def __init__(self, line: Callable[[MeasuredPoint], bytes], note: Callable[[str], None]) -> None:
        self._line, self._note = line, note
        self.sent = 0
        """Lines that have left, or had no receiver."""

    def line_of(self, step: JobStep, *, live: bool) -> bytes:
        """Return the line of a new point; empty for other steps. `live`: after the start."""
        if step.point is not None:
            # A restored point has a new number: the operator has deleted its first line.
            return self._line(step.point)
        if live:
            self._note(
                f"Point {step.number} was annulled after it was sent: delete it in the receiving "
                "program."
            )
        return b""

    def note_sent(self, last: int, *, to_clients: int) -> None:
        """Note that all lines up to a number leave now; without clients, inform the operator."""
        lost = last - self.sent
        self.sent = last
        if lost and not to_clients:
            self._note(
                f"No program is connected: {lost} point(s) went out to none. They are in the job; "
                "connect the program, then touch again what it lacks."
            )
