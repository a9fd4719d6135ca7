"""Position of each camera's process data, learned from a captured bring-up."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from ocmm_core.fieldbus.device import (
    IDENTITY,
    IDENTITY_SERIAL,
    INPUT_DTYPE,
    INPUT_START,
    MAILBOX_IN_START,
    OUTPUT_DTYPE,
    OUTPUT_START,
)
from ocmm_core.fieldbus.objects import SERVICE_SDO_RESPONSE, coe_content
from ocmm_core.fieldbus.wire import Command, Datagram

_FMMU, _FMMU_BYTES, _N_FMMU = 0x0600, 16, 8
_FMMU_STRUCT = struct.Struct("<IHBBHBBB")
_READ, _WRITE = 1, 2
_WRITES = (Command.FPWR, Command.FPRW)
_SERIAL_ANSWER = struct.pack("<BHB", 0x43, IDENTITY, IDENTITY_SERIAL)
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
        return self.inputs + INPUT_DTYPE.itemsize


def usual_layout(n_cameras: int) -> tuple[CameraArea, ...]:
    """Return the layout of our own master: all outputs, then all inputs."""
    first_input = n_cameras * OUTPUT_DTYPE.itemsize
    return tuple(
        CameraArea(
            _FIRST_STATION + place,
            first_input + place * INPUT_DTYPE.itemsize,
            place * OUTPUT_DTYPE.itemsize,
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
        elif datagram.command == Command.FPRD and datagram.register == MAILBOX_IN_START:
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
            if (kind, physical, size) == (_READ, INPUT_START, INPUT_DTYPE.itemsize):
                inputs = logical
            elif (kind, physical, size) == (_WRITE, OUTPUT_START, OUTPUT_DTYPE.itemsize):
                outputs = logical
        if inputs is None or outputs is None:
            return None
        return CameraArea(station, inputs, outputs)
