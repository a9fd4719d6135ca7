"""What can go wrong with a frame on its way, and what the proxy writes down about it."""

from __future__ import annotations

from enum import StrEnum

import msgspec


class Way(StrEnum):
    """In which direction a frame goes."""

    REQUEST = "request"
    """To the cameras."""
    ANSWER = "answer"
    """Back to the master."""


class FrameKind(StrEnum):
    """What a frame is about."""

    PROCESS = "process"
    """Process data: its first datagram is logical."""
    SERVICE = "service"
    """Everything acyclic beside the process data: an index from 128 on."""
    OTHER = "other"
    """What the master's library sends while it configures."""


class Trick(StrEnum):
    """What is done to a frame; the comment says what ``value`` means."""

    DROP = "drop"
    DUPLICATE = "duplicate"
    """``value`` copies follow it at once."""
    DELAY = "delay"
    """It arrives ``value`` microseconds later."""
    HOLD = "hold"
    """It waits until ``value`` further frames of its kind and way have passed."""
    FLIP = "flip"
    """``value`` bits behind the Ethernet head are wrong."""
    FLIP_DATA = "flip data"
    """``value`` bits in the data of its first datagram are wrong."""
    COUNTER = "counter"
    """The working counter of its first datagram is off by ``value``."""
    REPLAY = "replay"
    """The one before it, of its kind and way, comes once more instead of it."""


class LineRule(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One thing that goes wrong, again and again."""

    do: Trick
    value: int = 1
    """`do`, `value`: What, and how much of it."""
    way: Way = Way.ANSWER
    kinds: tuple[FrameKind, ...] = (FrameKind.PROCESS, FrameKind.SERVICE, FrameKind.OTHER)
    """`way`, `kinds`: To which frames."""
    share: float = 1.0
    """Part of these frames, 0 to 1, drawn at random."""
    only: tuple[int, ...] = ()
    """Exactly these of them instead, counted from 0 since the rule was given."""


class LineOrder(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the proxy is told."""

    rules: tuple[LineRule, ...] | None = None
    """All rules from now on; the first one that takes a frame decides. None: as before."""
    new_log: bool = False
    """Begin the log anew, after its end was sent."""


class Touched(msgspec.Struct, frozen=True, array_like=True):
    """A frame of process data that something was done to: its way, its heartbeat, and what."""

    way: Way
    heartbeat: int
    did: Trick


class LineLog(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """What the proxy saw and did."""

    monotonic_ns: int = 0
    utc_ns: int = 0
    """`monotonic_ns`, `utc_ns`: When the order took effect that this answers."""
    seen: dict[str, int] = msgspec.field(default_factory=dict)
    """Frames that came in, by ``"way kind"``."""
    done: dict[str, int] = msgspec.field(default_factory=dict)
    """Frames that something was done to, by ``"way kind trick"``."""
    touched: list[Touched] = msgspec.field(default_factory=list)
    """The same for process data, one by one; the first `MAX_TOUCHED`."""
    heartbeats: tuple[int, int] = (-1, -1)
    """First and last heartbeat of process data that came from the master; -1 before."""
    first_utc_ns: int = 0
    """When something was done to a frame for the first time; 0 before."""
    error: str = ""
    """Why the order was not understood."""


MAX_TOUCHED = 2000
"""A log stays below the size of a datagram of the control socket."""
