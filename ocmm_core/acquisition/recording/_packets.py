"""Network captures, also truncated (draft-ietf-opsawg-pcap and draft-ietf-opsawg-pcapng).

The position of each camera's process data is learned from a captured bring-up.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from ocmm_core.errors import InputError
from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.objects import SERVICE_SDO_RESPONSE, coe_content
from ocmm_core.fieldbus.wire import Command, Datagram
from ocmm_core.side_files import open_guarded

_ETHERNET = 1
_LONGEST_PACKET = 1 << 18
_LONGEST_BLOCK = 1 << 24
_PCAP_MAGICS = {
    b"\xd4\xc3\xb2\xa1": ("<", 1000),
    b"\xa1\xb2\xc3\xd4": (">", 1000),
    b"\x4d\x3c\xb2\xa1": ("<", 1),
    b"\xa1\xb2\x3c\x4d": (">", 1),
}
"""Byte order and nanoseconds per tick."""
_PCAPNG_MAGIC = b"\x0a\x0d\x0d\x0a"
_BYTE_ORDERS = {b"\x4d\x3c\x2b\x1a": "<", b"\x1a\x2b\x3c\x4d": ">"}
_BLOCK_INTERFACE, _BLOCK_SIMPLE, _BLOCK_PACKET = 1, 3, 6
_BLOCK_OVERHEAD = 12
_OPTION_END, _OPTION_RESOLUTION = 0, 9
_DEFAULT_RESOLUTION = 6
_FINEST_RESOLUTION = 18


@dataclass(frozen=True, slots=True)
class Packet:
    time_ns: int
    """Capture time, ns since 1970."""
    content: bytes
    whole: bool


class PacketFile:
    """A capture, read once from start to end."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.cut_off = False
        """The file ends within a packet; valid at the end."""

    def packets(self) -> Iterator[Packet]:
        """Yield the packets; raise InputError if unreadable, damaged or not Ethernet."""
        try:
            stream = os.fdopen(open_guarded(self._path), "rb")
        except OSError as error:
            raise self._error(f"cannot be opened ({error.strerror})", "Check the name.") from error
        with stream:
            try:
                yield from self._read(stream)
            except OSError as error:
                raise self._error(f"cannot be read ({error})", "Copy it again.") from error

    def _read(self, stream: BinaryIO) -> Iterator[Packet]:
        magic = stream.read(4)
        if magic in _PCAP_MAGICS:
            yield from self._read_pcap(stream, *_PCAP_MAGICS[magic])
        elif magic == _PCAPNG_MAGIC:
            yield from self._read_pcapng(stream)
        else:
            raise self._error(
                "is not a network recording (pcap or pcapng)", "Record it with tcpdump -w FILE."
            )

    def _read_pcap(self, stream: BinaryIO, order: str, tick_ns: int) -> Iterator[Packet]:
        head = self._read_exactly(stream, 20)
        if head is None:
            return
        self._check_link(struct.unpack_from(order + "I", head, 16)[0] & 0x0FFFFFFF)
        record = struct.Struct(order + "IIII")
        while (raw := self._read_exactly(stream, record.size, first=True)) is not None:
            seconds, ticks, size, original = record.unpack(raw)
            if size > _LONGEST_PACKET:
                raise self._damaged(stream, f"a packet claims {size} bytes")
            content = self._read_exactly(stream, size)
            if content is None:
                return
            yield Packet(seconds * 1_000_000_000 + ticks * tick_ns, content, size >= original)

    def _read_pcapng(self, stream: BinaryIO) -> Iterator[Packet]:
        stream.seek(0)
        order = "<"
        interfaces: list[int] = []
        while (raw := self._read_exactly(stream, 8, first=True)) is not None:
            if raw[:4] == _PCAPNG_MAGIC:
                order = self._section_order(stream)
                interfaces.clear()
            kind, size = struct.unpack(order + "II", raw)
            if size % 4 or not _BLOCK_OVERHEAD <= size <= _LONGEST_BLOCK:
                raise self._damaged(stream, f"a block claims {size} bytes")
            body = self._read_exactly(stream, size - 8)
            if body is None:
                return
            if struct.unpack_from(order + "I", body, len(body) - 4)[0] != size:
                raise self._damaged(stream, "a block has two lengths")
            body = body[:-4]
            if kind == _BLOCK_INTERFACE:
                interfaces.append(self._interface(stream, order, body))
            elif kind == _BLOCK_PACKET:
                yield self._packet(stream, order, body, interfaces)
            elif kind == _BLOCK_SIMPLE and len(body) >= 4 and interfaces:
                (original,) = struct.unpack_from(order + "I", body)
                yield Packet(0, body[4 : 4 + original], len(body) - 4 >= original)

    def _section_order(self, stream: BinaryIO) -> str:
        at = stream.tell()
        magic = stream.read(4)
        stream.seek(at)
        if magic not in _BYTE_ORDERS:
            raise self._damaged(stream, "a section has no byte order")
        return _BYTE_ORDERS[magic]

    def _interface(self, stream: BinaryIO, order: str, body: bytes) -> int:
        """Return the ticks per second of an interface."""
        if len(body) < 8:
            raise self._damaged(stream, "the description of an interface is too short")
        self._check_link(struct.unpack_from(order + "H", body)[0])
        at, resolution = 8, _DEFAULT_RESOLUTION
        while at + 4 <= len(body):
            code, size = struct.unpack_from(order + "HH", body, at)
            if code == _OPTION_END:
                break
            if code == _OPTION_RESOLUTION and size == 1 and at + 4 < len(body):
                resolution = body[at + 4]
            at += 4 + (size + 3) // 4 * 4
        power = resolution & 0x7F
        if resolution & 0x80:
            return 1 << power if power < 64 else 1 << 63
        if power > _FINEST_RESOLUTION:
            raise self._damaged(stream, f"times in steps of 10^-{power} s")
        return int(10**power)

    def _packet(self, stream: BinaryIO, order: str, body: bytes, interfaces: list[int]) -> Packet:
        if len(body) < 20:
            raise self._damaged(stream, "a packet is too short")
        interface, high, low, size, original = struct.unpack_from(order + "IIIII", body)
        if interface >= len(interfaces) or size > len(body) - 20:
            raise self._damaged(stream, "a packet does not fit its block or its interface")
        time_ns = (high << 32 | low) * 1_000_000_000 // interfaces[interface]
        return Packet(time_ns, body[20 : 20 + size], size >= original)

    def _read_exactly(self, stream: BinaryIO, size: int, *, first: bool = False) -> bytes | None:
        """Return `size` bytes, or None at the end; note truncation."""
        content = stream.read(size)
        if len(content) == size:
            return content
        self.cut_off = bool(content) or not first
        return None

    def _check_link(self, link: int) -> None:
        if link != _ETHERNET:
            raise self._error(
                f"contains packets other than Ethernet (link type {link})",
                "Record on the interface of the cameras: tcpdump -i IFACE -w FILE.",
            )

    def _damaged(self, stream: BinaryIO, why: str) -> InputError:
        return self._error(
            f"is damaged before byte {stream.tell()}: {why}", "Copy it again, or record again."
        )

    def _error(self, why: str, remedy: str) -> InputError:
        return InputError("capture.file", f"{self._path}: {why}.", remedy)


_FMMU, _FMMU_BYTES, _N_FMMU = 0x0600, 16, 8
_FMMU_STRUCT = struct.Struct("<IHBBHBBB")
_READ, _WRITE = 1, 2
_WRITES = (Command.FPWR, Command.FPRW)
_SERIAL_ANSWER = struct.pack("<BHB", 0x43, device.IDENTITY, device.IDENTITY_SERIAL)
_MAX_STATIONS = 256
_FIRST_STATION = 0x1001


@dataclass(frozen=True, slots=True)
class CameraArea:
    """Logical addresses of one camera's process data."""

    station: int
    inputs: int
    outputs: int

    @property
    def inputs_end(self) -> int:
        """Return the first address behind the inputs."""
        return self.inputs + device.INPUT_DTYPE.itemsize


def usual_layout(n_cameras: int) -> tuple[CameraArea, ...]:
    """Return the layout of our own master: all outputs, then all inputs."""
    first_input = n_cameras * device.OUTPUT_DTYPE.itemsize
    return tuple(
        CameraArea(
            _FIRST_STATION + place,
            first_input + place * device.INPUT_DTYPE.itemsize,
            place * device.OUTPUT_DTYPE.itemsize,
        )
        for place in range(n_cameras)
    )


class LayoutListener:
    """Extracts settings and identities from returned datagrams."""

    def __init__(self) -> None:
        self._registers: dict[int, bytearray] = {}
        self._serials: dict[int, int] = {}
        self._areas: tuple[CameraArea, ...] | None = None

    @property
    def areas(self) -> tuple[CameraArea, ...]:
        """Return the cameras with mapped inputs and outputs, by station address."""
        if self._areas is None:
            found = (self._area(station) for station in sorted(self._registers))
            self._areas = tuple(area for area in found if area is not None)
        return self._areas

    def serial(self, station: int) -> int | None:
        """Return the serial number of a camera, if read by the master."""
        return self._serials.get(station)

    def hear(self, datagram: Datagram) -> None:
        """Process a datagram returned from the cameras."""
        if datagram.working_counter == 0:
            return
        if datagram.command in _WRITES:
            self._hear_write(datagram)
        elif datagram.command == Command.FPRD and datagram.register == device.MAILBOX_IN_START:
            parts = coe_content(datagram.data)
            if parts is not None and parts[0] == SERVICE_SDO_RESPONSE and len(parts[1]) >= 8:
                self._hear_answer(datagram.target, parts[1])

    def _hear_write(self, datagram: Datagram) -> None:
        end = _FMMU + _N_FMMU * _FMMU_BYTES
        low, high = datagram.register, datagram.register + len(datagram.data)
        if high <= _FMMU or low >= end:
            return
        if datagram.target not in self._registers and len(self._registers) >= _MAX_STATIONS:
            return
        image = self._registers.setdefault(datagram.target, bytearray(end - _FMMU))
        start, stop = max(low, _FMMU), min(high, end)
        image[start - _FMMU : stop - _FMMU] = datagram.data[start - low : stop - low]
        self._areas = None

    def _hear_answer(self, station: int, body: bytes) -> None:
        known = station in self._serials or len(self._serials) < _MAX_STATIONS
        if body[:4] == _SERIAL_ANSWER and known:
            self._serials[station] = int.from_bytes(body[4:8], "little")

    def _area(self, station: int) -> CameraArea | None:
        inputs = outputs = None
        for number in range(_N_FMMU):
            logical, size, _first, _last, physical, _bit, kind, active = _FMMU_STRUCT.unpack_from(
                self._registers[station], number * _FMMU_BYTES
            )
            if not active & 1:
                continue
            if (kind, physical, size) == (_READ, device.INPUT_START, device.INPUT_DTYPE.itemsize):
                inputs = logical
            elif (kind, physical, size) == (
                _WRITE,
                device.OUTPUT_START,
                device.OUTPUT_DTYPE.itemsize,
            ):
                outputs = logical
        return None if inputs is None or outputs is None else CameraArea(station, inputs, outputs)
