"""The station's view of the calibration: may points be recorded, and if not, why."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from typing import Generic, TypeVar

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
from ocmm_core.station._bus_watch import BusWatch

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
