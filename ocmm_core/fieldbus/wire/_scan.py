"""Scan of the wire by position, read-only, before any configuration.

Each device's EEPROM holds maker, product and serial number (ETG.1000.6 SII, words 4 and 8 to 15);
it is read through registers (ETG.1000.4, 6.4), so that devices other than the rig's cameras are
also listed.
"""

from __future__ import annotations

import select
import struct
import time
from collections.abc import Callable, Sequence

import msgspec

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import FoundDevice
from ocmm_core.fieldbus.wire._datagrams import (
    Command,
    Datagram,
    answers_like,
    encode_frame,
    frame_index,
)
from ocmm_core.fieldbus.wire._interface import refuse_other_programs
from ocmm_core.fieldbus.wire._sockets import listen, receive

_TYPE, _AL_STATUS = 0x0000, 0x0130
_EEPROM_OWNER, _EEPROM_CONTROL = 0x0500, 0x0502
_READ, _WRITE, _BUSY, _ERRORS = 0x0100, 0x0201, 0x8000, 0x7800
_EEPROM_REQUEST = struct.Struct("<HI")
_EEPROM_ANSWER = struct.Struct("<HI4s")
_ALIAS_WORD, _IDENTITY_WORD, _SERIAL_WORD = 4, 8, 14
_IDENTITY = struct.Struct("<IIII")
_STATES = {1: "INIT", 2: "PREOP", 3: "BOOT", 4: "SAFEOP", 8: "OP"}
_POLLS = 50
_TRIES = 5
_ANSWER_S = 0.02
_MAX_DEVICES = 1000

Exchange = Callable[[Datagram], Datagram]
"""Sends a datagram and returns the answer."""
_Ask = Callable[[Command, int, bytes], bytes]


class ScannedDevice(msgspec.Struct, frozen=True):
    """Result of scanning one device."""

    device: FoundDevice
    state: str


def scan_devices(exchange: Exchange) -> tuple[ScannedDevice, ...]:
    """Return the devices in wire order; raise BusError if one stops answering."""
    count = exchange(Datagram(Command.BRD, 0, _TYPE, b"\x00")).working_counter
    return tuple(_look_at(exchange, position) for position in range(min(count, _MAX_DEVICES)))


def stored_serial(exchange: Exchange, position: int) -> int:
    """Return the EEPROM serial of a device, 0 if none; raise BusError if not released."""
    read = _asking(exchange, position)
    read(Command.APWR, _EEPROM_OWNER, b"\x00")
    return int(struct.unpack("<I", _read_eeprom(read, position, _SERIAL_WORD))[0])


def read_words(exchange: Exchange, position: int, word: int, words: int) -> bytes:
    """Return EEPROM words of a device by position; errors as `stored_serial`."""
    read = _asking(exchange, position)
    read(Command.APWR, _EEPROM_OWNER, b"\x00")
    content = b"".join(_read_eeprom(read, position, each) for each in range(word, word + words, 2))
    return content[: 2 * words]


def write_word(exchange: Exchange, position: int, word: int, value: int) -> None:
    """Write an EEPROM word of a device by position; raise BusError if refused."""
    read = _asking(exchange, position)
    read(Command.APWR, _EEPROM_OWNER, b"\x00")
    # Address and value first, then the command with the bit that allows writing.
    read(Command.APWR, _EEPROM_CONTROL + 2, struct.pack("<IH", word, value))
    read(Command.APWR, _EEPROM_CONTROL, struct.pack("<H", _WRITE))
    for _ in range(_POLLS):
        (status,) = struct.unpack("<H", read(Command.APRD, _EEPROM_CONTROL, bytes(2)))
        if not status & _BUSY:
            if status & _ERRORS:
                break
            return
    raise _lost(position, f"does not let its EEPROM be written (word {word})")


class RawLine:
    """Single datagrams over an interface without a master; BusError if another program is one."""

    def __init__(self, interface: str) -> None:
        self._interface = interface
        self._index = 0
        self._channel = listen(interface)
        try:
            refuse_other_programs([interface])
        except BaseException:
            self._channel.close()
            raise

    def exchange(self, datagram: Datagram) -> Datagram:
        """Send a datagram until it returns; errors as `exchange_all`."""
        return self.exchange_all([datagram])[0]

    def exchange_all(self, datagrams: Sequence[Datagram]) -> list[Datagram]:
        """Send datagrams in one frame until it returns; raise BusError if it does not."""
        for _ in range(_TRIES):
            self._index = self._index % 0xFF + 1
            self._channel.send(encode_frame(self._index, datagrams))
            answer = self._wait(datagrams)
            if answer is not None:
                return answer
        raise BusError(
            "bus.silent",
            f"No camera answers on interface '{self._interface}'.",
            "Check the cable and that the cameras are switched on.",
        )

    def close(self) -> None:
        self._channel.close()

    def _wait(self, asked: Sequence[Datagram]) -> list[Datagram] | None:
        deadline = time.monotonic() + _ANSWER_S
        while (left := deadline - time.monotonic()) > 0.0:
            if not select.select([self._channel], [], [], left)[0]:
                break
            frame = receive(self._channel)
            if frame is None or frame_index(frame) != self._index:
                continue
            answer = answers_like(frame, asked)
            if answer is not None:
                return list(answer)
        return None


def encode_scan(devices: Sequence[ScannedDevice]) -> bytes:
    """Return the devices as one line of JSON."""
    return msgspec.json.encode(list(devices)) + b"\n"


def decode_scan(content: bytes) -> tuple[ScannedDevice, ...]:
    """Return the devices in `content`; raise BusError if of another version."""
    try:
        return msgspec.json.decode(content, type=tuple[ScannedDevice, ...])
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise BusError(
            "bus.scan",
            f"The list of devices cannot be read ({error}).",
            "Install the program completely; its parts are of different versions.",
        ) from error


def _look_at(exchange: Exchange, position: int) -> ScannedDevice:
    read = _asking(exchange, position)
    (state,) = struct.unpack("<H", read(Command.APRD, _AL_STATUS, bytes(2)))
    read(Command.APWR, _EEPROM_OWNER, b"\x00")
    words = b"".join(
        _read_eeprom(read, position, word)
        for word in (_ALIAS_WORD, *range(_IDENTITY_WORD, _IDENTITY_WORD + _IDENTITY.size // 2, 2))
    )
    (alias,) = struct.unpack_from("<H", words)
    vendor, product, revision, serial = _IDENTITY.unpack_from(words, 4)
    name = _STATES.get(state & 0x0F, f"{state & 0x0F:#x}") + (" + error" if state & 0x10 else "")
    return ScannedDevice(FoundDevice(vendor, product, revision, serial, alias, serial), name)


def _asking(exchange: Exchange, position: int) -> _Ask:
    target = -position & 0xFFFF

    def read(command: Command, register: int, data: bytes) -> bytes:
        answer = exchange(Datagram(command, target, register, data))
        if answer.working_counter != 1:
            raise _lost(position, "no longer answers")
        return answer.data

    return read


def _read_eeprom(read: _Ask, position: int, word: int) -> bytes:
    read(Command.APWR, _EEPROM_CONTROL, _EEPROM_REQUEST.pack(_READ, word))
    for _ in range(_POLLS):
        answer = read(Command.APRD, _EEPROM_CONTROL, bytes(_EEPROM_ANSWER.size))
        status, place, data = _EEPROM_ANSWER.unpack(answer)
        if status & _BUSY:
            continue
        if status & _ERRORS or place != word:
            break
        return bytes(data)
    raise _lost(position, f"does not release its EEPROM (word {word})")


def _lost(position: int, why: str) -> BusError:
    return BusError(
        "bus.scan",
        f"The device at position {position + 1} of the bus {why}.",
        "Stop any other master on the bus, then power-cycle that device.",
    )
