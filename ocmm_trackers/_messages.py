"""Messages of a tracker in the form that all protocols share, and the interface of a protocol."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any, Protocol

MOST_NAME = 64
"""Characters of a name."""


@dataclass(frozen=True, slots=True)
class MarkerPlace:
    """A named place in a message; NaN if the device sent no number."""

    name: str
    place: tuple[float, float, float]
    """In the unit of the device."""
    turned: bool = False
    """It has a rotation: it is the pose of a tool, not a marker."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Places of one time: markers, or tools."""

    elements: tuple[MarkerPlace, ...]
    whole: bool
    """All markers of the time are in this message."""


@dataclass(frozen=True, slots=True)
class DeviceStatus:
    code: int
    text: str


@dataclass(frozen=True, slots=True)
class SensorValues:
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Message:
    """A message with a correct checksum; `content` is None for kinds that are not read."""

    kind: str
    device: str
    time_ns: int
    """0 if the sender did not stamp it."""
    content: Pose | DeviceStatus | SensorValues | None = None


@dataclass(slots=True)
class MessageAccount:
    """``received == decoded + unread + damaged + malformed``, messages."""

    received: int = 0
    decoded: int = 0
    unread: int = 0
    """Of kinds that are not read, or too large."""
    damaged: int = 0
    """With a wrong checksum."""
    malformed: int = 0


class Decoder(Protocol):
    """One protocol: bytes of a device to messages, and the requests to the device.

    It holds one message at most, and raises AcquisitionError for bytes of another protocol and for
    devices that refuse to send.
    """

    account: MessageAccount
    ready: bool
    """The device has answered all requests before its first frame."""
    wait_s: float
    """Longest wait for bytes before `requests` is to be called again."""
    group: tuple[str, int] | None
    """Multicast address and port of its frames; None: they come to the sender of the requests."""

    def requests(self, now_s: float) -> bytes:
        """Return the bytes to send now, or none; ``now_s``: of a monotonic clock."""

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages that these bytes, one datagram if it is one, complete."""


class Cursor:
    """Little-endian numbers and texts of a packet, one after another; ValueError at its end."""

    def __init__(self, packet: bytes) -> None:
        self._packet, self.at = packet, 0

    @property
    def left(self) -> int:
        return len(self._packet) - self.at

    def take(self, form: str) -> tuple[Any, ...]:
        """Return the next numbers, of a format of `struct`."""
        return struct.unpack("<" + form, self.skip(struct.calcsize("<" + form)))

    def skip(self, size: int) -> bytes:
        """Return the next bytes."""
        if not 0 <= size <= self.left:
            raise ValueError("end of packet")
        self.at += size
        return self._packet[self.at - size : self.at]

    def text(self) -> bytes:
        """Return the bytes before the next zero."""
        found = self._packet.find(b"\0", self.at)
        if found < 0:
            raise ValueError("end of text")
        raw = self.skip(found - self.at)
        self.at += 1
        return raw


def name_of(raw: bytes) -> str:
    """Return a text field of fixed size; ValueError unless printable ASCII."""
    text = raw.split(b"\0", 1)[0].decode("ascii")
    if not text.isprintable():
        raise ValueError("name")
    return text


def frame_of(device: str, time_ns: int, elements: list[MarkerPlace]) -> Message:
    """Return the message of all markers of one exposure."""
    return Message("frame", device, time_ns, Pose(tuple(elements), whole=True))
