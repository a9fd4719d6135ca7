"""Clock of a slave controller, and its control to the bus reference clock."""

from __future__ import annotations

_FOLLOW_SHARE = 1000
"""Maximum correction: a thousandth of the time since the last comparison."""
_SIGN = 1 << 31
_WORD = 1 << 32
_LARGEST = _SIGN - 1


class SlaveClock:
    """A free-running clock with adjustable errors, relative to the host's."""

    def __init__(self, offset_ns: int) -> None:
        self.rate_ppb = 0
        """Rate error, 1e-9."""
        self._shown_ns = offset_ns
        self._since_ns = 0
        self._compared_ns: int | None = None

    def local_ns(self, now_ns: int) -> int:
        """Return the clock reading at host time `now_ns`."""
        passed = now_ns - self._since_ns
        if not self.rate_ppb:
            return self._shown_ns + passed
        return self._shown_ns + passed + passed * self.rate_ppb // 1_000_000_000

    def set_rate(self, rate_ppb: int, now_ns: int) -> None:
        """Set the rate error from now on."""
        self._shown_ns, self._since_ns = self.local_ns(now_ns), now_ns
        self.rate_ppb = rate_ppb

    def jump(self, amount_ns: int) -> None:
        self._shown_ns += amount_ns

    def follow(self, difference_ns: int, now_ns: int) -> None:
        """Follow the reference clock within a slave's limits; difference: own minus received."""
        if self._compared_ns is not None:
            limit = (now_ns - self._compared_ns) // _FOLLOW_SHARE
            self._shown_ns -= max(-limit, min(limit, difference_ns))
        self._compared_ns = now_ns


def time_difference(own_ns: int, received: bytes) -> int:
    """Return own minus received system time (4 or 8 bytes, low 32 bits used), ns."""
    reference = int.from_bytes(received[:4], "little")
    return (own_ns - reference + _SIGN) % _WORD - _SIGN


def difference_register(difference_ns: int) -> int:
    """Return register 0x092C: magnitude, and bit 31 if the own time is behind."""
    amount = min(abs(difference_ns), _LARGEST)
    return amount | _SIGN if difference_ns < 0 else amount
