"""The camera's own objects: data, configuration, commands, information.

Also messages of the diagnosis history, object 0x10F3 (ETG.1020, chapter 16).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device._camera_slave import (
    N_SLOTS,
    OUTPUT_PDO,
    CameraConfig,
    CameraMode,
    DataType,
    Pdo,
)
from ocmm_core.fieldbus.device._firmware import BLOB_BYTES
from ocmm_core.fieldbus.device._input_layout import InputLayout
from ocmm_core.fieldbus.device._object_entries import (
    Access,
    DictionaryObject,
    ObjectEntry,
    number,
    octets,
    record,
    text_entry,
)

CONFIGURATION = 0x8000
WINDOWS = 0x8001
CALIBRATION = 0x8010
BLACK_IMAGE = 0x8020
SNAPSHOT = 0x8030
IDENTIFY = 0x8040
INFORMATION = 0x9000
VERSIONS = 0x9010
COUNTERS = 0xA000

CHUNK_BYTES = 4096
"""Bytes of a snapshot per transfer."""
NOTE_BYTES = 1200
MAX_BLACK_FRAMES = 4096
MAX_GREY_LEVEL = (1 << 14) - 1
"""14-bit sensor."""


class BlackCommand(IntEnum):
    """Commands of the black image (0x8020:01)."""

    MEASURE = 1
    """Switch the LEDs off, average exposures and apply the mean."""
    STORE = 2
    """Store the active image permanently."""
    LOAD = 3
    CLEAR = 4
    """Disable and delete the stored image."""


class SnapshotCommand(IntEnum):
    """Commands of the snapshot (0x8030:05)."""

    TAKE = 1
    """Capture a raw image of the region and hold it."""
    RELEASE = 2


class Work(IntEnum):
    """State of a lengthy command."""

    IDLE = 0
    BUSY = 1
    DONE = 2
    FAILED = 3


class BlackImage(IntFlag):
    """Available black images (0x8020:05)."""

    IN_USE = 1
    STORED = 2
    SAME = 4
    """The active image equals the stored one."""


_WINDOW = (("left", "px"), ("top", "px"), ("width", "px"), ("height", "px"))


def profile_objects(serial: int, layout: InputLayout) -> dict[int, DictionaryObject]:
    """Return objects 0x6000 and above of the camera with this serial number, by index."""
    objects = {
        CONFIGURATION: _configuration(),
        WINDOWS: record(
            "Windows",
            [
                number(
                    f"Window {slot} {name}", DataType.UINT, unit=unit, access=Access.WRITE_PREOP,
                    text="All four zero: the camera chooses by itself." if name == "left" else "",
                )
                for slot in range(N_SLOTS)
                for name, unit in _WINDOW
            ],
            "Where on the sensor the spot of each slot is looked for.",
        ),
        CALIBRATION: _calibration(),
        BLACK_IMAGE: _black_image(),
        SNAPSHOT: _snapshot(),
        IDENTIFY: _identify(),
        INFORMATION: _information(serial),
        VERSIONS: record(
            "Versions",
            [
                text_entry("Firmware", f"{layout.revision >> 16}.0.0"),
                text_entry("Sensor logic", "1.0.0"),
                text_entry("Boot loader", "1.0.0"),
                number(
                    "Object table", DataType.UINT, layout.revision >> 16, "Version of this table."
                ),
            ],
            "What runs in the camera.",
        ),
        COUNTERS: _counters(),
    }  # fmt: skip
    for pdo in (*layout.input_pdos, OUTPUT_PDO):
        objects[pdo.entries[0].index] = _mapped(pdo)
    return objects


def _mapped(pdo: Pdo) -> DictionaryObject:
    entries = [
        ObjectEntry(
            entry.name, entry.kind, bytes(entry.bits // 8), unit=entry.unit, text=entry.text,
            live=True, mapped=True,
        )
        for entry in pdo.entries
    ]  # fmt: skip
    side = "outputs" if pdo is OUTPUT_PDO else "inputs"
    return record(f"{pdo.name} data", entries, f"The {side} of {pdo.index:#06x} as they are now.")


def _configuration() -> DictionaryObject:
    config = CameraConfig()
    preop = Access.WRITE_PREOP
    return record(
        "Configuration",
        [
            number("Frame period", DataType.UDINT, config.frame_period_ns, unit="ns",
                   access=preop, low=50_000, high=1_000_000_000,
                   text="Between two exposures; with the clock in use SYNC0 decides."),
            number("Exposure", DataType.UDINT, config.exposure_ns, unit="ns",
                   access=preop, low=1, high=999_999_999,
                   text="Shorter than the frame period."),
            number("Threshold", DataType.UINT, config.threshold, unit="grey levels",
                   access=preop, high=MAX_GREY_LEVEL,
                   text="A pixel above it belongs to a spot."),
            number("Mode", DataType.USINT, config.mode, access=preop, high=max(CameraMode),
                   text="0: raw spots, px. 1: corrected image points, mm; needs intrinsics."),
            number("LED strobe", DataType.UINT, config.strobe, access=preop,
                   high=(1 << N_SLOTS) - 1, text="Bit s lights LED s; 0 lights all."),
        ],
        "In force from the change to SAFEOP on; the header shows its check sum.",
    )  # fmt: skip


def _calibration() -> DictionaryObject:
    return record(
        "Intrinsics",
        [
            octets("Intrinsics", BLOB_BYTES, "Block of data, see below; kept without power.",
                   access=Access.WRITE),
            number("Length", DataType.UDINT, unit="bytes", text="0: none stored.", live=True),
            octets("SHA-256", 32, "Of the block; empty where there is none."),
            number("CRC-32", DataType.UDINT, text="Of the block.", live=True),
            octets("Note", NOTE_BYTES, "Free text beside the block, UTF-8; kept without power.",
                   access=Access.WRITE),
        ],
        "What this camera's lens does to an image, found by calibration.",
    )  # fmt: skip


def _black_image() -> DictionaryObject:
    return record(
        "Black image",
        [
            number("Command", DataType.USINT, text="1 measure, 2 store, 3 load, 4 clear.",
                   access=Access.WRITE, low=1, high=max(BlackCommand)),
            number("Exposures", DataType.UINT, 64, "How many are averaged.",
                   access=Access.WRITE, low=1, high=MAX_BLACK_FRAMES),
            number("State", DataType.USINT, text="0 idle, 1 busy, 2 done, 3 failed.", live=True),
            number("Progress", DataType.USINT, unit="%", live=True),
            number("Images", DataType.USINT, live=True,
                   text="Bit 0: one is in use; bit 1: one is stored; bit 2: it is the same."),
            octets("SHA-256", 32, "Of the one in use; empty where there is none."),
            number("CRC-32", DataType.UDINT, text="Of the one in use.", live=True),
            number("Mean", DataType.UINT, unit="0.1 grey levels", live=True,
                   text="Of the one in use."),
        ],
        "The dark pattern of the sensor, subtracted from every exposure. No spots while measuring.",
    )  # fmt: skip


def _snapshot() -> DictionaryObject:
    region = [
        number(name, DataType.UINT, unit="px", access=Access.WRITE,
               text="Width or height 0: the whole sensor." if name == "Left" else "")
        for name in ("Left", "Top", "Width", "Height")
    ]  # fmt: skip
    return record(
        "Snapshot",
        [
            *region,
            number("Command", DataType.USINT, text="1 take, 2 release.",
                   access=Access.WRITE, low=1, high=max(SnapshotCommand)),
            number("State", DataType.USINT, text="0 idle, 1 busy, 2 done, 3 failed.", live=True),
            number("Progress", DataType.USINT, unit="%", live=True),
            number("Total", DataType.UDINT, unit="bytes", text="Of the picture.", live=True),
            number("Chunk offset", DataType.UDINT, unit="bytes", access=Access.WRITE,
                   text="Where in the picture the chunk begins."),
            octets("Chunk", CHUNK_BYTES,
                   "Pixels row by row, two bytes each, low byte first; short at the end."),
            number("CRC-32", DataType.UDINT, text="Of the whole picture.", live=True),
            number("Picture width", DataType.UINT, unit="px", live=True),
            number("Picture height", DataType.UINT, unit="px", live=True),
        ],
        "A raw picture as the sensor sees it, read in chunks.",
    )  # fmt: skip


def _identify() -> DictionaryObject:
    return record(
        "Identify",
        [
            number("Seconds", DataType.UINT, unit="s", access=Access.WRITE, low=0, high=600,
                   text="The camera blinks for so long; 0 ends it."),
            number("Left", DataType.UINT, unit="s", text="0: it does not blink.", live=True),
        ],
        "Lets people find the camera: its status light blinks twice a second.",
    )  # fmt: skip


def _information(serial: int) -> DictionaryObject:
    return record(
        "Information",
        [
            number("Sensor serial number", DataType.UDINT, serial),
            number("Width", DataType.UINT, unit="px", live=True),
            number("Height", DataType.UINT, unit="px", live=True),
            number("Temperature", DataType.INT, unit="0.1 degC", text="Of the sensor.", live=True),
            number("Operating hours", DataType.UDINT, unit="h", live=True,
                   text="Since it was made, powered."),
            number("Pixel pitch", DataType.UDINT, 12_000, unit="nm"),
            number("Slots", DataType.USINT, N_SLOTS),
            number("Grey levels", DataType.UINT, MAX_GREY_LEVEL + 1),
        ],
        "What the camera is.",
    )  # fmt: skip


def _counters() -> DictionaryObject:
    return record(
        "Counters",
        [
            number(name, DataType.UDINT, text=text, live=True)
            for name, text in (
                ("Frames lost", "Dropped because nobody took them."),
                ("Watchdog events", "The master's outputs stayed away."),
                ("Overruns", "How often the buffer began to drop frames."),
                ("Bad mailboxes", "Answered with an error reply, or not at all."),
                ("Link events", "Lost links of both ports."),
                ("Emergencies", "Emergency messages, also those that nobody took."),
            )
        ],
        "Since the camera was switched on; frames lost since the exposures began.",
    )


# Diagnosis code, flags, text, time, then two parameters: the error register and five bytes.
_MESSAGE = struct.Struct("<HHHHQHBH5s")
MESSAGE_BYTES = _MESSAGE.size
_EMERGENCY_CODE = 0xE800
_ERROR_LEVEL, _INFO_LEVEL = 2, 0
_TWO_PARAMETERS = 2 << 8
_OCTETS = 1 << 12
DATA_BYTES = 5


@dataclass(frozen=True, slots=True)
class DiagnosisMessage:
    """One entry of the error history."""

    code: int
    """Error code of the emergency message; 0: the previous error is over."""
    time_ns: int
    register: int
    data: bytes

    def encode(self) -> bytes:
        level = _ERROR_LEVEL if self.code else _INFO_LEVEL
        return _MESSAGE.pack(
            _EMERGENCY_CODE, self.code, _TWO_PARAMETERS | level, self.code, self.time_ns,
            DataType.USINT, self.register, _OCTETS | DATA_BYTES, self.data,
        )  # fmt: skip

    @classmethod
    def decode(cls, content: bytes) -> DiagnosisMessage:
        """Return the message; raise BusError if it is not of this camera."""
        if len(content) == MESSAGE_BYTES:
            kind, code, flags, _text, time_ns, usint, register, octets, data = _MESSAGE.unpack(
                content
            )
            if (kind, flags & 0xFF00, usint, octets) == (
                _EMERGENCY_CODE, _TWO_PARAMETERS, DataType.USINT, _OCTETS | DATA_BYTES,
            ):  # fmt: skip
                return cls(code, time_ns, register, data)
        raise BusError(
            "bus.history",
            f"The camera error history contains a message of {len(content)} bytes that this "
            "program cannot read.",
            "Install the camera firmware that matches this program.",
        )
