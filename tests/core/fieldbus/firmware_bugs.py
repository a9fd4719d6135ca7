"""Bugs that firmware could have, planted into the software camera: each must be found by its rule.

A bug reaches into the camera as no other code may, for that is what a bug does. Each names the rule
that must find it; there is none that the good camera breaks.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace

from ocmm_core.fieldbus.device import (
    DATA_CRC,
    DATA_CRC_AT,
    FRAME_DTYPE,
    HEADER_STRUCT,
    INPUT_DTYPE,
    INPUT_START,
    NEWEST_LAYOUT,
    Header,
    Intrinsics,
)
from ocmm_core.fieldbus.device._intrinsics import _CRC as BLOCK_CRC
from ocmm_core.simulation.firmware._banks import Firmware
from ocmm_core.simulation.slave import SoftwareCamera, checksum_of_configuration
from ocmm_core.simulation.slave import registers as reg
from ocmm_core.simulation.slave._sdo_abort import Abort, AbortError

# ruff: noqa: SLF001 - see the module
Plant = Callable[[SoftwareCamera], object]
_FRAME = FRAME_DTYPE.itemsize
_HEAD = INPUT_START + HEADER_STRUCT.size
BUGS: list[Bug] = []


@dataclass(frozen=True, slots=True)
class Bug:
    """One bug: what it is, which rule must find it, and how it gets into a camera."""

    name: str
    rule: str
    plant: Plant


def _bug(rule: str, name: str) -> Callable[[Plant], Plant]:
    def keep(plant: Plant) -> Plant:
        BUGS.append(Bug(name, rule, plant))
        return plant

    return keep


def _add(rule: str, name: str, plant: Plant) -> None:
    BUGS.append(Bug(name, rule, plant))


# Tools of the trade


def _eeprom(at: int, content: bytes, *, seal: bool = False) -> Plant:
    def plant(camera: SoftwareCamera) -> None:
        camera.esc._sii[at : at + len(content)] = content
        if seal:
            camera.esc._sii[14] = checksum_of_configuration(bytes(camera.esc._sii[:14]))

    return plant


def _entry(index: int, sub: int, **changes: object) -> Plant:
    def plant(camera: SoftwareCamera) -> None:
        objects = camera.coe._objects
        item = objects[index]
        changed = replace(item.entries[sub], **changes)  # type: ignore[arg-type]  # any field
        objects[index] = replace(item, entries={**item.entries, sub: changed})  # type: ignore[index]  # a dict it is
        if "value" in changes:
            camera.coe._values._values[index, sub] = changed.value

    return plant


def _live(index: int, sub: int, value: Callable[[bytes], bytes]) -> Plant:
    """Let an entry that is worked out when it is read say something else."""

    def plant(camera: SoftwareCamera) -> None:
        before = camera.coe._values._live[index, sub]
        camera.coe._values._live[index, sub] = lambda: value(before())  # type: ignore[index]  # a dict it is

    return plant


def _header(change: Callable[[Header], Header]) -> Plant:
    """Change the header of every input, and let its check sum fit."""

    def plant(camera: SoftwareCamera) -> None:
        begin = camera._crc_begin

        def spoil(memory: bytearray) -> None:
            end = INPUT_START + INPUT_DTYPE.itemsize
            header = change(NEWEST_LAYOUT.decode(bytes(memory[INPUT_START:end])))
            memory[INPUT_START:_HEAD] = NEWEST_LAYOUT.encode(header._replace(data_crc=0))
            crc = zlib.crc32(memory[INPUT_START:end], begin)
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, crc)

        camera.esc.spoil = spoil

    return plant


def _frames(change: Callable[[bytearray], object]) -> Plant:
    """Change the frames of every input, and let its check sum fit."""

    def plant(camera: SoftwareCamera) -> None:
        begin = camera._crc_begin

        def spoil(memory: bytearray) -> None:
            end = INPUT_START + INPUT_DTYPE.itemsize
            frames = memory[_HEAD:end]
            change(frames)
            memory[_HEAD:end] = frames
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, 0)
            crc = zlib.crc32(memory[INPUT_START:end], begin)
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, crc)

        camera.esc.spoil = spoil

    return plant


def _crc(work_out: Callable[[bytes, int], int]) -> Plant:
    def plant(camera: SoftwareCamera) -> None:
        def spoil(memory: bytearray) -> None:
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, 0)
            content = bytes(memory[INPUT_START : INPUT_START + INPUT_DTYPE.itemsize])
            crc = work_out(content, camera._crc_begin)
            DATA_CRC.pack_into(memory, INPUT_START + DATA_CRC_AT, crc)

        camera.esc.spoil = spoil

    return plant


def _refusal(change: Callable[[int, int, int], int]) -> Plant:
    """Change what the controller says to a request: of the code, the state and the request."""

    def plant(camera: SoftwareCamera) -> None:
        before = camera.esc._refusal

        def refuse(current: int, request: int) -> int:
            return change(before(current, request), current, request)

        camera.esc._refusal = refuse  # type: ignore[method-assign]  # a bug

    return plant


def _aborting(change: Callable[[Abort], Abort | None]) -> Plant:
    """Change how writing is refused; None lets it pass without doing anything."""

    def plant(camera: SoftwareCamera) -> None:
        values = camera.coe._values
        before = values.write

        def write(index: int, sub: int, value: bytes) -> None:
            try:
                before(index, sub, value)
            except AbortError as abort:
                other = change(abort.reason)
                if other is not None:
                    raise AbortError(other) from abort

        values.write = write  # type: ignore[method-assign]  # a bug

    return plant


def _answers(change: Callable[[SoftwareCamera, bytes, bytes | None], bytes | None]) -> Plant:
    """Change the mailbox that answers a mailbox."""

    def plant(camera: SoftwareCamera) -> None:
        before = camera.answer
        camera.answer = lambda asked: change(camera, asked, before(asked))  # type: ignore[method-assign]  # a bug

    return plant


def _late(seconds: float, when: Callable[[bytes], bool]) -> Plant:
    """Answer some mailboxes late."""

    def plant(camera: SoftwareCamera) -> None:
        before, poll = camera.answer, camera.esc.poll
        waiting: list[tuple[int, bytes]] = []

        def answer(asked: bytes) -> bytes | None:
            found = before(asked)
            if found is not None and when(asked):
                waiting.append((camera.esc.now_ns + round(seconds * 1e9), found))
                return None
            return found

        def polled(now_ns: int) -> None:
            poll(now_ns)
            while waiting and waiting[0][0] <= now_ns:
                camera.esc._replies.append(waiting.pop(0)[1])
                camera.esc._load_reply()

        camera.answer, camera.esc.poll = answer, polled  # type: ignore[method-assign]  # a bug

    return plant


def _set(path: str, value: object) -> Plant:
    """Replace an attribute of the camera or of a part of it."""

    def plant(camera: SoftwareCamera) -> None:
        *way, last = path.split(".")
        owner: object = camera
        for step in way:
            owner = getattr(owner, step)
        setattr(owner, last, value)

    return plant


# EEPROM

_add("eeprom.configuration", "check sum of the EEPROM is wrong", _eeprom(14, b"\x00"))
_add(
    "eeprom.configuration",
    "SYNC0 is an input (0500 0000)",
    _eeprom(0, bytes.fromhex("05000000"), seal=True),
)
_add(
    "eeprom.configuration",
    "station alias is not loaded",
    lambda camera: camera.esc.memory.__setitem__(slice(0x12, 0x14), b"\x00\x00"),
)
_add("eeprom.configuration", "pulse has no length", _eeprom(4, b"\x00\x00", seal=True))
_add("eeprom.identity", "no serial number in the EEPROM", _eeprom(28, bytes(4)))
_add("eeprom.identity", "revision of the EEPROM is old", _eeprom(24, bytes.fromhex("00000200")))
_add("eeprom.identity", "vendor is another", _eeprom(16, b"\x02"))
_add("eeprom.mailboxes", "no mailboxes for BOOT", _eeprom(40, bytes(8)))
_add("eeprom.mailboxes", "FoE is not among the protocols", _eeprom(56, b"\x04\x00"))
_add("eeprom.mailboxes", "size of the EEPROM in bytes", _eeprom(0x7C, b"\x00\x10"))


@_bug("eeprom.categories", "ports stand two bytes early")
def _ports(camera: SoftwareCamera) -> None:
    at = camera.esc._sii.index(struct.pack("<HH", 30, 16)) + 4
    camera.esc._sii[at + 14 : at + 18] = b"\x11\x00\x00\x00"


@_bug("eeprom.categories", "inputs are buffered as a mailbox")
def _manager(camera: SoftwareCamera) -> None:
    at = camera.esc._sii.index(struct.pack("<HH", 41, 16)) + 4
    camera.esc._sii[at + 3 * 8 + 4] = 0x22


@_bug("eeprom.categories", "a PDO entry is a byte too short")
def _pdo_bits(camera: SoftwareCamera) -> None:
    at = camera.esc._sii.index(struct.pack("<HBB", 0x6000, 3, 0)[:3])
    camera.esc._sii[at + 5] = 24


_add(
    "eeprom.alias",
    "EEPROM cannot be written",
    lambda camera: setattr(camera.esc, "_sii", _Stubborn(camera.esc._sii)),
)


class _Stubborn(bytearray):
    """Memory that keeps what it has."""

    def __setitem__(self, _place: object, _value: object) -> None:
        """Keep nothing."""


_add("controller.registers", "one FMMU only", lambda camera: camera.esc.memory.__setitem__(4, 1))
_add(
    "controller.registers",
    "clock of 32 bits",
    lambda camera: camera.esc.memory.__setitem__(8, 0x04),
)
_add(
    "controller.registers",
    "watchdog of 10 ms at power-on",
    lambda camera: camera.esc._set(reg.WATCHDOG_SM_TIME, "<H", 100),
)

# States

_add(
    "state.forbidden",
    "INIT to SAFEOP is allowed",
    _refusal(lambda code, now, to: 0 if (now, to) == (1, 4) else code),
)
_add(
    "state.forbidden",
    "a forbidden change has no code of its own",
    _refusal(lambda code, _now, _to: 0x0001 if code == 0x0011 else code),
)
_add(
    "state.forbidden",
    "an unknown state is taken for an invalid change",
    _refusal(lambda code, _now, _to: 0x0011 if code == 0x0012 else code),
)
_add(
    "state.sync_managers",
    "mailboxes are not looked at",
    _refusal(lambda code, _now, _to: 0 if code == 0x0016 else code),
)
_add(
    "state.sync_managers",
    "outputs are not looked at",
    _refusal(lambda code, _now, _to: 0 if code == 0x001D else code),
)
_add(
    "state.sync_managers",
    "wrong inputs are told as wrong outputs",
    _refusal(lambda code, _now, _to: 0x001D if code == 0x001E else code),
)
_add(
    "state.clock",
    "any SYNC0 is taken",
    _refusal(lambda code, _now, _to: 0 if code == 0x0030 else code),
)
_add(
    "state.boot",
    "PREOP after BOOT",
    _refusal(lambda code, now, to: 0 if (now, to) == (3, 2) else code),
)
_add(
    "state.boot",
    "BOOT without mailboxes",
    _refusal(lambda code, _now, _to: 0 if code == 0x0015 else code),
)
_add("state.boot", "no BOOT at all", lambda camera: setattr(camera.esc, "can_boot", False))
_add(
    "state.boot",
    "CoE in BOOT",
    _answers(lambda camera, asked, found: camera.coe.answer(asked) if found is None else found),
)
_add(
    "state.forbidden",
    "BOOT from PREOP",
    _refusal(lambda code, now, to: 0 if (now, to) == (2, 3) else code),
)


@_bug("state.acknowledge", "an error needs no acknowledgement")
def _no_acknowledgement(camera: SoftwareCamera) -> None:
    before = camera.esc._al_control

    def control() -> None:
        camera.esc.memory[reg.AL_CONTROL] |= reg.ERROR
        before()

    camera.esc._al_control = control  # type: ignore[method-assign]  # a bug


@_bug("state.acknowledge", "the AL status code stays")
def _code_stays(camera: SoftwareCamera) -> None:
    before = camera.esc._al_control

    def control() -> None:
        code = camera.esc._get(reg.AL_STATUS_CODE, "<H")
        before()
        if not camera.esc._get(reg.AL_STATUS_CODE, "<H"):
            camera.esc._set(reg.AL_STATUS_CODE, "<H", code)

    camera.esc._al_control = control  # type: ignore[method-assign]  # a bug


@_bug("state.forbidden", "a refusal does not set the error bit")
def _no_error_bit(camera: SoftwareCamera) -> None:
    before = camera.esc._al_control

    def control() -> None:
        before()
        camera.esc.memory[reg.AL_STATUS] &= ~reg.ERROR

    camera.esc._al_control = control  # type: ignore[method-assign]  # a bug


@_bug("state.allowed", "SAFEOP takes 1.2 s")
def _slow_state(camera: SoftwareCamera) -> None:
    before, poll = camera.esc._al_control, camera.esc.poll
    due: list[int] = []

    def control() -> None:
        if camera.esc.memory[reg.AL_CONTROL] & 0x0F == reg.SAFEOP:
            due.append(camera.esc.now_ns + 1_200_000_000)
        else:
            before()

    def polled(now_ns: int) -> None:
        poll(now_ns)
        while due and due[0] <= now_ns:
            due.clear()
            before()

    camera.esc._al_control, camera.esc.poll = control, polled  # type: ignore[method-assign]  # a bug


@_bug("state.configuration", "an exposure longer than the period is started")
def _any_exposure(camera: SoftwareCamera) -> None:
    camera._config = lambda: type(camera)._config.__get__(_Short(camera))()  # type: ignore[method-assign]  # a bug


class _Short:
    """A camera whose exposure reads as 1 ns."""

    def __init__(self, camera: SoftwareCamera) -> None:
        self._camera = camera

    @property
    def coe(self) -> _Short:
        """Return itself."""
        return self

    def value(self, index: int, sub: int) -> bytes:
        """Return a value."""
        if (index, sub) == (0x8000, 2):
            return b"\x01\x00\x00\x00"
        return self._camera.coe.value(index, sub)


@_bug("state.configuration", "a contradiction has the code of missing outputs")
def _other_code(camera: SoftwareCamera) -> None:
    before = camera.esc.fall_back
    camera.esc.fall_back = lambda state, code: before(state, 0x1D if code == 0x26 else code)  # type: ignore[method-assign]  # a bug


# Objects

_add(
    "object.read", "an entry is missing", lambda camera: camera.coe._objects[0x8030].entries.pop(9)
)  # type: ignore[attr-defined]  # a dict it is
_add("object.read", "an entry has four bytes instead of two", _entry(0x9000, 8, value=bytes(4)))
_add("object.read", "a fixed number is another", _entry(0x9000, 6, value=b"\x10\x27\x00\x00"))
_add(
    "object.read",
    "a mapping names another entry",
    _entry(0x1A00, 3, value=bytes.fromhex("20040060")),
)
_add("object.read", "the number of entries is wrong", _entry(0x8001, 0, value=b"\x1f"))
_add(
    "object.identity",
    "serial number of the objects is another",
    _entry(0x1018, 4, value=b"\x07\x00\x00\x00"),
)
_add("object.identity", "two versions of the firmware", _entry(0x9010, 1, value=b"2.9.9"))
_add("object.read_only", "the width of the sensor can be written", _entry(0x9000, 2, writable=True))
_add(
    "object.read_only",
    "read only is told as unknown",
    lambda camera: _abort_code(camera, Abort.READ_ONLY, Abort.NO_OBJECT),
)
_add(
    "object.absent",
    "what is not there has another code",
    lambda camera: _abort_code(camera, Abort.NO_OBJECT, Abort.NO_ENTRY),
)
_add("object.limits", "too high is taken", _entry(0x8000, 3, high=None))
_add("object.limits", "too low is taken", _entry(0x8000, 1, low=None))
_add("object.limits", "the limit itself is refused", _entry(0x8040, 1, high=599))
_add(
    "object.limits",
    "too high and too low are the same",
    _aborting(lambda why: Abort.VALUE if why in (Abort.TOO_HIGH, Abort.TOO_LOW) else why),
)
_add("object.limits", "a value is taken and not kept", lambda camera: _forgets(camera, (0x8001, 7)))
_add("object.lengths", "a note is longer than it may be", _entry(0x8010, 5, max_bytes=1300))
_add(
    "object.lengths",
    "a wrong length is a wrong value",
    lambda camera: _abort_code(camera, Abort.LENGTH, Abort.VALUE),
)
_add("object.preop", "exposure can be written in operation", _entry(0x8000, 2, preop_only=False))
_add("object.preop", "windows can be written in operation", _entry(0x8001, 9, preop_only=False))
_add(
    "object.config_crc",
    "check sum of the configuration at power-on stays",
    lambda camera: _frozen_crc(camera),
)


def _abort_code(camera: SoftwareCamera, wrong: Abort, told: Abort) -> None:
    before = camera.coe.answer

    def answer(mailbox: bytes) -> bytes | None:
        found = before(mailbox)
        code = wrong.value.to_bytes(4, "little")
        if found is not None and found[8:9] == b"\x80" and found[12:16] == code:
            return found[:12] + told.value.to_bytes(4, "little")
        return found

    camera.coe.answer = answer  # type: ignore[method-assign]  # a bug


def _forgets(camera: SoftwareCamera, place: tuple[int, int]) -> None:
    before = camera.coe._values.write

    def write(index: int, sub: int, value: bytes) -> None:
        kept = camera.coe._values._values[index, sub]
        before(index, sub, value)
        if (index, sub) == place:
            camera.coe._values._values[index, sub] = kept

    camera.coe._values.write = write  # type: ignore[method-assign]  # a bug


def _frozen_crc(camera: SoftwareCamera) -> None:
    crc = camera._crc
    _header(lambda header: header._replace(config_crc=crc))(camera)


@_bug("object.complete", "a mixed record travels as a whole")
def _any_record(camera: SoftwareCamera) -> None:
    before = camera.coe._values.read_all

    def read_all(index: int, first: int) -> bytes:
        try:
            return before(index, first)
        except AbortError:
            return bytes(8)

    camera.coe._values.read_all = read_all  # type: ignore[method-assign]  # a bug


@_bug("object.complete", "a record is kept up to its first bad value")
def _half_record(camera: SoftwareCamera) -> None:
    values = camera.coe._values

    def write_all(index: int, first: int, content: bytes) -> None:
        at = 0
        for sub in values._together(index, first):
            size = values._entry(index, sub).room if sub else 2
            if sub:
                values.write(index, sub, content[at : at + size])
            at += size
        if at != len(content):
            raise AbortError(Abort.LENGTH)

    values.write_all = write_all  # type: ignore[method-assign]  # a bug


# Mailboxes

_add(
    "mailbox.segments",
    "the last byte of a long value is lost",
    lambda camera: _segment(camera, lambda part: part[:-1] if len(part) > 100 else part),
)
_add("mailbox.broken", "the toggle bit is not looked at", lambda camera: _no_toggle(camera))
_add(
    "mailbox.broken",
    "an abort is answered",
    _answers(
        lambda camera, asked, found: (
            found if asked[8] != 0x80 else camera.coe.answer(asked[:8] + b"\xe0" + asked[9:])
        )
    ),
)
_add(
    "mailbox.broken",
    "an unknown command is told as busy",
    lambda camera: _abort_code(camera, Abort.COMMAND, Abort.BUSY),
)
_add(
    "mailbox.bad",
    "a bad mailbox is not answered",
    _answers(lambda _camera, _asked, found: None if found and found[5] & 15 == 0 else found),
)
_add("mailbox.bad", "bad mailboxes are not counted", _live(0xA000, 4, lambda _value: bytes(4)))
_add(
    "mailbox.bad",
    "the error reply has no reason",
    _answers(
        lambda _camera, _asked, found: (
            found[:8] + b"\x01\x00" if found and found[5] & 15 == 0 else found
        )
    ),
)
_add(
    "mailbox.repeat",
    "nothing is sent again",
    lambda camera: setattr(camera.esc, "_sync_managers", lambda: None),
)
_add(
    "mailbox.counter",
    "the mailbox counter stands still",
    _answers(lambda _camera, _asked, found: found and found[:5] + bytes([0x13]) + found[6:]),
)
_add(
    "mailbox.information",
    "an object is not in the list",
    lambda camera: camera.coe._objects.pop(0xA000),
)  # type: ignore[attr-defined]  # a dict it is
_add(
    "mailbox.information",
    "a record is described as a single value",
    lambda camera: camera.coe._objects.__setitem__(  # type: ignore[attr-defined]  # a dict it is
        0x9010, replace(camera.coe._objects[0x9010], record=False)
    ),
)
_add("mailbox.deadline", "some answers take 120 ms", lambda camera: _late(0.12, _every(50))(camera))
_add("mailbox.deadline", "some answers never come", lambda camera: _late(10.0, _every(50))(camera))


def _every(count: int) -> Callable[[bytes], bool]:
    seen = [0]

    def when(_asked: bytes) -> bool:
        seen[0] += 1
        return seen[0] % count == 0

    return when


def _segment(camera: SoftwareCamera, change: Callable[[bytes], bytes]) -> None:
    before = camera.coe._store
    camera.coe._store = lambda index, sub, whole, value: before(index, sub, whole, change(value))  # type: ignore[method-assign]  # a bug


def _no_toggle(camera: SoftwareCamera) -> None:
    before = camera.coe._upload_segment

    def segment(upload: object, command: int) -> bytes:
        toggle = upload.toggle  # type: ignore[attr-defined]  # an upload
        return before(upload, command & ~0x10 | toggle << 4)  # type: ignore[arg-type]  # an upload

    camera.coe._upload_segment = segment  # type: ignore[assignment, method-assign]  # a bug


# Process data

_add(
    "frames.inputs",
    "check sum without the serial number",
    _crc(lambda content, _begin: zlib.crc32(content)),
)
_add(
    "frames.inputs",
    "check sum of the header alone",
    _crc(lambda content, begin: zlib.crc32(content[: HEADER_STRUCT.size], begin)),
)
_add(
    "frames.inputs",
    "check sum with the serial number at the end",
    _crc(lambda content, _begin: zlib.crc32(struct.pack("<I", 1001), zlib.crc32(content))),
)
_add(
    "frames.inputs",
    "cycle counter of 8 bits",
    _header(lambda header: header._replace(cycle_counter=header.cycle_counter & 0xFF)),
)
_add(
    "frames.inputs",
    "cycle counter goes on by two",
    _header(lambda header: header._replace(cycle_counter=2 * header.cycle_counter & 0xFFFF)),
)
_add(
    "frames.inputs",
    "boot counter is never counted",
    _header(lambda header: header._replace(boot_counter=0)),
)
_add(
    "frames.inputs",
    "time of the end of the exposure",
    _header(lambda header: header._replace(start_ns=header.start_ns + header.period_ns)),
)
_add(
    "frames.inputs",
    "exposures are counted from 1",
    _header(lambda header: header._replace(counter=header.counter + 1)),
)
_add(
    "frames.inputs",
    "period is a nanosecond off",
    _header(lambda header: header._replace(period_ns=max(0, header.period_ns - 1))),
)
_add(
    "frames.inputs",
    "thirteen frames are announced",
    _header(lambda header: header._replace(frames_valid=13 if header.frames_valid else 0)),
)
_add(
    "frames.inputs",
    "the clock signal is not told",
    _header(lambda header: header._replace(status=header.status & ~2)),
)
_add(
    "frames.inputs",
    "a reserved flag is set",
    _frames(lambda frames: frames.__setitem__(2, frames[2] | 0x40)),
)
_add(
    "frames.inputs",
    "a ninth slot is valid",
    _frames(lambda frames: frames.__setitem__(1, frames[1] | 0x01)),
)
_add(
    "frames.inputs",
    "old layout: cycle counter and status exchanged",
    _header(
        lambda header: header._replace(
            status=header.cycle_counter & 0xFF, cycle_counter=header.status
        )
    ),
)
_add(
    "frames.exchange",
    "operation is told in SAFEOP",
    _header(lambda header: header._replace(status=header.status | 1)),
)
_add("frames.exchange", "outputs are not taken in SAFEOP", lambda camera: _deaf_in_safeop(camera))
_add(
    "frames.exchange",
    "inputs already in PREOP",
    lambda camera: setattr(camera.esc, "exchange_allowed", lambda _sync_manager: True),
)
_add("frames.order", "frames come before they are over", lambda camera: _shifted(camera, 1))
_add("frames.order", "frames come two periods late", lambda camera: _shifted(camera, -2))
_add(
    "frames.order",
    "the first frame of a block is the last of the one before",
    lambda camera: _acknowledging(camera, lambda counter: counter - 1),
)
_add(
    "frames.go_back", "an acknowledgement needs no control bit", lambda camera: _no_control(camera)
)
_add("frames.go_back", "what is far ahead can be acknowledged", lambda camera: _any_ack(camera))
_add("frames.go_back", "frames are sent once", lambda camera: _sent_once(camera))
_add(
    "frames.go_back",
    "frames change when they come again",
    _frames(
        lambda frames: frames.__setitem__(4, (frames[4] + 1) & 0xFF) if _every_other() else None
    ),
)
_add("frames.go_back", "a part cannot be acknowledged", lambda camera: _whole_blocks(camera))
_add("frames.overrun", "the buffer holds half", lambda camera: _small_buffer(camera))
_add(
    "frames.overrun",
    "a loss is not told in the status",
    _header(lambda header: header._replace(status=header.status & ~4)),
)
_add(
    "frames.overrun",
    "the frame behind a gap is not marked",
    _frames(lambda frames: frames.__setitem__(2, frames[2] & ~2)),
)
_add("frames.overrun", "lost frames are not counted", _live(0xA000, 1, lambda _value: bytes(4)))
_add("frames.overrun", "overruns are not counted", _live(0xA000, 3, lambda _value: bytes(4)))
_add(
    "frames.objects", "objects of the outputs show zero", _live(0x7000, 3, lambda _value: bytes(4))
)
_add(
    "frames.objects",
    "objects of the header show another period",
    _live(0x6000, 3, lambda _value: b"\x01\x00\x00\x00"),
)
_add(
    "frames.sensor",
    "spots in millimetres instead of pixels",
    _frames(lambda frames: frames.__setitem__(slice(4, 8), struct.pack("<i", -40 << 16))),
)
_turn = [0]


def _every_other() -> bool:
    _turn[0] += 1
    return _turn[0] % 2 == 0


def _deaf_in_safeop(camera: SoftwareCamera) -> None:
    before = camera.esc.exchange_allowed
    camera.esc.exchange_allowed = lambda manager: (  # type: ignore[method-assign]  # a bug
        before(manager) and (manager != 2 or camera.esc.state == reg.OP)
    )


def _shifted(camera: SoftwareCamera, periods: int) -> None:
    before = camera.buffer._newest
    camera.buffer._newest = lambda now_ns: max(-1, before(now_ns) + periods)  # type: ignore[method-assign]  # a bug


def _acknowledging(camera: SoftwareCamera, change: Callable[[int], int]) -> None:
    before = camera.buffer.acknowledge
    camera.buffer.acknowledge = lambda counter: before(change(counter))  # type: ignore[method-assign]  # a bug


def _no_control(camera: SoftwareCamera) -> None:
    before = camera.outputs_written

    def written() -> None:
        camera.esc.memory[0x1400] |= 1
        before()

    camera.outputs_written = written  # type: ignore[method-assign]  # a bug


def _any_ack(camera: SoftwareCamera) -> None:
    def acknowledge(counter: int) -> None:
        camera.buffer._tail = max(camera.buffer._tail, counter + 1)

    camera.buffer.acknowledge = acknowledge  # type: ignore[method-assign]  # a bug


def _sent_once(camera: SoftwareCamera) -> None:
    before = camera.buffer.take

    def take(now_ns: int) -> tuple[int, int]:
        first, count = before(now_ns)
        camera.buffer._tail += count
        return first, count

    camera.buffer.take = take  # type: ignore[method-assign]  # a bug


def _whole_blocks(camera: SoftwareCamera) -> None:
    before, last = camera.buffer.take, [0]

    def take(now_ns: int) -> tuple[int, int]:
        first, count = before(now_ns)
        last[0] = first + count
        return first, count

    def acknowledge(counter: int) -> None:
        if counter + 1 <= last[0] <= counter + 12:
            camera.buffer._tail = max(camera.buffer._tail, last[0])

    camera.buffer.take = take  # type: ignore[method-assign]  # a bug
    camera.buffer.acknowledge = acknowledge  # type: ignore[method-assign]  # a bug


def _small_buffer(camera: SoftwareCamera) -> None:
    before = camera.buffer.take

    def take(now_ns: int) -> tuple[int, int]:
        first, count = before(now_ns)
        end = camera.buffer._newest(now_ns) + 1
        if end - first > 512:
            camera.buffer.lost += end - 512 - first
            camera.buffer.overruns += 1
            camera.buffer._tail = camera.buffer._overrun_at = end - 512
            first, count = before(now_ns)
        return first, count

    camera.buffer.take = take  # type: ignore[method-assign]  # a bug


# Clock

_add(
    "clock.time",
    "clock a thousandth too fast",
    lambda camera: camera.esc.clock.set_rate(1_000_000, camera.esc.now_ns),
)
_add("clock.time", "bus time of 32 bits", lambda camera: _short_time(camera))
_add("clock.time", "the offset of the clock is not used", lambda camera: _no_offset(camera))
_add("clock.difference", "the sign of the difference is turned", lambda camera: _turned(camera))
_add(
    "clock.phase",
    "SYNC0's period is not looked at",
    lambda camera: _schedule(camera, lambda start, _period: (start, 125_000)),
)
_add(
    "clock.phase",
    "exposures half a period behind SYNC0",
    _header(lambda header: header._replace(start_ns=header.start_ns + header.period_ns // 2)),
)
_add(
    "clock.late",
    "exposures begin when they like",
    lambda camera: _schedule(camera, lambda start, period: (start - 10 * period, period)),
)
_add("clock.free", "free running is told as SYNC0", _live(0x1C32, 1, lambda _value: b"\x02\x00"))
_add(
    "clock.free",
    "own period is not used without SYNC0",
    lambda camera: _schedule(camera, lambda start, period: (start, 125_000)),
)
_add("clock.restart", "exposures go on counting over a restart", lambda camera: _goes_on(camera))


def _short_time(camera: SoftwareCamera) -> None:
    before = camera.esc.read

    def read(address: int, length: int) -> bytes | None:
        found = before(address, length)
        if address == reg.SYSTEM_TIME and found and length == 8:
            return found[:4] + bytes(4)
        return found

    camera.esc.read = read  # type: ignore[method-assign]  # a bug


def _no_offset(camera: SoftwareCamera) -> None:
    before = camera.esc.write

    def write(address: int, data: bytes) -> bool:
        return True if address == reg.TIME_OFFSET else before(address, data)

    camera.esc.write = write  # type: ignore[assignment, method-assign]  # a bug


def _turned(camera: SoftwareCamera) -> None:
    before = camera.esc.read

    def read(address: int, length: int) -> bytes | None:
        found = before(address, length)
        if address == reg.TIME_DIFFERENCE and found:
            return found[:3] + bytes([found[3] ^ 0x80])
        return found

    camera.esc.read = read  # type: ignore[method-assign]  # a bug


def _schedule(camera: SoftwareCamera, change: Callable[[int, int], tuple[int, int]]) -> None:
    before = camera._schedule
    camera._schedule = lambda: change(*before())  # type: ignore[method-assign]  # a bug


def _goes_on(camera: SoftwareCamera) -> None:
    before, starts = camera.buffer.start, [0]

    def start(start_ns: int, period_ns: int) -> None:
        starts[0] += 1
        before(start_ns - 1000 * period_ns * (starts[0] - 1), period_ns)
        camera.buffer._tail = camera.buffer._generated = 1000 * (starts[0] - 1)

    camera.buffer.start = start  # type: ignore[method-assign]  # a bug


# Watchdog and errors

_add("watchdog.time", "no watchdog", lambda camera: setattr(camera.esc, "poll", lambda _now: None))
_add("watchdog.time", "the watchdog barks at half its time", lambda camera: _bite(camera, 2))
_add(
    "watchdog.time",
    "the time of the watchdog cannot be set",
    lambda camera: _deaf(camera, reg.WATCHDOG_SM_TIME),
)
_add(
    "watchdog.time",
    "the watchdog does not count",
    lambda camera: _after_fall(
        camera, lambda: camera.esc.memory.__setitem__(reg.WATCHDOG_COUNT, 0)
    ),
)
_add(
    "watchdog.time",
    "the watchdog has the code of missing outputs",
    lambda camera: _after_fall(camera, lambda: camera.esc._set(reg.AL_STATUS_CODE, "<H", 0x1D)),
)
_add(
    "watchdog.time",
    "the watchdog leads to PREOP",
    lambda camera: _after_fall(camera, lambda: camera.esc.fall_back(reg.PREOP, reg.AL_WATCHDOG)),
)
_add(
    "watchdog.frames",
    "exposures end with the outputs",
    lambda camera: _after_fall(camera, camera.buffer.stop),
)
_add(
    "watchdog.frames",
    "frames are dropped with the outputs",
    lambda camera: _after_fall(camera, lambda: _drop(camera)),
)
_add("errors.told", "no emergency", _set("_diagnosis._send", lambda *_: None))
_add("errors.told", "the end of an error is not told", lambda camera: _never_over(camera))
_add("errors.told", "the error register stays empty", _live(0x1001, 0, lambda _value: b"\x00"))
_add("errors.told", "watchdog events are not counted", _live(0xA000, 2, lambda _value: bytes(4)))
_add("errors.told", "emergencies are not counted", _live(0xA000, 6, lambda _value: bytes(4)))
_add(
    "errors.told",
    "messages have no time",
    _live(0x10F3, 6, lambda value: value[:8] + bytes(8) + value[16:]),
)
_add(
    "errors.told",
    "messages have other flags",
    _live(0x10F3, 6, lambda value: value[:4] + b"\x02\x00" + value[6:]),
)
_add("errors.told", "new messages are not told", _live(0x10F3, 4, lambda _value: b"\x00"))
_add("errors.told", "any message can be acknowledged", lambda camera: _any_message(camera))
_add(
    "errors.told",
    "status bit 4 is never set",
    _header(lambda header: header._replace(status=header.status & ~16)),
)
_add(
    "errors.history",
    "the newest message stays at the last place",
    _live(0x10F3, 2, lambda value: bytes([max(value[0], 21)])),
)
_add(
    "errors.history",
    "emergencies cannot be switched off",
    lambda camera: (
        setattr(camera._diagnosis, "_set_flags", lambda _value: None)
        or camera.coe._values._written.__setitem__((0x10F3, 5), lambda _value: None)
    ),
)  # type: ignore[attr-defined]  # a dict it is


def _bite(camera: SoftwareCamera, share: int) -> None:
    before = camera.esc.poll
    camera.esc.poll = lambda now_ns: before(  # type: ignore[method-assign]  # a bug
        camera.esc._fed_ns + share * (now_ns - camera.esc._fed_ns)
    )


def _deaf(camera: SoftwareCamera, register: int) -> None:
    camera.esc._writable[register : register + 2] = bytes(2)


def _after_fall(camera: SoftwareCamera, then: Callable[[], object]) -> None:
    before = camera.esc.poll

    def poll(now_ns: int) -> None:
        state = camera.esc.state
        before(now_ns)
        if state == reg.OP and camera.esc.state != reg.OP:
            then()

    camera.esc.poll = poll  # type: ignore[method-assign]  # a bug


def _drop(camera: SoftwareCamera) -> None:
    camera.buffer._tail += 50


def _never_over(camera: SoftwareCamera) -> None:
    before = camera._diagnosis.report

    def report(code: int, register: int, data: bytes = b"") -> None:
        if code:
            before(code, register, data)

    camera._diagnosis.report = report  # type: ignore[method-assign]  # a bug


def _any_message(camera: SoftwareCamera) -> None:
    written = camera.coe._values._written
    before = written[0x10F3, 3]

    def acknowledge(value: bytes) -> object:
        try:
            return before(value)
        except AbortError:
            return None

    written[0x10F3, 3] = acknowledge  # type: ignore[index]  # a dict it is


# Commands

_add("command.identify", "blinking does not end", _live(0x8040, 2, lambda _value: b"\x05\x00"))
_add(
    "command.identify",
    "what is left is in milliseconds",
    _live(0x8040, 2, lambda value: struct.pack("<H", 1000 * value[0] & 0xFFFF)),
)
_add(
    "command.intrinsics",
    "intrinsics of another camera are taken",
    lambda camera: setattr(camera.electronics, "_serial", 1000),
)
_add("command.intrinsics", "damaged intrinsics are taken", lambda camera: _takes_damaged(camera))
_add(
    "command.intrinsics",
    "SHA-256 is that of nothing",
    _live(0x8010, 3, lambda value: bytes(len(value))),
)
_add(
    "command.intrinsics",
    "CRC-32 begins with zero",
    _live(0x8010, 4, lambda value: struct.pack("<I", struct.unpack("<I", value)[0] ^ 0xFFFFFFFF)),
)
_add("command.intrinsics", "corrected without intrinsics", lambda camera: _mode(camera))
_add(
    "command.black_image",
    "spots while the light is off",
    lambda camera: setattr(camera.buffer, "darken", lambda _now, _count: 50_000_000),
)
_add("command.black_image", "a command while another one runs", lambda camera: _impatient(camera))
_add(
    "command.black_image",
    "storing is not told",
    _live(0x8020, 5, lambda value: bytes([value[0] & ~2])),
)
_add(
    "command.black_image",
    "clearing leaves the stored image",
    lambda camera: setattr(camera.electronics._black, "_clear", lambda: None),
)
_add(
    "command.snapshot",
    "CRC-32 of the first chunk only",
    _live(0x8030, 0x0B, lambda value: struct.pack("<I", struct.unpack("<I", value)[0] ^ 1)),
)
_add(
    "command.snapshot",
    "a region off the sensor is taken",
    lambda camera: setattr(camera.electronics._snapshots, "_size", (5000, 5000)),
)
_add(
    "command.snapshot",
    "chunks without their offset",
    lambda camera: camera.coe._values._written.__setitem__((0x8030, 9), lambda _value: None),
)  # type: ignore[attr-defined]  # a dict it is
_add(
    "command.snapshot",
    "width and height exchanged",
    lambda camera: _exchanged(camera, (0x8030, 0x0C), (0x8030, 0x0D)),
)


def _takes_damaged(camera: SoftwareCamera) -> None:
    def keep(value: bytes) -> None:
        if value and len(value) == 100:
            sealed = value[:-4] + BLOCK_CRC.pack(zlib.crc32(value[:-4]))
            if Intrinsics.decode(sealed).serial != camera.electronics._serial:
                raise AbortError(Abort.VALUE)
        elif value:
            raise AbortError(Abort.VALUE)
        camera.electronics._intrinsics = value

    camera.coe._values._written[0x8010, 1] = keep  # type: ignore[index]  # a dict it is


def _mode(camera: SoftwareCamera) -> None:
    camera.coe._values._written[0x8000, 4] = lambda _value: None  # type: ignore[index]  # a dict it is


def _impatient(camera: SoftwareCamera) -> None:
    written = camera.coe._values._written
    before = written[0x8020, 1]

    def command(value: bytes) -> object:
        try:
            return before(value)
        except AbortError as abort:
            if abort.reason is Abort.BUSY:
                return None
            raise

    written[0x8020, 1] = command  # type: ignore[index]  # a dict it is


def _exchanged(camera: SoftwareCamera, one: tuple[int, int], other: tuple[int, int]) -> None:
    live = camera.coe._values._live
    live[one], live[other] = live[other], live[one]  # type: ignore[index]  # a dict it is


# Firmware

_add("firmware.refusals", "firmware is taken outside of BOOT", _set("foe._may_write", lambda: True))
_add("firmware.refusals", "any name of a file will do", lambda camera: _any_name(camera))
_add("firmware.refusals", "packets in any order", lambda camera: _any_order(camera))
_add("firmware.refusals", "a packet that comes again is refused", lambda camera: _no_echo(camera))
_add(
    "firmware.refusals",
    "reading has the code of a missing file",
    _answers(
        lambda _camera, asked, found: (
            found and found[:8] + b"\x01\x80" + found[10:]
            if asked[5] & 15 == 4 and asked[6] == 1
            else found
        )
    ),
)
_add("firmware.wrong", "the signature is not looked at", lambda camera: _unsigned(camera))
_add(
    "firmware.wrong",
    "wrong firmware is told as too large",
    _answers(lambda _camera, _asked, found: found and found.replace(b"\x09\x80", b"\x03\x80", 1)),
)
_add(
    "firmware.interrupted",
    "an update goes on after INIT",
    lambda camera: setattr(camera.foe, "reset", lambda: None),
)
_add("firmware.interrupted", "an update cannot begin anew", lambda camera: _once(camera))
_add("firmware.update", "no way back from a trial", lambda camera: _confirmed_at_once(camera))
_add("firmware.update", "new firmware is never kept", _set("_banks.confirm", lambda: None))
_add(
    "firmware.update",
    "new firmware needs a loss of power",
    lambda camera: setattr(camera, "_start_firmware", lambda: None),
)
_add(
    "firmware.wrong",
    "a packet takes 3 s",
    lambda camera: _late(3.0, lambda asked: asked[5] & 15 == 4 and asked[6] == 3)(camera),
)


def _any_name(camera: SoftwareCamera) -> None:
    before = camera.foe._begin
    camera.foe._begin = lambda _name: before(b"firmware")  # type: ignore[method-assign]  # a bug


def _any_order(camera: SoftwareCamera) -> None:
    before = camera.foe._data

    def data(number: int, content: bytes) -> bytes:
        if camera.foe._expected:
            camera.foe._expected = number
        return before(number, content)

    camera.foe._data = data  # type: ignore[method-assign]  # a bug


def _no_echo(camera: SoftwareCamera) -> None:
    before = camera.foe._data

    def data(number: int, content: bytes) -> bytes:
        camera.foe._last = (0, b"")
        return before(number, content)

    camera.foe._data = data  # type: ignore[method-assign]  # a bug


def _unsigned(camera: SoftwareCamera) -> None:
    banks = camera._banks

    def finish() -> Firmware:
        image = bytes(banks._banks[1 - banks._running][: banks._at])
        found = Firmware.read(image)
        found.check_for()
        return found

    banks.finish = finish  # type: ignore[method-assign]  # a bug


def _once(camera: SoftwareCamera) -> None:
    before = camera.foe._begin

    def begin(name: bytes) -> bytes:
        if camera.foe._expected > 1:
            return camera.foe._error(0x8004, "busy")
        return before(name)

    camera.foe._begin = begin  # type: ignore[method-assign]  # a bug


def _confirmed_at_once(camera: SoftwareCamera) -> None:
    before = camera._start_firmware

    def start() -> None:
        before()
        camera._banks.confirm()

    camera._start_firmware = start  # type: ignore[method-assign]  # a bug
