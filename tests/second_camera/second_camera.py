"""A minimal second camera: exposures, objects, errors, commands (integrator/camera_objects.md).

Its sensor sees one spot that wanders. ``python -m tests.second_camera.second_camera INTERFACE``
puts it on a network interface.
"""

from __future__ import annotations

import binascii
import hashlib
import socket
import struct
import sys
import time
import zlib
from collections.abc import Callable

from tests.second_camera.second_controller import BOOT, INIT, OP, PREOP, SAFEOP, Controller
from tests.second_camera.second_firmware import Banks
from tests.second_camera.second_mailbox import Objects, Refused
from tests.second_camera.second_page import PAGE, eeprom, identity, things

_WIDTH, _HEIGHT = 1280, 1024
_BUFFER, _BLOCK, _FRAME = 1024, 12, 68
_INPUTS, _OUTPUTS, _INPUT_BYTES, _CRC_AT = 0x1800, 0x1400, 844, 24
_FLAG_LOST, _STATUS_LOST, _STATUS_DARK, _STATUS_NEWS = 2, 4, 8, 16
_MESSAGES = range(6, 22)
SECOND = 1_000_000_000


class SecondCamera:
    """One camera on the wire."""

    def __init__(self, serial: int, alias: int) -> None:
        page = PAGE.read_text(encoding="utf-8")
        _vendor, product, revision = identity(page)
        self.serial = serial
        self.objects = Objects(things(page))
        self.banks = Banks(product, revision)
        self.chip = Controller(eeprom(page, serial, alias), self)
        self._begin, self._period = 0, 0
        self._tail = self._lost = self._overruns = 0
        self._gap_at = -1
        self._cycle = self._config = 0
        self._dark = range(0)
        self._messages: dict[int, bytes] = {}
        self._newest = self._acknowledged = self._register = self._sent = self._events = 0
        self._blinks_until = 0
        self._work: tuple[int, Callable[[], None]] | None = None
        self._black_state = self._black = self._stored = 0
        self._picture, self._picture_state, self._shape = b"", 0, (0, 0)
        self.objects.frames_are_made = lambda: self.chip.state >= SAFEOP
        self._connect()

    # The wire

    def work_on(self, frame: bytearray, now: int) -> bool:
        """Work on a frame; say whether it goes back."""
        return self.chip.work_on(frame, now)

    def idle(self, now: int) -> None:
        """Let time pass."""
        self.chip.idle(now)
        if self._work is not None and now >= self._work[0]:
            then, self._work = self._work[1], None
            then()

    # Requests of the controller

    def mailbox(self, content: bytes) -> bytes | None:
        if content[5] & 15 == 4:
            (size,) = struct.unpack_from("<H", content)
            body = self.banks.answer(content[6 : 6 + size], self.chip.state == BOOT)
            return self.objects.box(4, body)
        return None if self.chip.state == BOOT else self.objects.answer(content)

    def entered(self, before: int, state: int) -> int:
        if state == INIT:
            self.objects.forget()
            self.banks.forget()
            if before == BOOT:
                self.banks.start()
        if state == PREOP:
            self.banks.confirm()
        if state < SAFEOP:
            self._period = 0
        elif not self._period:
            if self._contradicts():
                return 0x26
            self._config = binascii.crc_hqx(self._configuration(), 0xFFFF)
            if self.chip.sync0 is not None or state == OP:
                own = (self.chip.time, self._number(0x8000, 1))
                self._begin, self._period = self.chip.sync0 or own
                self._tail = self._lost = 0
                self._gap_at, self._dark = -1, range(0)
        if state == OP and self._register:
            self._report(0, 0)
        return 0

    def watchdog_event(self) -> None:
        self._events += 1
        self._report(0x8130, 0x11)

    def outputs(self) -> None:
        control, _leds, counter = struct.unpack_from("<HHI", self.chip.ram, _OUTPUTS)
        ahead = (counter + 1 - self._tail) & 0xFFFFFFFF
        if control & 1 and 0 < ahead <= _BLOCK and self._tail + ahead <= self._over():
            self._tail += ahead

    def inputs(self) -> None:
        over = self._over()
        if over - self._tail > _BUFFER:
            self._overruns += 1
            self._lost += over - _BUFFER - self._tail
            self._tail = self._gap_at = over - _BUFFER
        count = max(0, min(_BLOCK, over - self._tail))
        frames = b"".join(self._frame(self._tail + n) for n in range(count))
        dark = any(self._tail + n in self._dark for n in range(count))
        status = (
            (1 if self.chip.state == OP else 0) | (2 if self.chip.sync0 else 0)
            | (_STATUS_LOST if count and self._tail == self._gap_at else 0)
            | (_STATUS_DARK if dark else 0) | (_STATUS_NEWS if self._news() else 0)
        )  # fmt: skip
        self._cycle = self._cycle + 1 & 0xFFFF
        head = struct.pack(
            "<IQIBBHHHI", self._tail & 0xFFFFFFFF, self._begin + self._tail * self._period,
            self._period, count, status, self._cycle, self._config, 1, 0,
        )  # fmt: skip
        content = bytearray((head + frames).ljust(_INPUT_BYTES, b"\x00"))
        crc = zlib.crc32(content, zlib.crc32(struct.pack("<I", self.serial)))
        struct.pack_into("<I", content, _CRC_AT, crc)
        self.chip.ram[_INPUTS : _INPUTS + _INPUT_BYTES] = content

    # Exposures

    def _over(self) -> int:
        """Return the number of readable exposures: one period after their start."""
        if not self._period:
            return self._tail
        return max(0, (self.chip.time - self._begin) // self._period)

    def _frame(self, number: int) -> bytes:
        flags = _FLAG_LOST if number == self._gap_at else 0
        if number in self._dark:
            return struct.pack("<HH", 0, flags).ljust(_FRAME, b"\x00")
        x, y = 100 + number % 1000, 200 + number // 7 % 700
        return struct.pack("<HHii", 1, flags, x << 16, y << 16).ljust(_FRAME, b"\x00")

    def _number(self, index: int, sub: int) -> int:
        return int.from_bytes(self.objects.read(index, sub), "little")

    def _configuration(self) -> bytes:
        places = [(0x8000, sub) for sub in range(1, 6)] + [(0x8001, sub) for sub in range(1, 33)]
        return b"".join(self.objects.read(*place) for place in places)

    def _contradicts(self) -> bool:
        windows = struct.unpack("<32H", self._configuration()[-64:])
        off = any(
            windows[n] + windows[n + 2] > _WIDTH or windows[n + 1] + windows[n + 3] > _HEIGHT
            for n in range(0, 32, 4)
        )
        too_long = self._number(0x8000, 2) >= self._number(0x8000, 1)
        return off or too_long or (self._number(0x8000, 4) == 1 and not self._block())

    # Errors

    def _report(self, code: int, register: int) -> None:
        self._register = register
        self._sent += 1
        self._newest = 6 if not self._newest else 6 + (self._newest - 5) % len(_MESSAGES)
        self._messages[self._newest] = struct.pack(
            "<HHHHQHBH5x", 0xE800, code, 0x0202 if code else 0x0200, code, self.chip.time, 5,
            register, 0x1005,
        )  # fmt: skip
        if self._number(0x10F3, 5) & 1 and self.chip.state >= PREOP:
            body = struct.pack("<HB5x", code, register)
            self.chip.replies.append(self.objects.coe(1, body))
            self.chip.load()

    def _news(self) -> bool:
        return bool(self._newest) and self._newest != self._acknowledged

    def _acknowledge(self, value: bytes) -> None:
        if not value[0]:
            self._messages.clear()
            self._newest = self._acknowledged = 0
        elif value[0] in self._messages:
            self._acknowledged = value[0]
        else:
            raise Refused(0x06090030)

    # Commands

    def _block(self) -> bytes:
        return self.objects.things[0x8010].items[1].value

    def _check_block(self, value: bytes) -> None:
        good = len(value) == 100 and value[:8] == b"OCIN\x01\x00\x00\x00"
        good = good and struct.unpack_from("<I", value, 8)[0] == self.serial
        good = good and zlib.crc32(value[:-4]) == struct.unpack("<I", value[-4:])[0]
        if value and not good:
            raise Refused(0x06090030)

    def _check_mode(self, value: bytes) -> None:
        if value[0] == 1 and not self._block():
            raise Refused(0x08000024)

    def _black_command(self, value: bytes) -> None:
        command = value[0]
        if self._black_state == 1:
            raise Refused(0x08000021)
        if (command == 2 and not self._black) or (command == 3 and not self._stored):
            raise Refused(0x08000024)
        takes = 0
        if command == 1 and self._period:
            exposures = self._number(0x8020, 2)
            self._dark = range(self._over(), self._over() + exposures)
            takes = exposures * self._period
        self._black_state = 1
        self._work = (self.chip.now + takes, lambda: self._black_done(command))

    def _black_done(self, command: int) -> None:
        self._black_state = 2
        if command == 1:
            self._black += 1
        elif command == 2:
            self._stored = self._black
        elif command == 3:
            self._black = self._stored
        else:
            self._black = self._stored = 0

    def _black_images(self) -> int:
        same = self._black and self._black == self._stored
        return bool(self._black) | bool(self._stored) << 1 | bool(same) << 2

    def _take_picture(self, value: bytes) -> None:
        if value[0] == 2:
            self._picture, self._picture_state, self._shape = b"", 0, (0, 0)
            return
        left, top, width, height = (self._number(0x8030, sub) for sub in range(1, 5))
        if not width or not height:
            left, top, width, height = 0, 0, _WIDTH, _HEIGHT
        if left + width > _WIDTH or top + height > _HEIGHT:
            raise Refused(0x06090030)
        rows = (bytes(2 * ((left + x + y) % 120) for x in range(2 * width)) for y in range(height))
        self._picture, self._picture_state, self._shape = b"".join(rows), 2, (width, height)

    def _chunk(self) -> bytes:
        begin = self._number(0x8030, 9)
        if self._picture_state != 2 or begin >= len(self._picture):
            raise Refused(0x08000024)
        return self._picture[begin : begin + 4096]

    def _blink(self, value: bytes) -> None:
        self._blinks_until = self.chip.now + int.from_bytes(value, "little") * SECOND

    def _connect(self) -> None:
        """Connect the objects to their providers."""
        read, write = self.objects.reading, self.objects.writing

        def number(place: tuple[int, int], value: Callable[[], int]) -> None:
            size = self.objects.things[place[0]].items[place[1]].size
            read[place] = lambda: value().to_bytes(size, "little")

        number((0x1018, 4), lambda: self.serial)
        number((0x9000, 1), lambda: self.serial + 1)
        number((0x9000, 2), lambda: _WIDTH)
        number((0x9000, 3), lambda: _HEIGHT)
        number((0x10F8, 0), lambda: self.chip.time)
        read[0x100A, 0] = read[0x9010, 1] = lambda: self.banks.version.encode("ascii")
        for index in (0x1C32, 0x1C33):
            number((index, 1), lambda: 2 if self.chip.sync0 else 0)
        number((0x1001, 0), lambda: self._register)
        number((0x10F3, 2), lambda: self._newest)
        number((0x10F3, 3), lambda: self._acknowledged)
        number((0x10F3, 4), self._news)
        for place in _MESSAGES:
            read[0x10F3, place] = lambda place=place: self._messages.get(place, b"")  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
        write[0x10F3, 3] = self._acknowledge
        for sub, count in enumerate((
            lambda: self._lost, lambda: self._events, lambda: self._overruns,
            lambda: self.objects.bad, lambda: 0, lambda: self._sent,
        ), start=1):  # fmt: skip
            number((0xA000, sub), count)
        frames = [(0x6100 + 16 * n, _INPUTS + 28 + 68 * n) for n in range(12)]
        for index, at in [(0x6000, _INPUTS), (0x7000, _OUTPUTS), *frames]:
            for sub, item in self.objects.things[index].items.items():
                if sub:
                    read[index, sub] = lambda at=at, n=item.size: bytes(self.chip.ram[at : at + n])  # type: ignore[misc]  # mypy cannot infer a lambda with bound defaults
                    at += item.size
        number((0x8010, 2), lambda: len(self._block()))
        read[0x8010, 3] = lambda: _digest(self._block())
        number((0x8010, 4), lambda: zlib.crc32(self._block()))
        write[0x8010, 1] = self._check_block
        write[0x8000, 4] = self._check_mode
        number((0x8020, 3), lambda: self._black_state)
        number((0x8020, 4), lambda: 100 if self._black_state == 2 else 0)
        number((0x8020, 5), self._black_images)
        read[0x8020, 6] = lambda: _digest(bytes([self._black])) if self._black else b""
        write[0x8020, 1] = self._black_command
        write[0x8030, 5] = self._take_picture
        number((0x8030, 6), lambda: self._picture_state)
        number((0x8030, 8), lambda: len(self._picture))
        read[0x8030, 0x0A] = self._chunk
        number((0x8030, 0x0B), lambda: zlib.crc32(self._picture))
        number((0x8030, 0x0C), lambda: self._shape[0])
        number((0x8030, 0x0D), lambda: self._shape[1])
        write[0x8040, 1] = self._blink
        number((0x8040, 2), lambda: max(0, -((self.chip.now - self._blinks_until) // SECOND)))


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).digest() if content else b""


def main() -> None:
    """Answer on a network interface until standard input ends."""
    import select

    camera = SecondCamera(serial=int(sys.argv[2]), alias=21)
    wire = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x88A4))
    wire.bind((sys.argv[1], 0x88A4))
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while True:
        ready = select.select([wire, sys.stdin], [], [], 0.001)[0]
        if sys.stdin in ready:
            return
        if wire in ready:
            frame, address = wire.recvfrom(2048)
            if address[2] != socket.PACKET_OUTGOING:
                content = bytearray(frame)
                if camera.work_on(content, time.monotonic_ns()):
                    wire.send(content)
        camera.idle(time.monotonic_ns())


if __name__ == "__main__":
    main()
