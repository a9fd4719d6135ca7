"""Reasons why a camera refuses a mailbox or transfer (ETG.1000.4 and ETG.1000.6)."""

from __future__ import annotations

ABORT_TEXTS: dict[int, str] = {
    0x05030000: "toggle bit not changed",
    0x05040000: "protocol timeout",
    0x05040001: "unknown command",
    0x05040005: "out of memory",
    0x06010000: "access not supported",
    0x06010001: "object can only be written",
    0x06010002: "object can only be read",
    0x06010003: "entry 0 must be 0 to write this entry",
    0x06010004: "no complete access to this object",
    0x06010005: "object longer than the mailbox",
    0x06010006: "object is mapped to process data",
    0x06020000: "object does not exist",
    0x06040041: "object cannot be mapped",
    0x06040042: "mapped objects are longer than the process data",
    0x06040043: "parameters do not fit together",
    0x06040047: "incompatible inside the camera",
    0x06060000: "hardware fault",
    0x06070010: "wrong length",
    0x06070012: "too long",
    0x06070013: "too short",
    0x06090011: "entry does not exist",
    0x06090030: "value not allowed",
    0x06090031: "value too large",
    0x06090032: "value too small",
    0x06090036: "maximum below minimum",
    0x08000000: "general error",
    0x08000020: "cannot be stored",
    0x08000021: "cannot be stored: the camera is in local control",
    0x08000022: "cannot be stored in this state of the camera",
    0x08000023: "no object dictionary",
}
"""Abort codes of SDO transfers (ETG.1000.6, table 41)."""

MAILBOX_ERRORS: dict[int, str] = {
    1: "syntax error",
    2: "protocol not supported",
    3: "wrong channel",
    4: "service not supported",
    5: "wrong head",
    6: "too short",
    7: "no memory",
    8: "wrong length",
}
"""Details of a mailbox error reply (ETG.1000.4, 5.6)."""
