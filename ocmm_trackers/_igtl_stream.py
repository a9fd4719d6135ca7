"""Bytes of a connection to messages of OpenIGTLink; every message is in one account."""

from __future__ import annotations

from ocmm_core.camera import TrackerDocument
from ocmm_core.errors import AcquisitionError
from ocmm_trackers._igtl import HEADER, MOST_BODY, checksum, decode
from ocmm_trackers._messages import Message, MessageAccount, name_of

_MOST_PASSED = 1 << 28
_VERSIONS = (1, 2, 3)


class IgtlDecoder:
    """A `Decoder` of OpenIGTLink; its server sends without requests."""

    ready = True
    wait_s = 0.1
    group = None

    def __init__(self, _document: TrackerDocument) -> None:
        self.account = MessageAccount()
        self._buffer = bytearray()
        self._passed = 0

    def requests(self, _now_s: float) -> bytes:
        """Return nothing."""
        return b""

    def feed(self, data: bytes) -> list[Message]:
        """Return the messages that these bytes complete.

        AcquisitionError if they are not OpenIGTLink.
        """
        found: list[Message] = []
        self._buffer += data
        while self._buffer:
            if self._passed:
                part = min(self._passed, len(self._buffer))
                del self._buffer[:part]
                self._passed -= part
                continue
            if len(self._buffer) < HEADER.size:
                break
            version, kind, device, seconds, fraction, size, stated = HEADER.unpack_from(
                self._buffer
            )
            try:
                names = name_of(kind), name_of(device)
            except ValueError:
                names = "", ""
            if version not in _VERSIONS or not names[0] or size > _MOST_PASSED:
                raise AcquisitionError(
                    "igtl.stream",
                    "The tracker sent bytes that are no OpenIGTLink message.",
                    "Check host and port, and that the program there is an OpenIGTLink server.",
                )
            if size > MOST_BODY:
                self.account.received += 1
                self.account.unread += 1
                self._passed = HEADER.size + size
                continue
            if len(self._buffer) < HEADER.size + size:
                break
            body = bytes(self._buffer[HEADER.size : HEADER.size + size])
            del self._buffer[: HEADER.size + size]
            message = self._message(version, names, (seconds, fraction), body, stated)
            if message is not None:
                found.append(message)
        return found

    def _message(
        self, version: int, names: tuple[str, str], stamp: tuple[int, int], body: bytes, stated: int
    ) -> Message | None:
        self.account.received += 1
        if checksum(body) != stated:
            self.account.damaged += 1
            return None
        try:
            message = decode(*names, version, stamp, body)
        except ValueError:
            self.account.malformed += 1
            return None
        if message.content is None:
            self.account.unread += 1
            return None
        self.account.decoded += 1
        return message
