"""Messages of the diagnosis history, object 0x10F3 (ETG.1020, chapter 16)."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device._camera_slave import DataType

# Diagnosis code, flags, text, time, then two parameters: the error register and five bytes.
_MESSAGE = struct.Struct("<HHHHQHBH5s")
MESSAGE_BYTES = _MESSAGE.size
_EMERGENCY_CODE = 0xE800
_ERROR_LEVEL, _INFO_LEVEL = 2, 0
_TWO_PARAMETERS = 2 << 8
_OCTETS = 1 << 12
DATA_BYTES = 5


@dataclass(frozen=True, slots=True)
class DiagnosisMessage:
    """One entry of the error history."""

    code: int
    """Error code of the emergency message; 0: the previous error is over."""
    time_ns: int
    register: int
    data: bytes

    def encode(self) -> bytes:
        level = _ERROR_LEVEL if self.code else _INFO_LEVEL
        return _MESSAGE.pack(
            _EMERGENCY_CODE, self.code, _TWO_PARAMETERS | level, self.code, self.time_ns,
            DataType.USINT, self.register, _OCTETS | DATA_BYTES, self.data,
        )  # fmt: skip

    @classmethod
    def decode(cls, content: bytes) -> DiagnosisMessage:
        """Return the message; raise BusError if it is not of this camera."""
        if len(content) == MESSAGE_BYTES:
            kind, code, flags, _text, time_ns, usint, register, octets, data = _MESSAGE.unpack(
                content
            )
            if (kind, flags & 0xFF00, usint, octets) == (
                _EMERGENCY_CODE, _TWO_PARAMETERS, DataType.USINT, _OCTETS | DATA_BYTES,
            ):  # fmt: skip
                return cls(code, time_ns, register, data)
        raise BusError(
            "bus.history",
            f"The camera error history contains a message of {len(content)} bytes that this "
            "program cannot read.",
            "Install the camera firmware that matches this program.",
        )
