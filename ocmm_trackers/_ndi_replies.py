"""Replies of NDI devices: checksum, BX and BX2 (binary), and TX (text).

Source: the public programs ndicapi and the sample programs of NDI. Little endian, mm. Markers of
tools are named TOOL:MARKER (hexadecimal handle, number in the reply), stray ones have no name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from ocmm_trackers._messages import HIDDEN, Cursor, MarkerPlace

_STRAYS = 0xFFFF
"""Handle of stray markers in BX2."""
_FRAME, _MARKERS, _BUTTONS = 1, 3, 4
"""Components of BX2."""
_VALID, _MISSING, _DISABLED = 1, 2, 4
_UNSEEN, _SEEN = 1, (0, 4, 5)
"""States of a marker: without coordinates; seen, out of the volume, that but used."""
_SWITCHES = 0x0E
"""Bits of the port status."""
_FRAMES_HZ = 60
"""Rate of the frame numbers, also of devices that measure less often."""
_TOOL = re.compile(
    "([0-9A-F]{2})(?:UNOCCUPIED|(?:MISSING|DISABLED|[+-][0-9+-]{50})([0-9A-F]{8})([0-9A-F]{8}))\n"
)


@dataclass(slots=True)
class NdiFrame:
    """Markers of one exposure."""

    time_ns: int
    """0 if the reply states no time."""
    tools: list[MarkerPlace] = field(default_factory=list)
    buttons: dict[str, bool] = field(default_factory=dict)
    """Whether a button of a tool is pressed, by its handle."""
    strays: list[tuple[float, float, float]] = field(default_factory=list)


def checksum_ndi(content: bytes | bytearray) -> int:
    """Return the CRC-16 of a command or reply (polynomial 0x8005 reflected, start 0)."""
    rest = 0
    for byte in content:
        rest ^= byte
        for _ in range(8):
            rest = rest >> 1 ^ (0xA001 if rest & 1 else 0)
    return rest


def read_bx(body: bytes) -> list[NdiFrame]:
    """Return the frame of a reply to BX with poses, markers of tools and strays (option 1009)."""
    cursor, found, number = Cursor(body), NdiFrame(0), 0
    for _ in range(*cursor.take("B")):
        handle, state = cursor.take("BB")
        if state == _DISABLED:
            continue
        if state not in (_VALID, _MISSING):
            raise ValueError("state")
        if state == _VALID:
            cursor.take("8f")
        status, counted = cursor.take("II")
        number = max(number, counted)
        found.buttons[f"{handle:02X}"] = bool(status & _SWITCHES)
        found.tools += [
            MarkerPlace(f"{handle:02X}:{index}", place)
            for index, place in enumerate(_places(cursor))
        ]
    found.strays = _places(cursor)
    cursor.take("H")
    if cursor.left:
        raise ValueError("size")
    found.time_ns = _time_of(number)
    return [found]


def read_bx2(body: bytes) -> list[NdiFrame]:
    """Return the new frames of a reply to BX2."""
    found = []
    for kind, part, count in _components(Cursor(body)):
        for _ in range(count if kind == _FRAME else 0):
            *_, number, seconds, nanoseconds = part.take("BBHIII")
            frame = NdiFrame(seconds * 10**9 + nanoseconds if seconds else _time_of(number))
            for inner, values, items in _components(part):
                if inner == _MARKERS:
                    _read_markers(values, items, frame)
                elif inner == _BUTTONS:
                    for _ in range(items):
                        handle, size = values.take("HH")
                        frame.buttons[f"{handle:02X}"] = any(values.skip(size))
            found.append(frame)
    return found


def read_tx(text: str) -> list[NdiFrame]:
    """Return the frame of a reply to TX with poses and strays (option 1001), to 0.01 mm."""
    at, number, found = 2, 0, NdiFrame(0)
    for _ in range(int(text[:2], 16)):
        tool = _TOOL.match(text, at)
        if tool is None:
            raise ValueError("tool")
        number, at = max(number, int(tool[3] or "0", 16)), tool.end()
        found.buttons[tool[1]] = bool(int(tool[2] or "0", 16) & _SWITCHES)
    count = int(text[at : at + 2], 16)
    # A bit for each one out of the volume, which the stated volume judges.
    at += 2 - (-count // 4)
    found.time_ns = _time_of(number)
    for start in range(at, at + 21 * count, 21):
        x, y, z = (int(text[start + k : start + k + 7]) / 100.0 for k in (0, 7, 14))
        found.strays.append((x, y, z))
    if re.fullmatch("\n?[0-9A-F]{4}", text[at + 21 * count :]) is None:
        raise ValueError("strays")
    return [found]


def _time_of(number: int) -> int:
    return number * 10**9 // _FRAMES_HZ


def _places(cursor: Cursor) -> list[tuple[float, float, float]]:
    """Return markers of BX; those not seen are as far away as no marker can be."""
    (count,) = cursor.take("B")
    # As in TX.
    cursor.skip(-(-count // 8))
    return [cursor.take("3f") for _ in range(count)]


def _components(cursor: Cursor) -> Iterator[tuple[int, Cursor, int]]:
    """Yield kind, content and number of items of each component."""
    for _ in range(cursor.take("HH")[1]):
        kind, size, _, items = cursor.take("HIHI")
        yield kind, Cursor(cursor.skip(size - 12)), items


def _read_markers(values: Cursor, items: int, frame: NdiFrame) -> None:
    for _ in range(items):
        handle, count = values.take("HH")
        for _ in range(count):
            state, _, index = values.take("BBH")
            place = HIDDEN if state == _UNSEEN else values.take("3f")
            place = place if state in _SEEN else HIDDEN
            if handle == _STRAYS:
                frame.strays.append(place)
            else:
                frame.tools.append(MarkerPlace(f"{handle:02X}:{index}", place))
