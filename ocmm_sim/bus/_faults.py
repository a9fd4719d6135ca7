"""Faults of software cameras, with their messages."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import msgspec


@dataclass(frozen=True, slots=True)
class Faults:
    """Reproducible loss of answers."""

    drop: float = 0.0
    """Fraction of answers lost in operation, 0 to 1."""
    seed: int = 0


CORRUPT_WITH_SUM, COPIED, EXCHANGED, SHARED = 2, 3, 4, 16
"""Values of `FaultKind.CORRUPT`; the last one is added to another."""


class FaultKind(StrEnum):
    """Fault of a camera or its cable, with the meaning of ``value``."""

    NOTHING = "nothing"
    POWER_OFF = "power off"
    """The camera and the cable behind it are dead."""
    POWER_ON = "power on"
    """The camera starts: next boot counter, unconfigured, other clock."""
    RESTART = "restart"
    MUTE = "mute"
    """1: frames pass the camera unprocessed; 0: end."""
    FREEZE = "freeze"
    """1: the camera's program hangs, its controller continues; 0: end."""
    FALL_BACK = "fall back"
    """Fall to AL state ``value`` with AL status code ``code``."""
    STATION = "station"
    SERIAL = "serial"
    """Replace the camera by one with serial number ``value``."""
    ALIAS = "alias"
    """Replace the camera by one with station alias ``value``."""
    SWAP = "swap"
    """Swap cables with camera ``value``, both off meanwhile."""
    UNPLUG = "unplug"
    """Remove the camera and join its cables."""
    PLUG = "plug"
    """Reconnect the camera, restarted."""
    CLOCK_JUMP = "clock jump"
    CLOCK_RATE = "clock rate"
    """The camera's clock runs ``value`` ppb too fast."""
    FRAME_PERIOD = "frame period"
    """Expose every ``value`` ns regardless of the configuration; 0: end."""
    HANG_MAILBOX = "hang mailbox"
    """1: mailboxes are accepted and never answered; 0: end."""
    EMERGENCY = "emergency"
    """Send an emergency message with error code ``value``; 0: the error is over."""
    CORRUPT = "corrupt"
    """1: one bit of each answer is wrong; 2: one bit of frame counter and times, with valid
    checksum; 3: the inputs are those of the next camera; 4: and vice versa; 16 more: in three of
    ten cycles only; 0: end."""
    REMAP = "remap"
    """Position ``value`` of the input assignment shows the mapping object ``code``."""
    LINK_ERRORS = "link errors"
    BREAK = "break"
    """1: the cable behind the camera is broken; 0: repaired."""


class CameraDeed(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A fault command; see `FaultKind` for ``value`` and ``code``."""

    do: FaultKind
    camera: int = 0
    """Camera number in the segment configuration, 0 first."""
    value: int = 0
    code: int = 0


class DeedAnswer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """State after a fault command."""

    monotonic_ns: int
    utc_ns: int
    """`monotonic_ns`, `utc_ns`: time of effect."""
    order: tuple[int, ...] = ()
    """Numbers of the plugged cameras in wire order."""
    states: tuple[int, ...] = ()
    """AL states with error bit; 0 without power."""
    boots: tuple[int, ...] = ()
    error: str = ""
