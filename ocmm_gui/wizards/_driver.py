"""Between a guided procedure and the window: commands out, snapshots in, nothing waits.

Every observation is on the disk before `Procedure.take` returns, and a calculation takes seconds.
Both happen on threads of their own; the window pulls the latest snapshot with a timer.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.calibration.guided import ProcedureDecision
from ocmm_core.errors import InternalError, OcmmError
from ocmm_core.failure import contained
from ocmm_gui.wizards.parts import Calculation, Seen, ShownProcedure, Tap, TemperatureReadings

LOOK_S = 0.02
"""Between two looks at whether something is ready to be taken by itself."""
NAME_S = 0.25
"""Between two comparisons of the session file with its name."""
WARMTH_S = 5.0
"""Between two looks at the temperature of the sensors."""

NOT_READY = "session.not_ready"
"""Code of the error when there is nothing to take."""

PULL_MS = 50
"""Between two snapshots: pictures and scores of a wizard need not be faster."""

PREDICT_S = 2.0
"""Between two predictions, at least: each takes a second or some."""

CLOSE_LIMIT_S = 3.0
"""How long a command that is under way may take when the wizard is left."""

_PART = "The calibration procedure"
_SAFE = "All observations so far are saved in the session."

_log = logging.getLogger(__name__)


class WizardDriver(QObject):
    """Drive one procedure; made and used on the window's thread.

    Parameters
    ----------
    procedure
        The procedure; also an attribute.
    tap
        Where its frames come from.
    calculation
        How its result is calculated.
    predict
        Works out how good the result would be by now; None where nothing does.
    clock
        The time of day, with its zone.
    """

    seen = Signal(object)
    """Emits a `Seen` every `PULL_MS`."""
    failed = Signal(object)
    """Emits the `OcmmError` of a command or of the calculation."""
    taken = Signal()
    """An observation is on the disk."""

    _failed_elsewhere = Signal(object)
    _taken_elsewhere = Signal()

    def __init__(
        self,
        procedure: ShownProcedure,
        tap: Tap,
        calculation: Calculation,
        predict: Callable[[], None] | None = None,
        temperature_state: TemperatureReadings = tuple,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.procedure = procedure
        self._tap = tap
        self._calculation = calculation
        self._predict = predict
        self._warmth = temperature_state
        self._warmth_at = self._named_at = -float("inf")
        self._clock = clock
        self._view = procedure.view
        self._automatic = False
        self._blind = False
        """The procedure failed over a block of frames; it gets no more."""
        self._commands: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="ocmm-wizard")
        self._worker: threading.Thread | None = None
        self._stop = threading.Event()
        # A prediction of thousands of poses takes seconds, changes nothing but one number, and
        # cannot be interrupted: nobody waits for it.
        self._predictor = threading.Thread(
            target=self._run_predictions, name="ocmm-prediction", daemon=True
        )
        self._begun_at = 0.0
        self._closed = False
        queued = Qt.ConnectionType.QueuedConnection
        self._failed_elsewhere.connect(self.failed, queued)
        self._taken_elsewhere.connect(self.taken, queued)
        self._timer = QTimer(self)
        self._timer.setInterval(PULL_MS)
        self._timer.timeout.connect(self._pull)

    def start(self) -> None:
        """Let the procedure watch, and begin to send snapshots."""
        self._tap(self._watch)
        self._thread.start()
        if self._predict is not None:
            self._predictor.start()
        self._timer.start()
        self._pull()

    def close(self) -> bool:
        """End everything in bounded time and say whether it ended; the session can be resumed."""
        if self._closed:
            return True
        self._closed = True
        self._timer.stop()
        self._tap(None)
        self._calculation.cancel()
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
    def now(self) -> Seen:
        """Return what the window shows now."""
        running = self._worker is not None and self._worker.is_alive()
        since = time.monotonic() - self._begun_at if running else None
        return Seen(self._view, self._automatic, since)

    def take(self) -> None:
        """Take what is seen now."""
        self._commands.put(self._take)

    def drop(self) -> None:
        """Take back the last observation of the step."""
        self.do(lambda now: self.procedure.drop(now))

    def advance(self) -> None:
        """Enter the next step."""
        self.do(lambda now: self.procedure.advance(now))

    def back(self) -> None:
        """Return to the step before."""
        self.do(lambda now: self.procedure.back(now))

    def accept(self, reason: str) -> None:
        """Put the result in force, or store the verdict."""
        self.do(lambda now: self.procedure.accept(now, reason))

    def keep(self, reason: str) -> None:
        """End and leave everything as it was."""
        self.do(lambda now: self.procedure.keep(now, reason))

    def do(self, call: Callable[[datetime], None]) -> None:
        """Run a command of the procedure, after those that came before it."""
        self._commands.put(lambda: call(self._clock()))

    def set_automatic(self, automatic: bool) -> None:
        """Take what is ready without a key, or no longer."""
        self._automatic = automatic

    def calculate(self) -> None:
        """Calculate the result, unless that is under way."""
        if self._closed or (self._worker is not None and self._worker.is_alive()):
            return
        self._begun_at = time.monotonic()
        self._worker = threading.Thread(target=self._calculate, name="ocmm-wizard-calculation")
        self._worker.start()

    def cancel(self) -> None:
        """Give up the calculation that is under way."""
        self._calculation.cancel()

    def _run(self) -> None:
        while True:
            command: Callable[[], None] | None = self._look
            with suppress(queue.Empty):
                command = self._commands.get(timeout=LOOK_S)
            if command is None:
                return
            try:
                command()
            except Exception as error:
                if not isinstance(error, OcmmError):
                    # What is taken by itself would fail by itself, again and again.
                    self._automatic = False
                self._failed_elsewhere.emit(contained(error, _PART, _SAFE))
            self._view = self.procedure.view

    def _run_predictions(self) -> None:
        """Predict again and again, where something was taken or dropped since the last time."""
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
        # On the thread that reads the frames: it must not end over what one of them holds.
        if self._blind:
            return
        try:
            self.procedure.watch(block)
        except Exception as error:
            self._blind = not isinstance(error, OcmmError)
            self._failed_elsewhere.emit(contained(error, _PART, _SAFE))

    def _look(self) -> None:
        """Note the warmth, and take what is ready where nobody has to press a key."""
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
                self._take()
            except OcmmError as error:
                # Between the look and the taking the target may have moved: that is no error.
                if error.code != NOT_READY:
                    self._automatic = False
                    raise

    def _take(self) -> None:
        self.procedure.take(self._clock())
        self._taken_elsewhere.emit()

    def _calculate(self) -> None:
        try:
            self._calculation.run()
        except Exception as error:
            # What went wrong and was foreseen is in the snapshot, and stays there.
            if isinstance(error, InternalError) or not isinstance(error, OcmmError):
                self._failed_elsewhere.emit(contained(error, "The calculation", _SAFE))
        # Whoever sees that the calculation is over must see what it gave.
        self._view = self.procedure.view

    def _pull(self) -> None:
        self.seen.emit(self.now)
