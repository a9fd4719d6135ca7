"""Faults of frames in transit, and the log of the proxy."""

from __future__ import annotations

from enum import StrEnum

import msgspec


class LineDirection(StrEnum):
    """Direction of a frame."""

    REQUEST = "request"
    ANSWER = "answer"


class FrameKind(StrEnum):
    """Kind of a frame."""

    PROCESS = "process"
    """Process data: the first datagram is logical."""
    SERVICE = "service"
    OTHER = "other"
    """Other frames of the master library, during configuration."""


class Trick(StrEnum):
    """Fault of a frame, with the meaning of ``value``."""

    DROP = "drop"
    DUPLICATE = "duplicate"
    """Followed directly by ``value`` copies."""
    DELAY = "delay"
    """Arrives ``value`` microseconds later."""
    HOLD = "hold"
    """Waits for ``value`` further frames of its kind and direction."""
    FLIP = "flip"
    """``value`` wrong bits behind the Ethernet header."""
    FLIP_DATA = "flip data"
    """``value`` wrong bits in the data of the first datagram."""
    COUNTER = "counter"
    """Working counter of the first datagram off by ``value``."""
    REPLAY = "replay"
    """Replaced by the previous frame of its kind and direction."""


class LineRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A recurring fault."""

    do: Trick
    value: int = 1
    way: LineDirection = LineDirection.ANSWER
    kinds: tuple[FrameKind, ...] = (FrameKind.PROCESS, FrameKind.SERVICE, FrameKind.OTHER)
    share: float = 1.0
    """Random fraction of these frames, 0 to 1."""
    only: tuple[int, ...] = ()
    """Instead: these frames only, counted from 0 since the rule was set."""


class LineOrder(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Command to the proxy."""

    rules: tuple[LineRule, ...] | None = None
    """All rules; the first match decides. None: unchanged."""
    new_log: bool = False
    """Start a new log after sending the current one."""


class ModifiedFrame(msgspec.Struct, frozen=True, array_like=True):
    """A modified process data frame: direction, heartbeat and fault."""

    way: LineDirection
    heartbeat: int
    did: Trick


class LineLog(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """Frames seen and modified by the proxy."""

    monotonic_ns: int = 0
    utc_ns: int = 0
    seen: dict[str, int] = msgspec.field(default_factory=dict)
    """Incoming frames by ``"way kind"``."""
    done: dict[str, int] = msgspec.field(default_factory=dict)
    """Modified frames by ``"way kind trick"``."""
    touched: list[ModifiedFrame] = msgspec.field(default_factory=list)
    """Modified process data frames, the first `MAX_TOUCHED`."""
    heartbeats: tuple[int, int] = (-1, -1)
    """First and last heartbeat of process data from the master; -1 if none."""
    first_utc_ns: int = 0
    """Time of the first modification; 0 if none."""
    error: str = ""


MAX_TOUCHED = 2000
"""Keeps a log within a datagram of the control socket."""
