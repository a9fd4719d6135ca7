"""Device model of the smart camera: identity, process data and configuration.

The object dictionary and SII image of the software camera and the host's decoder are made from the
tables in this module. The layout follows the oversampling convention of ETG.5001 devices: a header
with the time of the first exposure, then a fixed number of frames. Lengths on the wire are 2^-16
px.
"""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag

import numpy as np
from numpy.typing import NDArray

from ocmm_core.errors import BusError, InputError

VENDOR_ID = 0xFA4E0001
"""Not assigned by the EtherCAT Technology Group; marks an unregistered device."""
VENDOR_NAME = "OCMM"
PRODUCT_CODE = 0x00CA3E01
REVISION = 0x00030000
DEVICE_NAME = "OCMM smart camera"

N_SLOTS = 8
"""Tracking windows of one camera."""
FRAMES_PER_CYCLE = 12
"""Maximum frames per cycle: the 8 of 1 ms and room to catch up."""
SUBPIXELS = 65536
"""Steps of a pixel on the wire."""
SUBMILLIMETRES = 1 << 24
"""Steps of a millimetre on the wire in mode CORRECTED: 0.06 nm, range +-128 mm."""
DEFAULT_FRAME_PERIOD_NS = 125_000
COUNTER_MODULUS = 1 << 32
"""The frame counter on the wire has 32 bits."""

SM_MAILBOX_OUT, SM_MAILBOX_IN, SM_OUTPUTS, SM_INPUTS = range(4)
"""Sync managers, named from the master's side."""

MAILBOX_BYTES = 256
MAILBOX_OUT_START = 0x1000
MAILBOX_IN_START = MAILBOX_OUT_START + MAILBOX_BYTES
OUTPUT_START = 0x1400
INPUT_START = 0x1800
"""Three buffers of the inputs end at 0x21E4, inside the 8 KiB of an ET1100."""


class DataType(IntEnum):
    """CoE data types (ETG.1000.6) that the camera uses."""

    BOOLEAN = 0x0001
    INT = 0x0003
    DINT = 0x0004
    USINT = 0x0005
    UINT = 0x0006
    UDINT = 0x0007
    VISIBLE_STRING = 0x0009
    OCTET_STRING = 0x000A
    ULINT = 0x001B


_FORMAT = {
    DataType.BOOLEAN: "u1",
    DataType.INT: "<i2",
    DataType.DINT: "<i4",
    DataType.USINT: "u1",
    DataType.UINT: "<u2",
    DataType.UDINT: "<u4",
    DataType.ULINT: "<u8",
}


class CameraStatus(IntFlag):
    """Bits of the status word in the header."""

    OPERATIONAL = 1
    """The camera is in OP and received its outputs in time."""
    SYNCHRONISED = 2
    """SYNC0 starts the exposures; otherwise frame counters of cameras do not agree."""
    OVERRUN = 4
    """The camera's buffer lost frames just before this block."""
    DARK = 8
    """Black image in progress: LEDs off, no valid spots."""
    DIAGNOSIS = 16
    """The diagnosis history holds an unacknowledged message."""


class Control(IntFlag):
    """Bits of the control word."""

    STREAM = 1
    """The acknowledge counter is valid; frames up to it are released."""


@dataclass(frozen=True, slots=True)
class PdoEntry:
    """A mapped variable: place in the object dictionary, name, type, unit and meaning."""

    index: int
    sub: int
    name: str
    kind: DataType
    unit: str = ""
    text: str = ""

    @property
    def bits(self) -> int:
        return 8 * np.dtype(_FORMAT[self.kind]).itemsize

    @property
    def mapping(self) -> int:
        """Return the word of the entry in a mapping object."""
        return self.index << 16 | self.sub << 8 | self.bits


@dataclass(frozen=True, slots=True)
class Pdo:
    """A process data object: mapping object, name and entries in wire order."""

    index: int
    name: str
    entries: tuple[PdoEntry, ...]


def _entries(index: int, *variables: tuple[str, DataType, str, str]) -> tuple[PdoEntry, ...]:
    return tuple(PdoEntry(index, sub, *variable) for sub, variable in enumerate(variables, start=1))


_SPOTS = tuple(
    (
        f"{axis}{slot}",
        DataType.DINT,
        "2^-16 px",
        f"Spot in slot {slot}; in mode CORRECTED in 2^-24 mm.",
    )
    for slot in range(N_SLOTS)
    for axis in "xy"
)

_COUNTER = ("counter", DataType.UDINT, "", "Number of the first frame's exposure, modulo 2^32.")
_START = ("start_ns", DataType.ULINT, "ns", "Bus time of the first frame's exposure.")
_PERIOD = ("period_ns", DataType.UDINT, "ns", "Between two exposures; 0 while none are made.")
_VALID = ("frames_valid", DataType.USINT, "", "How many of the frames that follow are valid.")
_CONFIG = ("config_crc", DataType.UINT, "", "Check sum of the configuration in force, see below.")
_BOOT = ("boot_counter", DataType.UINT, "", "How often the camera was switched on.")

HEADER_PDO = Pdo(
    0x1A00,
    "Header",
    _entries(
        0x6000,
        _COUNTER, _START, _PERIOD, _VALID,
        ("status", DataType.USINT, "", "Bits, see below."),
        ("cycle_counter", DataType.UINT, "", "One more at each renewal, modulo 2^16."),
        _CONFIG, _BOOT,
        ("data_crc", DataType.UDINT, "", "CRC-32 of serial number and whole input, see below."),
    ),
)  # fmt: skip
FIRST_HEADER_PDO = Pdo(
    0x1A00,
    "Header",
    _entries(
        0x6000,
        _COUNTER, _START, _PERIOD, _VALID,
        ("cycle_counter", DataType.USINT, "", "One more at each renewal, modulo 256."),
        ("status", DataType.UINT, "", "Bits, see below."),
        _CONFIG, _BOOT,
        ("data_crc", DataType.UDINT, "", "CRC-32 of the whole input, this field being zero."),
    ),
)  # fmt: skip
"""First cameras: no serial number in the checksum, and the counter repeats after 256 cycles."""
FRAME_PDOS = tuple(
    Pdo(
        0x1A10 + frame,
        f"Frame {frame}",
        _entries(
            0x6100 + 0x10 * frame,
            ("valid", DataType.UINT, "", "Bit s: slot s holds a spot."),
            ("flags", DataType.UINT, "", "Bits, see below."),
            *_SPOTS,
        ),
    )
    for frame in range(FRAMES_PER_CYCLE)
)
INPUT_PDOS = (HEADER_PDO, *FRAME_PDOS)
OUTPUT_PDO = Pdo(
    0x1600,
    "Control",
    _entries(
        0x7000,
        ("control", DataType.UINT, "", "Bits, see below."),
        ("led_pattern", DataType.UINT, "", "Reserved; write 0."),
        ("ack_counter", DataType.UDINT, "", "Counter of the last frame that the master has."),
        ("heartbeat", DataType.UDINT, "", "Bus cycle of the master, modulo 2^32."),
    ),
)


def plain_dtype(pdo: Pdo) -> list[tuple[str, str]]:
    """Return the fields of a numpy structure with the entries of a PDO."""
    return [(entry.name, _FORMAT[entry.kind]) for entry in pdo.entries]


HEADER_DTYPE = np.dtype(plain_dtype(HEADER_PDO))
FRAME_DTYPE = np.dtype([("valid", "<u2"), ("flags", "<u2"), ("xy", "<i4", (N_SLOTS, 2))])
INPUT_DTYPE = np.dtype([("header", HEADER_DTYPE), ("frames", FRAME_DTYPE, (FRAMES_PER_CYCLE,))])
OUTPUT_DTYPE = np.dtype(plain_dtype(OUTPUT_PDO))
HEADER_STRUCT = struct.Struct("<IQIBBHHHI")
"""Common to all layouts: fields only swap with fields of equal size."""
OUTPUT_STRUCT = struct.Struct("<HHII")

# Start, length, control, status, activate, type (1 to 4: mailbox out, in, outputs, inputs).
SYNC_MANAGERS = (
    (MAILBOX_OUT_START, MAILBOX_BYTES, 0x26, 0, 1, 1),
    (MAILBOX_IN_START, MAILBOX_BYTES, 0x22, 0, 1, 2),
    (OUTPUT_START, OUTPUT_DTYPE.itemsize, 0x64, 0, 1, 3),
    (INPUT_START, INPUT_DTYPE.itemsize, 0x20, 0, 1, 4),
)
SYNC0_NS, SYNC1_NS = DEFAULT_FRAME_PERIOD_NS, 875_000
"""Default periods: SYNC0 exposes, SYNC1 ends the bus cycle."""


class CameraMode(IntEnum):
    """Unit of the spots sent by the camera."""

    RAW = 0
    """Spots on the sensor, px."""
    CORRECTED = 1
    """Ideal image points, mm: the camera applies its stored intrinsics."""


Window = tuple[int, int, int, int]
"""Left, top, width and height, px."""


@dataclass(frozen=True, slots=True)
class CameraConfig:
    """Settings of objects 0x8000 and 0x8001, written before operation."""

    frame_period_ns: int = DEFAULT_FRAME_PERIOD_NS
    exposure_ns: int = 20_000
    threshold: int = 200
    """Grey level above which a pixel belongs to a spot."""
    mode: CameraMode = CameraMode.RAW
    strobe: int = 0
    """Bit s lights LED s during the exposures; 0 lights all."""
    windows: tuple[Window, ...] = ()
    """Up to 8 windows, one per slot; if empty, the camera chooses."""

    def __post_init__(self) -> None:
        """Raise InputError for too many windows or a number that does not fit."""
        for name, value, bits in (
            ("frame_period_ns", self.frame_period_ns, 32),
            ("exposure_ns", self.exposure_ns, 32),
            ("threshold", self.threshold, 16),
            ("strobe", self.strobe, 16),
            *(("windows", number, 16) for window in self.windows for number in window),
        ):
            if not 0 <= value < 1 << bits:
                raise InputError(
                    "bus.configuration",
                    f"Field '{name}' of the camera's configuration is {value}, "
                    f"but must be 0 to {(1 << bits) - 1}.",
                    "Correct that field.",
                )
        if self.exposure_ns >= self.frame_period_ns:
            raise InputError(
                "bus.configuration",
                f"The exposure of {self.exposure_ns} ns does not end within the frame period of "
                f"{self.frame_period_ns} ns.",
                "Shorten the exposure.",
            )
        if len(self.windows) > N_SLOTS:
            raise InputError(
                "bus.configuration",
                f"There are {len(self.windows)} windows, but a camera has {N_SLOTS}.",
                "Leave windows out.",
            )

    @property
    def all_windows(self) -> tuple[Window, ...]:
        """Return 8 windows; unset ones are empty."""
        return self.windows + ((0, 0, 0, 0),) * (N_SLOTS - len(self.windows))

    def crc(self) -> int:
        """Return the checksum that the camera reports for this configuration.

        CRC-16/CCITT-FALSE of all values in the order of the objects, little-endian.
        """
        numbers = (number for window in self.all_windows for number in window)
        packed = struct.pack(
            f"<IIHBH{4 * N_SLOTS}H",
            self.frame_period_ns, self.exposure_ns, self.threshold, self.mode, self.strobe,
            *numbers,
        )  # fmt: skip
        return binascii.crc_hqx(packed, 0xFFFF)


def require_raw(config: CameraConfig) -> None:
    """Raise BusError if a camera would send anything but raw pixel coordinates."""
    if config.mode != CameraMode.RAW:
        raise BusError(
            "bus.mode",
            "The cameras are set to send corrected image points, but this program measures with "
            "raw pixel coordinates and its own calibration.",
            "Set the mode of the cameras to raw.",
        )


_SLOT_NUMBERS = np.arange(N_SLOTS, dtype=np.uint16)
_ALL_SLOTS = ((1 << N_SLOTS) - 1).to_bytes(2, "little")


def encode_frames(
    valid: NDArray[np.uint16],
    flags: NDArray[np.uint16],
    uv: NDArray[np.float64],
    mode: CameraMode = CameraMode.RAW,
) -> NDArray[np.void]:
    """Return frames in wire format: (n,) of `FRAME_DTYPE`.

    ``valid`` (n,): bit s: slot s holds a spot; ``flags`` (n,); ``uv`` (n, 8, 2), px, or mm in mode
    CORRECTED; invalid ones are sent as zero.
    """
    frames = np.zeros(len(valid), FRAME_DTYPE)
    frames["valid"] = valid
    frames["flags"] = flags
    seen = (valid[:, None] >> _SLOT_NUMBERS) & 1 == 1
    steps = SUBPIXELS if mode == CameraMode.RAW else SUBMILLIMETRES
    frames["xy"] = np.round(np.where(seen[:, :, None], uv, 0.0) * steps)
    return frames


def frames_of(content: bytes, first: int, end: int) -> memoryview:
    """Return the frames of a whole input from `first` to before `end`, as bytes of `FRAME_DTYPE`.

    Nothing is copied or checked.
    """
    head, size = HEADER_STRUCT.size, FRAME_DTYPE.itemsize
    return memoryview(content)[head + first * size : head + end * size]


def decode_spots(
    frames: NDArray[np.void], mode: CameraMode = CameraMode.RAW
) -> NDArray[np.float64]:
    """Return the spots (..., 8, 2) of frames (...) of `FRAME_DTYPE`; NaN if invalid.

    px in mode RAW, ideal image points in mm in mode CORRECTED.
    """
    valid = frames["valid"]
    steps = SUBPIXELS if mode == CameraMode.RAW else SUBMILLIMETRES
    # Exact, because `steps` is a power of two, and faster than a division.
    spots: NDArray[np.float64] = frames["xy"] * (1.0 / steps)
    # Bytes, because each function of numpy costs microseconds in a process that mostly sleeps.
    if valid.tobytes() != _ALL_SLOTS * valid.size:
        spots[(valid[..., None] >> _SLOT_NUMBERS) & 1 == 0] = np.nan
    return spots
