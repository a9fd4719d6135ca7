"""Replies of NDI devices: checksums, BX and BX2 (binary) and TX (text).

Source: the public programs ndicapi and the sample programs of NDI. Little endian, mm. Markers of
tools are named TOOL:MARKER (hexadecimal handle, number in the reply), stray ones have no name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from ocmm_trackers._messages import Cursor, MarkerPlace

_STRAYS = 0xFFFF
"""Handle of stray markers in BX2."""
_FRAME, _MARKERS = 1, 3
"""Components of BX2."""
_VALID, _MISSING, _DISABLED = 1, 2, 4
_SEEN = (0, 4, 5)
"""States of a marker with measured coordinates: seen, out of the volume, that but used."""
_UNSEEN = 1
"""State without coordinates."""
_FRAMES_HZ = 60
"""Of the frame numbers, also if the device measures less often."""
_HIDDEN = (float("nan"),) * 3
_TOOL = re.compile(
    "[0-9A-F]{2}(?:UNOCCUPIED|(?:MISSING|DISABLED|[+-][0-9+-]{50})[0-9A-F]{8}([0-9A-F]{8}))\n"
)

Place = tuple[float, float, float]


@dataclass(slots=True)
class NdiFrame:
    """Markers of one exposure."""

    time_ns: int = 0
    """0 if the reply states no time."""
    tools: list[MarkerPlace] = field(default_factory=list)
    strays: list[Place] = field(default_factory=list)


def _table() -> list[int]:
    found = []
    for byte in range(256):
        for _ in range(8):
            byte = byte >> 1 ^ (0xA001 if byte & 1 else 0)
        found.append(byte)
    return found


_TABLE = _table()


def checksum_ndi(content: bytes) -> int:
    """Return the CRC-16 of a command or reply (polynomial 0x8005 reflected, start 0)."""
    rest = 0
    for byte in content:
        rest = rest >> 8 ^ _TABLE[(rest ^ byte) & 0xFF]
    return rest


def read_bx(body: bytes) -> list[NdiFrame]:
    """Return the frame of a reply to BX with poses, markers of tools and strays (option 1009)."""
    cursor, found, number = Cursor(body), NdiFrame(), 0
    for _ in range(*cursor.take("B")):
        handle, state = cursor.take("BB")
        if state == _DISABLED:
            continue
        if state == _VALID:
            cursor.take("8f")
        elif state != _MISSING:
            raise ValueError("state")
        _, counted = cursor.take("II")
        number = max(number, counted)
        for index, place in enumerate(_places(cursor)):
            found.tools.append(MarkerPlace(f"{handle:02X}:{index}", place))
    found.strays = _places(cursor)
    cursor.take("H")
    if cursor.left:
        raise ValueError("size")
    found.time_ns = _time_of(number)
    return [found]


def read_bx2(body: bytes) -> list[NdiFrame]:
    """Return the frames of a reply to BX2, none if there is no new one."""
    found = []
    for kind, part, count in _components(Cursor(body)):
        if kind != _FRAME:
            continue
        for _ in range(count):
            _, _, _, number, seconds, nanoseconds = part.take("BBHIII")
            time_ns = seconds * 10**9 + nanoseconds if seconds else _time_of(number)
            frame = NdiFrame(time_ns)
            # The rest is that of this frame: its components state their sizes.
            for inner, values, items in _components(part):
                if inner == _MARKERS:
                    _read_markers(values, items, frame)
            found.append(frame)
    return found


def read_tx(text: str) -> list[NdiFrame]:
    """Return the frame of a reply to TX with poses and strays (option 1001), to 0.01 mm."""
    count, rest, number = int(text[:2], 16), text[2:], 0
    for _ in range(count):
        tool = _TOOL.match(rest)
        if tool is None:
            raise ValueError("tool")
        number, rest = max(number, int(tool[1] or "0", 16)), rest[tool.end() :]
    strays, rest = int(rest[:2], 16), rest[2 + -(-int(rest[:2], 16) // 4) :]
    digits, end = rest[: 21 * strays], rest[21 * strays :].lstrip("\n")
    if len(digits) != 21 * strays or re.fullmatch("[0-9A-F]{4}", end) is None:
        raise ValueError("strays")
    values = [int(digits[at : at + 7]) / 100.0 for at in range(0, len(digits), 7)]
    places = [(values[at], values[at + 1], values[at + 2]) for at in range(0, len(values), 3)]
    return [NdiFrame(_time_of(number), [], places)]


def _time_of(number: int) -> int:
    return number * 10**9 // _FRAMES_HZ


def _places(cursor: Cursor) -> list[Place]:
    """Return markers of BX; those not seen are as far away as no marker can be."""
    (count,) = cursor.take("B")
    # Bits of those out of the volume, which the stated volume judges.
    cursor.skip(-(-count // 8))
    return [cursor.take("3f") for _ in range(count)]


def _components(cursor: Cursor) -> list[tuple[int, Cursor, int]]:
    """Return kind, content and number of items of each component."""
    found = []
    _, count = cursor.take("HH")
    for _ in range(count):
        kind, size, _, items = cursor.take("HIHI")
        found.append((kind, Cursor(cursor.skip(size - 12)), items))
    return found


def _read_markers(values: Cursor, items: int, frame: NdiFrame) -> None:
    for _ in range(items):
        handle, count = values.take("HH")
        for _ in range(count):
            state, _, index = values.take("BBH")
            place = _HIDDEN if state == _UNSEEN else values.take("3f")
            place = place if state in _SEEN else _HIDDEN
            if handle == _STRAYS:
                frame.strays.append(place)
            else:
                frame.tools.append(MarkerPlace(f"{handle:02X}:{index}", place))
