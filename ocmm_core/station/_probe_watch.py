"""The station's view of the tip: may points be recorded with it, and if not, why.

Events that can change the tip (shock, long pause, another tip) are stored in the history of the
probe and force the quick check. Without a history the suspicion lasts as long as the job.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration import records
from ocmm_core.calibration.guided import ShockDetector
from ocmm_core.errors import CalibrationError
from ocmm_core.inspection.finished import last_good_utc, settle_tip
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.station._calibration_watch import KeptView
from ocmm_core.storage import JobFile

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
        """Invalidate the cached state."""
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
