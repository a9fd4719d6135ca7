"""The station's view of calibration and tip: may points be recorded with them, and if not, why.

Events that can change the tip (shock, long pause, another tip) are stored in the history of the
probe and force the quick check. Without a history the suspicion lasts as long as the job.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Generic, TypeVar

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import records
from ocmm_core.calibration.guided import ShockDetector
from ocmm_core.calibration.records import (
    Blocker,
    CalibrationInUse,
    CalibrationStatus,
    CalibrationView,
    CameraRecord,
    check_camera_temperature,
    compare_with_cameras,
    judge,
    require_record,
    write_to_cameras,
)
from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.fieldbus.objects import ObjectAccess
from ocmm_core.fieldbus.report import BusPhase, BusReport
from ocmm_core.inspection.finished import last_good_utc, settle_tip
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.station._bus_watch import BusWatch
from ocmm_core.storage import JobFile

Objects = Callable[[str], ObjectAccess]
"""Returns the objects of a camera by name."""

_KEEP_S = 0.2
"""Lifetime of a cached judgement, s."""
_LOOK_S = 0.05
_AGAIN_S = 1.0

_NOT_ASKED = Blocker(
    "The intrinsics stored in the cameras have not been read yet.",
    "Wait until they are in operation.",
)


V = TypeVar("V")


class KeptView(Generic[V]):
    """A judgement cached for 0.2 s; thread-safe. `judge`: makes it."""

    def __init__(self, judge: Callable[[], V]) -> None:
        self._judge = judge
        self._lock = threading.Lock()
        self._view: V | None = None
        self._looked_at = -float("inf")

    def view(self) -> V:
        """Return the judgement, at most 0.2 s old."""
        with self._lock:
            now = time.monotonic()
            if self._view is None or now - self._looked_at >= _KEEP_S:
                self._view, self._looked_at = self._judge(), now
            return self._view

    @contextmanager
    def changed(self) -> Iterator[None]:
        """Change the inputs of the judgement atomically, and invalidate it."""
        with self._lock:
            yield
            self._view = None

    def forget(self) -> None:
        with self.changed():
            pass


class CalibrationWatch:
    """Judge the calibration in use repeatedly; `view` never waits for a camera.

    `bus`: None if frames do not come over one. `objects`: access to the cameras, or None.
    `failed`: receives the error that ended polling.
    """

    def __init__(
        self,
        in_use: CalibrationInUse,
        bus: BusWatch | None,
        objects: Objects | None,
        failed: Callable[[Exception], object] = lambda error: None,
    ) -> None:
        self.in_use = in_use
        self._bus = bus
        self._objects = objects
        self._failed = failed
        self._kept = KeptView(self._judge)
        self._stored: Blocker | None = None
        self._asked: tuple[tuple[int, int], ...] | None = None
        self._again_at = -float("inf")
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start to read the cameras' stored intrinsics, after each power-on."""
        if self._record_in_cameras() is not None:
            self._thread = threading.Thread(target=self._run, name="ocmm-camera-memory")
            self._thread.start()

    def close(self, timeout_s: float) -> bool:
        """Stop, after the bus has ended; return whether in time."""
        self._stop.set()
        if self._thread is None:
            return True
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def view(self) -> CalibrationView:
        """Return the state of the calibration, at most 0.2 s old."""
        return self._kept.view()

    def forget(self) -> None:
        """Invalidate the cached state."""
        self._kept.forget()

    def write_to_cameras(self) -> None:
        """Store the intrinsics of the calibration in force in the cameras; takes some seconds.

        That is the one accepted last, even if this job was started with another one. Raises
        CalibrationError if there is no calibration, or there are no cameras to write to; BusError
        if a camera refuses them.
        """
        store, objects = self.in_use.store, self._objects
        record = store.active() if store is not None else None
        if record is None:
            record = require_record(self.in_use)
        if objects is None:
            raise CalibrationError(
                "calibration.no_cameras",
                (
                    "The frames of this job do not come from real cameras, so nothing can be "
                    "stored in them."
                ),
                "Choose real cameras (Settings, Instrument).",
            )
        write_to_cameras(record, objects)
        with self._kept.changed():
            self._asked = None

    def _judge(self) -> CalibrationView:
        view = judge(self.in_use, datetime.now(UTC))
        report = self._bus.report() if self._bus is not None else None
        record = self.in_use.record
        if record is not None and report is not None:
            temperatures = [camera.temperature_c for camera in report.cameras]
            temperature_state, warnings = check_camera_temperature(record, temperatures)
            view = replace(
                view,
                blocker=view.blocker or temperature_state,
                warnings=(*view.warnings, *warnings),
            )
        if view.blocker is None and self._record_in_cameras() is not None:
            if report is None or self._asked != _powered(report):
                return replace(view, blocker=_NOT_ASKED)
            if self._stored is not None:
                return replace(view, word=CalibrationStatus.UNUSABLE, blocker=self._stored)
        return view

    def _record_in_cameras(self) -> CameraRecord | None:
        """Return the record whose intrinsics the cameras must hold, or None."""
        return None if self._bus is None or self._objects is None else self.in_use.record

    def _run(self) -> None:
        try:
            self._ask_again_and_again()
        except Exception as error:
            self._failed(error)

    def _ask_again_and_again(self) -> None:
        record, bus, objects = self._record_in_cameras(), self._bus, self._objects
        if record is None or bus is None or objects is None:
            return
        while not self._stop.wait(_LOOK_S):
            report = bus.report()
            if report is None or report.phase is not BusPhase.OPERATION:
                continue
            powered = _powered(report)
            # Missing intrinsics may be written meanwhile, by this or another program.
            settled = self._stored is None or time.monotonic() < self._again_at
            if powered == self._asked and settled:
                continue
            try:
                stored = compare_with_cameras(record, objects)
            except OcmmError as error:
                stored = Blocker(error.what, error.remedy)
            self._again_at = time.monotonic() + _AGAIN_S
            with self._kept.changed():
                self._stored, self._asked = stored, powered


def _powered(report: BusReport) -> tuple[tuple[int, int], ...]:
    """Return the cameras with their boot counters: stored intrinsics are reread after each boot."""
    return tuple((camera.serial, camera.boot_counter) for camera in report.cameras)


PAUSE = timedelta(hours=8)
"""Time without a point or a check after which the state of the tip is unknown."""

_USABLE = (records.CalibrationStatus.VALID, records.CalibrationStatus.DUE)


class ProbeWatch:
    """Judge the probe in use repeatedly; `push` belongs to the reconstruction thread.

    `session`, `job`: Hold the points. `pause`: Time without a point or a check after which the tip
    must be checked. `clock`: Local time with its zone.
    """

    def __init__(
        self,
        in_use: records.ProbeInUse,
        session: InspectionSession,
        job: JobFile,
        pause: timedelta = PAUSE,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self.in_use = in_use
        self._session = session
        self._job = job
        self._pause = pause
        self._clock = clock
        self._kept = KeptView(self._judge)
        self._settling = threading.Lock()
        self._settled = 0
        self._used = max(map(datetime.fromisoformat, job.taken_utc().values()), default=None)
        self._shocks = ShockDetector()
        self._dropped: records.Blocker | None = None

    def start(self) -> None:
        """Mount a requested tip; suspect after a pause; OcmmError if an event is not durable."""
        store = self._store
        if store is not None and self.in_use.tip != store.mounted:
            self.mount(self.in_use.tip)
        self._notice_pause()
        self.settle()

    def view(self) -> records.ProbeView:
        """Return the state of the probe, at most 0.2 s old."""
        return self._kept.view()

    def forget(self) -> None:
        self._kept.forget()

    def used(self) -> None:
        """Note that a point was recorded with it."""
        self._used = self._clock()

    def mount(self, tip: str) -> None:
        """Note a mounted tip, to be checked; CalibrationError: no records of it; StorageError."""
        store = self.in_use.store
        if store is None:
            raise CalibrationError(
                "probe_record.design",
                "This job uses the probe document, which defines one tip only.",
                "Choose the folder of tip records (Settings, Instrument).",
            )
        store.mount(tip, self._job.head.operator, self._clock())
        self.forget()
        self.settle()

    def push(self, block: FrameBlock) -> bool:
        """Check for shock and pause; return if anything changed; OcmmError: not durable."""
        dropped = self._notice_shock(block)
        paused = self._notice_pause()
        settled = self.settle()
        return dropped or paused or settled

    def settle(self) -> bool:
        """Hold and release points by the history of the tip; return whether any changed.

        Raises StorageError if not durable; points are then held until the program ends.
        """
        store = self._store
        if store is None:
            return False
        # Also reads entries of other processes.
        self.view()
        with self._settling:
            events = store.events
            if len(events) == self._settled:
                return False
            self._settled = len(events)
            return settle_tip(self._session, self._job, events, self.in_use.tip)

    @property
    def _store(self) -> records.ProbeStore | None:
        """Return the store of the tip's history, or None without one."""
        return self.in_use.store if self.in_use.records is not None else None

    def _judge(self) -> records.ProbeView:
        view = records.judge(self.in_use, self._clock())
        if view.blocker is None and self._dropped is not None:
            return replace(view, word=records.CalibrationStatus.SUSPECT, blocker=self._dropped)
        return view

    def _notice_shock(self, block: FrameBlock) -> bool:
        begun = self._shocks.push(block)
        if not len(begun):
            return False
        now = self._clock()
        ago_s = float(block.time_ns[-1] - block.time_ns[begun[0]]) * 1e-9
        self._doubt(
            f"Probe shock detected at {now.astimezone():%Y-%m-%d %H:%M}.",
            now - timedelta(seconds=ago_s),
        )
        return True

    def _notice_pause(self) -> bool:
        store = self._store
        if store is None or self.view().word not in _USABLE:
            return False
        good = last_good_utc(store.events, self.in_use.tip)
        known = max((one for one in (good, self._used) if one is not None), default=None)
        if known is None or self._clock() - known <= self._pause:
            return False
        hours = self._pause.total_seconds() / 3600.0
        self._doubt(
            f"The probe was not used for more than {hours:g} hours: its tip may have changed.",
            known,
        )
        return True

    def _doubt(self, reason: str, since: datetime) -> None:
        """Mark the mounted tip suspect; without a history, for as long as the job runs."""
        self._dropped = records.Blocker(reason, "Check the probe, then start a new job.")
        self.forget()
        if self._store is not None:
            self._store.doubt(records.MONITOR, reason, since, self._clock())
            self._dropped = None
            self.forget()
