"""Control and stream of a software GigE Vision camera (GVCP, GVSP), with faults on request."""

from __future__ import annotations

import random
import select
import socket
import struct
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ocmm_sim.genicam._registers import (
    CONTROL,
    FORMATS,
    HEARTBEAT,
    HOST_ADDRESS,
    HOST_PORT,
    PACKET_SIZE,
    Feature,
    GigeConfig,
    Memory,
)

PORT = 3956
_KEY = 0x42
_DISCOVERY, _RESEND, _READREG, _WRITEREG, _READMEM, _WRITEMEM = 0x02, 0x40, 0x80, 0x82, 0x84, 0x86
_OK, _NOT_IMPLEMENTED, _BAD_ADDRESS, _PROTECTED, _DENIED = 0x0000, 0x8001, 0x8003, 0x8004, 0x8006
_GONE, _RESENT = 0x800C, 0x0100
_LEADER, _TRAILER, _PAYLOAD = 1, 2, 3
_HEADERS = 36
"""Of IP, UDP and GVSP, bytes."""
_KEPT_FRAMES = 8
_BURST = 1 << 20
"""Bytes sent before the receiver's queue is checked; a socket buffer holds four of them."""


@dataclass(slots=True)
class CameraFaults:
    """Faults of a camera; may be changed while it runs."""

    swap: float = 0.0
    double: float = 0.0
    """`swap`, `double`: probability of each for a packet."""
    refuse_resend: bool = False
    clock_step_ns: int = 0
    """Added to the time of each exposure from now on."""
    deaf: bool = False
    """Commands are not heard."""
    edit: Callable[[bytes], bytes] | None = None
    """Changes each packet, header and content, before it is sent; an empty one is not sent."""


@dataclass(frozen=True, slots=True)
class _Sent:
    leader: bytes
    image: memoryview
    step: int

    @property
    def n_packets(self) -> int:
        return -(-len(self.image) // self.step)

    def packet(self, block: int, number: int, status: int = _OK) -> tuple[bytes, memoryview]:
        """Return header and content of a packet: leader, payload or trailer."""
        if number == 0:
            kind, content = _LEADER, memoryview(self.leader)
        elif number <= self.n_packets:
            begin = (number - 1) * self.step
            kind, content = _PAYLOAD, self.image[begin : begin + self.step]
        else:
            kind, content = _TRAILER, memoryview(struct.pack(">HHI", 0, 1, 0))
        return struct.pack(">HHI", status, block, kind << 24 | number), content


class GigeCamera:
    """One camera at an address of this computer; a thread answers its control port.

    Images come from the caller by `send`, which returns when they have left.
    """

    def __init__(self, config: GigeConfig, seed: int = 0) -> None:
        self.memory = Memory(config)
        self.faults = CameraFaults()
        self.acquiring = threading.Event()
        self._random = random.Random(seed)  # noqa: S311 - faults of a simulation, repeatable
        self._block = 0
        self._sent: OrderedDict[int, _Sent] = OrderedDict()
        self._controller: tuple[str, int] | None = None
        self._heard = 0.0
        self._control = self._bound(config.address, PORT)
        self._stream = self._bound(config.address, 0)
        self._search = self._bound("255.255.255.255", PORT)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=f"ocmm-gvcp-{config.serial}")
        self._thread.start()

    @staticmethod
    def _bound(address: str, port: int) -> socket.socket:
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        made.bind((address, port))
        return made

    def close(self) -> None:
        """Stop answering and release the sockets."""
        self._ended.set()
        self._thread.join()
        for one in (self._control, self._stream, self._search):
            one.close()

    def reconfigure(self, **changes: Any) -> None:
        """Change what the camera reports: fields of `GigeConfig` about its clock."""
        self.memory.config = replace(self.memory.config, **changes)
        self.memory.settle()

    def send(self, image: memoryview, time_ns: int) -> None:
        """Send one image, in the format of the registers, exposed at `time_ns`."""
        memory, faults = self.memory, self.faults
        port = memory.u32(HOST_PORT)
        if not port or not self.acquiring.is_set():
            return
        self._block = self._block % 0xFFFF + 1
        leader = self._leader(time_ns + faults.clock_step_ns)
        sent = _Sent(leader, image, memory.packet_size - _HEADERS)
        self._sent[self._block] = sent
        while len(self._sent) > _KEPT_FRAMES:
            self._sent.popitem(last=False)
        target = (socket.inet_ntoa(struct.pack(">I", memory.u32(HOST_ADDRESS))), port)
        order = list(range(sent.n_packets + 2))
        for place in range(1, len(order)):
            if faults.swap and self._random.random() < faults.swap:
                order[place - 1], order[place] = order[place], order[place - 1]
        left = _BURST
        for number in order:
            if left <= 0:
                _wait_for(port)
                left = _BURST
            left -= sent.step
            self._send_packet(sent.packet(self._block, number), target)

    def _leader(self, time_ns: int) -> bytes:
        memory = self.memory
        return struct.pack(
            ">HHIIIIIIIHH", 0, 1, time_ns >> 32, time_ns & 0xFFFF_FFFF,
            FORMATS[memory.format],
            *(memory.integer(one) for one in
              (Feature.WIDTH, Feature.HEIGHT, Feature.OFFSET_X, Feature.OFFSET_Y)),
            0, 0,
        )  # fmt: skip

    def _send_packet(self, packet: tuple[bytes, memoryview], target: tuple[str, int]) -> None:
        faults, chance = self.faults, self._random.random
        if faults.edit is not None:
            edited = faults.edit(packet[0] + packet[1])
            if not edited:
                return
            packet = (edited, memoryview(b""))
        for _ in range(2 if faults.double and chance() < faults.double else 1):
            # The receiver may be gone; a camera does not notice.
            try:
                self._stream.sendmsg(packet, (), 0, target)
            except OSError:
                return

    def _serve(self) -> None:
        while not self._ended.is_set():
            ready, _, _ = select.select([self._control, self._search], [], [], 0.1)
            for one in ready:
                content, sender = one.recvfrom(2048)
                if not self.faults.deaf:
                    self._answer(content, sender)
            limit_s = self.memory.u32(HEARTBEAT) * 1e-3
            if self._controller is not None and time.monotonic() - self._heard > limit_s:
                self.release()

    def release(self) -> None:
        """Forget who controls the camera, and stop."""
        self._controller = None
        self.acquiring.clear()
        self.memory.set_u32(CONTROL, 0)
        self.memory.set_u32(HOST_PORT, 0)
        self.memory.set_integer(Feature.LOCKED, 0)

    def _answer(self, content: bytes, sender: tuple[str, int]) -> None:
        if len(content) < 8 or content[0] != _KEY:
            return
        _, flags, command, size, number = struct.unpack(">BBHHH", content[:8])
        if sender == self._controller:
            self._heard = time.monotonic()
        body = content[8 : 8 + size]
        if command == _RESEND:
            self._resend(body)
            return
        try:
            status, told = self._done(command, body, sender)
        except (IndexError, struct.error):
            status, told = _BAD_ADDRESS, b""
        if flags & 1:
            head = struct.pack(">HHHH", status, command + 1, len(told), number)
            self._control.sendto(head + told, sender)
        if command in (_WRITEREG, _WRITEMEM) and self.memory.take_test_packet():
            port, size = self.memory.u32(HOST_PORT), self.memory.packet_size
            self._send_packet((bytes(8), memoryview(bytes(size - _HEADERS))), (sender[0], port))

    def _done(self, command: int, body: bytes, sender: tuple[str, int]) -> tuple[int, bytes]:
        memory = self.memory
        if command == _DISCOVERY:
            return _OK, memory.read(0, 248)
        if command == _READREG:
            places = struct.unpack(f">{len(body) // 4}I", body)
            return _OK, b"".join(memory.read(place, 4) for place in places)
        if command == _READMEM:
            place, _, count = struct.unpack(">IHH", body)
            return _OK, body[:4] + memory.read(place, count)
        if command not in (_WRITEREG, _WRITEMEM):
            return _NOT_IMPLEMENTED, b""
        if self._controller not in (None, sender):
            return _DENIED, b""
        pairs = (
            [(place, body[i + 4 : i + 8])
             for i, (place, _) in enumerate(struct.iter_unpack(">II", body)) for i in [8 * i]]
            if command == _WRITEREG
            else [(int.from_bytes(body[:4], "big"), body[4:])]
        )  # fmt: skip
        for place, value in pairs:
            if self._controller is None and place != CONTROL:
                return _DENIED, b""
            if memory.is_locked(place):
                return _PROTECTED, b""
            memory.write(place, value)
            self._obey(place, sender)
        return _OK, struct.pack(">HH", 0, len(pairs))

    def _obey(self, place: int, sender: tuple[str, int]) -> None:
        """Carry out a written command."""
        if place == CONTROL:
            if self.memory.u32(CONTROL):
                self._controller, self._heard = sender, time.monotonic()
            else:
                self.release()
        elif place == Feature.START:
            self._block = 0
            self._sent.clear()
            self.acquiring.set()
        elif place == Feature.STOP:
            self.acquiring.clear()
        elif place != PACKET_SIZE:
            self.memory.settle()

    def _resend(self, body: bytes) -> None:
        _, block, first, last = struct.unpack(">HHII", body[:12])
        port = self.memory.u32(HOST_PORT)
        target = (socket.inet_ntoa(struct.pack(">I", self.memory.u32(HOST_ADDRESS))), port)
        sent = self._sent.get(block)
        if self.faults.refuse_resend or sent is None:
            head = struct.pack(">HHI", _GONE, block, _PAYLOAD << 24 | first)
            self._send_packet((head, memoryview(b"")), target)
            return
        for number in range(first & 0xFF_FFFF, min(last & 0xFF_FFFF, sent.n_packets + 1) + 1):
            self._send_packet(sent.packet(block, number, _RESENT), target)


def _wait_for(port: int) -> None:
    """Wait until the receiver at a port of this computer has taken most of what it was sent."""
    until = time.monotonic() + 1.0
    ending = f":{port:04X} "
    while time.monotonic() < until:
        table = Path("/proc/self/net/udp").read_text(encoding="ascii").splitlines()
        rows = [line.split() for line in table if ending in line]
        if not any(int(row[4].partition(":")[2], 16) > _BURST // 4 for row in rows):
            return
        time.sleep(2e-4)
