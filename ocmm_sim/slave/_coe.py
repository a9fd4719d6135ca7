"""CANopen over EtherCAT, slave side: mailbox requests and answers.

Any bytes are answered by CoE, a mailbox error reply or nothing (ETG.1000.4, 5.6; ETG.1000.6, 5.6).
Includes SDO information (ETG.1000.6, 5.6.3).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ocmm_core.fieldbus.device import DictionaryObject, ObjectEntry
from ocmm_sim.slave._sdo_values import Abort, AbortError, Address, SdoValues

_LIST, _OBJECT, _ENTRY, _ERROR = 1, 3, 5, 7
_VARIABLE, _RECORD = 7, 9
_LIST_COUNTS, _LIST_ALL, _LIST_OUTPUTS, _LIST_INPUTS, _LIST_BACKUP, _LIST_SETTINGS = range(6)
_READ_ALWAYS, _WRITE_PREOP, _WRITE_ALWAYS = 0x07, 0x08, 0x38
_MAPPED_OUTPUT, _MAPPED_INPUT, _SETTING = 0x40, 0x80, 0x0200
_NO_TYPE = 0
_OUTPUTS = range(0x7000, 0x8000)


def object_information(objects: Mapping[int, DictionaryObject], request: bytes, room: int) -> bytes:
    """Return the answer to a request of 4 bytes or more, up to `room` bytes."""
    operation = request[0] & 0x7F
    content = request[4:]
    answer: bytes | None = None
    if operation == _LIST and len(content) >= 2:
        answer = _list(objects, int(struct.unpack_from("<H", content)[0]))
    elif operation == _OBJECT and len(content) >= 2:
        index = int(struct.unpack_from("<H", content)[0])
        item = objects.get(index)
        if item is not None:
            shape = _RECORD if item.record else _VARIABLE
            head = struct.pack("<HHBB", index, item.kind, max(item.entries), shape)
            answer = head + item.name.encode("ascii")
    elif operation == _ENTRY and len(content) >= 3:
        index, sub = struct.unpack_from("<HB", content)
        item = objects.get(index)
        entry = item.entries.get(sub) if item is not None else None
        if item is not None and entry is None and sub < max(item.entries):
            # A gap in a record is no error, or a full listing would contain many.
            answer = struct.pack("<HBBHHH", index, sub, 0, _NO_TYPE, 0, 0)
        if entry is not None:
            access = entry_access(index, entry)
            # No additional values (unit, default, limits) follow.
            head = struct.pack("<HBBHHH", index, sub, 0, entry.kind, entry.bits, access)
            answer = head + entry.name.encode("ascii")
    if answer is None:
        return _refusal(Abort.NO_OBJECT if operation in (_LIST, _OBJECT, _ENTRY) else Abort.COMMAND)
    if len(answer) + 4 > room:
        return _refusal(Abort.TOO_LONG_FOR_MAILBOX)
    return struct.pack("<BBH", operation + 1, 0, 0) + answer


def entry_access(index: int, entry: ObjectEntry) -> int:
    access = _READ_ALWAYS
    if entry.writable:
        access |= _WRITE_PREOP if entry.preop_only else _WRITE_ALWAYS
    if entry.preop_only:
        access |= _SETTING
    if entry.mapped:
        access |= _MAPPED_OUTPUT if index in _OUTPUTS else _MAPPED_INPUT
    return access


def _list(objects: Mapping[int, DictionaryObject], kind: int) -> bytes | None:
    bits = {
        _LIST_ALL: _READ_ALWAYS,
        _LIST_OUTPUTS: _MAPPED_OUTPUT,
        _LIST_INPUTS: _MAPPED_INPUT,
        _LIST_BACKUP: 0,
        _LIST_SETTINGS: _SETTING,
    }
    lists = {
        key: [
            index
            for index, item in sorted(objects.items())
            if any(entry_access(index, entry) & bit for entry in item.entries.values())
        ]
        for key, bit in bits.items()
    }
    if kind == _LIST_COUNTS:
        return struct.pack("<H5H", kind, *(len(found) for found in lists.values()))
    if kind not in lists:
        return None
    return struct.pack(f"<H{len(lists[kind])}H", kind, *lists[kind])


def _refusal(reason: Abort) -> bytes:
    return struct.pack("<BBHI", _ERROR, 0, 0, reason)


_MAILBOX_ERROR, _MAILBOX_COE = 0, 3
_EMERGENCY, _SDO_REQUEST, _SDO_RESPONSE, _SDO_INFORMATION = 1, 2, 3, 8
_MAILBOX_HEAD = 6
_COE_HEAD = 2
_SDO_HEAD = 8
_SEGMENT_BYTES = 7
_ABORT = 0x80
_ERROR_PROTOCOL, _ERROR_SERVICE, _ERROR_SHORT, _ERROR_SIZE = 2, 4, 6, 8
_MAX_COUNTER = 7


@dataclass(slots=True)
class _Upload:
    """A value being uploaded: remaining bytes and next toggle bit."""

    index: int
    sub: int
    rest: bytes
    toggle: int = 0


@dataclass(slots=True)
class _Download:
    """A value being downloaded: expected length and bytes so far."""

    index: int
    sub: int
    complete: bool
    size: int
    content: bytearray
    toggle: int = 0


class CoeServer:
    """Answers CoE mailboxes from an object dictionary.

    By (index, entry): ``live``, readers of computed values; ``written``, actions before a value is
    stored; both may raise `AbortError`. ``configurable``: entries for PREOP may be written now.
    """

    def __init__(
        self,
        objects: Mapping[int, DictionaryObject],
        mailbox_bytes: int,
        live: Mapping[Address, Callable[[], bytes]],
        written: Mapping[Address, Callable[[bytes], object]] | None = None,
        configurable: Callable[[], bool] = lambda: True,
    ) -> None:
        self._objects = objects
        self._values = SdoValues(objects, live, written or {}, configurable)
        self._room = mailbox_bytes - _MAILBOX_HEAD - _COE_HEAD
        self._transfer: _Upload | _Download | None = None
        self._counter = 0
        self.bad_mailboxes = 0
        """Mailboxes answered with an error reply or not at all."""

    def value(self, index: int, sub: int) -> bytes:
        return self._values.read(index, sub)

    def set_value(self, index: int, sub: int, value: bytes) -> None:
        """Set a value of the dictionary, from the device side."""
        self._values.put(index, sub, value)

    def reset(self) -> None:
        self._transfer = None

    def emergency(self, code: int, register: int, data: bytes) -> bytes:
        """Return the mailbox of an emergency message with five bytes of data."""
        return self._coe(_EMERGENCY, struct.pack("<HB5s", code, register, data))

    def answer(self, mailbox: bytes) -> bytes | None:
        if len(mailbox) < _MAILBOX_HEAD or mailbox[5] & 0x0F == _MAILBOX_ERROR:
            self.bad_mailboxes += 1
            return None
        length, _address, _channel, kind = struct.unpack_from("<HHBB", mailbox)
        payload = mailbox[_MAILBOX_HEAD : _MAILBOX_HEAD + length]
        if kind & 0x0F != _MAILBOX_COE:
            return self._error(_ERROR_PROTOCOL)
        if len(payload) < length:
            return self._error(_ERROR_SIZE)
        if length <= _COE_HEAD:
            return self._error(_ERROR_SHORT)
        service = struct.unpack_from("<H", payload)[0] >> 12
        body = payload[_COE_HEAD:]
        if service == _SDO_REQUEST:
            return self._sdo(body)
        if service == _SDO_INFORMATION:
            if len(body) < 4:
                return self._error(_ERROR_SHORT)
            return self._coe(service, object_information(self._objects, body, self._room))
        return self._error(_ERROR_SERVICE)

    def _mailbox(self, protocol: int, content: bytes) -> bytes:
        self._counter = self._counter % _MAX_COUNTER + 1
        return struct.pack("<HHBB", len(content), 0, 0, self._counter << 4 | protocol) + content

    def _coe(self, service: int, body: bytes) -> bytes:
        return self._mailbox(_MAILBOX_COE, struct.pack("<H", service << 12) + body)

    def _error(self, detail: int) -> bytes:
        self.bad_mailboxes += 1
        return self._mailbox(_MAILBOX_ERROR, struct.pack("<HH", 1, detail))

    def _sdo(self, body: bytes) -> bytes | None:
        specifier = body[0] >> 5
        if specifier in (1, 2) and len(body) < _SDO_HEAD:
            return self._error(_ERROR_SHORT)
        if body[0] == _ABORT:
            # Abort by the master; not answered.
            self._transfer = None
            return None
        index, sub = struct.unpack_from("<HB", body.ljust(_SDO_HEAD, b"\x00"), 1)
        try:
            if specifier == 2:
                return self._coe(_SDO_RESPONSE, self._start_upload(body, index, sub))
            if specifier == 1:
                return self._coe(_SDO_RESPONSE, self._start_download(body, index, sub))
            if self._transfer is not None:
                index, sub = self._transfer.index, self._transfer.sub
            if specifier == 3 and isinstance(self._transfer, _Upload):
                return self._coe(_SDO_RESPONSE, self._upload_segment(self._transfer, body[0]))
            if specifier == 0 and isinstance(self._transfer, _Download):
                return self._coe(_SDO_RESPONSE, self._download_segment(self._transfer, body))
            raise AbortError(Abort.COMMAND)
        except AbortError as abort:
            self._transfer = None
            # The abort is a separate service that the standard sends as a request.
            return self._coe(_SDO_REQUEST, struct.pack("<BHBI", _ABORT, index, sub, abort.reason))

    def _start_upload(self, body: bytes, index: int, sub: int) -> bytes:
        self._transfer = None
        complete = bool(body[0] & 0x10)
        value = self._values.read_all(index, sub) if complete else self._values.read(index, sub)
        head = 0x50 if complete else 0x40
        if 1 <= len(value) <= 4:
            command = head | 0x03 | (4 - len(value)) << 2
            return struct.pack("<BHB", command, index, sub) + value.ljust(4, b"\x00")
        first = value[: self._room - _SDO_HEAD]
        if len(first) < len(value):
            self._transfer = _Upload(index, sub, value[len(first) :])
        return struct.pack("<BHBI", head | 0x01, index, sub, len(value)) + first

    def _upload_segment(self, upload: _Upload, command: int) -> bytes:
        if command >> 4 & 1 != upload.toggle:
            raise AbortError(Abort.TOGGLE)
        part, upload.rest = upload.rest[: self._room - 1], upload.rest[self._room - 1 :]
        head = upload.toggle << 4
        upload.toggle = 1 - upload.toggle
        if not upload.rest:
            self._transfer = None
            head |= 1
        head |= max(0, _SEGMENT_BYTES - len(part)) << 1
        return bytes([head]) + part.ljust(_SEGMENT_BYTES, b"\x00")

    def _start_download(self, body: bytes, index: int, sub: int) -> bytes:
        self._transfer = None
        command, complete = body[0], bool(body[0] & 0x10)
        room = self._values.check_writable(index, sub, complete=complete)
        if command & 0x02:
            size = 4 - (command >> 2 & 3) if command & 0x01 else min(4, room)
            self._store(index, sub, complete, body[4 : 4 + size])
        else:
            size = int(struct.unpack_from("<I", body, 4)[0])
            if size > room:
                raise AbortError(Abort.LENGTH)
            part = body[_SDO_HEAD : _SDO_HEAD + size]
            if len(part) == size:
                self._store(index, sub, complete, part)
            else:
                self._transfer = _Download(index, sub, complete, size, bytearray(part))
        return struct.pack("<BHBI", 0x70 if complete else 0x60, index, sub, 0)

    def _download_segment(self, download: _Download, body: bytes) -> bytes:
        command = body[0]
        if command >> 4 & 1 != download.toggle:
            raise AbortError(Abort.TOGGLE)
        part = body[1:]
        if len(part) <= _SEGMENT_BYTES:
            part = part[: _SEGMENT_BYTES - (command >> 1 & 7)]
        download.content += part
        if len(download.content) > download.size:
            raise AbortError(Abort.LENGTH)
        if command & 1:
            if len(download.content) < download.size:
                raise AbortError(Abort.LENGTH)
            self._transfer = None
            self._store(download.index, download.sub, download.complete, bytes(download.content))
        reply = 0x20 | download.toggle << 4
        download.toggle = 1 - download.toggle
        return bytes([reply]) + bytes(_SEGMENT_BYTES)

    def _store(self, index: int, sub: int, complete: bool, value: bytes) -> None:
        if complete:
            self._values.write_all(index, sub, value)
        else:
            self._values.write(index, sub, value)
