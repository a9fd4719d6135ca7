"""The time that the master lives in: this computer's own, or one that waits on a virtual wire."""

from __future__ import annotations

import time


class HostTime:
    """The monotonic clock of this computer; it waits for nobody.

    A virtual wire may bring another one, whose time stands still while this computer is late.
    """

    stretched = False
    """This time can stand still. Never true for real cameras."""
    patience = 1
    """How many times longer than real cameras others are waited for."""
    pace: float | None = None
    """This time over real time during the last second or so; None where it is the same, and before
    it is known."""

    def now_ns(self) -> int:
        """Return the time now."""
        return time.monotonic_ns()

    def wait_until(self, deadline_ns: int) -> int:
        """Wait until a time has come; return how late this computer is for it, ns."""
        left = deadline_ns - time.monotonic_ns()
        if left > 0:
            time.sleep(left * 1e-9)
        return time.monotonic_ns() - deadline_ns

    def passage(self, sent_ns: int, answered_ns: int) -> tuple[int, int]:
        """Return between which times an exchange took place that this computer's clock timed."""
        return sent_ns, answered_ns

    def hold(self) -> None:
        """From now on time may go on from cycle to cycle; only a stretched time does so."""

    def flow(self) -> None:
        """From now on time flows by itself, as it always does on real hardware."""

    def mark(self) -> None:
        """Begin to count the frames that are on their way."""

    def on_their_way(self, sent: int, came: int) -> bool:
        """Say whether frames are known to be on their way still.

        Parameters
        ----------
        sent, came
            Frames sent to the cameras and answers taken since `mark`.
        """
        del sent, came
        return False
