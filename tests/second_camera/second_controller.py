"""A slave controller as ETG.1000.4 describes it: registers, datagrams, states, clock, EEPROM."""

from __future__ import annotations

import struct
from collections import deque
from typing import Protocol

INIT, PREOP, BOOT, SAFEOP, OP = 1, 2, 3, 4, 8
_NS_64 = (1 << 64) - 1
_AREAS = {0: (0x1000, 256), 1: (0x1100, 256), 2: (0x1400, 12), 3: (0x1800, 844)}
_WRITABLE = (
    range(0x0010, 0x0012), range(0x0120, 0x0122), range(0x0400, 0x0402), range(0x0420, 0x0422),
    range(0x0442, 0x0443), range(0x0500, 0x0510), range(0x0600, 0x0640), range(0x0800, 0x0820),
    range(0x0920, 0x092C), range(0x0980, 0x0982), range(0x0990, 0x0998), range(0x09A0, 0x09A8),
)  # fmt: skip


class Firmware(Protocol):
    """What sits behind the controller."""

    def mailbox(self, content: bytes) -> bytes | None: ...

    def entered(self, before: int, state: int) -> int: ...

    def outputs(self) -> None: ...

    def inputs(self) -> None: ...

    def watchdog_event(self) -> None: ...


class Controller:
    """One controller with its firmware."""

    def __init__(self, eeprom: bytearray, firmware: Firmware) -> None:
        self.ram = bytearray(0x2000)
        self.eeprom = eeprom
        self.now = 0
        self.replies: deque[bytes] = deque()
        self._firmware = firmware
        self._last = b""
        self._fed = 0
        self.ram[0:10] = struct.pack("<BBHBBBBH", 0x04, 0, 1, 4, 4, 8, 0x0F, 0x0C)
        self.ram[0x12:0x14] = eeprom[8:10]
        self.ram[0x140:0x142], self.ram[0x150:0x152] = eeprom[0:2], eeprom[2:4]
        self.ram[0x982:0x984] = eeprom[4:6]
        self.put(0x0400, "<H", 2498)
        self.put(0x0420, "<H", 1000)
        self.put(0x0440, "<H", 1)
        self.put(0x0502, "<H", 0x40)
        self.put(0x0130, "<H", INIT)

    def put(self, at: int, form: str, value: int) -> None:
        struct.pack_into(form, self.ram, at, value)

    def take(self, at: int, form: str) -> int:
        return int(struct.unpack_from(form, self.ram, at)[0])

    @property
    def state(self) -> int:
        return self.ram[0x130] & 0x0F

    @property
    def time(self) -> int:
        return self.now + self.take(0x0920, "<q") + self.take(0x0928, "<I")

    @property
    def sync0(self) -> tuple[int, int] | None:
        """Return start and period of SYNC0 while it is active."""
        if self.ram[0x0981] & 3 != 3:
            return None
        return self.take(0x0990, "<Q"), self.take(0x09A0, "<I")

    # Frames

    def work_on(self, frame: bytearray, now: int) -> bool:
        """Work on an Ethernet frame; say whether it was an EtherCAT frame."""
        if frame[12:14] != b"\x88\xa4":
            return False
        self.now, at, more = now, 16, True
        while more and at + 12 <= len(frame):
            command, address, register, flags = struct.unpack_from("<BxHHH", frame, at)
            size, more = flags & 0x7FF, bool(flags & 0x8000)
            data = bytearray(frame[at + 10 : at + 10 + size])
            count, address = self._datagram(command, address, register, data)
            frame[at + 10 : at + 10 + size] = data
            struct.pack_into("<H", frame, at + 2, address)
            counter = struct.unpack_from("<H", frame, at + 10 + size)[0] + count
            struct.pack_into("<H", frame, at + 10 + size, counter)
            at += size + 12
        frame[6] |= 2
        return True

    def _datagram(
        self, command: int, address: int, register: int, data: bytearray
    ) -> tuple[int, int]:
        if command in (10, 11, 12):
            return self._logical(command, register << 16 | address, data), address
        by_place, broadcast = command in (1, 2, 3, 13), command in (7, 8, 9)
        mine = broadcast or (address == 0 if by_place else address == self.take(0x10, "<H"))
        address = address + 1 & 0xFFFF if by_place or broadcast else address
        if command in (13, 14):
            reads, writes = mine, not mine
        elif not mine or command == 0:
            return 0, address
        else:
            reads, writes = command not in (2, 5, 8), command not in (1, 4, 7)
        count, sent = 0, bytes(data)
        if reads:
            found = self._read(register, len(data))
            if found is not None:
                data[:] = (
                    bytes(a | b for a, b in zip(data, found, strict=True)) if broadcast else found
                )
                count += 1
        if writes and self._write(register, sent):
            count += 2 if reads else 1
        return count, address

    def _logical(self, command: int, logical: int, data: bytearray) -> int:
        count = 0
        for number in range(4):
            begin, size, _a, _b, physical, _c, kind, active = struct.unpack_from(
                "<IHBBHBBB", self.ram, 0x600 + 16 * number
            )
            low, high = max(begin, logical), min(begin + size, logical + len(data))
            if not active or low >= high or self.state < SAFEOP:
                continue
            place = physical + low - begin
            if kind == 2 and command != 10 and self._active(2):
                self.ram[place : place + high - low] = data[low - logical : high - logical]
                self._fed = self.now
                self._firmware.outputs()
                count += 2 if command == 12 else 1
            elif kind == 1 and command != 11 and self._active(3):
                self._firmware.inputs()
                data[low - logical : high - logical] = self.ram[place : place + high - low]
                count += 1
        return count

    def _read(self, at: int, size: int) -> bytes | None:
        if at <= 0x0910 < at + size:
            self.put(0x0910, "<Q", self.time & _NS_64)
        if self._active(1) and 0x1100 <= at < 0x1200:
            if at != 0x1100 or not self.ram[0x80D] & 8:
                return None
            found = bytes(self.ram[at : at + size])
            if size >= 256:
                self.ram[0x80D] &= ~8
                self.load()
            return found
        return bytes(self.ram[at : at + size])

    def _write(self, at: int, data: bytes) -> bool:
        if at >= 0x1000:
            return self._write_mailbox(at, data)
        for number, byte in enumerate(data):
            if any(at + number in each for each in _WRITABLE) and at + number not in (0x80D, 0x80F):
                self.ram[at + number] = byte
        end = at + len(data)
        if at <= 0x0120 < end:
            self._request(self.ram[0x120])
        if at <= 0x0502 < end:
            self._eeprom_command()
        if at == 0x0910:
            difference = (self.time - int.from_bytes(data[:4], "little")) & 0xFFFFFFFF
            behind = bool(difference >> 31)
            amount = (1 << 32) - difference if behind else difference
            self.put(0x092C, "<I", amount | (1 << 31 if behind else 0))
        if at <= 0x080E < end and (self.ram[0x80E] ^ self.ram[0x80F]) & 2:
            self.ram[0x80F] ^= 2
            self.ram[0x80D] &= ~8
            if self._last:
                self.replies.appendleft(self._last)
            self.load()
        return True

    def _write_mailbox(self, at: int, data: bytes) -> bool:
        if at != 0x1000 or not self._active(0) or self.state == INIT or len(data) != 256:
            return False
        reply = self._firmware.mailbox(data)
        if reply is not None:
            self.replies.append(reply)
        self.load()
        return True

    def load(self) -> None:
        """Put the next mailbox into the buffer that the master reads."""
        if self.replies and not self.ram[0x80D] & 8:
            self._last = self.replies.popleft().ljust(256, b"\x00")
            self.ram[0x1100:0x1200] = self._last
            self.ram[0x80D] |= 8

    def _active(self, number: int) -> bool:
        return bool(self.ram[0x806 + 8 * number] & 1)

    def _fits(self, number: int) -> bool:
        found = struct.unpack_from("<HH", self.ram, 0x800 + 8 * number)
        return self._active(number) and found == _AREAS[number]

    def _eeprom_command(self) -> None:
        command, at = self.take(0x502, "<H"), 2 * self.take(0x504, "<I")
        if command & 0x700 == 0x100:
            self.ram[0x508:0x510] = bytes(self.eeprom[at : at + 8]).ljust(8, b"\xff")
        elif command & 0x700 == 0x200 and command & 1:
            self.eeprom[at : at + 2] = self.ram[0x508:0x50A]
        self.put(0x502, "<H", 0x40)

    # States

    def _request(self, asked: int) -> None:
        wanted, acknowledged = asked & 0x0F, bool(asked & 0x10)
        if self.ram[0x130] & 0x10 and not acknowledged and wanted >= self.state:
            return
        code = self._why_not(wanted)
        if not code:
            self.put(0x134, "<H", 0)
            self.enter(wanted)
        else:
            self.ram[0x130] |= 0x10
            self.put(0x134, "<H", code)

    def _why_not(self, wanted: int) -> int:
        now = self.state
        boxes = self._fits(0) and self._fits(1)
        if wanted not in (INIT, PREOP, BOOT, SAFEOP, OP):
            return 0x12
        if wanted == BOOT or now == BOOT:
            if (now, wanted) in ((BOOT, BOOT), (BOOT, INIT)):
                return 0
            return 0x11 if now != INIT else 0 if boxes else 0x15
        if wanted <= now:
            return 0
        if (now, wanted) == (INIT, PREOP):
            return 0 if boxes else 0x16
        if (now, wanted) == (PREOP, SAFEOP):
            too_fast = self.sync0 is not None and self.sync0[1] < 50_000
            return 0x1D if not self._fits(2) else 0x1E if not self._fits(3) else 0x30 * too_fast
        return 0 if (now, wanted) == (SAFEOP, OP) else 0x11

    def enter(self, state: int, code: int = 0) -> None:
        """Go to a state; with a code by the firmware's own decision."""
        before = self.state
        if state == INIT:
            self.replies.clear()
            self.ram[0x80D] &= ~8
        if state == OP:
            self._fed = self.now
            self.put(0x0440, "<H", 1)
        self.ram[0x130] = state | (0x10 if code else 0)
        if code:
            self.put(0x134, "<H", code)
        refused = self._firmware.entered(before, state)
        if refused:
            self.enter(PREOP, refused)

    def idle(self, now: int) -> None:
        """Watch the watchdog."""
        self.now = now
        limit = (self.take(0x400, "<H") + 2) * 40 * self.take(0x420, "<H")
        if self.state == OP and limit and now - self._fed > limit:
            self.put(0x0440, "<H", 0)
            self.ram[0x442] = min(255, self.ram[0x442] + 1)
            self.enter(SAFEOP, 0x1B)
            self._firmware.watchdog_event()
