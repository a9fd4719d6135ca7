"""CANopen over EtherCAT, the slave's side: SDO transfers and SDO information (ETG.1000.6)."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

from ocmm_core.fieldbus.camera_objects import DictionaryObject, ObjectEntry
from ocmm_core.fieldbus.camera_slave import DataType

_MAILBOX_COE = 3
_SDO_REQUEST, _SDO_RESPONSE, _SDO_INFORMATION = 2, 3, 8
_MAILBOX_HEAD = 6
_COE_HEAD = 2
_SDO_HEAD = 8
_ABORT = 0x80

ABORT_TOGGLE = 0x05030000
ABORT_COMMAND = 0x05040001
ABORT_ACCESS = 0x06010000
ABORT_READ_ONLY = 0x06010002
ABORT_NO_OBJECT = 0x06020000
ABORT_LENGTH = 0x06070010
ABORT_NO_ENTRY = 0x06090011

Address = tuple[int, int]


class CoeServer:
    """Answers CoE mailboxes from an object dictionary.

    Parameters
    ----------
    objects
        The dictionary, by index.
    mailbox_bytes
        Size of one mailbox, head included.
    live
        Values that are asked for when they are read, by (index, entry).
    """

    def __init__(
        self,
        objects: Mapping[int, DictionaryObject],
        mailbox_bytes: int,
        live: Mapping[Address, Callable[[], bytes]],
    ) -> None:
        self._objects = objects
        self._values = {
            (index, sub): entry.value
            for index, item in objects.items()
            for sub, entry in item.entries.items()
        }
        self._live = live
        self._room = mailbox_bytes - _MAILBOX_HEAD - _COE_HEAD
        self._upload: tuple[bytes, int] | None = None
        self._download: tuple[Address, int, bytearray, int] | None = None

    def value(self, index: int, sub: int) -> bytes:
        """Return what the dictionary holds."""
        live = self._live.get((index, sub))
        return self._values[index, sub] if live is None else live()

    def set_value(self, index: int, sub: int, value: bytes) -> None:
        """Change what the dictionary holds, from the device's side."""
        self._values[index, sub] = value

    def answer(self, mailbox: bytes) -> bytes | None:
        """Return the mailbox that answers ``mailbox``, or None where there is nothing to say."""
        if len(mailbox) < _MAILBOX_HEAD + _COE_HEAD:
            return None
        length, _address, _channel, kind = struct.unpack_from("<HHBB", mailbox)
        if kind & 0x0F != _MAILBOX_COE or length < _COE_HEAD:
            return None
        payload = mailbox[_MAILBOX_HEAD : _MAILBOX_HEAD + length]
        service = struct.unpack_from("<H", payload)[0] >> 12
        body = payload[_COE_HEAD:]
        if service == _SDO_REQUEST and len(body) >= 1:
            reply = self._sdo(body.ljust(_SDO_HEAD, b"\x00"))
            # The abort is a service of its own that the standard sends as a request.
            answer_service = _SDO_REQUEST if reply[0] == _ABORT else _SDO_RESPONSE
        elif service == _SDO_INFORMATION and len(body) >= 4:
            reply, answer_service = self._information(body), _SDO_INFORMATION
        else:
            return None
        content = struct.pack("<H", answer_service << 12) + reply
        return struct.pack("<HHBB", len(content), 0, 0, kind) + content

    def _sdo(self, body: bytes) -> bytes:
        command, index, sub = struct.unpack_from("<BHB", body)
        specifier = command >> 5
        if specifier in (1, 2):
            code = self._refusal(index, sub, command, write=specifier == 1)
            if code:
                return _abort(index, sub, code)
            if specifier == 2:
                return self._start_upload(index, sub)
            return self._start_download(command, index, sub, body)
        if specifier == 3:
            return self._upload_segment(command)
        if specifier == 0:
            return self._download_segment(command, body)
        if specifier == 4:
            self._upload = self._download = None
        return _abort(index, sub, ABORT_COMMAND)

    def _refusal(self, index: int, sub: int, command: int, *, write: bool) -> int:
        if index not in self._objects:
            return ABORT_NO_OBJECT
        if command & 0x10:
            return ABORT_ACCESS
        entry = self._objects[index].entries.get(sub)
        if entry is None:
            return ABORT_NO_ENTRY
        if write and not entry.writable:
            return ABORT_READ_ONLY
        return 0

    def _start_upload(self, index: int, sub: int) -> bytes:
        value = self.value(index, sub)
        if len(value) <= 4:
            command = 0x43 | (4 - len(value)) << 2
            return struct.pack("<BHB", command, index, sub) + value.ljust(4, b"\x00")
        first = value[: self._room - _SDO_HEAD]
        self._upload = (value[len(first) :], 0)
        return struct.pack("<BHBI", 0x41, index, sub, len(value)) + first

    def _upload_segment(self, command: int) -> bytes:
        toggle = command >> 4 & 1
        if self._upload is None:
            return _abort(0, 0, ABORT_COMMAND)
        rest, expected = self._upload
        if toggle != expected:
            return _abort(0, 0, ABORT_TOGGLE)
        part, rest = rest[: self._room - 1], rest[self._room - 1 :]
        self._upload = (rest, 1 - expected) if rest else None
        head = toggle << 4 | (0 if rest else 1)
        if len(part) < 7:
            head |= 7 - len(part) << 1
        return bytes([head]) + part.ljust(7, b"\x00")

    def _start_download(self, command: int, index: int, sub: int, body: bytes) -> bytes:
        if command & 0x02:
            size = 4 - (command >> 2 & 3) if command & 0x01 else 4
            return self._store(index, sub, body[4 : 4 + size])
        size = int(struct.unpack_from("<I", body, 4)[0])
        if size > len(self._values[index, sub]):
            return _abort(index, sub, ABORT_LENGTH)
        part = body[_SDO_HEAD : _SDO_HEAD + size]
        if len(part) == size:
            return self._store(index, sub, part)
        self._download = ((index, sub), size, bytearray(part), 0)
        return struct.pack("<BHBI", 0x60, index, sub, 0)

    def _download_segment(self, command: int, body: bytes) -> bytes:
        if self._download is None:
            return _abort(0, 0, ABORT_COMMAND)
        (index, sub), size, content, expected = self._download
        toggle = command >> 4 & 1
        if toggle != expected:
            return _abort(index, sub, ABORT_TOGGLE)
        content += body[1 : 1 + size - len(content)]
        self._download = ((index, sub), size, content, 1 - expected)
        if command & 1:
            self._download = None
            reply = self._store(index, sub, bytes(content[:size]))
            if reply[0] == _ABORT:
                return reply
        return bytes([0x20 | toggle << 4]) + bytes(7)

    def _store(self, index: int, sub: int, value: bytes) -> bytes:
        if len(value) != len(self._values[index, sub]):
            return _abort(index, sub, ABORT_LENGTH)
        self._values[index, sub] = value
        return struct.pack("<BHBI", 0x60, index, sub, 0)

    def _information(self, body: bytes) -> bytes:
        operation = body[0] & 0x7F
        if operation == 1:
            indices = sorted(self._objects)
            return struct.pack("<BBHH", 2, 0, 0, 1) + struct.pack(f"<{len(indices)}H", *indices)
        if operation == 3 and len(body) >= 6:
            index = struct.unpack_from("<H", body, 4)[0]
            item = self._objects.get(index)
            if item is not None:
                highest = max(item.entries)
                kind = DataType.UDINT if item.record else item.entries[0].kind
                shape = 9 if item.record else 7
                head = struct.pack("<BBHHHBB", 4, 0, 0, index, kind, highest, shape)
                return head + item.name.encode("ascii")
        if operation == 5 and len(body) >= 7:
            index, sub = struct.unpack_from("<HB", body, 4)
            item = self._objects.get(index)
            entry = item.entries.get(sub) if item is not None else None
            if entry is not None:
                return self._describe(index, sub, entry)
        return struct.pack("<BBHI", 7, 0, 0, ABORT_NO_OBJECT)

    def _describe(self, index: int, sub: int, entry: ObjectEntry) -> bytes:
        access = 0x3F if entry.writable else 0x07
        bits = 8 * len(self._values[index, sub])
        head = struct.pack("<BBHHBBHHH", 6, 0, 0, index, sub, 0, entry.kind, bits, access)
        return head + entry.name.encode("ascii")


def _abort(index: int, sub: int, code: int) -> bytes:
    return struct.pack("<BHBI", _ABORT, index, sub, code)
