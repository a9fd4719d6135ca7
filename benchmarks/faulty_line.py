"""Faulty cable: forwards EtherCAT frames between two interfaces.

A separate process between master and cameras that applies seeded fault rules to frames and logs all
frames and changes, so that a master's counters can be compared with the truth. Run ``python -m
benchmarks.faulty_line`` with a `ProxyConfig` as one line on standard input; it prints
``ready``, accepts `LineOrder` over its control socket, and ends with its standard input.
"""

from __future__ import annotations

import heapq
import select
import socket
import sys
import time
from collections import Counter
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.acquisition.bus_process import CAMERA_PRIORITY, take_priority
from ocmm_core.fieldbus.device import OUTPUT_STRUCT
from ocmm_sim.bus import READY, LinkPort, input_ended

_COMMAND_AT = 16
_INDEX_AT = 17
_ADDRESS = slice(18, 22)
_LENGTH_AT = 22
_DATA_AT = 26
_FIRST_SERVICE_INDEX = 0x80
_LOGICAL = (10, 11, 12)
_NO_ADDRESS = bytes(4)
_HEARTBEAT = slice(_DATA_AT + OUTPUT_STRUCT.size - 4, _DATA_AT + OUTPUT_STRUCT.size)
_IDLE_S = 0.02
_HOUSEKEEPING_NS = 20_000_000


class LineDirection(StrEnum):
    """Direction of a frame."""

    REQUEST = "request"
    ANSWER = "answer"


class FrameKind(StrEnum):
    """Kind of a frame by its first datagram."""

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


class ProxyConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Configuration of the proxy."""

    master_side: str
    camera_side: str
    control: str
    """Control socket; accepts `LineOrder`, answers with `LineLog`."""
    seed: int = 0


class LineTricks:
    """Applies rules to frames and keeps the log; no sockets."""

    def __init__(self, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        self._draws: list[float] = []
        self.rules: list[tuple[LineRule, list[int]]] = []
        self._before: dict[tuple[LineDirection, FrameKind], bytes] = {}
        self._held: list[tuple[int, LineDirection, FrameKind, bytes]] = []
        self._seen: Counter[tuple[LineDirection, FrameKind]] = Counter()
        self._done: Counter[tuple[LineDirection, FrameKind, Trick]] = Counter()
        self._touched: list[ModifiedFrame] = []
        self._first = self._last = -1
        self._first_utc_ns = 0
        self._cycles: dict[int, int] = {}

    def set_rules(self, rules: tuple[LineRule, ...]) -> None:
        """Set the rules; discard delayed frames."""
        self.rules = [(rule, [0]) for rule in rules]
        self._held.clear()

    def log(self, *, new: bool) -> LineLog:
        """Return the log; `new` starts another one."""
        log = LineLog(
            seen={f"{way} {kind}": count for (way, kind), count in self._seen.items()},
            done={f"{way} {kind} {did}": n for (way, kind, did), n in self._done.items()},
            touched=self._touched[:MAX_TOUCHED],
            heartbeats=(self._first, self._last),
            first_utc_ns=self._first_utc_ns,
        )
        if new:
            self._seen.clear()
            self._done.clear()
            self._touched = []
            self._first = self._last = -1
            self._first_utc_ns = 0
        return log

    def treat(self, frame: bytes, way: LineDirection) -> list[tuple[int, bytes]]:
        """Return the outgoing frames for `frame`: delays in ns and frames, in order."""
        kind = kind_of(frame)
        key = (way, kind)
        self._seen[key] += 1
        heartbeat = self._cycle_of(frame, way) if kind is FrameKind.PROCESS else -1
        released = self._release(key) if self._held else []
        rule = self._rule(way, kind) if self.rules else None
        if rule is None:
            self._before[key] = frame
            return [(0, frame), *released]
        self._done[way, kind, rule.do] += 1
        self._first_utc_ns = self._first_utc_ns or time.time_ns()
        if kind is FrameKind.PROCESS:
            self._touched.append(ModifiedFrame(way, heartbeat, rule.do))
        leaving = self._changed(frame, key, rule)
        self._before[key] = frame
        return [*leaving, *released]

    def _cycle_of(self, frame: bytes, way: LineDirection) -> int:
        """Return the heartbeat of the cycle of a process data frame."""
        index = frame[_INDEX_AT]
        if way is LineDirection.REQUEST:
            # The outputs come first; a cycle's other frames hold inputs only, and follow.
            if frame[_ADDRESS] == _NO_ADDRESS:
                self._last = int.from_bytes(frame[_HEARTBEAT], "little")
                self._first = self._last if self._first < 0 else self._first
            self._cycles[index] = self._last
        return self._cycles.get(index, -1)

    def _changed(
        self, frame: bytes, key: tuple[LineDirection, FrameKind], rule: LineRule
    ) -> list[tuple[int, bytes]]:
        if rule.do is Trick.DROP:
            return []
        if rule.do is Trick.DUPLICATE:
            return [(0, frame)] * (1 + rule.value)
        if rule.do is Trick.DELAY:
            return [(1000 * rule.value, frame)]
        if rule.do is Trick.HOLD:
            self._held.append((rule.value, *key, frame))
            return []
        if rule.do is Trick.FLIP:
            return [(0, self._flip(frame, 14, len(frame), rule.value))]
        if rule.do is Trick.FLIP_DATA:
            return [(0, self._flip(frame, _DATA_AT, _data_end(frame), rule.value))]
        if rule.do is Trick.COUNTER:
            at = _data_end(frame)
            counter = int.from_bytes(frame[at : at + 2], "little") + rule.value
            return [(0, frame[:at] + (counter & 0xFFFF).to_bytes(2, "little") + frame[at + 2 :])]
        return [(0, self._before[key])] if key in self._before else []

    def _flip(self, frame: bytes, begin: int, end: int, count: int) -> bytes:
        changed = bytearray(frame)
        for bit in self._random.integers(8 * begin, 8 * end, count):
            changed[bit // 8] ^= 1 << int(bit % 8)
        return bytes(changed)

    def _rule(self, way: LineDirection, kind: FrameKind) -> LineRule | None:
        chosen = None
        for rule, count in self.rules:
            if rule.way is not way or kind not in rule.kinds:
                continue
            number = count[0]
            count[0] += 1
            if chosen is not None:
                continue
            if rule.only:
                chosen = rule if number in rule.only else None
            elif rule.share >= 1.0 or self._draw() < rule.share:
                chosen = rule
        return chosen

    def _draw(self) -> float:
        if not self._draws:
            # A single draw takes longer than forwarding a frame.
            self._draws = self._random.random(1000).tolist()
        return self._draws.pop()

    def _release(self, key: tuple[LineDirection, FrameKind]) -> list[tuple[int, bytes]]:
        kept, released = [], []
        for left, way, kind, frame in self._held:
            if (way, kind) == key and left <= 1:
                released.append((0, frame))
            else:
                kept.append((left - ((way, kind) == key), way, kind, frame))
        self._held = kept
        return released


class Proxy:
    """The proxy on its two interfaces; raises BusError if one cannot be opened."""

    def __init__(self, config: ProxyConfig) -> None:
        self._ports = {LineDirection.REQUEST: LinkPort(config.master_side)}
        self._ports[LineDirection.ANSWER] = LinkPort(config.camera_side)
        self._tricks = LineTricks(config.seed)
        self._later: list[tuple[int, int, LineDirection, bytes]] = []
        self._number = 0
        self._path = Path(config.control)
        self._control = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._control.bind(config.control)

    def run(self, stopping: Callable[[], bool]) -> None:
        """Forward until `stopping`, polled a few times a second, returns True."""
        wanted: list[LinkPort | socket.socket] = [*self._ports.values(), self._control]
        housekeeping = 0
        while True:
            now = time.monotonic_ns()
            while self._later and self._later[0][0] <= now:
                _due, _number, way, frame = heapq.heappop(self._later)
                self._send(way, frame)
            if now - housekeeping > _HOUSEKEEPING_NS:
                housekeeping = now
                for port in self._ports.values():
                    port.renew()
                if stopping():
                    return
            due = (self._later[0][0] - now) * 1e-9 if self._later else _IDLE_S
            ready, _, _ = select.select(wanted, [], [], max(0.0, min(due, _IDLE_S)))
            if self._control in ready:
                self._obey()
            elif ready and not self._forward_all(ready):
                # A port without link is always ready and never has data.
                time.sleep(1e-3)

    def close(self) -> None:
        """Close both interfaces and the control socket."""
        for port in self._ports.values():
            port.close()
        self._control.close()
        if self._path.is_socket():
            self._path.unlink(missing_ok=True)

    def _forward_all(self, ready: list[LinkPort | socket.socket]) -> bool:
        moved = False
        for way, port in self._ports.items():
            while port in ready and (frame := port.receive()) is not None:
                moved = True
                for delay_ns, leaving in self._tricks.treat(bytes(frame), way):
                    if delay_ns:
                        self._number += 1
                        due = time.monotonic_ns() + delay_ns
                        heapq.heappush(self._later, (due, self._number, way, leaving))
                    else:
                        self._send(way, leaving)
        return moved

    def _send(self, way: LineDirection, frame: bytes) -> None:
        self._ports[
            LineDirection.ANSWER if way is LineDirection.REQUEST else LineDirection.REQUEST
        ].send(frame)

    def _obey(self) -> None:
        try:
            content, sender = self._control.recvfrom(65536)
        except BlockingIOError:
            return
        try:
            order = msgspec.json.decode(content, type=LineOrder)
        except msgspec.DecodeError as error:
            log = LineLog(error=str(error))
        else:
            log = self._tricks.log(new=order.new_log)
            if order.rules is not None:
                self._tricks.set_rules(order.rules)
        log.monotonic_ns, log.utc_ns = time.monotonic_ns(), time.time_ns()
        if sender:
            self._control.sendto(msgspec.json.encode(log), sender)


def kind_of(frame: bytes) -> FrameKind:
    """Return the kind of an EtherCAT frame."""
    if frame[_COMMAND_AT] in _LOGICAL:
        return FrameKind.PROCESS
    return FrameKind.SERVICE if frame[_INDEX_AT] >= _FIRST_SERVICE_INDEX else FrameKind.OTHER


def _data_end(frame: bytes) -> int:
    return _DATA_AT + (int.from_bytes(frame[_LENGTH_AT : _LENGTH_AT + 2], "little") & 0x07FF)


def main() -> None:
    """Run the proxy."""
    proxy = Proxy(msgspec.json.decode(sys.stdin.buffer.readline(), type=ProxyConfig))
    take_priority(CAMERA_PRIORITY)
    try:
        sys.stdout.write(f"{READY}\n")
        sys.stdout.flush()
        proxy.run(input_ended)
    finally:
        proxy.close()


if __name__ == "__main__":
    main()
