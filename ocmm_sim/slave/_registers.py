"""Registers, states and AL status codes of a slave (ETG.1000.4, ETG.1000.6), and its clock.

The clock is controlled to the reference clock of the bus.
"""

from __future__ import annotations

from ocmm_core.fieldbus.device import SYNC_MANAGERS

INIT, PREOP, BOOT, SAFEOP, OP = 1, 2, 3, 4, 8
ERROR = 0x10

STATION_ADDRESS = 0x0010
STATION_ALIAS = 0x0012
DL_CONTROL = 0x0100
DL_STATUS = 0x0110
AL_CONTROL = 0x0120
AL_STATUS = 0x0130
AL_STATUS_CODE = 0x0134
WATCHDOG_DIVIDER = 0x0400
WATCHDOG_SM_TIME = 0x0420
WATCHDOG_STATUS = 0x0440
WATCHDOG_COUNT = 0x0442
EEPROM_CONTROL = 0x0502
EEPROM_ADDRESS = 0x0504
EEPROM_DATA = 0x0508
FMMU = 0x0600
SYNC_MANAGER = 0x0800
PORT_TIME = 0x0900
SYSTEM_TIME = 0x0910
RECEIVE_TIME = 0x0918
TIME_OFFSET = 0x0920
TIME_DELAY = 0x0928
TIME_DIFFERENCE = 0x092C
SPEED_COUNTER = 0x0930
PDI_CONTROL = 0x0140
PDI_CONFIGURATION = 0x0150
SYNC_ACTIVATION = 0x0981
SYNC_PULSE = 0x0982
SYNC0_START = 0x0990
SYNC0_CYCLE = 0x09A0
RAM = 0x1000

N_FMMU = 8
AL_INVALID_CHANGE = 0x0011
AL_UNKNOWN_STATE = 0x0012
AL_NO_BOOT = 0x0013
AL_BOOT_MAILBOX = 0x0015
AL_MAILBOX = 0x0016
AL_WATCHDOG = 0x001B
AL_OUTPUTS = 0x001D
AL_INPUTS = 0x001E
AL_SYNC = 0x0030

# Registers writable by a master below the process memory.
WRITABLE = (
    (STATION_ADDRESS, 2), (DL_CONTROL, 4), (AL_CONTROL, 2), (0x0200, 4), (0x0300, 16),
    (WATCHDOG_DIVIDER, 2), (0x0410, 2), (WATCHDOG_SM_TIME, 2), (WATCHDOG_COUNT, 2), (0x0500, 16),
    (FMMU, 16 * N_FMMU), (SYNC_MANAGER, 8 * len(SYNC_MANAGERS)), (TIME_OFFSET, 8),
    (TIME_DELAY, 4), (0x0930, 6), (0x0980, 2), (SYNC0_START, 8), (SYNC0_CYCLE, 8),
)  # fmt: skip


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
        """Set the rate error from now on; for tests."""
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
    return (own_ns - int.from_bytes(received[:4], "little") + _SIGN) % _WORD - _SIGN


def difference_register(difference_ns: int) -> int:
    """Return register 0x092C: magnitude, and bit 31 if the own time is behind."""
    amount = min(abs(difference_ns), _LARGEST)
    return amount | _SIGN if difference_ns < 0 else amount
