"""Dialogue with NDI devices (Polaris, Vega): commands with checksum, and polled frames.

Source: as in `_ndi_replies`. The decoder polls by the newest command of the device: BX2, BX, or TX.
"""

from __future__ import annotations

import re
import struct
from collections import deque

import numpy as np
from scipy.optimize import linear_sum_assignment

from ocmm_core.camera import TrackerDocument
from ocmm_core.errors import AcquisitionError
from ocmm_core.geometry import Float
from ocmm_trackers._messages import (
    DamagedPacketError,
    Decoder,
    MarkerPlace,
    Message,
    frame_of,
    printable,
    sensor_of,
)
from ocmm_trackers._ndi_replies import NdiFrame, checksum_ndi, read_bx, read_bx2, read_tx

_START = ("TSTOP:", "INIT:", "PHSR:02", "PHSR:03", "TSTART:")
"""A device that still tracks for an earlier client refuses the others before the first."""
# In parts: the catalogue of sentences would take it for one.
_POLLS = (" ".join(("BX2:--6d=tools", "--3d=all", "--1d=buttons")), "BX:1009", "TX:1001")
_UNKNOWN = ("ERROR01", "ERROR07")
"""Unknown command or parameter."""
_SHORT, _LONG = 0xA5C4, 0xA5C8
"""Starts of binary replies, by the size of their length."""
_MOST_TEXT, _MOST_BINARY = 1 << 13, 1 << 16
_WAIT_S, _REPEAT_S = 0.1, 1.0
_PAUSE = 0.1
"""Wait before the next poll after one without a new frame, in periods."""
_HIGHEST = 1e7
"""mm; hidden markers have larger coordinates."""
_FARTHEST_MM = 20.0
"""Way of a marker between two frames, beyond that of the others: 1.2 m/s at 60 Hz."""
_KEPT = 30
"""Frames for which the name of a hidden marker is kept."""


class NdiDecoder(Decoder):
    """Stray markers are named S1, S2, ..., those of tools TOOL:MARKER, their buttons TOOL."""

    name, port = "NDI", 8765
    ready = False

    def __init__(self, document: TrackerDocument) -> None:
        super().__init__(document)
        self._queue, self._polls = deque(_START), deque(_POLLS)
        self._sent, self._repeat_s, self._next_s = "", 0.0, 0.0
        self._paused, self._pause_s = False, _PAUSE / document.frame_rate_hz
        self._last_ns = 0
        self._names = StrayNames()

    def requests(self, now_s: float) -> bytes:
        """Return the next command, or the last one again if no reply came."""
        if self._paused:
            self._next_s, self._paused = now_s + self._pause_s, False
        if now_s < (self._repeat_s if self._sent else self._next_s):
            return b""
        self._sent = self._sent or (self._queue or self._polls)[0]
        self._repeat_s, self.wait_s = now_s + _REPEAT_S, _WAIT_S
        return f"{self._sent}{checksum_ndi(self._sent.encode()):04X}\r".encode()

    def _cut(self) -> bytes | None:
        start = int.from_bytes(self._buffer[:2], "little")
        if start in (_SHORT, _LONG):
            form = struct.Struct("<HHH" if start == _SHORT else "<HIH")
            if len(self._buffer) < form.size:
                return None
            _, size, stated = form.unpack_from(self._buffer)
            if size > _MOST_BINARY or checksum_ndi(self._buffer[: form.size - 2]) != stated:
                raise self._foreign()
            size += form.size + 2
        else:
            size = self._buffer.find(b"\r") + 1
            if max(size, (not size) * len(self._buffer)) > _MOST_TEXT:
                raise self._foreign()
        return self._taken(size) if size else None

    def _read(self, packet: bytes) -> list[Message] | None:
        head = {_SHORT: 6, _LONG: 8}.get(int.from_bytes(packet[:2], "little"), 0)
        body, stated = packet[head:-2], int.from_bytes(packet[-2:], "little")
        if not head:
            body, stated = packet[:-5], int(packet[-5:-1], 16)
        if checksum_ndi(body) != stated:
            # The command is sent again.
            self._repeat_s = 0.0
            raise DamagedPacketError
        sent, self._sent = self._sent, ""
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
                "Check its status lights and the tools plugged in, switch it off and on, then "
                "open the job again.",
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
    the markers, as with the spots of cameras.
    """

    def __init__(self) -> None:
        self._places = np.zeros((0, 3))
        self._hidden = np.zeros(0, np.int64)
        """Frames since a marker of this name was seen."""

    def named(self, places: Float) -> list[MarkerPlace]:
        """Return the markers (n, 3), mm, of the next frame with their names."""
        self._hidden += 1
        away = np.linalg.norm(places[:, None] - self._places, axis=2)
        away[:, self._hidden > _KEPT] = np.inf
        names = np.full(len(places), -1)
        cost = np.minimum(away, 2.0 * _FARTHEST_MM) ** 2
        for marker, name in zip(*linear_sum_assignment(cost), strict=True):
            names[marker] = name if away[marker, name] <= _FARTHEST_MM else -1
        known = names >= 0
        if known.any():
            # Hidden markers move with the others.
            self._places += (places[known] - self._places[names[known]]).mean(axis=0)
        for marker in np.flatnonzero(~known):
            free = np.setdiff1d(np.flatnonzero(self._hidden > _KEPT), names)
            if not len(free):
                free = np.array([len(self._hidden)])
                self._places = np.vstack([self._places, places[marker]])
                self._hidden = np.append(self._hidden, 0)
            names[marker] = free[0]
        self._places[names], self._hidden[names] = places, 0
        return [
            MarkerPlace(f"S{name + 1}", (x, y, z))
            for name, (x, y, z) in zip(names.tolist(), places.tolist(), strict=True)
        ]
