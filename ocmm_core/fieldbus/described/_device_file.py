"""Description of a camera of another maker: document ``ocmm.device/1``.

It defines the device, its process data layout, the meaning of each value, the exposure clock, and
the values written at start-up. A camera that follows it needs no code.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Literal

import msgspec
import numpy as np

from ocmm_core.documents import Document

SCHEMA = "ocmm.device/1"
TypeName = Literal[
    "SINT", "USINT", "INT", "UINT", "DINT", "UDINT", "LINT", "ULINT", "REAL32", "REAL64", "BOOL",
    "BITS",
]  # fmt: skip
FORMATS: dict[TypeName, str] = {
    "SINT": "<i1", "USINT": "<u1", "INT": "<i2", "UINT": "<u2", "DINT": "<i4", "UDINT": "<u4",
    "LINT": "<i8", "ULINT": "<u8", "REAL32": "<f4", "REAL64": "<f8", "BOOL": "<u1", "BITS": "<u8",
}  # fmt: skip
MOST_BITS = 64
"""Longest number; entries without a role may have `LONGEST_BITS`."""
LONGEST_BITS = 255
"""Longest entry of a mapping object, whose length is one byte."""


class Sends(StrEnum):
    """Unit of spot coordinates."""

    PIXELS = "pixels"
    """Sensor position, px times ``step``."""
    ONE_STEP = "corrected mm, one step"
    """Image points, mm, corrected in one step as in the thesis (2.4.1): x = xd - d(xd)."""
    EXACT = "corrected mm, exact"
    """Image points, mm, exactly corrected: xd = x + d(x)."""


class Clock(StrEnum):
    """Exposure clock, and so the source of exposure times."""

    DISTRIBUTED = "distributed"
    """SYNC0 of the distributed clock: all cameras at once."""
    ARRIVAL = "arrival"
    """Camera clock: exposure time from arrival, within `doubt_ns`."""


class Role(StrEnum):
    """Meaning of a process data entry."""

    X = "x"
    Y = "y"
    INTENSITY = "intensity"
    """Spot brightness; zero means no spot."""
    VALID = "valid"
    """Bit s: slot s holds a spot; or one entry per slot, 0 without a spot."""
    COUNTER = "counter"
    """Increments at each renewal of the inputs."""
    TIME = "time"
    """First exposure in the inputs, ns of the bus clock."""
    BUTTON = "button"
    HEARTBEAT = "heartbeat"
    CONSTANT = "constant"
    IGNORED = "ignored"


class Entry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Entry of a process data object, or one per slot."""

    index: int
    sub: int
    type: TypeName
    """Little-endian on the wire, lowest bit first; "BITS" is an unsigned number of `bits`."""
    role: tuple[Role, ...]
    """Roles; several roles are consecutive entries, such as x and y."""
    slots: bool = False
    """One entry per slot, consecutive."""
    slot: int = -1
    """The only slot of this entry, first 0; -1: see `slots`."""
    bits: int = 0
    """Length on the wire if shorter than the type; entries need not start on a byte."""
    value: int = 0

    @property
    def is_gap(self) -> bool:
        """Return whether it only pads: index 0, as in a mapping object."""
        return self.index == 0

    @property
    def width(self) -> int:
        """Return the length of one entry, bits."""
        whole = 1 if self.type == "BOOL" else 8 * np.dtype(FORMATS[self.type]).itemsize
        return self.bits or whole

    @property
    def is_of_slots(self) -> bool:
        """Return whether it belongs to single slots."""
        return self.slots or self.slot >= 0


class ProcessObject(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A process data object."""

    index: int
    entries: tuple[Entry, ...]
    exposures: bool = False
    """One object per exposure of a cycle, consecutive; indices of mapping objects and entries
    increase by ``step``."""
    step: int = 1


class StartUp(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A value written and read back before operation."""

    index: int
    sub: int
    type: TypeName
    value: float

    @property
    def content(self) -> bytes:
        """Return the value in wire format."""
        form = np.dtype(FORMATS[self.type])
        number = np.array(self.value if form.kind == "f" else round(self.value))
        return number.astype(form).tobytes()


class DeviceDescription(Document, frozen=True, kw_only=True):
    """A camera of another maker."""

    name: str
    vendor: int
    product: int
    revisions: tuple[int, int]
    """`vendor`, `product`, `revisions`: matching devices; lowest and highest revision."""
    sends: Sends
    step: float
    """Resolution of these coordinates, px or mm."""
    slots: int
    exposures: int
    """`slots`: Spots per exposure, 1 to 8; `exposures`: Exposures per cycle, 1 to 12."""
    clock: Clock
    doubt_ns: int
    inputs: tuple[ProcessObject, ...]
    outputs: tuple[ProcessObject, ...]
    cycle_ns: int = 1_000_000
    """Required bus cycle; the exposure period is this over `exposures`."""
    latency_ns: int = 0
    """From the end of a block of exposures to the renewal of its inputs."""
    lens_doubt_px: float = 0.0
    """Error of pixels recovered from corrected points, px, due to the camera's own arithmetic."""
    start_up: tuple[StartUp, ...] = ()
    mailbox: tuple[int, int, int, int] = (0x1000, 256, 0x1100, 256)
    """Start and size of the mailbox out, start and size of the mailbox in."""
    memory: tuple[int, int] = (0x1400, 0x1800)
    """Start of outputs and inputs in the controller."""
    note: str = ""

    @property
    def period_ns(self) -> int:
        return self.cycle_ns // self.exposures

    @property
    def is_corrected(self) -> bool:
        """Return whether it sends corrected millimetres."""
        return self.sends is not Sends.PIXELS

    def has(self, role: Role) -> bool:
        """Return whether its inputs contain a role."""
        return any(role in entry.role for pdo in self.inputs for entry in pdo.entries)

    def is_for(self, vendor: int, product: int, revision: int) -> bool:
        low, high = self.revisions
        return (vendor, product) == (self.vendor, self.product) and low <= revision <= high
