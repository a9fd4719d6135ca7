"""CoE as ETG.1000.6 and the page describe it: objects, segments, refusals, information."""

from __future__ import annotations

import struct
from collections.abc import Callable

from tests.second_camera.second_page import CODES, Item, Thing

Place = tuple[int, int]


class Refused(Exception):  # noqa: N818 - the name used on the page
    """An SDO request is refused with a code."""

    def __init__(self, code: int) -> None:
        super().__init__(hex(code))
        self.code = code


class Objects:
    """The objects, the values computed on reading, and the effects of writing."""

    def __init__(self, things: dict[int, Thing]) -> None:
        self.things = things
        self.reading: dict[Place, Callable[[], bytes]] = {}
        self.writing: dict[Place, Callable[[bytes], object]] = {}
        self.frames_are_made: Callable[[], bool] = lambda: False
        self.bad = 0
        self._counter = 0
        self._out: tuple[Place, bytes, int] | None = None
        self._in: tuple[Place, bool, int, bytes, int] | None = None

    def forget(self) -> None:
        self._out = self._in = None

    def answer(self, content: bytes) -> bytes | None:
        size, _address, _channel, kind = struct.unpack_from("<HHBB", content)
        if kind & 15 != 3:
            return self._bad(2)
        if size > len(content) - 6:
            return self._bad(8)
        if size < 3:
            return self._bad(6)
        body = content[6 : 6 + size]
        service = body[1] >> 4
        if service == 2:
            return self._sdo(body[2:])
        if service == 8:
            return self._bad(6) if size < 6 else self.coe(8, self._information(body[2:]))
        return self._bad(4)

    def coe(self, service: int, body: bytes) -> bytes:
        return self.box(3, struct.pack("<H", service << 12) + body)

    def box(self, protocol: int, body: bytes) -> bytes:
        self._counter = self._counter % 7 + 1
        return struct.pack("<HHBB", len(body), 0, 0, self._counter << 4 | protocol) + body

    def _bad(self, detail: int) -> bytes:
        self.bad += 1
        return self.box(0, struct.pack("<HH", 1, detail))

    # Values

    def read(self, index: int, sub: int) -> bytes:
        item = self._item(index, sub)
        return self.reading.get((index, sub), lambda: item.value)()

    def write(self, index: int, sub: int, value: bytes, *, check_only: bool = False) -> None:
        item = self._item(index, sub)
        self._may_write(item)
        if len(value) > item.size or (not item.variable and len(value) != item.size):
            raise Refused(0x06070010)
        if item.whole_number:
            number = int.from_bytes(value, "little")
            if item.high is not None and number > item.high:
                raise Refused(0x06090031)
            if item.low is not None and number < item.low:
                raise Refused(0x06090032)
        if check_only:
            return
        then = self.writing.get((index, sub))
        if then is not None:
            then(value)
        item.value = value

    def _item(self, index: int, sub: int) -> Item:
        if index not in self.things:
            raise Refused(0x06020000)
        if sub not in self.things[index].items:
            raise Refused(0x06090011)
        return self.things[index].items[sub]

    def _may_write(self, item: Item) -> None:
        if item.access == "ro":
            raise Refused(0x06010002)
        if item.access == "rw in PREOP" and self.frames_are_made():
            raise Refused(0x08000022)

    def _whole(self, index: int, first: int) -> list[int]:
        self._item(index, 0)
        thing = self.things[index]
        if not thing.record or not all(item.whole_number for item in thing.items.values()):
            raise Refused(0x06010004)
        return [sub for sub in sorted(thing.items) if sub >= first]

    def _read_whole(self, index: int, first: int) -> bytes:
        parts = [(sub, self.read(index, sub)) for sub in self._whole(index, first)]
        return b"".join(value if sub else value + b"\x00" for sub, value in parts)

    def _write_whole(self, index: int, first: int, content: bytes) -> None:
        parts, at = [], 0
        for sub in self._whole(index, first):
            size = self._item(index, sub).size if sub else 2
            if sub:
                parts.append((sub, content[at : at + size]))
            at += size
        if at != len(content):
            raise Refused(0x06070010)
        for sub, value in parts:
            self.write(index, sub, value, check_only=True)
        for sub, value in parts:
            self.write(index, sub, value)

    # Transfers

    def _sdo(self, body: bytes) -> bytes | None:
        if body[0] == 0x80:
            self.forget()
            return None
        if len(body) < 8:
            return self._bad(6)
        command, index, sub = struct.unpack_from("<BHB", body)
        try:
            return self.coe(3, self._transfer(command, index, sub, body))
        except Refused as refused:
            self.forget()
            return self.coe(2, struct.pack("<BHBI", 0x80, index, sub, refused.code))

    def _transfer(self, command: int, index: int, sub: int, body: bytes) -> bytes:
        kind, whole = command >> 5, bool(command & 0x10)
        if kind == 2:
            self.forget()
            value = self._read_whole(index, sub) if whole else self.read(index, sub)
            head = 0x40 | command & 0x10
            if 1 <= len(value) <= 4:
                short = head | 3 | (4 - len(value)) << 2
                return struct.pack("<BHB", short, index, sub) + value.ljust(4, b"\x00")
            if len(value) > 240:
                self._out = ((index, sub), value[240:], 0)
            return struct.pack("<BHBI", head | 1, index, sub, len(value)) + value[:240]
        if kind == 1:
            self.forget()
            return self._begin(command, (index, sub), whole, body)
        if kind == 3 and self._out is not None:
            place, rest, toggle = self._out
            if command >> 4 & 1 != toggle:
                raise Refused(0x05030000)
            part, rest = rest[:247], rest[247:]
            self._out = (place, rest, 1 - toggle) if rest else None
            head = toggle << 4 | max(0, 7 - len(part)) << 1 | (0 if rest else 1)
            return bytes([head]) + part.ljust(7, b"\x00")
        if kind == 0 and self._in is not None:
            return self._go_on(command, body[1:])
        raise Refused(0x05040001)

    def _begin(self, command: int, place: Place, whole: bool, body: bytes) -> bytes:
        for sub in self._whole(*place) if whole else [place[1]]:
            if not whole or sub:
                self._may_write(self._item(place[0], sub))
        if command & 2:
            self._keep(place, whole, body[4 : 8 - (command >> 2 & 3)])
        else:
            (size,) = struct.unpack_from("<I", body, 4)
            if not whole and size > self._item(*place).size:
                raise Refused(0x06070010)
            first = body[8 : 8 + size]
            if len(first) == size:
                self._keep(place, whole, first)
            else:
                self._in = (place, whole, size, first, 0)
        return struct.pack("<BHBI", 0x60 | command & 0x10, *place, 0)

    def _go_on(self, command: int, part: bytes) -> bytes:
        assert self._in is not None
        place, whole, size, content, toggle = self._in
        if command >> 4 & 1 != toggle:
            raise Refused(0x05030000)
        content += part[: 7 - (command >> 1 & 7)] if len(part) <= 7 else part
        self._in = (place, whole, size, content, 1 - toggle)
        if command & 1 or len(content) > size:
            self._in = None
            if len(content) != size:
                raise Refused(0x06070010)
            self._keep(place, whole, content)
        return bytes([0x20 | toggle << 4]) + bytes(7)

    def _keep(self, place: Place, whole: bool, value: bytes) -> None:
        if whole:
            self._write_whole(*place, value)
        else:
            self.write(*place, value)

    # Information

    def _information(self, body: bytes) -> bytes:
        kind, content = body[0], body[4:]
        index = int(struct.unpack_from("<H", content)[0])
        if kind == 1:
            found = sorted(self.things) if index == 1 else []
            return struct.pack(f"<BBHH{len(found)}H", 2, 0, 0, index, *found)
        thing = self.things.get(index)
        if kind == 3 and thing is not None:
            shape = 9 if thing.record else 7
            return struct.pack("<BBHHHBB", 4, 0, 0, index, 0, max(thing.items), shape) + (
                thing.name.encode()
            )
        if kind == 5 and thing is not None and content[2] in thing.items:
            item = thing.items[content[2]]
            access = {"ro": 0x07, "rw": 0x3F, "rw in PREOP": 0x0F}[item.access]
            bits = 1 if item.kind == "BOOL" else 8 * item.size
            head = struct.pack(
                "<BBHHBBHHH", 6, 0, 0, index, content[2], 0, CODES[item.kind], bits, access
            )
            return head + item.name.encode()
        return struct.pack("<BBHI", 7, 0, 0, 0x06020000)
