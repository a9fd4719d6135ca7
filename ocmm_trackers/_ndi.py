"""Dialogue with NDI devices (Polaris, Vega): commands with checksum, and polled frames.

Source: as in `_ndi_replies`. The newest command that the device knows is used: BX2, BX, or TX.
"""

from __future__ import annotations

import re
import struct
from collections import deque

import numpy as np

from ocmm_core.camera import TrackerDocument
from ocmm_core.errors import AcquisitionError
from ocmm_trackers._messages import Message, MessageAccount, frame_of
from ocmm_trackers._ndi_replies import NdiFrame, checksum_ndi, read_bx, read_bx2, read_tx
from ocmm_trackers._strays import StrayNames

_START = ("TSTOP:", "INIT:", "PHSR:02", "PHSR:03", "TSTART:")
"""A device that still tracks for an earlier client refuses the others before the first."""
_POLLS = ("BX2:--6d=tools --3d=all", "BX:1009", "TX:1001")
_UNKNOWN = ("ERROR01", "ERROR07")
"""Unknown command or parameter."""
_SHORT, _LONG = 0xA5C4, 0xA5C8
_MOST_TEXT, _MOST_BINARY = 1 << 13, 1 << 16
_WAIT_S, _REPEAT_S = 0.1, 1.0
_PAUSE = 0.1
"""Wait before the next poll after one without a new frame, in periods."""
_HIGHEST = 1e7
"""mm; larger coordinates stand for a marker that is not seen."""


class NdiDecoder:
    """A `Decoder` of NDI devices, their stray markers and the markers of their tools.

    Stray markers are named S1, S2, ..., those of tools TOOL:MARKER.
    """

    group = None

    def __init__(self, document: TrackerDocument) -> None:
        self.account = MessageAccount()
        self.ready = False
        self.wait_s = _WAIT_S
        self._queue = deque(_START)
        self._polls = deque(_POLLS)
        self._sent, self._repeat_s, self._next_s = "", 0.0, 0.0
        self._paused, self._pause_s = False, _PAUSE / document.frame_rate_hz
        self._last_ns = 0
        self._names = StrayNames()
        self._buffer = bytearray()

    def requests(self, now_s: float) -> bytes:
        """Return the next command, or the last one again if no reply came."""
        if self._paused:
            self._next_s, self._paused = now_s + self._pause_s, False
        if now_s < (self._repeat_s if self._sent else self._next_s):
            return b""
        self._sent = self._sent or (self._queue or self._polls)[0]
        self._repeat_s, self.wait_s = now_s + _REPEAT_S, _WAIT_S
        return command(self._sent)

    def feed(self, data: bytes) -> list[Message]:
        """Return the frames that these bytes complete.

        AcquisitionError if they are of another protocol, or if the device refuses a command.
        """
        found: list[Message] = []
        self._buffer += data
        while len(self._buffer) >= 2:
            (start,) = struct.unpack_from("<H", self._buffer)
            reply = self._binary(start) if start in (_SHORT, _LONG) else self._text()
            if reply is None:
                break
            self.account.received += 1
            content, intact = reply
            if not intact:
                # The command is sent again.
                self.account.damaged += 1
                self._repeat_s = 0.0
                continue
            try:
                found += self._take(content)
            except ValueError:
                self.account.malformed += 1
            else:
                self.account.decoded += 1
        return found

    def _binary(self, start: int) -> tuple[bytes | str, bool] | None:
        form = "<HHH" if start == _SHORT else "<HIH"
        head = struct.calcsize(form)
        if len(self._buffer) < head:
            return None
        _, size, stated = struct.unpack_from(form, self._buffer)
        if size > _MOST_BINARY or checksum_ndi(bytes(self._buffer[: head - 2])) != stated:
            raise _foreign()
        if len(self._buffer) < head + size + 2:
            return None
        body = bytes(self._buffer[head : head + size])
        (stated,) = struct.unpack_from("<H", self._buffer, head + size)
        del self._buffer[: head + size + 2]
        return body, checksum_ndi(body) == stated

    def _text(self) -> tuple[bytes | str, bool] | None:
        end = self._buffer.find(b"\r")
        if end > _MOST_TEXT or (end < 0 and len(self._buffer) > _MOST_TEXT):
            raise _foreign()
        if end < 0:
            return None
        line = bytes(self._buffer[:end])
        del self._buffer[: end + 1]
        text, stated = line[:-4], line[-4:]
        intact = f"{checksum_ndi(text):04X}".encode() == stated.upper() and text.isascii()
        return text.decode("ascii", "replace"), intact

    def _take(self, reply: bytes | str) -> list[Message]:
        """Return the frames of an intact reply; ValueError if it is none to the last command."""
        sent = self._sent
        if not sent:
            raise ValueError("not requested")
        self._sent = ""
        if isinstance(reply, str) and reply.startswith(("ERROR", "RESET")):
            self._refused(sent, reply)
            return []
        if self._queue:
            self._started(sent, reply)
            return []
        if isinstance(reply, str):
            if not sent.startswith("TX:"):
                raise ValueError("text")
            return self._messages(read_tx(reply))
        return self._messages((read_bx2 if sent.startswith("BX2:") else read_bx)(reply))

    def _refused(self, sent: str, reply: str) -> None:
        if sent == _START[0]:
            self._queue.popleft()
        elif not self._queue and reply[:7] in _UNKNOWN and len(self._polls) > 1:
            self._polls.popleft()
        else:
            shown = "".join(one for one in reply if one.isprintable())[:40]
            raise AcquisitionError(
                "ndi.refused",
                f"The tracker answered {sent.partition(':')[0]} with {shown}.",
                "Check its status lights and the tools plugged in, switch it off and on, then "
                "open the job again.",
            )

    def _started(self, sent: str, reply: bytes | str) -> None:
        if not isinstance(reply, str):
            raise ValueError("binary")
        self._queue.popleft()
        if sent.startswith("PHSR:"):
            if re.fullmatch("[0-9A-F]{2}(?:[0-9A-F]{5})*", reply) is None:
                raise ValueError("handles")
            handles = [reply[at : at + 2] for at in range(2, len(reply), 5)]
            form = "PINIT:{}" if sent == "PHSR:02" else "PENA:{}D"
            self._queue.extendleft(form.format(one) for one in handles)
        self.ready = not self._queue

    def _messages(self, frames: list[NdiFrame]) -> list[Message]:
        new = [one for one in frames if one.time_ns != self._last_ns or not one.time_ns]
        if not new:
            self._paused, self.wait_s = True, self._pause_s
        found = []
        for one in new:
            self._last_ns = one.time_ns
            strays = np.array(one.strays).reshape(-1, 3)
            seen = np.abs(strays).max(axis=1, initial=0.0) < _HIGHEST
            if not one.time_ns:
                raise AcquisitionError(
                    "ndi.no_tool",
                    "The tracker sends no frame number, because no tool is enabled.",
                    "Load a tool definition into the device, or plug a tool in; its markers need "
                    "not be seen.",
                )
            elements = [*one.tools, *self._names.named(strays[seen])]
            found.append(frame_of("NDI", one.time_ns, elements))
        return found


def command(text: str) -> bytes:
    """Return a command with its checksum."""
    return f"{text}{checksum_ndi(text.encode()):04X}\r".encode()


def _foreign() -> AcquisitionError:
    return AcquisitionError(
        "ndi.stream",
        "The tracker sent bytes that are no reply of an NDI device.",
        "Check host and port, and that no other program uses the device.",
    )
