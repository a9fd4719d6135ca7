"""Markers as replies of an NDI device to BX2, BX and TX: strays, or the markers of a tool."""

from __future__ import annotations

import struct
from typing import Literal

from ocmm_core.camera import TrackerDocument
from ocmm_sim.trackers._encoder import MarkerEncoder, NamedPlaces
from ocmm_trackers import checksum_ndi, command_of

Places = list[tuple[float, float, float] | None]
Newest = Literal["BX2", "BX", "TX"]
_COMMANDS: dict[Newest, tuple[str, ...]] = {
    "BX2": ("BX2", "BX", "TX"), "BX": ("BX", "TX"), "TX": ("TX",),
}  # fmt: skip
_TOOL, _PORT, _SWITCH = 1, 0x31, 0x02
_MISSING = 2
_HZ = 60
_FAR = (-3.697314e28,) * 3
"""Coordinates of a marker that is not seen."""
_STARTED = 500_000
"""Frames since the device was switched on."""
_TEXTS = {
    "INIT": "OKAY", "TSTART": "OKAY", "TSTOP": "OKAY", "PINIT": "OKAY", "PENA": "OKAY",
    "BEEP": "1", "RESET": "RESET",
}  # fmt: skip
_STEPS = {"RESET": 0, "INIT": 1, "TSTOP": 1, "TSTART": 2}
"""State after a command: on, initialised, tracking."""
_RESET_BAUD = 9600
_BAUDS = {"0": _RESET_BAUD, "5": 115200, "6": 921600}


class NdiEncoder(MarkerEncoder):
    """Frames of markers of an NDI device, which it sends if it is polled.

    It has one tool, which is not seen. With ``as_tool`` the markers are those of the tool.
    """

    ready = False

    def __init__(
        self,
        document: TrackerDocument,
        newest: Newest = "BX2",
        seed: int = 0,
        *,
        as_tool: bool = False,
    ) -> None:
        super().__init__(document, seed)
        self._known, self._as_tool = _COMMANDS[newest], as_tool
        self._requests, self._polled = b"", ""
        self._named: NamedPlaces = {}
        self._first_ns = self._step = 0
        self.baud, self.fastest = _RESET_BAUD, max(_BAUDS.values())
        """`baud`, `fastest`: present speed of a serial line, after the reply; highest one."""
        self.plugged = True
        """Its tool is plugged in."""

    def restart(self) -> bytes:
        """Switch the device off and on, or let it hear a break; return its greeting."""
        self._requests, self._polled, self.ready = b"", "", False
        self._first_ns, self._held, self.baud = 0, b"", _RESET_BAUD
        return self._reply("RESET ")

    def answer(self, data: bytes) -> bytes:
        self._requests += data
        *lines, self._requests = self._requests.split(b"\r")
        return b"".join(self._reply(line.decode("ascii")) for line in lines)

    def _reply(self, line: str) -> bytes:
        name, colon, rest = line.partition(":")
        if not colon:
            name, _, rest = line.partition(" ")
        elif f"{checksum_ndi(line[:-4].encode()):04X}" != line[-4:]:
            return command_of("ERROR04")
        rest = rest[:-4] if colon else rest
        if name in ("BX2", "BX", "TX"):
            if name not in self._known:
                return command_of("ERROR01")
            if self._step < _STEPS["TSTART"]:
                return command_of("ERROR0C")
            self._polled, self.ready = f"{name}:{rest}", True
            return b""
        if name == "COMM":
            baud = _BAUDS.get(rest[:1], 0)
            self.baud = baud if 0 < baud <= self.fastest else self.baud
            return command_of("OKAY" if self.baud == baud else "ERROR06")
        if name in _STEPS:
            if not self._step and name in ("TSTOP", "TSTART"):
                return command_of("ERROR0C")
            self._step = _STEPS[name]
        if name == "PHSR":
            return command_of(f"01{_TOOL:02X}001" if self.plugged else "00")
        return command_of(_TEXTS.get(name, "ERROR01"))

    def _packets(self, named: NamedPlaces, time_ns: int, pressed: bool) -> bytes:
        """Return the reply to the last poll."""
        self._first_ns = self._first_ns or time_ns
        number = _STARTED + round((time_ns - self._first_ns) * _HZ / 1e9)
        name, _, options = self._polled.partition(":")
        self._polled, self.ready = "", False
        places = [one for one in named.values() if self._as_tool or one is not None]
        if name == "BX2":
            return _binary(self._bx2(places, time_ns, number, pressed))
        status = _PORT | (_SWITCH if pressed else 0)
        if name == "BX":
            return _binary(self._bx(places, status, number, int(options, 16)))
        return command_of(_tx(places, status, number, int(options, 16))) if name else b""

    def _bx2(self, places: Places, time_ns: int, number: int, pressed: bool) -> bytes:
        markers = struct.pack("<HH", _TOOL if self._as_tool else 0xFFFF, len(places))
        for index, place in enumerate(places):
            markers += struct.pack("<BBH", int(place is None), 0, index)
            markers += struct.pack("<3f", *place) if place else b""
        pose, button = struct.pack("<HH", _TOOL, 0x100 | 31), struct.pack("<HHB", _TOOL, 1, pressed)
        frame = struct.pack("<BBHIII", 2, 0, 0, number, *divmod(time_ns, 10**9))
        frame += struct.pack("<HH", 1, 3)
        frame += _component(2, pose) + _component(3, markers) + _component(4, button)
        return struct.pack("<HH", 1, 1) + _component(1, frame)

    def _bx(self, places: Places, status: int, number: int, options: int) -> bytes:
        content = struct.pack("<BBB", 1, _TOOL, 1 if self._as_tool else _MISSING)
        if not self.plugged:
            options, content = options & ~9, b"\0"
        if options & 1:
            pose = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1)
            content += struct.pack("<8f", *pose) if self._as_tool else b""
            content += struct.pack("<II", status, number)
        if options & 8:
            content += _listed(places if self._as_tool else [])
        if options & 0x1000:
            content += _listed([] if self._as_tool else places)
        return content + struct.pack("<H", 0)


def _listed(places: Places) -> bytes:
    content = bytes([len(places)]) + bytes(-(-len(places) // 8))
    return content + b"".join(struct.pack("<3f", *(place or _FAR)) for place in places)


def _component(kind: int, content: bytes) -> bytes:
    return struct.pack("<HIHI", kind, 12 + len(content), 0, 1) + content


def _tx(places: Places, status: int, number: int, options: int) -> str:
    text = f"01{_TOOL:02X}MISSING{status:08X}{number:08X}\n"
    if options & 0x1000:
        text += f"{len(places):02X}" + "0" * -(-len(places) // 4)
        text += "".join(f"{round(100 * x):+07d}" for place in places for x in place or _FAR)
    return f"{text}0000"


def _binary(body: bytes) -> bytes:
    head = struct.pack("<HH", 0xA5C4, len(body))
    return b"".join(one + struct.pack("<H", checksum_ndi(one)) for one in (head, body))
