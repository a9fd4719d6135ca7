"""Dialogue with NDI devices (Polaris, Vega): commands with checksum, and polled frames.

Source: the public programs ndicapi and the sample programs of NDI. Little endian, mm. Markers of
tools are named TOOL:MARKER (hexadecimal handle, number in the reply), stray ones have no name. The
decoder polls by the newest command of the device: BX2 or BX (binary), or TX (text).
"""

from __future__ import annotations

import re
import struct
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import scipy

from ocmm_core.camera import TrackerDocument
from ocmm_core.errors import AcquisitionError
from ocmm_core.geometry import Float
from ocmm_trackers._messages import (
    HIDDEN,
    Cursor,
    DamagedPacketError,
    Decoder,
    MarkerPlace,
    Message,
    frame_of,
    printable,
    sensor_of,
)

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


def _after_byte(rest: int) -> int:
    for _ in range(8):
        rest = rest >> 1 ^ (0xA001 if rest & 1 else 0)
    return rest


_AFTER_BYTE = tuple(map(_after_byte, range(256)))


def checksum_ndi(content: bytes | bytearray) -> int:
    """Return the CRC-16 of a command or reply (polynomial 0x8005 reflected, start 0)."""
    rest = 0
    for byte in content:
        rest = rest >> 8 ^ _AFTER_BYTE[(rest ^ byte) & 0xFF]
    return rest


def command_of(text: str) -> bytes:
    """Return a command with its checksum."""
    return f"{text}{checksum_ndi(text.encode()):04X}\r".encode()


def text_of(line: bytes) -> str:
    """Return the text of a reply without its end; empty if its checksum is wrong."""
    good = line[-4:] == f"{checksum_ndi(line[:-4]):04X}".encode()
    return printable(line[:-4]) if good else ""


def read_bx(body: bytes) -> list[NdiFrame]:
    """Return the frame of a reply to BX with poses, markers of tools and strays (option 1009)."""
    cursor, found, number = Cursor(body), NdiFrame(0), 0
    for _ in range(*cursor.read("B")):
        handle, state = cursor.read("BB")
        if state == _DISABLED:
            continue
        if state not in (_VALID, _MISSING):
            raise ValueError("state")
        if state == _VALID:
            cursor.read("8f")
        status, counted = cursor.read("II")
        number = max(number, counted)
        found.buttons[f"{handle:02X}"] = bool(status & _SWITCHES)
        found.tools += [
            MarkerPlace(f"{handle:02X}:{index}", place)
            for index, place in enumerate(_places(cursor))
        ]
    found.strays = _places(cursor)
    cursor.read("H")
    if cursor.left:
        raise ValueError("size")
    found.time_ns = _time_of(number)
    return [found]


def read_bx2(body: bytes) -> list[NdiFrame]:
    """Return the new frames of a reply to BX2."""
    found = []
    for kind, part, count in _components(Cursor(body)):
        for _ in range(count if kind == _FRAME else 0):
            *_, number, seconds, nanoseconds = part.read("BBHIII")
            frame = NdiFrame(seconds * 10**9 + nanoseconds if seconds else _time_of(number))
            for inner, values, items in _components(part):
                if inner == _MARKERS:
                    _read_markers(values, items, frame)
                elif inner == _BUTTONS:
                    for _ in range(items):
                        handle, size = values.read("HH")
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
    (count,) = cursor.read("B")
    # As in TX.
    cursor.skip(-(-count // 8))
    return [cursor.read("3f") for _ in range(count)]


def _components(cursor: Cursor) -> Iterator[tuple[int, Cursor, int]]:
    """Yield kind, content and number of items of each component."""
    for _ in range(cursor.read("HH")[1]):
        kind, size, _, items = cursor.read("HIHI")
        yield kind, Cursor(cursor.skip(size - 12)), items


def _read_markers(values: Cursor, items: int, frame: NdiFrame) -> None:
    for _ in range(items):
        handle, count = values.read("HH")
        for _ in range(count):
            state, _, index = values.read("BBH")
            place = HIDDEN if state == _UNSEEN else values.read("3f")
            place = place if state in _SEEN else HIDDEN
            if handle == _STRAYS:
                frame.strays.append(place)
            else:
                frame.tools.append(MarkerPlace(f"{handle:02X}:{index}", place))


_START = ("TSTOP:", "INIT:", "PHSR:02", "PHSR:03", "TSTART:")
"""A device that still tracks for an earlier client refuses the others before the first."""
# In parts: the catalogue of sentences would take it for one.
_POLLS = (" ".join(("BX2:--6d=tools", "--3d=all", "--1d=buttons")), "BX:1009", "TX:1001")
_UNKNOWN = ("ERROR01", "ERROR07")
"""Unknown command or parameter."""
_SHORT, _LONG = 0xA5C4, 0xA5C8
"""Starts of binary replies, by the size of their length."""
_MOST_TEXT, _MOST_BINARY = 1 << 13, 1 << 16
_WAIT_S, _REPEAT_S, _AGAIN_S = 0.1, 1.0, 0.2
"""Wait for bytes, and for the whole reply: to a command, to a poll."""
_MOST_DAMAGED = 20
_FAST_BAUD = 200_000
"""Slower lines do not carry the replies to BX2 at 60 Hz, but those to BX."""
_PAUSE = 0.1
"""Wait before the next poll after one without a new frame, in periods."""
_HIGHEST = 1e7
"""mm; hidden markers have larger coordinates."""
_FARTHEST_MM = 20.0
"""Way of a marker between two frames, beyond that of the others: 1.2 m/s at 60 Hz."""
_KEPT = 30
"""Frames for which the name of a hidden marker is kept."""
_MOST_STRAYS = 128
"""Limit for a frame, and half of their names; others have none."""


class NdiDecoder(Decoder):
    """Stray markers are named S1, S2, ..., those of tools TOOL:MARKER, their buttons TOOL."""

    name, port = "NDI", 8765
    ready = False
    silence_s = 1.0
    serial = True

    def __init__(self, document: TrackerDocument) -> None:
        super().__init__(document)
        self._queue, self._polls = deque(_START), deque(_POLLS)
        self._sent, self._repeat_s, self._next_s = "", 0.0, 0.0
        self._paused, self._pause_s = False, _PAUSE / document.frame_rate_hz
        self._last_ns = self._damaged = 0
        self._names = StrayNames(len(document.markers))

    def requests(self, now_s: float) -> bytes:
        """Return the next command, or the last one again if no reply came."""
        if self._paused:
            self._next_s, self._paused = now_s + self._pause_s, False
        if now_s < (self._repeat_s if self._sent else self._next_s):
            return b""
        if self._sent:
            # Part of a reply may have arrived, without the rest.
            self._buffer.clear()
        self._sent = self._sent or (self._queue or self._polls)[0]
        self._repeat_s, self.wait_s = now_s + (_REPEAT_S if self._queue else _AGAIN_S), _WAIT_S
        return command_of(self._sent)

    def _cut(self) -> bytes | None:
        start = int.from_bytes(self._buffer[:2], "little")
        if start in (_SHORT, _LONG):
            form = struct.Struct("<HHH" if start == _SHORT else "<HIH")
            if len(self._buffer) < form.size:
                return None
            _, size, stated = form.unpack_from(self._buffer)
            if size > _MOST_BINARY or checksum_ndi(self._buffer[: form.size - 2]) != stated:
                self._buffer.clear()
                self.account.received += 1
                self.account.damaged += 1
                self._send_again()
                return None
            size += form.size + 2
        else:
            size = self._buffer.find(b"\r") + 1
            if max(size, (not size) * len(self._buffer)) > _MOST_TEXT:
                raise self._foreign()
        return self._taken(size) if size else None

    def _send_again(self) -> None:
        """Let the command be sent again; AcquisitionError after many damaged replies."""
        self._repeat_s, self._damaged = 0.0, self._damaged + 1
        if self._damaged > _MOST_DAMAGED:
            raise self._foreign()

    def _read(self, packet: bytes) -> list[Message] | None:
        head = {_SHORT: 6, _LONG: 8}.get(int.from_bytes(packet[:2], "little"), 0)
        body = packet[head:-2] if head else packet[:-5]
        sealed = checksum_ndi(body)
        if packet[len(body) + head :] != (
            sealed.to_bytes(2, "little") if head else f"{sealed:04X}\r".encode()
        ):
            self._send_again()
            raise DamagedPacketError
        sent, self._sent, self._damaged = self._sent, "", 0
        text = "" if head else body.decode("ascii")
        if text.startswith(("ERROR", "RESET")):
            self._refused(sent, text)
            return []
        if not sent or (head > 0) is not (sent[:2] == "BX"):
            raise ValueError("reply to another command")
        if self._queue:
            self._started(sent, text)
            return []
        if text:
            return self._messages(read_tx(text))
        return self._messages(read_bx2(body) if sent[:3] == "BX2" else read_bx(body))

    def _refused(self, sent: str, reply: str) -> None:
        if sent == _START[0]:
            self._queue.popleft()
        elif not self._queue and reply[:7] in _UNKNOWN and len(self._polls) > 1:
            self._polls.popleft()
        else:
            command, shown = sent.partition(":")[0], printable(reply.encode())
            raise AcquisitionError(
                "ndi.refused",
                f"The tracker answered {command} with {shown}.",
                "Check its status lights and the tools plugged in, or switch it off and on.",
            )

    def _started(self, sent: str, reply: str) -> None:
        self._queue.popleft()
        if sent.startswith("PHSR:"):
            if re.fullmatch("[0-9A-F]{2}(?:[0-9A-F]{5})*", reply) is None:
                raise ValueError("handles")
            handles = [reply[at : at + 2] for at in range(2, len(reply), 5)]
            form = "PINIT:{}" if sent == "PHSR:02" else "PENA:{}D"
            self._queue.extendleft(form.format(one) for one in handles)
        self.ready = not self._queue
        if self.ready and 0 < self.baud < _FAST_BAUD:
            self._polls.popleft()

    def _messages(self, frames: list[NdiFrame]) -> list[Message]:
        found: list[Message] = []
        for one in frames:
            if not one.time_ns:
                raise AcquisitionError(
                    "ndi.no_tool",
                    "The tracker sends no frame number, because no tool is enabled.",
                    "Load a tool definition into the device, or plug a tool in; its markers need "
                    "not be seen.",
                )
            if one.time_ns != self._last_ns:
                self._last_ns = one.time_ns
                strays = np.array(one.strays).reshape(-1, 3)
                seen = np.abs(strays).max(axis=1, initial=0.0) < _HIGHEST
                elements = [*one.tools, *self._names.named(strays[seen])]
                found += [sensor_of(name, (float(on),)) for name, on in one.buttons.items()]
                found += frame_of(self.name, one.time_ns, elements)
        self._paused = not found
        self.wait_s = _WAIT_S if found else self._pause_s
        return found


class StrayNames:
    """Names S1, S2, ... for stray markers, which the device lists in any order.

    A name connects markers of consecutive frames. Their LEDs follow from the distances between
    the markers, as with the spots of cameras. ``wanted``: number of names in use.
    """

    def __init__(self, wanted: int) -> None:
        self._wanted = wanted
        self._places = np.zeros((0, 3))
        self._hidden = np.zeros(0, np.int64)
        """Frames since a marker of this name was seen."""

    def named(self, places: Float) -> list[MarkerPlace]:
        """Return the markers (n, 3), mm, of the next frame with their names."""
        places = places[:_MOST_STRAYS]
        self._hidden += 1
        away = np.linalg.norm(places[:, None] - self._places, axis=2)
        away[:, self._hidden > _KEPT] = np.inf
        names = np.full(len(places), -1)
        cost = np.minimum(away, 2.0 * _FARTHEST_MM) ** 2
        for marker, name in zip(*scipy.optimize.linear_sum_assignment(cost), strict=True):
            names[marker] = name if away[marker, name] <= _FARTHEST_MM else -1
        # A probe that came back elsewhere has no names in use until its old ones are free.
        beyond = np.flatnonzero(names >= self._wanted)
        free = np.setdiff1d(np.flatnonzero(self._hidden[: self._wanted] > _KEPT), names)
        renamed = beyond[: len(free)]
        self._places[free[: len(renamed)]] = self._places[names[renamed]]
        self._hidden[names[renamed]] = _KEPT + 1
        names[renamed] = free[: len(renamed)]
        known = names >= 0
        if known.any():
            # Hidden markers move with the others.
            self._places += (places[known] - self._places[names[known]]).mean(axis=0)
        for marker in np.flatnonzero(~known):
            free = np.setdiff1d(np.flatnonzero(self._hidden > _KEPT), names)
            if not len(free) and len(self._hidden) == 2 * _MOST_STRAYS:
                continue
            if not len(free):
                free = np.array([len(self._hidden)])
                self._places = np.vstack([self._places, places[marker]])
                self._hidden = np.append(self._hidden, 0)
            names[marker] = free[0]
        places, names = places[names >= 0], names[names >= 0]
        self._places[names], self._hidden[names] = places, 0
        return [
            MarkerPlace(f"S{name + 1}", (x, y, z))
            for name, (x, y, z) in zip(names.tolist(), places.tolist(), strict=True)
        ]
