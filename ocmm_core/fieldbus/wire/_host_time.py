"""Time of the master: this computer's, or one that waits on a virtual wire."""

from __future__ import annotations

import time


class HostTime:
    """Monotonic clock of this computer; never waits.

    A virtual wire may use a subclass whose time stops while this computer is late.
    """

    stretched = False
    """The time can stop. Never true for real cameras."""
    patience = 1
    """Factor on time limits relative to real cameras."""
    pace: float | None = None
    """This time over real time during the last second or so; None if identical or unknown."""

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def wait_until(self, deadline_ns: int) -> int:
        """Wait until `deadline_ns`; return the lateness, ns."""
        left = deadline_ns - time.monotonic_ns()
        if left > 0:
            time.sleep(left * 1e-9)
        return time.monotonic_ns() - deadline_ns

    def passage(self, sent_ns: int, answered_ns: int) -> tuple[int, int]:
        """Convert send and answer times of this computer's clock."""
        return sent_ns, answered_ns

    def hold(self) -> None:
        """Advance from cycle to cycle from now on; stretched time only."""

    def flow(self) -> None:
        """Let time flow freely from now on, as on real hardware."""

    def mark(self) -> None:
        """Start counting frames in transit."""

    def on_their_way(self, sent: int, came: int) -> bool:
        """Return whether frames sent since `mark` are in transit."""
        del sent, came
        return False
