"""The bus for a command: brought to operation, used, and released.

``ocmm bus watch``: the report of a running bus on the terminal.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

from ocmm_cli.terminal import PlainConsole, make_console, tr
from ocmm_core.acquisition import bus_process
from ocmm_core.acquisition.frames import AcquisitionState, read_status
from ocmm_core.camera import CameraModel, Rig, load_rig
from ocmm_core.composition import (
    DEMO_PLAN,
    Feed,
    NamedSource,
    SourceSpec,
    StationRequest,
    make_feed,
    names_in_words,
    source_of,
    sources,
)
from ocmm_core.errors import BusError, InputError
from ocmm_core.fieldbus.report import BusPhase, BusReport, decode_report
from ocmm_core.fieldbus.wire import ScannedDevice, decode_scan
from ocmm_core.inspection.plan import load_plan
from ocmm_core.station import BusWatch, bus_text

if TYPE_CHECKING:
    from ocmm_sim.bus import SegmentConfig


_START_S = 60.0
"""Generous: the bus process gives up earlier if starting is of no use."""
_SCAN_S = 30.0
_POLL_S = 0.01
_NO_BUS = "which is not a camera bus"


@dataclass(frozen=True, slots=True)
class BusSession:
    rig: Rig
    feed: Feed
    process: bus_process.ChildProcess

    def objects(self, camera: str) -> bus_process.RemoteObjects:
        """Return the objects of a camera; InputError if the rig has none of that name."""
        return bus_process.RemoteObjects(self.process, camera_of(self.rig, camera).name)

    def report(self) -> BusReport | None:
        return decode_report(self.feed.ring.report())


def camera_of(rig: Rig, name: str) -> CameraModel:
    """Return a camera of the rig; InputError if it has none of that name."""
    for camera in rig.cameras:
        if camera.name == name:
            return camera
    raise InputError(
        "bus.no_camera",
        f"The rig '{rig.name}' has no camera '{name}'.",
        f"Give one of: {', '.join(camera.name for camera in rig.cameras)}.",
    )


@contextmanager
def open_bus(
    source: str,
    rig_path: Path,
    *,
    camera: str = "",
    force: bool = False,
    wait: bool = True,
    processor: int | None = None,
) -> Iterator[BusSession]:
    """Keep the bus of a source in operation for the duration of the context.

    ``camera`` is checked before anything is started; without ``wait`` the context begins when the
    bus process is started. InputError if the source is no EtherCAT bus, or the rig has no such
    camera; BusError if it cannot be brought to operation.
    """
    if not source_of(source).spec.on_bus:
        raise _wrong_source(source, _NO_BUS, [spec for spec in sources() if spec.on_bus])
    rig = load_rig(rig_path)
    if camera:
        camera_of(rig, camera)
    request = StationRequest(
        plan=DEMO_PLAN,
        out=Path(),
        rig=rig_path,
        source=source,
        force=force,
        bus_processor=processor,
    )
    feed = make_feed(request, load_plan(DEMO_PLAN), rig)
    try:
        process = feed.acquisition
        if not isinstance(process, bus_process.ChildProcess):
            raise TypeError(f"the process of {source} does not accept requests")
        process.start()
        session = BusSession(rig, feed, process)
        if wait:
            with make_console().status(tr("Bringing the cameras to operation")):
                _await_operation(session)
        yield session
    finally:
        feed.end()


def command_of(
    errand: bus_process.WireErrand, segment: SegmentConfig | None
) -> tuple[list[str], bytes]:
    """Return the command of a task on a bus, or on the virtual wire of cameras, and its input."""
    if segment is None:
        return errand.command(), errand.to_json()
    from ocmm_sim.bus import errand_virtual

    return errand_virtual(segment, errand)


def scan(source: str, rig_path: Path, *, force: bool = False) -> tuple[ScannedDevice, ...]:
    """Return the devices on a bus without configuring it; errors as `open_bus`."""
    named = bus_to_scan(source)
    config = bus_process.ScanConfig(interface=named.value, force=force)
    return decode_scan(_ask(*command_of(config, segment_for(named, rig_path))))


def recorder_of(
    source: str, seconds: float, size_bytes: int, *, force: bool = False
) -> tuple[list[str], bytes]:
    """Return the command that records a bus, and its input; InputError without an interface."""
    named = source_of(source)
    if not named.spec.on_bus or not named.value or named.spec.segment is not None:
        what = "whose bus is private" if named.spec.on_bus else _NO_BUS
        raise _wrong_source(
            source, what, [s for s in sources() if _may_scan(s) and s.segment is None]
        )
    config = bus_process.RecordConfig(
        interface=named.value.partition("+")[0], force=force, seconds=seconds,
        size_bytes=size_bytes,
    )  # fmt: skip
    return command_of(config, None)


class BusErrand(subprocess.Popen[bytes]):
    stdin: IO[bytes]
    stdout: IO[bytes]
    stderr: IO[bytes]

    def complaint(self) -> str:
        """Return the last line of its complaint."""
        lines = self.stderr.read().decode("utf-8", errors="replace").strip().splitlines()
        return "".join(lines[-1:])


@contextmanager
def errand(command: list[str], first_lines: bytes) -> Iterator[BusErrand]:
    """Run a program of the bus on its first lines; its input stays open until it ends."""
    pipe = subprocess.PIPE
    with BusErrand(command, stdin=pipe, stdout=pipe, stderr=pipe) as process:
        process.stdin.write(first_lines)
        process.stdin.flush()
        yield process


def _ask(command: list[str], first_lines: bytes) -> bytes:
    """Return the output of a program of the bus."""
    with errand(command, first_lines) as ran:
        try:
            ran.wait(_SCAN_S)
        except subprocess.TimeoutExpired:
            ran.kill()
        answer, complaint = ran.stdout.read(), ran.complaint()
    if ran.returncode:
        raise BusError(
            "bus.scan",
            complaint or f"The bus cannot be scanned (code {ran.returncode}).",
            "Then try again.",
        )
    return answer


def _await_operation(session: BusSession) -> None:
    deadline = time.monotonic() + _START_S
    while True:
        status = read_status(session.feed.ring)
        if status.state is AcquisitionState.STOPPED:
            raise status.error("bus.start", "Correct that and repeat the command.")
        report = session.report()
        running = status.state is AcquisitionState.RUNNING
        if running and (report is None or report.phase is BusPhase.OPERATION):
            return
        if time.monotonic() > deadline:
            state = report.phase.value if report is not None else "starting"
            why = f" ({report.message})" if report is not None and report.message else ""
            raise BusError(
                "bus.start",
                f"The bus is not in operation after {_START_S:.0f} s; it is {state}{why}.",
                "Check power and cables of the cameras, then repeat the command.",
            )
        time.sleep(_POLL_S)


def bus_to_scan(source: str) -> NamedSource:
    """Return a source whose bus a scan may use: services keep theirs private; else InputError."""
    named = source_of(source)
    if not _may_scan(named.spec):
        what = "whose bus is private" if named.spec.on_bus else _NO_BUS
        raise _wrong_source(source, what, [spec for spec in sources() if _may_scan(spec)])
    return named


def segment_for(named: NamedSource, rig_path: Path) -> SegmentConfig | None:
    """Return the software cameras of a virtual wire; None for real cameras."""
    if named.spec.segment is None:
        return None
    request = StationRequest(plan=DEMO_PLAN, out=Path(), rig=rig_path, source=named.name)
    found: SegmentConfig = named.spec.segment(request, load_plan(DEMO_PLAN), load_rig(rig_path))
    return found


def _may_scan(spec: SourceSpec) -> bool:
    """Return whether a scan may use the wire: services keep theirs private."""
    return spec.on_bus and (spec.segment is not None or spec.takes_value)


def _wrong_source(source: str, what: str, possible: Sequence[SourceSpec]) -> InputError:
    return InputError(
        "bus.source", f"--source is {source!r}, {what}.", f"Give {names_in_words(possible)}."
    )


_WATCH_POLL_S = 0.05


def watch_bus(
    session: BusSession, seconds: float, every: float | None, console: PlainConsole
) -> tuple[str, bool]:
    """Print the report of a bus at intervals and at the end.

    ``seconds``: duration; ``every``: interval, s, None prints only at the end. Returns the last
    report, and whether the bus was in operation then. BusError if the bus process ended; its last
    report was printed.
    """
    watch = BusWatch(session.feed.ring)
    begin = printed = time.monotonic()
    stopped = False
    while not stopped and time.monotonic() - begin < seconds:
        time.sleep(_WATCH_POLL_S)
        watch.report()
        status = read_status(session.feed.ring)
        stopped = status.state is AcquisitionState.STOPPED
        if every is not None and watch.report() and time.monotonic() - printed >= every:
            printed = time.monotonic()
            console.out(bus_text(watch, session.rig.name), highlight=False)
    report = watch.report()
    text = "" if report is None and stopped else bus_text(watch, session.rig.name)
    if text:
        console.out(text, highlight=False, end="")
    if stopped:
        raise status.error("bus.watch", "Correct that and repeat the command.")
    return text, report is not None and report.phase is BusPhase.OPERATION
