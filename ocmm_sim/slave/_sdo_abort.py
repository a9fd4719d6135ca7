"""Reasons for refused objects (abort codes of ETG.1000.6, table 41)."""

from __future__ import annotations

from enum import IntEnum

from ocmm_core.errors import BusError


class Abort(IntEnum):
    TOGGLE = 0x05030000
    COMMAND = 0x05040001
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    ENTRY_0 = 0x06010003
    NO_COMPLETE_ACCESS = 0x06010004
    TOO_LONG_FOR_MAILBOX = 0x06010005
    NO_OBJECT = 0x06020000
    HARDWARE = 0x06060000
    LENGTH = 0x06070010
    NO_ENTRY = 0x06090011
    VALUE = 0x06090030
    TOO_HIGH = 0x06090031
    TOO_LOW = 0x06090032
    NOT_STORED = 0x08000020
    BUSY = 0x08000021
    STATE = 0x08000022
    NO_DATA = 0x08000024


class AbortError(BusError):
    """A refused transfer, with the reason sent to the master."""

    def __init__(self, reason: Abort) -> None:
        super().__init__(
            "bus.refused",
            f"The camera refuses the object ({reason.name}, {reason.value:#010x}).",
            "Check the object and its value.",
        )
        self.reason = reason

    def __reduce__(self) -> tuple[type[AbortError], tuple[Abort]]:  # type: ignore[override]  # made from its reason alone
        return (type(self), (self.reason,))
