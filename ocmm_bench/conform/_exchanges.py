"""States, deadlines and results of one exchange, used by the rules."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.fieldbus.device import FRAME_DTYPE, HEADER_STRUCT, Header

INIT, PREOP, BOOT, SAFEOP, OP = 1, 2, 3, 4, 8
ERROR = 0x10
NAMES = {INIT: "INIT", PREOP: "PREOP", BOOT: "BOOT", SAFEOP: "SAFEOP", OP: "OP"}
MS = 1_000_000
SDO_LIMIT_NS, STATE_LIMIT_NS, BACK_LIMIT_NS = 80 * MS, 1000 * MS, 500 * MS
FIRST_LIMIT_NS, BOOT_LIMIT_NS, ERASE_LIMIT_NS, PACKET_LIMIT_NS = (
    60 * MS, 5000 * MS, 10_000 * MS, 2000 * MS,
)  # fmt: skip
"""Deadlines of the object description, ns."""
SDO_TIME, STATE_TIME = "Answer to an SDO request", "Change of state"


@dataclass(frozen=True, slots=True)
class Status:
    """State of a camera with error bit, and AL status code."""

    state: int
    code: int

    def __str__(self) -> str:
        name = NAMES.get(self.state & 0x0F, f"{self.state:#x}")
        return f"{name}{' with error' if self.state & ERROR else ''} (code {self.code:#06x})"


@dataclass(frozen=True, slots=True)
class ExchangeCycle:
    """One exchange of process data."""

    working_counter: int
    content: bytes
    header: Header
    system_ns: int
    """Bus time of the camera when the frame passed it."""
    sent_ns: int
    came_ns: int
    """`sent_ns`, `came_ns`: line time before and after."""

    def frame(self, number: int) -> bytes:
        begin = HEADER_STRUCT.size + number * FRAME_DTYPE.itemsize
        return self.content[begin : begin + FRAME_DTYPE.itemsize]
