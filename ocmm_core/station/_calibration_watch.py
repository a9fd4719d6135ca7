"""The calibration as the station sees it: may points be taken now, and if not, why."""

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
"""Returns the objects of the camera of a name."""

_KEEP_S = 0.2
"""What was found is given out for so long before it is looked at again."""
_LOOK_S = 0.05
_AGAIN_S = 1.0

_NOT_ASKED = Blocker(
    "The intrinsics stored in the cameras have not been read yet.",
    "Wait until they are in operation.",
)


V = TypeVar("V")


class KeptView(Generic[V]):
    """What was found is given out for 0.2 s before it is looked at again; any thread may ask.

    Parameters
    ----------
    judge
        Looks.
    """

    def __init__(self, judge: Callable[[], V]) -> None:
        self._judge = judge
        self._lock = threading.Lock()
        self._view: V | None = None
        self._looked_at = -float("inf")

    def view(self) -> V:
        """Return what is to be said, at most 0.2 s old."""
        with self._lock:
            now = time.monotonic()
            if self._view is None or now - self._looked_at >= _KEEP_S:
                self._view, self._looked_at = self._judge(), now
            return self._view

    @contextmanager
    def changed(self) -> Iterator[None]:
        """Change what is judged by, which nobody sees half done, and look anew the next time."""
        with self._lock:
            yield
            self._view = None

    def forget(self) -> None:
        """Look anew the next time."""
        with self.changed():
            pass


class CalibrationWatch:
    """Judge the calibration in use again and again; `view` never waits for a camera.

    Parameters
    ----------
    in_use
        What is measured with.
    bus
        None where the frames do not come over one.
    objects
        The cameras, where they can be asked; None where there are none.
    clock
        The time of day, with its zone.
    failed
        Told what ended the asking, where something nobody foresaw did.
    """

    def __init__(
        self,
        in_use: CalibrationInUse,
        bus: BusWatch | None,
        objects: Objects | None,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
        failed: Callable[[Exception], object] = lambda error: None,
    ) -> None:
        self.in_use = in_use
        self._bus = bus
        self._objects = objects
        self._clock = clock
        self._failed = failed
        self._kept = KeptView(self._judge)
        self._stored: Blocker | None = None
        self._asked: tuple[tuple[int, int], ...] | None = None
        self._again_at = -float("inf")
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to ask the cameras what they store, each time that one was switched on."""
        if self._record_in_cameras() is not None:
            self._thread = threading.Thread(target=self._run, name="ocmm-camera-memory")
            self._thread.start()

    def close(self, timeout_s: float) -> bool:
        """End, when the bus has ended, and say whether it came in time."""
        self._stop.set()
        if self._thread is None:
            return True
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def view(self) -> CalibrationView:
        """Return what is to be said about the calibration, at most 0.2 s old."""
        return self._kept.view()

    def forget(self) -> None:
        """Look at everything anew at the next `view`."""
        self._kept.forget()

    def write_to_cameras(self) -> None:
        """Store the intrinsics of the calibration in force in the cameras; takes some seconds.

        That is the one that was accepted last, also where this job was begun with another one.

        Raises
        ------
        CalibrationError
            There is no calibration, or there are no cameras to write to.
        BusError
            A camera does not take them.
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
        view = judge(self.in_use, self._clock())
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
            # What is missing may be written meanwhile, by this program or another one.
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
    """Return who is there and how often each was switched on: what it stores lasts so long."""
    return tuple((camera.serial, camera.boot_counter) for camera in report.cameras)
