"""Non-blocking link between a guided procedure and the window.

Every observation is on disk before `Procedure.record` returns, and a calculation takes seconds.
Both run on their own threads; the window pulls the latest snapshot with a timer. A dense solution
holds the GIL for more than a second: another process resumes the session from its file and
calculates.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from functools import partial

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import Procedure, ProcedureDecision
from ocmm_core.errors import CalibrationError, InternalError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.processes import Tell, run_elsewhere
from ocmm_gui.wizards.pages import StepSnapshot, Tap, TemperatureReadings

LOOK_S = 0.02
"""Interval of automatic takes."""
NAME_S = 0.25
"""Interval of comparing the session file with its name."""
WARMTH_S = 5.0
"""Interval of sensor temperature readings."""

NOT_READY = "session.not_ready"
"""Error code if nothing can be taken."""

PULL_MS = 50
"""Snapshot interval; displays of a wizard need not be faster."""

PREDICT_S = 2.0
"""Minimum interval of predictions: each takes a second or more."""

CLOSE_LIMIT_S = 3.0
"""Time limit of a running command when the wizard is left."""

_PART = "The calibration procedure"
_SAFE = "All observations so far are saved in the session."

_log = logging.getLogger(__name__)


class WizardDriver(QObject):
    """Drive one procedure, on the window's thread; ``predict``: quality so far, or None."""

    seen = Signal(object)
    failed = Signal(object)
    """Emits the `OcmmError` of a command or of the calculation."""
    taken = Signal()

    _failed_elsewhere = Signal(object)
    _taken_elsewhere = Signal()

    def __init__(
        self,
        procedure: Procedure,
        tap: Tap,
        again: Callable[[], Procedure] | None = None,
        predict: Callable[[], None] | None = None,
        temperature_state: TemperatureReadings = tuple,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.procedure = procedure
        self._tap = tap
        self._again = again
        self._predict = predict
        self._warmth = temperature_state
        self._warmth_at = self._named_at = -float("inf")
        self._clock = clock
        self._view = procedure.view
        self._automatic = False
        self._blind = False
        """The procedure failed on a block of frames and gets no more."""
        self._commands: queue.SimpleQueue[Callable[[], object] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="ocmm-wizard")
        self._worker: threading.Thread | None = None
        self._stop, self._given_up = threading.Event(), threading.Event()
        # A prediction takes seconds, changes one number only, and cannot be interrupted: do not
        # wait for it.
        self._predictor = threading.Thread(
            target=self._run_predictions, name="ocmm-prediction", daemon=True
        )
        self._begun_at = 0.0
        self._closed = False
        queued = Qt.ConnectionType.QueuedConnection
        self._failed_elsewhere.connect(self.failed, queued)
        self._taken_elsewhere.connect(self.taken, queued)
        self._timer = QTimer(self, interval=PULL_MS)
        self._timer.timeout.connect(self._pull)

    def start(self) -> None:
        """Connect the frames, and start sending snapshots."""
        self._tap(self._watch)
        self._thread.start()
        if self._predict is not None:
            self._predictor.start()
        self._timer.start()
        self._pull()

    def close(self) -> bool:
        """Stop in bounded time; return whether all ended; the session can be resumed."""
        if self._closed:
            return True
        self._closed = True
        self._timer.stop()
        self._tap(None)
        self.cancel()
        self._stop.set()
        self._commands.put(None)
        ended = True
        for thread in (self._thread, self._worker):
            if thread is not None and thread.ident is not None:
                thread.join(CLOSE_LIMIT_S)
                ended = ended and not thread.is_alive()
        if not ended:
            _log.error("The wizard did not end within %.1f s.", CLOSE_LIMIT_S)
        return ended

    @property
    def now(self) -> StepSnapshot:
        running = self._worker is not None and self._worker.is_alive()
        since = time.monotonic() - self._begun_at if running else None
        return StepSnapshot(self._view, self._automatic, since)

    def record(self) -> None:
        self._commands.put(self._record)

    def drop(self) -> None:
        """Undo the last observation of the step."""
        self.do(lambda now: self.procedure.drop(now))

    def advance(self) -> None:
        """Enter the next step."""
        self.do(lambda now: self.procedure.advance(now))

    def back(self) -> None:
        self.do(lambda now: self.procedure.back(now))

    def accept(self, reason: str) -> None:
        """Activate the result, or store the verdict."""
        self.do(lambda now: self.procedure.accept(now, reason))

    def keep(self, reason: str) -> None:
        """End without changes."""
        self.do(lambda now: self.procedure.keep(now, reason))

    def do(self, call: Callable[[datetime], object]) -> None:
        self._commands.put(lambda: call(self._clock()))

    def set_automatic(self, automatic: bool) -> None:
        self._automatic = automatic

    def calculate(self) -> None:
        """Calculate the result, unless already running."""
        if self._closed or (self._worker is not None and self._worker.is_alive()):
            return
        self._begun_at = time.monotonic()
        # Cleared here, not by the thread: it may start after it was given up.
        self._given_up.clear()
        self._worker = threading.Thread(target=self._calculate, name="ocmm-wizard-calculation")
        self._worker.start()

    def cancel(self) -> None:
        self._given_up.set()

    def _run(self) -> None:
        while True:
            command: Callable[[], object] | None = self._poll
            with suppress(queue.Empty):
                command = self._commands.get(timeout=LOOK_S)
            if command is None:
                return
            try:
                command()
            except Exception as error:
                if not isinstance(error, OcmmError):
                    # An automatic take would fail repeatedly.
                    self._automatic = False
                self._failed_elsewhere.emit(contained(error, _PART, _SAFE))
            self._view = self.procedure.view

    def _run_predictions(self) -> None:
        """Repeat the prediction after each take or drop."""
        known = -1
        while self._predict is not None and not self._stop.wait(PREDICT_S):
            base = self._view.base
            count = sum(step.done for step in base.steps)
            if count != known and base.decision is ProcedureDecision.OPEN:
                known = count
                try:
                    self._predict()
                except Exception as error:
                    self._failed_elsewhere.emit(contained(error, "The prediction", _SAFE))
                    return

    def _watch(self, block: FrameBlock) -> None:
        # Runs on the frame thread, which must survive any frame.
        if self._blind:
            return
        try:
            self.procedure.watch(block)
        except Exception as error:
            self._blind = not isinstance(error, OcmmError)
            self._failed_elsewhere.emit(contained(error, _PART, _SAFE))

    def _poll(self) -> None:
        """Record the temperature, and take automatically if ready."""
        base = self.procedure.base
        now = time.monotonic()
        if now - self._named_at >= NAME_S and base.decision is ProcedureDecision.OPEN:
            self._named_at = now
            try:
                self.procedure.require_name()
            except OcmmError:
                # Reported once: from now on each step is refused for it.
                self._named_at, self._automatic = float("inf"), False
                raise
        if now - self._warmth_at >= WARMTH_S and base.decision is ProcedureDecision.OPEN:
            self._warmth_at = now
            self.procedure.record_temperature(self._clock(), self._warmth())
        if self._automatic and base.live.ready and base.decision is ProcedureDecision.OPEN:
            try:
                self._record()
            except OcmmError as error:
                # The target may have moved since the check: no error.
                if error.code != NOT_READY:
                    self._automatic = False
                    raise

    def _record(self) -> None:
        self.procedure.record(self._clock())
        self._taken_elsewhere.emit()

    def _calculate(self) -> None:
        try:
            again = self._again
            self.procedure.compute(None if again is None else partial(self._elsewhere, again))
        except Exception as error:
            # Expected errors are in the snapshot and stay there.
            if isinstance(error, InternalError) or not isinstance(error, OcmmError):
                self._failed_elsewhere.emit(contained(error, "The calculation", _SAFE))
        # The result must be visible together with the end of the calculation.
        self._view = self.procedure.view

    def _elsewhere(self, again: Callable[[], Procedure]) -> object:
        return run_elsewhere(
            partial(_calculate, again),
            "The calculation",
            self._given_up.is_set,
            CalibrationError(
                "calculation.given_up", "Calculation cancelled.", "Recalculate when you are ready."
            ),
            CalibrationError(
                "calculation.died",
                "The calculation ended unexpectedly; the computer may be out of memory.",
                "Close other programs and recalculate.",
            ),
        )

    def _pull(self) -> None:
        self.seen.emit(self.now)


def _calculate(resume: Callable[[], Procedure], _tell: Tell) -> object:
    procedure = resume()
    procedure.compute()
    outcome = procedure.view.outcome
    if outcome is None:
        raise CalibrationError(
            "calculation.nothing", "The calculation gave no result.", "Recalculate."
        )
    return outcome
