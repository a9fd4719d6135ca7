"""Messages of OpenIGTLink, protocol versions 1 to 3: header, checksum and content.

Source: the protocol documents of openigtlink.org (TRANSFORM, POSITION, TDATA, QTDATA, POINT,
STATUS, SENSOR). Integers and floats are big endian, lengths mm.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np

from ocmm_core.geometry import Float
from ocmm_trackers._messages import (
    DamagedPacketError,
    Decoder,
    DeviceStatus,
    MarkerPlace,
    Message,
    Pose,
    SensorValues,
    printable,
)

_HEADER = struct.Struct(">H12s20sIIQQ")
_MOST_BODY, _MOST_PASSED = 1 << 16, 1 << 28
"""Larger messages, such as images, are passed over unread, to the second size."""
_VERSIONS = (1, 2, 3)
_EXTENDED = struct.Struct(">HHII")
_EXTENDED_VERSION = 2
"""Header version of protocol 3."""
_POLYNOMIAL = 0x42F0E1EBA9EA3693
_MASK = (1 << 64) - 1

IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_TURNED = 1e-6
"""Larger elements of a rotation less identity are those of a pose; float32 holds 1e-7."""


def _table() -> list[int]:
    found = []
    for byte in range(256):
        rest = byte << 56
        for _ in range(8):
            rest = ((rest << 1) ^ (_POLYNOMIAL if rest >> 63 else 0)) & _MASK
        found.append(rest)
    return found


_TABLE = _table()


def checksum(content: bytes) -> int:
    """Return the CRC-64 of a body (ECMA-182, start 0, not reflected)."""
    rest = 0
    for byte in content:
        rest = _TABLE[(rest >> 56) ^ byte] ^ (rest << 8) & _MASK
    return rest


def fraction_of(time_ns: int) -> tuple[int, int]:
    """Return seconds and fraction (units of 2^-32 s) of a time stamp."""
    return time_ns // 10**9, ((time_ns % 10**9 << 32) + 10**9 - 1) // 10**9


def name_of(raw: bytes) -> str:
    """Return a text field of fixed size; ValueError unless printable ASCII."""
    text = raw.split(b"\0", 1)[0].decode("ascii")
    if not text.isprintable():
        raise ValueError("name")
    return text


class IgtlDecoder(Decoder):
    """OpenIGTLink; its server sends without requests."""

    name, port = "OpenIGTLink", 18944
    _passed = 0

    def _cut(self) -> bytes | None:
        if self._passed:
            part = min(self._passed, len(self._buffer))
            del self._buffer[:part]
            self._passed -= part
        if len(self._buffer) < _HEADER.size:
            return None
        version, kind, device, _, _, size, _ = _HEADER.unpack_from(self._buffer)
        try:
            name_of(device)
            known = bool(name_of(kind)) and version in _VERSIONS
        except ValueError:
            known = False
        if not known or size > _MOST_PASSED:
            raise self._foreign()
        size += _HEADER.size
        if size > _MOST_BODY:
            self._passed = size - _HEADER.size
            size = _HEADER.size
        return self._taken(size)

    def _read(self, packet: bytes) -> list[Message] | None:
        version, kind, device, *stamp, size, stated = _HEADER.unpack_from(packet)
        body = packet[_HEADER.size :]
        if len(body) < size:
            return None
        if checksum(body) != stated:
            raise DamagedPacketError
        message = decode(name_of(kind), name_of(device), version, (stamp[0], stamp[1]), body)
        return None if message.content is None else [message]


def decode(kind: str, device: str, version: int, stamp: tuple[int, int], body: bytes) -> Message:
    """Return the message of a body; ValueError if it does not have the form of its kind."""
    if version >= _EXTENDED_VERSION:
        body = _without_extension(body)
    time_ns = stamp[0] * 10**9 + (stamp[1] * 10**9 >> 32)
    reader = _READERS.get(kind)
    try:
        return Message(kind, device, time_ns, None if reader is None else reader(device, body))
    except struct.error as error:
        raise ValueError(kind) from error


def _without_extension(body: bytes) -> bytes:
    if len(body) < _EXTENDED.size:
        raise ValueError("extended header")
    size, head, data, _ = _EXTENDED.unpack_from(body)
    if size < _EXTENDED.size or size + head + data > len(body):
        raise ValueError("extended header")
    return body[size : len(body) - head - data]


def _floats(raw: bytes) -> Float:
    # Not by numpy, which warns of a signalling NaN.
    return np.array(struct.unpack(f">{len(raw) // 4}f", raw))


def _element(
    name: str, place: Float, rotation: Float | tuple[float, ...] = IDENTITY
) -> MarkerPlace:
    x, y, z = (float(value) for value in place)
    with np.errstate(invalid="ignore"):
        turned = not bool(np.all(np.abs(np.asarray(rotation) - IDENTITY) <= _TURNED))
    return MarkerPlace(name, (x, y, z), turned)


def _of_quaternion(name: str, place: Float, quaternion: Float) -> MarkerPlace:
    """Return an element; a quaternion without real part is compressed, its parts still zero."""
    upright = bool(np.all(np.abs(quaternion[:3]) <= _TURNED))
    x, y, z = (float(value) for value in place)
    return MarkerPlace(name, (x, y, z), not upright)


def _transform(device: str, body: bytes) -> Pose:
    if len(body) != 48:
        raise ValueError("TRANSFORM")
    numbers = _floats(body)
    return Pose((_element(device, numbers[9:], numbers[:9]),), whole=False)


def _position(device: str, body: bytes) -> Pose:
    if len(body) not in (12, 24, 28):
        raise ValueError("POSITION")
    numbers = _floats(body)
    if len(numbers) == 3:
        return Pose((_element(device, numbers),), whole=False)
    return Pose((_of_quaternion(device, numbers[:3], numbers[3:]),), whole=False)


def _rows(body: bytes, size: int) -> list[bytes]:
    if len(body) % size:
        raise ValueError("rows")
    return [body[at : at + size] for at in range(0, len(body), size)]


def _tracking_data(_device: str, body: bytes) -> Pose:
    found = []
    for row in _rows(body, 70):
        numbers = _floats(row[22:])
        found.append(_element(name_of(row[:20]), numbers[9:], numbers[:9]))
    return Pose(tuple(found), whole=True)


def _quaternion_data(_device: str, body: bytes) -> Pose:
    found = []
    for row in _rows(body, 50):
        numbers = _floats(row[22:])
        found.append(_of_quaternion(name_of(row[:20]), numbers[:3], numbers[3:]))
    return Pose(tuple(found), whole=True)


def _points(_device: str, body: bytes) -> Pose:
    rows = _rows(body, 136)
    return Pose(tuple(_element(name_of(row[:64]), _floats(row[100:112])) for row in rows), True)


def _status(_device: str, body: bytes) -> DeviceStatus:
    return DeviceStatus(struct.unpack_from(">HQ20s", body)[0], printable(body[30:]))


def _sensor(_device: str, body: bytes) -> SensorValues:
    count, _, _ = struct.unpack_from(">BBQ", body)
    if len(body) != 10 + 8 * count:
        raise ValueError("SENSOR")
    return SensorValues(struct.unpack_from(f">{count}d", body, 10))


_READERS: dict[str, Callable[[str, bytes], Pose | DeviceStatus | SensorValues]] = {
    "TRANSFORM": _transform, "POSITION": _position, "TDATA": _tracking_data,
    "QTDATA": _quaternion_data, "POINT": _points, "STATUS": _status, "SENSOR": _sensor,
}  # fmt: skip
