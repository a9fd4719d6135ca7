"""The clock of a slave controller, and how it follows the reference clock of the bus."""

from __future__ import annotations

_FOLLOW_SHARE = 1000
"""A clock is pulled by at most a thousandth of the time since it was last compared."""
_SIGN = 1 << 31
_WORD = 1 << 32
_LARGEST = _SIGN - 1


class SlaveClock:
    """A free-running clock that can be wrong on purpose.

    Parameters
    ----------
    offset_ns
        What it shows more than the host's clock.
    """

    def __init__(self, offset_ns: int) -> None:
        self.rate_ppb = 0
        """How much too fast it runs, 1e-9."""
        self._shown_ns = offset_ns
        self._since_ns = 0
        self._compared_ns: int | None = None

    def local_ns(self, now_ns: int) -> int:
        """Return what the clock shows at host time ``now_ns``."""
        passed = now_ns - self._since_ns
        if not self.rate_ppb:
            return self._shown_ns + passed
        return self._shown_ns + passed + passed * self.rate_ppb // 1_000_000_000

    def set_rate(self, rate_ppb: int, now_ns: int) -> None:
        """Let the clock run that much too fast from now on."""
        self._shown_ns, self._since_ns = self.local_ns(now_ns), now_ns
        self.rate_ppb = rate_ppb

    def jump(self, amount_ns: int) -> None:
        """Let the clock show so much more from one moment to the next."""
        self._shown_ns += amount_ns

    def follow(self, difference_ns: int, now_ns: int) -> None:
        """Go towards the reference clock, as far as the control loop of a slave can.

        Parameters
        ----------
        difference_ns
            Own system time less the received one.
        now_ns
            Host time of the comparison.
        """
        if self._compared_ns is not None:
            limit = (now_ns - self._compared_ns) // _FOLLOW_SHARE
            self._shown_ns -= max(-limit, min(limit, difference_ns))
        self._compared_ns = now_ns


def time_difference(own_ns: int, received: bytes) -> int:
    """Return own less received system time, of which the low 32 bits came (4 or 8 bytes), ns."""
    reference = int.from_bytes(received[:4], "little")
    return (own_ns - reference + _SIGN) % _WORD - _SIGN


def difference_register(difference_ns: int) -> int:
    """Return the content of register 0x092C: amount, and bit 31 where the own time is behind."""
    amount = min(abs(difference_ns), _LARGEST)
    return amount | _SIGN if difference_ns < 0 else amount
