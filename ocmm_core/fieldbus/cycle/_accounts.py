"""Bus counters (every cycle once, each camera), journal of events, and the report.

Similar events are merged, so they never flood.
"""

from __future__ import annotations

import time
from bisect import bisect_left
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from msgspec.structs import replace

from ocmm_core.fieldbus.cycle._bringup import BusSettings
from ocmm_core.fieldbus.cycle._bus import CameraBus
from ocmm_core.fieldbus.cycle._health import CameraPast
from ocmm_core.fieldbus.cycle._supervisor import Supervisor
from ocmm_core.fieldbus.cycle._watch import CameraView
from ocmm_core.fieldbus.device import CameraIdentity, CameraStatus, Header
from ocmm_core.fieldbus.objects import ObjectService
from ocmm_core.fieldbus.report import (
    EDGES_US,
    MAX_EVENTS,
    BusEvent,
    BusReport,
    CameraReport,
    Histogram,
    alarm_of_code,
)
from ocmm_core.fieldbus.wire import STATE_NAMES, al_text

OPERATION = "bus.operation"
"""Event code: bus in operation (again)."""
ERROR_OVER = "bus.error_over"
"""Event code: a camera reports the end of an error."""
_GROUP_NS = 1_000_000_000
"""Similar events closer than this are merged."""


@dataclass(slots=True)
class _Entry:
    event: BusEvent
    last_ns: int


class Journal:
    """Ring of the newest events."""

    def __init__(self) -> None:
        self.dropped = 0
        self._entries: deque[_Entry] = deque()
        self._open: dict[tuple[str, str], _Entry] = {}
        self._number = 0

    def note(
        self,
        code: str,
        what: str,
        *,
        cycle: int,
        now_ns: int,
        camera: str = "",
        remedy: str = "",
        cycles: int = 1,
    ) -> bool:
        """Record an event, see `BusEvent`; return whether it is new.

        An alarm's remedy may be omitted; `now_ns` is monotonic host time.
        """
        entry = self._open.get((code, camera))
        if entry is not None and now_ns - entry.last_ns <= _GROUP_NS:
            entry.event = replace(entry.event, cycles=entry.event.cycles + cycles)
            entry.last_ns = now_ns
            return False
        alarm = alarm_of_code(code)
        if not remedy and alarm is not None:
            remedy = alarm.spec.remedy
        self._number += 1
        event = BusEvent(
            number=self._number, utc_ns=time.time_ns(), cycle=cycle, code=code, camera=camera,
            what=what, remedy=remedy, cycles=cycles,
        )  # fmt: skip
        entry = _Entry(event, now_ns)
        self._entries.append(entry)
        self._open[code, camera] = entry
        if len(self._entries) > MAX_EVENTS:
            self._entries.popleft()
            self.dropped += 1
        return True

    def events(self) -> tuple[BusEvent, ...]:
        """Return the newest events, newest last."""
        return tuple(entry.event for entry in self._entries)


class Durations:
    """Counts durations in the bins of a report."""

    def __init__(self) -> None:
        self._edges_ns = [int(edge * 1000) for edge in EDGES_US]
        self._counts = [0] * (len(EDGES_US) + 1)
        self._worst_ns = 0

    def add(self, duration_ns: int) -> None:
        self._counts[bisect_left(self._edges_ns, duration_ns)] += 1
        self._worst_ns = max(self._worst_ns, duration_ns)

    def histogram(self) -> Histogram:
        """Return the counts so far."""
        return Histogram(
            edges_us=EDGES_US, counts=tuple(self._counts), worst_us=self._worst_ns / 1e3
        )


@dataclass(slots=True)
class _CameraAccount:
    frames: int = 0
    frames_lost: int = 0
    overruns: int = 0
    bad_cycles: int = 0
    emergencies: int = 0
    boot_counter: int = 0


class BusAccounts:
    """Counts events and writes the report.

    `lateness` and `round_trip` are histograms of the cycles; `notes` lists what this computer does
    not allow the process.
    """

    def __init__(self, settings: BusSettings, notes: Sequence[str]) -> None:
        self.journal = Journal()
        self.lateness = Durations()
        self.round_trip = Durations()
        self.cycles: Counter[str] = Counter()
        """Verdicts by name; they add up to ``elapsed``."""
        self.elapsed = 0
        self._settings = settings
        self._notes = tuple(notes)
        self._cameras = {camera.name: _CameraAccount() for camera in settings.cameras}

    def cycle(self, verdict: str, skipped: str, elapsed: int) -> None:
        """Count one read: its verdict, and `skipped` for the cycles missed before it."""
        self.cycles[verdict] += 1
        self.cycles[skipped] += elapsed - 1
        self.elapsed += elapsed

    def taken(self, record: CameraPast, header: Header, first: int) -> bool:
        """Count accepted frames from number `first` on; return whether the camera restarted."""
        account = self._cameras[record.name]
        end = first + header.frames_valid
        account.frames += max(0, end - max(first, record.next_frame))
        if header.frames_valid and first > record.next_frame:
            account.frames_lost += first - record.next_frame
            account.overruns += bool(header.status & CameraStatus.OVERRUN)
        restarted = account.boot_counter not in (0, header.boot_counter)
        account.boot_counter = header.boot_counter
        return restarted

    def refused(self, camera: str) -> None:
        """Count a cycle that was refused because of a camera."""
        if camera:
            self._cameras[camera].bad_cycles += 1

    def emergency(self, camera: str) -> None:
        self._cameras[camera].emergencies += 1

    def lost(self, frames: int) -> None:
        """Count frames of every camera that a bring-up cannot recover."""
        for account in self._cameras.values():
            account.frames_lost += frames

    def report(
        self,
        bus: CameraBus,
        supervisor: Supervisor,
        objects: ObjectService,
        phase_ns: float,
        celsius: Mapping[str, float],
        pace: float | None,
    ) -> BusReport:
        """Return the report; ``phase_ns``: of cycles on bus time; ``pace``: see `BusReport`."""
        settings, session, view = self._settings, bus.session, bus.view
        known = view.cameras if len(view.cameras) == len(settings.cameras) else ()
        # After bring-up has found a camera; a failed one leaves it in INIT.
        idle = "PREOP" if session.places and session.master else "INIT"
        cameras = tuple(
            self._camera(
                camera,
                session.serials.index(camera.serial) + 1 if camera.serial in session.serials else 0,
                session.firmware[place] if session.firmware else "",
                known[place] if known and session.master else None,
                idle,
                celsius.get(camera.name),
            )
            for place, camera in enumerate(settings.cameras)
        )
        return BusReport(
            interface=settings.interface,
            redundant_interface=settings.redundant_interface,
            phase=supervisor.phase,
            alarm=supervisor.alarm,
            message=supervisor.message,
            cameras=cameras,
            cycle_period_ns=settings.cycle_period_ns,
            frame_period_ns=settings.frame_period_ns,
            elapsed=self.elapsed,
            good=self.cycles["good"],
            late=self.cycles["late"],
            lost=self.cycles["lost"],
            bad=self.cycles["bad"],
            stray_answers=bus.stray_answers,
            recoveries=supervisor.recoveries,
            clock_phase_ns=round(phase_ns),
            clock_drift_ppm=round(bus.clock.drift_ppm, 2),
            redundancy_broken=bus.redundancy_broken,
            objects_done=objects.done,
            objects_failed=objects.failed,
            lateness=self.lateness.histogram(),
            round_trip=self.round_trip.histogram(),
            events=self.journal.events(),
            events_dropped=self.journal.dropped,
            notes=self._notes,
            pace=pace,
        )

    def _camera(
        self,
        camera: CameraIdentity,
        position: int,
        firmware: str,
        view: CameraView | None,
        idle: str,
        celsius: float | None,
    ) -> CameraReport:
        account = self._cameras[camera.name]
        state, code = idle if position and view is None else "-", 0
        if view is not None and view.answers:
            state, code = STATE_NAMES.get(view.state, "-"), view.code
        return CameraReport(
            name=camera.name,
            serial=camera.serial,
            alias=camera.alias,
            position=position,
            state=state,
            al_code=code,
            al_text=al_text(code),
            firmware=firmware,
            boot_counter=account.boot_counter,
            frames=account.frames,
            frames_lost=account.frames_lost,
            overruns=account.overruns,
            bad_cycles=account.bad_cycles,
            clock_offset_ns=None if view is None else view.clock_offset_ns,
            link_errors=(view.link_errors or 0) if view is not None else 0,
            emergencies=account.emergencies,
            temperature_c=celsius,
        )
