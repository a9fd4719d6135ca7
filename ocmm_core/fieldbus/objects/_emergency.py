"""Emergency messages, sent by a camera unrequested (ETG.1000.6, 5.6.4)."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from ocmm_core.fieldbus.objects._sdo import SERVICE_EMERGENCY, coe_content

_CONTENT = struct.Struct("<HB5s")

# First match: specific codes, then classes by their highest digits.
_TEXTS = (
    (0xFFFF, 0x0000, "error reset"),
    (0xFFFF, 0xA000, "state change impossible"),
    (0xFFFF, 0xA001, "state change refused"),
    (0xFF00, 0x1000, "general error"),
    (0xFF00, 0x2100, "current at the input"),
    (0xFF00, 0x2200, "current inside the device"),
    (0xFF00, 0x2300, "current at the output"),
    (0xF000, 0x2000, "current"),
    (0xFF00, 0x3100, "mains voltage"),
    (0xFF00, 0x3200, "voltage inside the device"),
    (0xFF00, 0x3300, "output voltage"),
    (0xF000, 0x3000, "voltage"),
    (0xFF00, 0x4100, "ambient temperature"),
    (0xFF00, 0x4200, "device temperature"),
    (0xF000, 0x4000, "temperature"),
    (0xF000, 0x5000, "device hardware"),
    (0xFF00, 0x6100, "internal software"),
    (0xFF00, 0x6200, "user software"),
    (0xFF00, 0x6300, "stored data"),
    (0xF000, 0x6000, "device software"),
    (0xF000, 0x7000, "additional modules"),
    (0xFF00, 0x8100, "communication"),
    (0xFF00, 0x8200, "protocol"),
    (0xF000, 0x8000, "monitoring"),
    (0xFF00, 0x9000, "external error"),
    (0xFF00, 0xF000, "additional functions"),
    (0xFF00, 0xFF00, "device specific"),
)


@dataclass(frozen=True, slots=True)
class Emergency:
    code: int
    """Error code; 0: the previous error is over."""
    register: int
    """Error register (object 0x1001): bit 0 any error, 3 temperature, 4 communication."""
    data: bytes

    @property
    def is_over(self) -> bool:
        """Return whether the previous error is over (ETG.1000.6, 5.6.4.1)."""
        return self.code == 0

    @property
    def text(self) -> str:
        """Return the meaning of the code's class."""
        for mask, value, text in _TEXTS:
            if self.code & mask == value:
                return text
        return "unknown error"


def parse_emergency(mailbox: bytes) -> Emergency | None:
    """Return the emergency message in a mailbox, or None."""
    parts = coe_content(mailbox)
    if parts is None:
        return None
    service, body = parts
    if service != SERVICE_EMERGENCY or len(body) < _CONTENT.size:
        return None
    return Emergency(*_CONTENT.unpack_from(body))
