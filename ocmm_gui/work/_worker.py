"""Work in the background: calls on a thread, the line that shows progress, sheets that stop it.

`Worker` makes calls one after the other, with answers on the window's thread. It is for calls of
milliseconds that may have to wait: the job is locked while it is evaluated, and a disk may be slow.
Long computations belong into a `SideProcess`, polled by a timer, because a long call into a
numerical library may block the window even from another thread.
"""

from __future__ import annotations

import atexit
import contextlib
import shutil
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.synchronize import Lock
from pathlib import Path
from queue import SimpleQueue
from typing import TypeVar

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QFrame, QProgressBar

from ocmm_core.cleanup import keep_folder, scratch_path
from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.host import HOST
from ocmm_core.processes import Tell as Tell
from ocmm_core.processes import end_process, end_with_parent, process_context
from ocmm_gui.kit import ActionInfo, PlainLabel, Sheet, dressed, hbox, text_font, tr

_LOOK_MS = 50
_END_S = 1.0
_NICE = 5
_TURN_S = 0.01
"""s: maximum time per poll for messages."""


class Teller:
    """Report progress by ``sender``; ``whole`` is held while the work is atomic."""

    def __init__(self, sender: Connection, whole: Lock) -> None:
        self._sender, self._whole = sender, whole

    def __call__(self, what: str, share: float) -> None:
        """Report the next step, and the share done."""
        self._sender.send(_Step(what, share))

    def send(self, part: object) -> None:
        """Send a part of the answer that can be shown already."""
        self._sender.send(_Part(part))

    def commit(self) -> None:
        """Forbid cancellation from now on; never returns if already cancelled.

        It is not undone: between the end of the work and its answer it is too late as well.
        """
        self._whole.acquire()


Work = Callable[[Teller], object]
"""A picklable computation with a picklable answer."""


@dataclass(frozen=True, slots=True)
class _Step:
    what: str
    share: float


@dataclass(frozen=True, slots=True)
class _Part:
    part: object


@dataclass(frozen=True, slots=True)
class _Done:
    answer: object


class SideProcess(QObject):
    """One computation at a time, a new one cancels the former; `helpers`: may start processes.

    `receivers`: of `finished`, `failed`, `advanced` and `came`, in this order and as far as wanted.
    """

    advanced = Signal(str, float)
    """Next step, and the share done."""
    came = Signal(object)
    """A part of the answer, ahead of the rest."""
    finished = Signal(object)
    failed = Signal(object)

    def __init__(
        self,
        parent: QObject | None = None,
        *receivers: Callable[..., object],
        helpers: bool = False,
    ) -> None:
        super().__init__(parent)
        signals = (self.finished, self.failed, self.advanced, self.came)
        for signal, receiver in zip(signals, receivers, strict=False):
            signal.connect(receiver)
        self._helpers = helpers
        self._process: BaseProcess | None = None
        self._whole: Lock | None = None
        self._scratch = Path()
        self._mail: deque[object] = deque()
        self._timer = QTimer(self, interval=_LOOK_MS)
        self._timer.timeout.connect(self._poll)

    def is_running(self) -> bool:
        return self._process is not None

    def start(self, work: Work) -> None:
        """Start a computation; the answer comes by signal."""
        self._end()
        context = process_context()
        receiver, sender = context.Pipe(duplex=False)
        given, giver = context.Pipe(duplex=False)
        self._whole, self._mail = context.Lock(), deque()
        self._scratch = scratch_path("side")
        self._process = context.Process(
            target=_run,
            args=(given, sender, self._whole, self._scratch),
            name="ocmm-examination",
            # A daemon of `multiprocessing` may not start processes.
            daemon=not self._helpers,
        )
        self._process.start()
        if self._helpers:
            # Exit would wait for a process that is not a daemon.
            atexit.register(self._process.kill)
        sender.close()
        given.close()
        threading.Thread(
            target=_converse, args=(work, giver, receiver, self._mail), name="ocmm-side-mail",
            daemon=True,
        ).start()  # fmt: skip
        self._timer.start()

    def give_up(self) -> bool:
        """Cancel the computation unless in an atomic step; return whether it was cancelled."""
        if self._whole is not None and not self._whole.acquire(block=False):
            return False
        self._end()
        return True

    def cancel(self) -> None:
        """Cancel and await the end, after an atomic write if one runs; no more signals."""
        if self._process is not None and not (self._whole and self._whole.acquire(block=False)):
            self._process.join(_END_S)
        ending = self._end()
        if ending is not None:
            ending.join()

    def _end(self) -> threading.Thread | None:
        """Release the process; the end of a large one takes longer than a window may wait."""
        self._timer.stop()
        process, self._process, self._whole = self._process, None, None
        if process is None:
            return None
        atexit.unregister(process.kill)
        ending = threading.Thread(
            target=_end_process, args=(process, self._scratch), name="ocmm-side-end"
        )
        ending.start()
        return ending

    def _poll(self) -> None:
        until = time.monotonic() + _TURN_S
        while self._process is not None and self._mail:
            said = self._mail.popleft()
            if isinstance(said, _Step):
                # The side process has no language.
                self.advanced.emit(tr(said.what), said.share)
            elif isinstance(said, _Part):
                self.came.emit(said.part)
            else:
                self._end()
                if isinstance(said, _Done):
                    self.finished.emit(said.answer)
                elif isinstance(said, OcmmError):
                    self.failed.emit(said)
            if time.monotonic() >= until:
                # The rest at the next poll, to keep the window responsive.
                return


_DIED = CalibrationError(
    "examination.died",
    "The calculation ended unexpectedly; the computer may be out of memory.",
    "Close other programs and recalculate.",
)


def _converse(work: Work, giver: Connection, receiver: Connection, mail: deque[object]) -> None:
    """Send the work and receive its messages, in a separate thread.

    A pipe blocks until the new process reads, which is a second later, and pictures of pages come
    in many pieces: the window waits for neither.
    """
    # A process cancelled meanwhile neither reads nor writes.
    with contextlib.suppress(OSError), giver:
        giver.send(work)
    with receiver:
        try:
            while True:
                mail.append(receiver.recv())
        except (EOFError, OSError):
            mail.append(_DIED)


def _end_process(process: BaseProcess, scratch: Path) -> None:
    process.terminate()
    end_process(process)
    # It had no time to clean up.
    shutil.rmtree(scratch, ignore_errors=True)


def _run(given: Connection, sender: Connection, whole: Lock, scratch: Path) -> None:
    """Compute and answer; runs in the process."""
    said: _Done | OcmmError
    # Atomic work continues even if the window was killed.
    end_with_parent(lambda: whole.acquire(block=False))
    # Tracking and window have priority on few processors.
    HOST.stand_back(_NICE)
    try:
        with contextlib.suppress(OSError):
            # A user who cannot create files is told elsewhere.
            if keep_folder(scratch):
                tempfile.tempdir = str(scratch)
        work: Work = given.recv()
        said = _Done(work(Teller(sender, whole)))
    except Exception as error:
        said = contained(error, "The calculation")
    sender.send(said)
    sender.close()


T = TypeVar("T")
Failed = Callable[[Exception], None]
"""Receives the exception of a call."""


class Worker(QObject):
    """Execute calls in order."""

    _back = Signal(object)

    def __init__(self, name: str, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._calls: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._closed = False
        # A call that hangs on a dead disk must not block the exit.
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._back.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    def do(self, call: Callable[[], T], done: Callable[[T], None], failed: Failed) -> None:
        """Queue a call; returns immediately.

        `done`, `failed` get the result on the window's thread; neither after `close`.
        """
        if self._closed:
            return
        if self._thread.ident is None:
            self._thread.start()

        def carry_out() -> None:
            try:
                answer = call()
            except Exception as error:
                caught = error
                self._report(lambda: failed(caught))
            else:
                self._report(lambda: done(answer))

        self._calls.put(carry_out)

    def close(self, limit_s: float) -> bool:
        """Finish queued calls within a time limit; return whether all were."""
        self._closed = True
        if self._thread.ident is None:
            return True
        self._calls.put(None)
        self._thread.join(max(limit_s, 0.0))
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (call := self._calls.get()) is not None:
            call()

    def _report(self, answer: Callable[[], None]) -> None:
        # After a close without waiting the receiver may be deleted, and the answer is not needed.
        if not self._closed:
            with contextlib.suppress(RuntimeError):
                self._back.emit(answer)

    def _deliver(self, answer: Callable[[], None]) -> None:
        if not self._closed:
            answer()


_BAR_PX = 220
_PARTS = 1000


class WorkLine(QFrame):
    """Step, progress bar, and cancel key; takes no focus, and no room while hidden."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        progress = tr("{name}: progress").format(name=name)
        self._label = dressed(PlainLabel(), progress, font=text_font(14))
        self._key = dressed(PlainLabel(), font=text_font(14), role="muted")
        self._bar = dressed(QProgressBar(), progress)
        self._bar.setTextVisible(False)
        self._bar.setFixedSize(_BAR_PX, 12)
        hbox(self._bar, self._label, self._key, 1, parent=self, spacing=12, margins=(14, 3, 14, 3))
        self.hide()

    def start(self, what: str, key: str = "") -> None:
        """Show the start of work; ``key`` describes its cancellation, if possible."""
        self._bar.setRange(0, 0)
        self._label.setText(what)
        self._key.setText(key)
        self.show()

    def advance(self, what: str, share: float) -> None:
        """Show the next step, and the share done."""
        self._bar.setRange(0, _PARTS)
        self._bar.setValue(round(_PARTS * share))
        self._label.setText(what)
        self._bar.setAccessibleDescription(f"{what}: {share:.0%}")

    def end(self) -> None:
        self.hide()

    def message(self) -> str:
        """Return step and cancel key; empty while idle."""
        if self.isHidden():
            return ""
        return f"{self._label.text()} {self._key.text()}".rstrip()


class WorkSheet(Sheet):
    """Show progress; F9 stops the work, and displayed results stay.

    Subclasses put ``working`` into their body and answer in `_show`. `title`, `infos`: as of
    `Sheet`; one of ``infos`` is ``stop``. `working`: accessible name of the progress line.
    """

    def __init__(self, title: str, infos: Sequence[ActionInfo], working: str) -> None:
        super().__init__(title, infos)
        self.working = WorkLine(working)
        self._work = SideProcess(self, self._finish, self._fail, self.working.advance, helpers=True)

    def stop(self) -> None:
        """Cancel the work; displayed results stay."""
        if self._work.is_running() and self._work.give_up():
            self.working.end()
            self.show_message(tr("Stopped; nothing was changed."))

    def close_work(self) -> None:
        """Cancel the work; call it before the window closes."""
        self._work.cancel()

    def is_working(self) -> bool:
        """Return whether work is running; for tests."""
        return self._work.is_running()

    def _start(self, what: str, work: Work) -> None:
        self._work.start(work)
        self.working.start(what, tr("F9 stops."))

    def _fail(self, error: object) -> None:
        self.working.end()
        self.show_message(tr("Failed; the previous result is still shown."))
        self.failed.emit(error)

    def _finish(self, answer: object) -> None:
        self.working.end()
        self._show(answer)

    def _show(self, answer: object) -> None:
        raise NotImplementedError
