"""Extraction of camera frames from a bus captured with tcpdump or tshark.

During bring-up the master writes the logical address of each camera's process data (registers
0x0600 and following, ETG.1000.4, 6.6), and reads its serial number. So a capture from the start is
self-contained; for one that starts later, give the number of cameras. Only answers are used, each
only if its checksum and counters are right.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from ocmm_core.acquisition.frames import FrameBlock, FrameJoiner
from ocmm_core.acquisition.recording._packets import (
    CameraArea,
    LayoutListener,
    Packet,
    PacketFile,
    usual_layout,
)
from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus import device
from ocmm_core.fieldbus.wire import Command, Datagram, decode_frame, frame_index, has_passed

_LOGICAL = (Command.LRD, Command.LWR, Command.LRW)
_READS = (Command.LRD, Command.LRW)
_RUNNING = device.CameraStatus.OPERATIONAL | device.CameraStatus.SYNCHRONISED
_PERIODS_NS = range(50_000, 1_000_000_001)
_MAX_ADDRESSES = 64
_LAST_NS = 1 << 62
"""Later than any bus clock that counts from 2000."""


_WITHOUT_SERIAL = next(each for each in device.INPUT_LAYOUTS.values() if not each.says_serial)


@dataclass(slots=True)
class CameraAccount:
    """Counters of one camera's answers."""

    name: str
    """Serial number, or station address if not captured."""
    answers: int = 0
    damaged: int = 0
    """With a wrong checksum, or that of another camera."""
    unproven: int = 0
    """Before a second answer confirmed the serial number in the checksum."""
    idle: int = 0
    """While not in operation or not synchronised."""
    repeated: int = 0
    """With the cycle counter of the previous answer."""
    contradicting: int = 0
    """With inconsistent counters and times."""
    frames: int = 0
    missing: int = 0
    known: int = 0
    """`frames`, `missing`, `known`: used, missing between them, and repeated."""
    overruns: int = 0
    restarts: int = 0


@dataclass(slots=True)
class CaptureAccount:
    """Contents of a capture."""

    packets: int = 0
    other: int = 0
    malformed: int = 0
    cut: int = 0
    """`packets`, `other`, `malformed`, `cut`: all; not EtherCAT; unreadable; partly captured."""
    sent: Counter[str] = field(default_factory=Counter)
    returned: Counter[str] = field(default_factory=Counter)
    """`sent`, `returned`: datagrams by command, to the cameras and back."""
    cycles: int = 0
    answered: int = 0
    short: int = 0
    """Returned process data with too low a working counter."""
    joined: int = 0
    unjoined: int = 0
    """`joined`, `unjoined`: exposures with a frame of every camera, and those given up."""
    first_ns: int = 0
    last_ns: int = 0
    cut_off: bool = False
    """The file ends within a packet."""
    cameras: list[CameraAccount] = field(default_factory=list)


@dataclass(slots=True)
class _Track:
    """Position of a camera in its frames, and its valid mark (`data_mark`)."""

    next_frame: int | None = None
    cycle_counter: int | None = None
    serial: int | None = None
    layouts: dict[int, device.InputLayout] = field(default_factory=dict)
    suspected: int = device.NO_MARK


class BusCapture:
    """Frames in a capture; `n_cameras`: if it starts after bring-up; 0: from the capture."""

    def __init__(self, path: Path, n_cameras: int = 0) -> None:
        self._path = path
        self._file = PacketFile(path)
        self._listener = LayoutListener()
        self._usual = usual_layout(n_cameras)
        self._areas: tuple[CameraArea, ...] = ()
        self._tracks: list[_Track] = []
        self._joiner: FrameJoiner | None = None
        self._start_ns = self._period_ns = self._base = 0
        self._sent: Counter[int] = Counter()
        self._answered: Counter[int] = Counter()
        self.account = CaptureAccount()

    @property
    def serials(self) -> tuple[int | None, ...]:
        """Return the serial numbers in wire order; None if not captured."""
        return tuple(self._listener.serial(area.station) for area in self._areas)

    @property
    def period_ns(self) -> int:
        """Return the exposure period; 0 before the first exposure."""
        return self._period_ns

    def blocks(self) -> Iterator[FrameBlock]:
        """Yield the complete frames in wire order, once; raise InputError if unreadable."""
        for packet in self._file.packets():
            block = self._take_packet(packet)
            if block is not None:
                yield block
        self.account.cut_off = self._file.cut_off
        for camera, area in zip(self.account.cameras, self._areas, strict=True):
            camera.name = self._name(area)
        if self.account.answered and not self._areas:
            raise InputError(
                "capture.layout",
                f"{self._path}: the start-up of the cameras is missing or incomplete in the "
                "recording, so the location of their data is unknown.",
                "Start recording before the cameras start (tcpdump -s 2048), or give the number "
                "of cameras.",
            )

    def _take_packet(self, packet: Packet) -> FrameBlock | None:
        account = self.account
        account.packets += 1
        account.first_ns = account.first_ns or packet.time_ns
        account.last_ns = packet.time_ns or account.last_ns
        if frame_index(packet.content) is None:
            account.other += 1
            return None
        if not packet.whole:
            account.cut += 1
            return None
        try:
            _index, datagrams = decode_frame(packet.content)
        except BusError:
            account.malformed += 1
            return None
        back = has_passed(packet.content)
        found = False
        for datagram in datagrams:
            (account.returned if back else account.sent)[_name(datagram.command)] += 1
            if datagram.command in _LOGICAL:
                found |= self._take_process_data(datagram, back)
            elif back:
                self._listener.hear(datagram)
        return self._join() if found else None

    def _take_process_data(self, datagram: Datagram, back: bool) -> bool:
        """Count process data and use its frames; return whether there was any."""
        at = datagram.register << 16 | datagram.target
        # Process data of many cameras need several datagrams, each with its address.
        counts = self._answered if back else self._sent
        if at in counts or len(counts) < _MAX_ADDRESSES:
            counts[at] += 1
        self.account.cycles = max(self._sent.values(), default=0)
        self.account.answered = max(self._answered.values(), default=0)
        if not back:
            return False
        areas = self._usual or self._listener.areas
        if areas != self._areas:
            self._start(areas)
        end = at + len(datagram.data)
        mine = [area for area in areas if at <= area.inputs and area.inputs_end <= end]
        if datagram.command not in _READS or not mine:
            return False
        if datagram.working_counter < _least_working_counter(areas, datagram.command, at, end):
            self.account.short += 1
            return False
        found = False
        for area in mine:
            content = datagram.data[area.inputs - at : area.inputs_end - at]
            found |= self._take_camera(areas.index(area), content)
        return found

    def _start(self, areas: tuple[CameraArea, ...]) -> None:
        known = dict(zip((area.station for area in self._areas), self.account.cameras, strict=True))
        self._areas = areas
        self._tracks = [_Track() for _ in areas]
        self._joiner = None
        self._start_ns = self._period_ns = 0
        self.account.cameras = [
            known.get(area.station, CameraAccount(self._name(area))) for area in areas
        ]

    def _take_camera(self, place: int, content: bytes) -> bool:
        account, track = self.account.cameras[place], self._tracks[place]
        account.answers += 1
        layout = self._layout(place, device.data_mark(content))
        if layout is None:
            return False
        header = layout.decode(content)
        if header.status & _RUNNING != _RUNNING:
            account.idle += 1
            return False
        if header.cycle_counter == track.cycle_counter:
            account.repeated += 1
            return False
        track.cycle_counter = header.cycle_counter
        first = self._first_frame(header)
        if first is None:
            account.contradicting += 1
            return False
        if header.status & device.CameraStatus.OVERRUN:
            account.overruns += 1
        return self._take_frames(place, first, header, content)

    def _layout(self, place: int, mark: int) -> device.InputLayout | None:
        """Return the layout of a valid input; without known serial number two must agree."""
        account, track = self.account.cameras[place], self._tracks[place]
        serial = self._listener.serial(self._areas[place].station)
        if serial is not None and serial != track.serial:
            track.serial = serial
            track.layouts = {each.mark(serial): each for each in device.INPUT_LAYOUTS.values()}
        layout = track.layouts.get(mark)
        if layout is not None:
            return layout
        if serial is None and mark == track.suspected != device.NO_MARK:
            track.layouts[mark] = device.NEWEST_LAYOUT if mark else _WITHOUT_SERIAL
            return track.layouts[mark]
        if serial is None and not track.layouts and mark != device.NO_MARK:
            account.unproven += 1
        else:
            account.damaged += 1
        track.suspected = mark
        return None

    def _first_frame(self, header: device.Header) -> int | None:
        """Return the number of the header's first exposure; None if inconsistent."""
        if (
            header.period_ns not in _PERIODS_NS
            or header.start_ns > _LAST_NS
            or header.frames_valid > device.FRAMES_PER_CYCLE
        ):
            return None
        start_ns, period_ns = self._start_ns, self._period_ns
        first, rest = divmod(header.start_ns - start_ns, period_ns) if period_ns else (0, 1)
        if (
            period_ns == header.period_ns
            and not rest
            and first % device.COUNTER_MODULUS == header.counter
        ):
            return first
        # Another first exposure: the cameras were (re)started.
        start_ns = header.start_ns - header.counter * header.period_ns
        if start_ns < 0:
            return None
        if self._period_ns:
            for camera in self.account.cameras:
                camera.restarts += 1
            self._tracks = [replace(old, next_frame=None) for old in self._tracks]
        self._start_ns, self._period_ns = start_ns, header.period_ns
        # A capture may start within an acquisition.
        self._base = header.counter
        base_ns = start_ns + self._base * header.period_ns
        self._joiner = FrameJoiner(len(self._areas), base_ns, header.period_ns)
        return header.counter

    def _take_frames(self, place: int, first: int, header: device.Header, content: bytes) -> bool:
        account, track = self.account.cameras[place], self._tracks[place]
        expected = first if track.next_frame is None else track.next_frame
        known = min(max(0, expected - first), header.frames_valid)
        account.known += known
        if not header.frames_valid - known or self._joiner is None:
            return False
        account.missing += max(0, first - expected)
        frames = device.frames_of(content, known, header.frames_valid)
        self._joiner.push(place, first + known - self._base, frames)
        account.frames += header.frames_valid - known
        track.next_frame = first + header.frames_valid
        return True

    def _join(self) -> FrameBlock | None:
        if self._joiner is None:
            return None
        joined = self._joiner.pull()
        self.account.unjoined += joined.lost
        if joined.frames is None:
            return None
        self.account.joined += len(joined.frames)
        return replace(joined.frames, counter=joined.frames.counter + self._base)

    def _name(self, area: CameraArea) -> str:
        serial = self._listener.serial(area.station)
        return f"station {area.station:#06x}" if serial is None else f"serial {serial}"


def _least_working_counter(areas: tuple[CameraArea, ...], command: int, at: int, end: int) -> int:
    weight = 2 if command == Command.LRW else 0
    return sum((at <= area.inputs < end) + weight * (at <= area.outputs < end) for area in areas)


def _name(command: int) -> str:
    try:
        return Command(command).name
    except ValueError:
        return f"{command:#04x}"
