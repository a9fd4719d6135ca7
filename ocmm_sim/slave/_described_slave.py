"""Software camera built from a description `ocmm.device/1` only.

In: the description, the sensor view, and its correction lens. Out: an EtherCAT slave whose bytes
follow the description.

EEPROM, object dictionary and exposures follow ETG.2010 and ETG.1000.6. It must not import the
host's decoder.
"""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import CameraModel
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described import (
    Clock,
    DeviceDescription,
    ProcessImage,
    Role,
    corrected_from_pixels,
)
from ocmm_core.fieldbus.device import (
    IDENTITY,
    SM_ASSIGNMENT,
    SM_INPUTS,
    SM_OUTPUTS,
    DataType,
    DictionaryObject,
    ObjectEntry,
)
from ocmm_sim.slave._coe import CoeServer
from ocmm_sim.slave._esc import Esc
from ocmm_sim.slave._esi import SII_BYTES, SII_CONFIGURATION
from ocmm_sim.slave._frames import CHUNK_FRAMES, CameraFrames, Frames
from ocmm_sim.slave._registers import INIT, SAFEOP
from ocmm_sim.slave._sii import checksum_of_configuration, sii_category

_PROTOCOL_COE = 0x0004
_STRINGS, _GENERAL, _FMMU, _SYNC_MANAGERS, _TX_PDO, _RX_PDO = 10, 30, 40, 41, 50, 51
_COE_SDO = 0x01
_PORTS = 0x0011
_MANDATORY, _FIXED = 0x0001, 0x0010
_DEVICE_TYPE, _NAME, _SM_TYPES = 0x1000, 0x1008, 0x1C00
_BY_SIZE = {1: DataType.USINT, 2: DataType.UINT, 4: DataType.UDINT, 8: DataType.ULINT}

SyncManagers = tuple[tuple[int, ...], ...]


def _sync_managers(device: DeviceDescription, image: ProcessImage) -> SyncManagers:
    out, out_bytes, into, in_bytes = device.mailbox
    outputs, inputs = device.memory
    return (
        (out, out_bytes, 0x26, 0, 1, 1),
        (into, in_bytes, 0x22, 0, 1, 2),
        (outputs, image.output_bytes, 0x64, 0, 1, 3),
        (inputs, image.input_bytes, 0x20, 0, 1, 4),
    )


def _described_eeprom(
    device: DeviceDescription, image: ProcessImage, serial: int, alias: int
) -> bytes:
    head = bytearray(SII_CONFIGURATION)
    struct.pack_into("<H", head, 8, alias)
    head += struct.pack("<H", checksum_of_configuration(head))
    head += struct.pack("<IIII", device.vendor, device.product, device.revisions[1], serial)
    head += bytes(16) + struct.pack("<HHHHH", *device.mailbox, _PROTOCOL_COE)
    head = head.ljust(0x7C, b"\x00") + struct.pack("<HH", SII_BYTES * 8 // 1024 - 1, 1)
    name = device.name.encode("ascii", errors="replace")[:64]
    managers = b"".join(struct.pack("<HHBBBB", *each) for each in _sync_managers(device, image))
    general = struct.pack("<BBBBBB8xBBH", 1, 0, 1, 1, 0, _COE_SDO, 1, 0, _PORTS).ljust(32, b"\x00")
    body = sii_category(_STRINGS, bytes([1, len(name)]) + name)
    body += sii_category(_GENERAL, general)
    body += sii_category(_FMMU, bytes([1, 2]))
    body += sii_category(_SYNC_MANAGERS, managers)
    for category, manager, objects in (
        (_TX_PDO, SM_INPUTS, image.inputs),
        (_RX_PDO, SM_OUTPUTS, image.outputs),
    ):
        for index, entries in objects:
            flags = _MANDATORY | _FIXED
            content = struct.pack("<HBBBBH", index, len(entries), manager, 0, 0, flags)
            content += b"".join(
                struct.pack("<HBBBBH", one.index, one.sub, 0, one.code, one.bits, 0)
                for one in entries
            )
            body += sii_category(category, content)
    return (bytes(head) + body + b"\xff\xff").ljust(SII_BYTES, b"\xff")


def _described_dictionary(
    device: DeviceDescription, image: ProcessImage, serial: int
) -> dict[int, DictionaryObject]:
    name = device.name.encode("ascii", errors="replace")
    identity = (device.vendor, device.product, device.revisions[1], serial)
    objects = {
        _DEVICE_TYPE: _single("Device type", _number(4, 0)),
        _NAME: _single("Name", ObjectEntry("Name", DataType.VISIBLE_STRING, name)),
        IDENTITY: _record("Identity", [_number(4, each) for each in identity]),
        _SM_TYPES: _record("Sync managers", [_number(1, kind) for kind in (1, 2, 3, 4)]),
    }
    for manager, pdos in ((SM_OUTPUTS, image.outputs), (SM_INPUTS, image.inputs)):
        objects[SM_ASSIGNMENT + manager] = _record(
            "Assignment", [_number(2, index) for index, _entries in pdos]
        )
        for index, entries in pdos:
            objects[index] = _record("Mapping", [_number(4, one.mapping) for one in entries])
    for each in device.start_up:
        known = objects.get(each.index)
        settings = dict(known.entries) if known is not None else {}
        settings[each.sub] = ObjectEntry(
            "Setting", _BY_SIZE[len(each.content)], bytes(len(each.content)), writable=True
        )
        settings[0] = _number(1, max(settings))
        objects[each.index] = DictionaryObject("Settings", dict(sorted(settings.items())), True)
    return dict(sorted(objects.items()))


def _number(size: int, value: int) -> ObjectEntry:
    return ObjectEntry("", _BY_SIZE[size], value.to_bytes(size, "little"))


def _single(name: str, entry: ObjectEntry) -> DictionaryObject:
    return DictionaryObject(name, {0: entry}, record=False, kind=entry.kind)


def _record(name: str, entries: list[ObjectEntry]) -> DictionaryObject:
    numbered = dict(enumerate(entries, start=1))
    return DictionaryObject(name, {0: _number(1, len(entries)), **numbered}, record=True)


_AHEAD = 2
"""Blocks of frames made before they are exposed."""
_BRIGHTNESS = 1000


class DescribedCamera:
    """One camera built from its description; an `Application` of its controller.

    ``lens`` corrects the spots and is required if it sends corrected millimetres. Faults:
    ``frozen``, its program hangs while its controller answers; ``mailbox_hangs``, mailboxes are
    never answered. Exposure k is at ``start_ns + k * period_ns`` of its clock; a period of 0: none.
    """

    def __init__(
        self,
        index: int,
        serial: int,
        alias: int,
        provider: CameraFrames,
        device: DeviceDescription,
        lens: CameraModel | None = None,
    ) -> None:
        if device.is_corrected and lens is None:
            raise InputError(
                "simulation.lens",
                f"The camera '{device.name}' corrects, but its lens is not known.",
                "Give the rig that it belongs to.",
            )
        self._index = index
        self._provider = provider
        self._device = device
        self._lens = lens
        self._image = ProcessImage(device)
        self.frozen = self.mailbox_hangs = False
        self.start_ns = self.period_ns = 0
        self.renewals = 0
        self._block: int | None = None
        self._pieces: dict[int, Frames] = {}
        self.esc = Esc(
            _described_eeprom(device, self._image, serial, alias),
            7_000_000_000 * (index + 1),
            self,
            _sync_managers(device, self._image),
        )
        self.coe = CoeServer(
            _described_dictionary(device, self._image, serial), device.mailbox[1], {}
        )

    def answer(self, mailbox: bytes) -> bytes | None:
        """Return the answer to a mailbox; None while mailboxes hang."""
        return None if self.mailbox_hangs else self.coe.answer(mailbox)

    def state_changed(self, state: int) -> None:
        if state == INIT:
            self.coe.reset()
        if state < SAFEOP:
            self.period_ns = 0
        elif not self.period_ns:
            self._start()

    def outputs_written(self) -> None:
        """Do nothing: such a camera ignores its outputs."""

    def refresh_inputs(self) -> None:
        """Publish the last complete block of exposures."""
        if self.frozen or not self.period_ns:
            return
        exposures = self._device.exposures
        since_ns = self.esc.system_time_ns - self.start_ns - self._device.latency_ns
        block = since_ns // (self.period_ns * exposures) - 1
        if block == self._block or block < 0:
            return
        self.renewals += 1 if self._block is None else block - self._block
        self._block = block
        content = self.inputs(block * exposures)
        at = self._device.memory[1]
        self.esc.memory[at : at + len(content)] = content

    def inputs(self, first: int) -> bytes:
        """Return the inputs starting at this exposure number."""
        device, image = self._device, self._image
        valid, flags, uv = self._frames(first)
        seen = valid[:, None] >> np.arange(device.slots) & 1 == 1
        values: dict[tuple[Role, int, int], float] = {
            (Role.COUNTER, -1, -1): self.renewals,
            (Role.TIME, -1, -1): self.start_ns + first * self.period_ns,
        }
        spots = uv[:, : device.slots]
        if self._lens is not None:
            # Absent spots are not computed.
            spots = corrected_from_pixels(self._lens, spots, device.sends)
        spots = np.where(seen[..., None], spots / device.step, 0.0)
        # Spots outside the number range are not seen.
        seen &= image.fits(Role.X, spots).all(axis=-1)
        spots = np.where(seen[..., None], spots, 0.0)
        valid = (seen << np.arange(device.slots)).sum(axis=1)
        for exposure in range(device.exposures):
            values[Role.COUNTER, exposure, -1] = self.renewals * device.exposures + exposure
            values[Role.TIME, exposure, -1] = self.start_ns + (first + exposure) * self.period_ns
            values[Role.BUTTON, exposure, -1] = float(flags[exposure] & 1)
            values[Role.VALID, exposure, -1] = float(valid[exposure])
            for slot in range(device.slots):
                values[Role.X, exposure, slot], values[Role.Y, exposure, slot] = (
                    float(number) for number in spots[exposure, slot]
                )
                values[Role.VALID, exposure, slot] = float(seen[exposure, slot])
                if seen[exposure, slot]:
                    values[Role.INTENSITY, exposure, slot] = _BRIGHTNESS
        if device.exposures == 1:
            for role in (Role.BUTTON, Role.VALID):
                values[role, -1, -1] = values[role, 0, -1]
        return image.pack_inputs(values)

    def generate(self, now_ns: int) -> bool:
        """Make a piece of frames ahead; return whether one was made."""
        self.esc.now_ns = now_ns
        if not self.period_ns:
            return False
        newest = (self.esc.system_time_ns - self.start_ns) // self.period_ns
        first = max(0, newest // CHUNK_FRAMES)
        for piece in range(first, first + _AHEAD):
            if piece not in self._pieces:
                self._piece(piece)
                return True
        return False

    def keep_up(self, now_ns: int) -> None:
        self.esc.now_ns = now_ns

    def _start(self) -> None:
        self._pieces.clear()
        self._block = None
        if self._device.clock is Clock.ARRIVAL:
            self.start_ns, self.period_ns = self.esc.system_time_ns, self._device.period_ns
        elif self.esc.sync0 is not None:
            self.start_ns, self.period_ns = self.esc.sync0

    def _frames(self, first: int) -> Frames:
        piece, at = divmod(first, CHUNK_FRAMES)
        end = at + self._device.exposures
        parts = [self._piece(piece)]
        if end > CHUNK_FRAMES:
            parts.append(self._piece(piece + 1))
        chosen: list[NDArray[np.generic]] = [
            np.concatenate([part[which] for part in parts])[at:end] for which in range(3)
        ]
        valid, flags, uv = chosen
        return valid.astype(np.uint16), flags.astype(np.uint16), uv.astype(np.float64)

    def _piece(self, number: int) -> Frames:
        if number not in self._pieces:
            for old in [each for each in self._pieces if each < number - 1]:
                del self._pieces[old]
            self._pieces[number] = self._provider.camera_frames(
                self._index, number * CHUNK_FRAMES, CHUNK_FRAMES
            )
        return self._pieces[number]
