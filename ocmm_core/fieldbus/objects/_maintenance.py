"""Permanent changes to a camera while the bus is idle: station alias and firmware.

Single datagrams over an idle wire. Each change is verified: the alias is read back from the EEPROM,
and the restarted camera must report the new firmware version. Firmware is uploaded by FoE, without
clock or wire (ETG.1000.6, 5.8).
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus import wire
from ocmm_core.fieldbus.device import (
    MAILBOX_BYTES,
    MAILBOX_IN_START,
    MAILBOX_OUT_START,
    SM_MAILBOX_IN,
    SM_MAILBOX_OUT,
    SYNC_MANAGERS,
    Firmware,
)
from ocmm_core.fieldbus.objects._mailbox_line import SYNC_MANAGERS as _SYNC_MANAGER_REGISTERS
from ocmm_core.fieldbus.objects._sdo import MAX_COUNTER, SERVICE_EMERGENCY, SdoRead, coe_content

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


_AL_CONTROL, _AL_STATUS = 0x0120, 0x0130
_INIT, _BOOT = 1, 3
_ACKNOWLEDGE = 0x10
_SM_STATUS_IN = 0x080D
_FULL = 0x08
_ALIAS_WORD, _SUM_WORD, _HEAD_WORDS = 4, 7, 7
_STATE_S, _ANSWER_S, _ERASE_S = 5.0, 2.0, 10.0
_POLL_S = 0.002
_BUSY_S = 0.05
_LATE = 8
"""Tolerated number of answers to earlier requests."""
_WRITE_FILE = 2
"""FoE write opcode (ETG.1000.6, 5.8)."""
_VERSION, _VERSION_BYTES = 0x100A, 64

Told = Callable[[int, int], None]
"""Called with bytes done and in total."""


def find_camera(exchange: wire.Exchange, serial: int) -> tuple[int, wire.ScannedDevice]:
    """Return wire position and identity of a camera; raise BusError unless unique."""
    devices = wire.scan_devices(exchange)
    places = [n for n, each in enumerate(devices) if each.device.serial == serial]
    if len(places) != 1:
        there = ", ".join(str(each.device.serial) for each in devices) or "none"
        raise BusError(
            "bus.camera_missing" if not places else "bus.duplicate",
            f"{len(places) or 'No'} cameras on the bus have the serial number {serial}; "
            f"found: {there}.",
            "Connect the camera, or give the rig that it belongs to.",
        )
    return places[0], devices[places[0]]


def write_alias(exchange: wire.Exchange, serial: int, alias: int) -> int:
    """Store a station alias in the EEPROM of a camera; return the previous one.

    Takes effect after a power cycle. Also updates the checksum of the first EEPROM words, without
    which a controller ignores all of them. InputError unless 1 to 65535; BusError if the camera is
    absent, the alias is in use, or the EEPROM did not keep it.
    """
    if not 1 <= alias <= 0xFFFF:
        raise InputError(
            "bus.alias_value", f"The alias {alias} is not 1 to 65535.", "Give such a number."
        )
    place, found = find_camera(exchange, serial)
    for number, other in enumerate(wire.scan_devices(exchange)):
        if number != place and other.device.alias == alias:
            raise BusError(
                "bus.duplicate",
                f"The camera with serial number {other.device.serial} has the alias {alias}.",
                "Give each camera its own alias.",
            )
    head = bytearray(wire.read_words(exchange, place, 0, _HEAD_WORDS))
    struct.pack_into("<H", head, 2 * _ALIAS_WORD, alias)
    # Checksum first: while it is wrong the controller keeps its values until both are written.
    wire.write_word(exchange, place, _SUM_WORD, check_sum(bytes(head)))
    wire.write_word(exchange, place, _ALIAS_WORD, alias)
    stored = wire.read_words(exchange, place, 0, _HEAD_WORDS + 1)
    if stored[: 2 * _HEAD_WORDS] != bytes(head) or stored[2 * _SUM_WORD] != check_sum(bytes(head)):
        raise BusError(
            "bus.eeprom",
            f"The EEPROM of the camera with serial number {serial} did not keep the alias {alias}.",
            "Repeat the command; if it happens again, have the camera repaired.",
        )
    return found.device.alias


def update_firmware(
    exchange: wire.Exchange, serial: int, image: bytes, told: Told = lambda _done, _total: None
) -> Firmware:
    """Upload firmware to a camera, confirm it by reaching PREOP, and verify it.

    The camera stores it in a second bank. After an interrupted transfer, or if the new firmware
    does not reach PREOP, the old one runs at the next start. InputError if the file is invalid,
    damaged, or for another device; BusError if the camera is absent, refuses, does not return, or
    runs another version.
    """
    firmware = Firmware.read(image)
    place, found = find_camera(exchange, serial)
    firmware.check_for(found.device.product, found.device.revision)
    _go(exchange, place, _INIT)
    _set_mailboxes(exchange, place)
    _go(exchange, place, _BOOT)
    _send(exchange, place, FoeWrite(FIRMWARE_NAME, image, MAILBOX_BYTES), told)
    # The camera starts the new firmware on trial; only PREOP confirms it.
    _set_mailboxes(exchange, place)
    _go(exchange, place, wire.PREOP)
    runs = _version(exchange, place)
    _go(exchange, place, _INIT)
    if runs != firmware.version:
        raise BusError(
            "bus.firmware",
            f"The camera took the firmware {firmware.version}, but runs {runs}.",
            "The new firmware did not start. Tell the maker of the camera.",
        )
    told(len(image), len(image))
    return firmware


def _send(exchange: wire.Exchange, place: int, transfer: FoeWrite, told: Told) -> None:
    """Upload a file to a camera in BOOT and bring it to INIT, also after failures."""
    counter = 1
    try:
        deadline = time.monotonic() + _ERASE_S
        while not transfer.done:
            request = transfer.request(counter)
            due = transfer.answer(_ask(exchange, place, request))
            for _ in range(_LATE):
                if due:
                    break
                due = transfer.answer(_fetch(exchange, place, _ANSWER_S))
            counter = counter % MAX_COUNTER + 1
            if not transfer.busy:
                deadline = time.monotonic() + _ERASE_S
            elif time.monotonic() > deadline:
                raise _silent(place)
            else:
                time.sleep(_BUSY_S)
            told(*transfer.progress)
    except BusError as error:
        if not transfer.undecided:
            raise
        raise BusError(
            "bus.firmware",
            f"The camera at position {place + 1} got the whole file and did not say whether it "
            "takes it.",
            "It may start the new firmware.",
        ) from error
    finally:
        _go(exchange, place, _INIT)


def _version(exchange: wire.Exchange, place: int) -> str:
    transfer = SdoRead(_VERSION, 0, _VERSION_BYTES, mailbox_bytes=MAILBOX_BYTES)
    counter = 1
    while not transfer.done:
        answer = _ask(exchange, place, transfer.request(counter))
        for _ in range(_LATE):
            content = coe_content(answer)
            if content is None or content[0] != SERVICE_EMERGENCY:
                break
            answer = _fetch(exchange, place, _ANSWER_S)
        transfer.answer(answer)
        counter = counter % MAX_COUNTER + 1
    told = transfer.result.rstrip(b"\x00").decode("ascii", errors="replace")
    return told if told.isprintable() else ascii(told)


def _go(exchange: wire.Exchange, place: int, state: int) -> None:
    target = -place & 0xFFFF
    control = (state | _ACKNOWLEDGE).to_bytes(2, "little")
    exchange(wire.Datagram(wire.Command.APWR, target, _AL_CONTROL, control))
    deadline = time.monotonic() + _STATE_S
    status = code = 0
    while time.monotonic() < deadline:
        answer = exchange(wire.Datagram(wire.Command.APRD, target, _AL_STATUS, bytes(6))).data
        status, code = answer[0], int.from_bytes(answer[4:6], "little")
        if status == state:
            return
        time.sleep(_POLL_S)
    raise BusError(
        "bus.state",
        f"The camera at position {place + 1} does not reach the state {state} (it is in "
        f"{status:#04x}, AL status {code:#06x}).",
        "Power-cycle the camera; its old firmware still runs.",
    )


def _set_mailboxes(exchange: wire.Exchange, place: int) -> None:
    target = -place & 0xFFFF
    for number in (SM_MAILBOX_OUT, SM_MAILBOX_IN):
        content = struct.pack("<HHBBBB", *SYNC_MANAGERS[number][:5], 0)
        register = _SYNC_MANAGER_REGISTERS + 8 * number
        exchange(wire.Datagram(wire.Command.APWR, target, register, content))


def _ask(exchange: wire.Exchange, place: int, mailbox: bytes) -> bytes:
    question = wire.Datagram(
        wire.Command.APWR, -place & 0xFFFF, MAILBOX_OUT_START, mailbox.ljust(MAILBOX_BYTES, b"\x00")
    )
    deadline = time.monotonic() + _ANSWER_S
    # A full mailbox may hold this very one, if its return frame was lost.
    while not exchange(question).working_counter and not _is_answered(exchange, place):
        if time.monotonic() > deadline:
            raise _silent(place)
        time.sleep(_POLL_S)
    # The first answer comes after a bank was erased.
    return _fetch(exchange, place, _ERASE_S if mailbox[6] == _WRITE_FILE else _ANSWER_S)


def _fetch(exchange: wire.Exchange, place: int, patience_s: float) -> bytes:
    deadline = time.monotonic() + patience_s
    while time.monotonic() < deadline:
        if _is_answered(exchange, place):
            question = wire.Datagram(
                wire.Command.APRD, -place & 0xFFFF, MAILBOX_IN_START, bytes(MAILBOX_BYTES)
            )
            answer = exchange(question)
            if answer.working_counter:
                return answer.data
        time.sleep(_POLL_S)
    raise _silent(place)


def _is_answered(exchange: wire.Exchange, place: int) -> bool:
    status = exchange(wire.Datagram(wire.Command.APRD, -place & 0xFFFF, _SM_STATUS_IN, bytes(1)))
    return bool(status.working_counter and status.data[0] & _FULL)


def _silent(place: int) -> BusError:
    return BusError(
        "bus.firmware",
        f"The camera at position {place + 1} stopped answering during the update.",
        "Check cable and power. Its old firmware still runs.",
    )


def check_sum(content: bytes) -> int:
    """Return the CRC-8 of the first 14 bytes of an EEPROM (ETG.2010, table 2)."""
    crc = 0xFF
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x07 if crc & 0x80 else crc << 1) & 0xFF
    return crc
