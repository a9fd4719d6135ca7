"""Messages of trackers in the form that all protocols share, and the base of their decoders."""

from __future__ import annotations

import struct
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

from ocmm_core.camera import TrackerDocument
from ocmm_core.errors import AcquisitionError

HIDDEN = (float("nan"),) * 3


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
    """An intact message; `content` is None for kinds that are not read."""

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


class DamagedPacketError(ValueError):
    """A packet has a wrong checksum."""


class Decoder(ABC):
    """One protocol: bytes of a device to messages, and the requests to the device."""

    name: ClassVar[str]
    """In sentences and recordings."""
    port: ClassVar[int]
    """If the source names none."""
    datagrams: ClassVar[bool] = False
    serial: ClassVar[bool] = False
    """It is spoken on serial lines also."""
    silence_s: ClassVar[float] = 5.0
    """Time without message after which the connection is made again."""
    baud = 0
    """Speed of a serial line; 0: network."""
    ready = True
    """The device has answered all requests before its first frame."""
    wait_s = 0.1
    """Longest wait for bytes before `requests` is to be called again."""
    group: tuple[str, int] | None = None
    """Multicast address and port of its frames; None: they come to the sender of the requests."""

    def __init__(self, _document: TrackerDocument) -> None:
        self.account = MessageAccount()
        self._buffer = bytearray()

    def requests(self, _now_s: float) -> bytes:
        """Return the bytes to send now, or none; ``now_s``: of a monotonic clock."""
        return b""

    def push(self, data: bytes) -> list[Message]:
        """Return the messages completed by these bytes, or by one datagram.

        AcquisitionError for bytes of another protocol, and for devices that refuse to send.
        """
        found: list[Message] = []
        self._buffer += data
        while (packet := self._cut()) is not None:
            self.account.received += 1
            try:
                messages = self._read(packet)
            except DamagedPacketError:
                self.account.damaged += 1
            except (ValueError, struct.error):
                self.account.malformed += 1
            else:
                self.account.decoded += messages is not None
                self.account.unread += messages is None
                found += messages or ()
        return found

    @abstractmethod
    def _cut(self) -> bytes | None:
        """Remove and return the next packet in the buffer; None if it is not complete."""

    def _taken(self, size: int) -> bytes | None:
        """Remove and return the first bytes of the buffer; None if they have not arrived."""
        if len(self._buffer) < size:
            return None
        packet = bytes(self._buffer[:size])
        del self._buffer[:size]
        return packet

    @abstractmethod
    def _read(self, packet: bytes) -> list[Message] | None:
        """Return the messages of a packet, None for a kind that is not read.

        ValueError if it does not have the form of its kind.
        """

    def _foreign(self) -> AcquisitionError:
        return AcquisitionError(
            "tracker.stream",
            f"The tracker sent bytes that are not of the protocol {self.name}.",
            f"Check host and port (usually {self.port}), and that the tracker sends by "
            f"{self.name}.",
        )


class Cursor:
    """Little-endian numbers and texts of a packet, one after another; ValueError at its end."""

    def __init__(self, packet: bytes) -> None:
        self._packet, self._at = packet, 0

    @property
    def left(self) -> int:
        return len(self._packet) - self._at

    def read(self, form: str) -> tuple[Any, ...]:
        """Return the next numbers, of a format of `struct`."""
        return struct.unpack("<" + form, self.skip(struct.calcsize("<" + form)))

    def skip(self, size: int) -> bytes:
        """Return the next bytes."""
        if not 0 <= size <= self.left:
            raise ValueError("end of packet")
        self._at += size
        return self._packet[self._at - size : self._at]

    def text(self) -> bytes:
        """Return the bytes before the next zero."""
        return self.skip(self._packet.index(b"\0", self._at) + 1 - self._at)[:-1]


def printable(raw: bytes) -> str:
    """Return a text of a device for a sentence, at most 100 characters."""
    text = raw.split(b"\0", 1)[0].decode("ascii", "replace")
    return "".join(one for one in text if one.isprintable())[:100]


def sensor_of(device: str, values: tuple[float, ...]) -> Message:
    """Return the message of the values of a device, such as a button."""
    return Message("sensor", device, 0, SensorValues(values))


def frame_of(device: str, time_ns: int, elements: list[MarkerPlace]) -> list[Message]:
    """Return the message of all markers of one exposure."""
    return [Message("frame", device, time_ns, Pose(tuple(elements), whole=True))]
