"""What can be made to go wrong with the software cameras, and how they are told while they run."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import msgspec


@dataclass(frozen=True, slots=True)
class Faults:
    """Answers that get lost on purpose, the same ones every time."""

    drop: float = 0.0
    """Part of the answers that get lost while the cameras are in operation, 0 to 1."""
    seed: int = 0
    """Which ones."""


CORRUPT_WITH_SUM, COPIED, EXCHANGED, SHARED = 2, 3, 4, 16
"""Values of `FaultKind.CORRUPT`; the last one is added to another."""


class FaultKind(StrEnum):
    """What is done to a camera or its cable; the comment says what ``value`` means."""

    NOTHING = "nothing"
    """Only answer, with the state of the camera."""
    POWER_OFF = "power off"
    """The camera and the cable behind it are dead."""
    POWER_ON = "power on"
    """The camera starts: next boot counter, nothing configured, another clock."""
    RESTART = "restart"
    """Off and on within one cycle."""
    MUTE = "mute"
    """1: frames pass the camera without being worked on; 0: no more."""
    FREEZE = "freeze"
    """1: the camera's program stands still, its controller goes on; 0: no more."""
    FALL_BACK = "fall back"
    """To the AL state ``value`` with the AL status code ``code``."""
    STATION = "station"
    """The station address becomes ``value``."""
    SERIAL = "serial"
    """The camera is exchanged for one with the serial number ``value``."""
    ALIAS = "alias"
    """The camera is exchanged for one with the station alias ``value``."""
    SWAP = "swap"
    """The cables are exchanged with those of the camera ``value``, both off meanwhile."""
    UNPLUG = "unplug"
    """The camera is taken off; its cables are joined."""
    PLUG = "plug"
    """The camera is put back to its place, restarted."""
    CLOCK_JUMP = "clock jump"
    """The camera's clock jumps by ``value`` ns."""
    CLOCK_RATE = "clock rate"
    """The camera's clock runs ``value`` ppb too fast."""
    FRAME_PERIOD = "frame period"
    """The camera exposes every ``value`` ns whatever it was told; 0: as told."""
    HANG_MAILBOX = "hang mailbox"
    """1: the camera takes mailboxes and never answers; 0: no more."""
    EMERGENCY = "emergency"
    """The camera sends an emergency message with error code ``value``; 0: the error is over."""
    CORRUPT = "corrupt"
    """1: one bit of each of the camera's answers is wrong; 2: one bit of its frame counter and
    times, with the right check sum; 3: its inputs are those of the next camera; 4: so are those of
    that camera its own; 16 more: in three of ten cycles only; 0: no more."""
    REMAP = "remap"
    """Position ``value`` of the input assignment shows the mapping object ``code``."""
    LINK_ERRORS = "link errors"
    """Port 0 counts ``value`` broken frames."""
    BREAK = "break"
    """1: the cable behind the camera is broken; 0: it is repaired."""


class CameraDeed(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One deed; see `FaultKind` for what ``value`` and ``code`` mean."""

    do: FaultKind
    """What."""
    camera: int = 0
    """To which camera, by its number in the configuration of the segment, 0 first."""
    value: int = 0
    code: int = 0
    """`value`, `code`: With which numbers."""


class DeedAnswer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the cameras say when a deed is done."""

    monotonic_ns: int
    utc_ns: int
    """`monotonic_ns`, `utc_ns`: When it took effect."""
    order: tuple[int, ...] = ()
    """Numbers of the cameras that are plugged in, in the order of the wire."""
    states: tuple[int, ...] = ()
    """AL state of each camera, error bit included, by its number; 0 without power."""
    boots: tuple[int, ...] = ()
    """Boot counter of each camera."""
    error: str = ""
    """Why it was not done; empty where it was."""
