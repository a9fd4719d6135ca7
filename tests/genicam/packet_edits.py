"""Edits of the packets of a software camera, as by a network or a faulty camera."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable

Edit = Callable[[bytes], bytes]
Which = Callable[[bytes], bool]


def any_packet(_packet: bytes) -> bool:
    return True


def leader(packet: bytes) -> bool:
    return packet[4] == 1


def payload(packet: bytes) -> bool:
    return packet[4] == 3


def some(share: float, which: Which, edit: Edit = lambda _one: b"") -> Edit:
    """Return an edit of a share of some packets; the default loses them."""
    draws = random.Random(3)  # noqa: S311 - faults, repeatable
    return lambda one: edit(one) if which(one) and draws.random() < share else one


def damaged(packet: bytes) -> bytes:
    """Return a packet with a number far beyond the last one."""
    (number,) = struct.unpack_from(">I", packet, 4)
    return packet[:4] + struct.pack(">I", number + (1 << 20)) + packet[8:]


def put(place: int, form: str, value: int) -> Edit:
    """Return an edit that writes a number into a packet."""

    def edit(packet: bytes) -> bytes:
        end = place + struct.calcsize(form)
        return packet[:place] + struct.pack(form, value) + packet[end:]

    return edit


def old_time() -> Edit:
    """Return an edit that gives leaders the time of the exposure before."""
    before: list[bytes] = []

    def edit(packet: bytes) -> bytes:
        before.append(packet[12:20])
        return packet[:12] + before[max(len(before) - 2, 0)] + packet[20:]

    return edit


def renumbered(packet: bytes, more: int) -> bytes:
    (block,) = struct.unpack_from(">H", packet, 2)
    return packet[:2] + struct.pack(">H", (block + more - 1) % 0xFFFF + 1) + packet[4:]


def from_one() -> Edit:
    """Return an edit that numbers images from one again."""
    first: list[int] = []

    def edit(packet: bytes) -> bytes:
        first.append(struct.unpack_from(">H", packet, 2)[0])
        return renumbered(packet, 1 - first[0])

    return edit


def every_second() -> Edit:
    """Return an edit that leaves out every second image, numbered without a gap."""
    first: list[int] = []

    def edit(packet: bytes) -> bytes:
        (block,) = struct.unpack_from(">H", packet, 2)
        first.append(block)
        since = block - first[0]
        return b"" if since % 2 else renumbered(packet, -(since // 2))

    return edit
