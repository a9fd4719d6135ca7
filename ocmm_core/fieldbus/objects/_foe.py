"""Firmware upload by FoE, without clock or wire (ETG.1000.6, 5.8)."""

from __future__ import annotations

import struct

from ocmm_core.errors import BusError

MAILBOX_FOE = 4
_WRITE, _DATA, _ACK, _ERROR, _BUSY = 2, 3, 4, 5, 6
_HEAD = struct.Struct("<BBI")
_MAILBOX_HEAD = struct.Struct("<HHBB")
FIRMWARE_NAME = b"firmware"


class FoeWrite:
    """Upload of one file.

    `done`: the camera has acknowledged the last packet; `busy`: resend the same mailbox.
    `mailbox_bytes` includes the header.
    """

    def __init__(self, name: bytes, content: bytes, mailbox_bytes: int) -> None:
        self._name = name
        self._content = content
        self._room = mailbox_bytes - _MAILBOX_HEAD.size - _HEAD.size
        self._number = 0
        self._refused = False
        self.done = self.busy = False

    @property
    def undecided(self) -> bool:
        """Return whether the camera may hold the whole file without acknowledgement."""
        sent = self._number > 0 and self._number * self._room > len(self._content)
        return sent and not (self.done or self._refused)

    @property
    def progress(self) -> tuple[int, int]:
        """Return acknowledged and total bytes."""
        sent = max(0, self._number - 1) * self._room
        return min(sent, len(self._content)), len(self._content)

    def request(self, counter: int) -> bytes:
        if self._number == 0:
            content = _HEAD.pack(_WRITE, 0, 0) + self._name
        else:
            # The last packet is shorter than a full one, possibly empty.
            begin = (self._number - 1) * self._room
            part = self._content[begin : begin + self._room]
            content = _HEAD.pack(_DATA, 0, self._number) + part
        head = _MAILBOX_HEAD.pack(len(content), 0, 0, counter << 4 | MAILBOX_FOE)
        return head + content

    def answer(self, mailbox: bytes) -> bool:
        """Process the camera's answer; return whether a mailbox is due next.

        A duplicate acknowledgement of the previous packet is accepted. A `busy` camera must get the
        same mailbox again after a pause. Raises BusError if the camera refuses or answers wrongly.
        """
        length, _address, _channel, kind = _MAILBOX_HEAD.unpack_from(mailbox.ljust(6, b"\x00"))
        body = mailbox[_MAILBOX_HEAD.size : _MAILBOX_HEAD.size + length]
        if kind & 0x0F != MAILBOX_FOE or len(body) < _HEAD.size:
            raise _refused("its answer is no answer to a file")
        operation, _reserved, number = _HEAD.unpack_from(body)
        self.busy = operation == _BUSY
        if self.busy:
            return True
        if operation == _ERROR:
            self._refused = True
            text = body[_HEAD.size :].split(b"\x00")[0].decode("ascii", errors="replace")
            raise _refused(f"{text.rstrip('.') or 'no reason'} (code {number:#06x})")
        if operation == _ACK and number == self._number - 1:
            return False
        if operation != _ACK or number != self._number:
            raise _refused(f"it acknowledges packet {number} instead of {self._number}")
        sent = max(0, self._number - 1) * self._room + (self._room if self._number else 0)
        self.done = self._number > 0 and sent > len(self._content)
        self._number += 1
        return True


def _refused(why: str) -> BusError:
    return BusError(
        "bus.firmware",
        f"The camera does not take the firmware: {why}.",
        "Its old firmware still runs. Check the file.",
    )
