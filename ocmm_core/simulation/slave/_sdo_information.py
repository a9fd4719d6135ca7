"""What the camera tells about its object dictionary (SDO information, ETG.1000.6, 5.6.3)."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from ocmm_core.fieldbus.device import DictionaryObject, ObjectEntry
from ocmm_core.simulation.slave._sdo_abort import Abort

_LIST, _OBJECT, _ENTRY, _ERROR = 1, 3, 5, 7
_VARIABLE, _RECORD = 7, 9
_LIST_COUNTS, _LIST_ALL, _LIST_OUTPUTS, _LIST_INPUTS, _LIST_BACKUP, _LIST_SETTINGS = range(6)
_READ_ALWAYS, _WRITE_PREOP, _WRITE_ALWAYS = 0x07, 0x08, 0x38
_MAPPED_OUTPUT, _MAPPED_INPUT, _SETTING = 0x40, 0x80, 0x0200
_NO_TYPE = 0
_OUTPUTS = range(0x7000, 0x8000)


def object_information(objects: Mapping[int, DictionaryObject], request: bytes, room: int) -> bytes:
    """Return the answer to a request of at least 4 bytes; ``room`` is what a mailbox takes."""
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
            # A gap inside a record is no error, or a list of everything would be full of them.
            answer = struct.pack("<HBBHHH", index, sub, 0, _NO_TYPE, 0, 0)
        if entry is not None:
            access = entry_access(index, entry)
            # No additional values (unit, default, limits) follow.
            head = struct.pack("<HBBHHH", index, sub, 0, entry.kind, entry.bits, access)
            answer = head + entry.name.encode("ascii")
    if answer is None:
        known = operation in (_LIST, _OBJECT, _ENTRY)
        return _refusal(Abort.NO_OBJECT if known else Abort.COMMAND)
    if len(answer) + 4 > room:
        return _refusal(Abort.TOO_LONG_FOR_MAILBOX)
    return struct.pack("<BBH", operation + 1, 0, 0) + answer


def entry_access(index: int, entry: ObjectEntry) -> int:
    """Return the access word of an entry."""
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
