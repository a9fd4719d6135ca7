"""Action on the monitor's findings: report a suspect calibration, hold points.

The suspicion is stored with a calibration from a store until a verification passes, which releases
the points. Failures entered by other programs also hold points. Without a store it lasts as long as
the job.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

from ocmm_core.calibration.monitor import (
    CalibrationMonitor,
    ChangeCause,
    DriftReport,
    load_baseline,
)
from ocmm_core.calibration.records import (
    Blocker,
    CalibrationInUse,
    CalibrationStatus,
    CalibrationView,
    record_hash,
)
from ocmm_core.inspection.archive import first_taken, is_known, settle_cameras
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.storage import JobFile
from ocmm_core.tracking import ProbeBody, TrackBlock

WHO = "monitor"
"""Author of suspicions in the history."""

_USABLE = (CalibrationStatus.VALID, CalibrationStatus.DUE)
_REMEDIES = {
    ChangeCause.PROBE: "Check the probe and calibrate it, then start a new job.",
    ChangeCause.COMMON: "Align the part again.",
}
_REMEDY = "Fasten the cameras and verify the calibration; if that fails, calibrate again."


class ChangeWatch:
    """Feed the monitor and act on its findings; `feed` belongs to the reconstruction thread.

    `session`, `job`: Hold the points. `clock`: Local time with its zone. Raises CalibrationError if
    the baseline learned for this calibration is damaged.
    """

    def __init__(
        self,
        in_use: CalibrationInUse,
        body: ProbeBody,
        session: InspectionSession,
        job: JobFile,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self._in_use = in_use
        self._body = body
        self._session = session
        self._job = job
        self._settled = 0
        self._clock = clock
        self._baseline = None
        if in_use.record is not None and in_use.store is not None:
            self._baseline = load_baseline(
                in_use.store.folder, record_hash(in_use.record), body.identity
            )
        self._monitor = self._new_monitor()
        self._doubt: Blocker | None = None
        self._stored = False

    @property
    def doubt(self) -> Blocker | None:
        """Return the change and its remedy, or None; thread-safe."""
        return self._doubt

    def feed(self, track: TrackBlock, view: CalibrationView) -> bool:
        """Process tracked frames; return whether the suspicion changed.

        `track`: consecutive frames. `view`: current state of the calibration. Raises OcmmError if
        the suspicion could not be made durable; it holds until the program ends in any case.
        """
        settled = self.settle()
        if self._doubt is not None:
            return self._cleared(view) or settled
        alarm = next((item for item in self._monitor.feed(track) if item.alarm), None)
        if alarm is None:
            return settled
        self._raise(alarm, int(track.time_ns[-1]), view)
        return True

    def settle(self) -> bool:
        """Hold and release points by the history of the calibration; return whether any changed.

        The store reads entries of other processes whenever the calibration is judged
        (`calibration.records.judge`), some times a second. Raises OcmmError if it could not be made
        durable, or the history cannot be read.
        """
        store, record = self._in_use.store, self._in_use.record
        if store is None or record is None or len(store.events) == self._settled:
            return False
        self._settled = len(store.events)
        used = self._job.head.rig_identity
        if not is_known(store.events, used):
            return False
        return settle_cameras(self._session, self._job, store, used)

    def _raise(self, alarm: DriftReport, now_ns: int, view: CalibrationView) -> None:
        self._doubt = Blocker(alarm.what, _REMEDIES.get(alarm.cause, _REMEDY))
        since_s = None if alarm.since_ns is None else alarm.since_ns * 1e-9
        try:
            self._session.held.hold_back(since_s, alarm.what)
        finally:
            store = self._in_use.store
            of_cameras = alarm.cause in (ChangeCause.CAMERA, ChangeCause.UNKNOWN)
            if store is not None and of_cameras and view.word in _USABLE:
                now = self._clock()
                # Never found good in this run: the change may be earlier.
                since = None
                if since_s is not None:
                    since = self._moment(since_s, now_ns * 1e-9, now)
                store.suspect(WHO, alarm.what, since, now)
                self._stored = True

    def _moment(self, since_s: float, now_s: float, now: datetime) -> datetime:
        """Return the wall time of a moment of the frames, also of faster simulated ones.

        Points are stored after their frames, and must also be before the moment in wall time.
        """
        taken = first_taken(self._job)
        before = [
            taken[point.number] + timedelta(microseconds=1)
            for feature in self._session.view.features
            for point in feature.points
            if point.time_s < since_s and point.number in taken
        ]
        return max([now - timedelta(seconds=now_s - since_s), *before])

    def _cleared(self, view: CalibrationView) -> bool:
        """Release the points once a verification has lifted the stored suspicion."""
        if not self._stored or view.word not in _USABLE:
            return False
        self._session.held.release("The calibration has since been verified.")
        self._doubt, self._stored = None, False
        self._monitor = self._new_monitor()
        return True

    def _new_monitor(self) -> CalibrationMonitor:
        record = self._in_use.record
        maps = record.residual_maps if record is not None else ()
        return CalibrationMonitor(self._in_use.rig, self._body, maps, self._baseline)
