"""The document that describes a camera of another maker: ``ocmm.device/1``.

It says which device it is for, how its process data are laid out, what each number in them is, by
which clock it exposes, and what has to be written into it before it runs. A camera that follows it
needs no line of code.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Literal

import msgspec
import numpy as np

from ocmm_core.documents import Document

SCHEMA = "ocmm.device/1"
TypeName = Literal[
    "SINT", "USINT", "INT", "UINT", "DINT", "UDINT", "LINT", "ULINT", "REAL32", "REAL64"
]
FORMATS: dict[TypeName, str] = {
    "SINT": "<i1", "USINT": "<u1", "INT": "<i2", "UINT": "<u2", "DINT": "<i4", "UDINT": "<u4",
    "LINT": "<i8", "ULINT": "<u8", "REAL32": "<f4", "REAL64": "<f8",
}  # fmt: skip


class Sends(StrEnum):
    """What the numbers of a spot are."""

    PIXELS = "pixels"
    """Where the light is on the sensor, px times ``step``."""
    ONE_STEP = "corrected mm, one step"
    """Image points in mm, corrected in one step as the thesis does (2.4.1): x = xd - d(xd)."""
    EXACT = "corrected mm, exact"
    """Image points in mm, corrected exactly: xd = x + d(x)."""


class Clock(StrEnum):
    """By what the camera exposes, and so how the time of an exposure is known."""

    DISTRIBUTED = "distributed"
    """SYNC0 of the distributed clock: all cameras at the same moment."""
    ARRIVAL = "arrival"
    """Its own clock: an exposure is as old as its arrival says, within the doubt."""


class Role(StrEnum):
    """What an entry of the process data is."""

    X = "x"
    Y = "y"
    INTENSITY = "intensity"
    """Brightness of a spot; a spot of zero intensity is not there."""
    VALID = "valid"
    """Bit s: slot s holds a spot."""
    COUNTER = "counter"
    """One more at each renewal of the inputs."""
    TIME = "time"
    """Of the first exposure in the inputs, ns of the bus clock."""
    BUTTON = "button"
    """Anything but zero: the button of the probe is pressed."""
    HEARTBEAT = "heartbeat"
    """Output: the number of the bus cycle."""
    CONSTANT = "constant"
    """Output: ``value``."""
    IGNORED = "ignored"
    """Not used."""


class Entry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of a process data object, or one for each slot."""

    index: int
    sub: int
    """`index`, `sub`: Place in the object dictionary."""
    type: TypeName
    """On the wire, low byte first."""
    role: tuple[Role, ...]
    """What it is; several roles are so many entries one behind the other, e.g. x and y."""
    slots: bool = False
    """Whether there is one for each slot, one behind the other."""
    value: int = 0


class ProcessObject(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One process data object."""

    index: int
    entries: tuple[Entry, ...]
    """In the order of the wire."""
    exposures: bool = False
    """Whether there is one for each exposure of a cycle, one behind the other; indices of the
    mapping objects and of their entries then go up by ``step``."""
    step: int = 1


class StartUp(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A value that is written, and read back, before the camera runs."""

    index: int
    sub: int
    type: TypeName
    value: float

    @property
    def content(self) -> bytes:
        """Return the value as on the wire."""
        form = np.dtype(FORMATS[self.type])
        number = np.array(self.value if form.kind == "f" else round(self.value))
        return number.astype(form).tobytes()


class DeviceDescription(Document, frozen=True, kw_only=True):
    """A camera of another maker."""

    name: str
    vendor: int
    product: int
    revisions: tuple[int, int]
    """`vendor`, `product`, `revisions`: Which devices it is for; the lowest and the highest
    revision."""
    sends: Sends
    """What the numbers of a spot are."""
    step: float
    """Of these numbers, px or mm."""
    slots: int
    """How many spots an exposure has, 1 to 8."""
    exposures: int
    """How many exposures a cycle brings, 1 to 12."""
    clock: Clock
    """By what it exposes."""
    doubt_ns: int
    """How wrong the time of an exposure can be."""
    inputs: tuple[ProcessObject, ...]
    outputs: tuple[ProcessObject, ...]
    """`outputs`, `inputs`: Process data objects."""
    cycle_ns: int = 1_000_000
    """The bus cycle that it needs; an exposure takes that divided by their number."""
    latency_ns: int = 0
    """From the end of a block of exposures until its inputs are renewed."""
    lens_doubt_px: float = 0.0
    """How far the pixels that the corrected points are led back to can be wrong, px, because the
    camera computes with numbers of its own."""
    start_up: tuple[StartUp, ...] = ()
    """What is written before it runs."""
    mailbox: tuple[int, int, int, int] = (0x1000, 256, 0x1100, 256)
    """Start and size of the mailbox out, start and size of the mailbox in."""
    memory: tuple[int, int] = (0x1400, 0x1800)
    """Where outputs and inputs begin in the controller."""
    note: str = ""
    """Where the description is from."""

    @property
    def period_ns(self) -> int:
        """Return the time between two exposures."""
        return self.cycle_ns // self.exposures

    @property
    def is_corrected(self) -> bool:
        """Return whether it sends corrected millimetres."""
        return self.sends is not Sends.PIXELS

    def has(self, role: Role) -> bool:
        """Return whether its inputs hold such a number."""
        return any(role in entry.role for pdo in self.inputs for entry in pdo.entries)

    def is_for(self, vendor: int, product: int, revision: int) -> bool:
        """Return whether a device is of this kind."""
        low, high = self.revisions
        return (vendor, product) == (self.vendor, self.product) and low <= revision <= high
