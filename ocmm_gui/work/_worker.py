"""Work in the background: calls on a thread, the line that shows progress, sheets that stop it.

`Worker` makes calls one after the other, with answers on the window's thread. It is for calls of
milliseconds that may have to wait: the job is locked while it is evaluated, and a disk may be slow.
Long computations belong into a process (`_side_process`), because a long call into a numerical
library may block the window even from another thread.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Sequence
from queue import SimpleQueue
from typing import TypeVar

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QFrame, QProgressBar

from ocmm_gui.kit import ActionInfo, PlainLabel, Sheet, dressed, hbox, text_font, tr
from ocmm_gui.work._side_process import SideProcess, Work

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
        self._back.connect(self._give, Qt.ConnectionType.QueuedConnection)

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
                self._tell(lambda: failed(caught))
            else:
                self._tell(lambda: done(answer))

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

    def _tell(self, answer: Callable[[], None]) -> None:
        # After a close without waiting the receiver may be deleted, and the answer is not needed.
        if not self._closed:
            with contextlib.suppress(RuntimeError):
                self._back.emit(answer)

    def _give(self, answer: Callable[[], None]) -> None:
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
        self._label = PlainLabel()
        self._label.setTextFormat(Qt.TextFormat.PlainText)
        self._label.setAccessibleName(tr("{name}: progress").format(name=name))
        self._label.setFont(text_font(14))
        self._key = dressed(PlainLabel(), font=text_font(14), role="muted")
        self._bar = dressed(QProgressBar(), tr("{name}: progress").format(name=name))
        self._bar.setTextVisible(False)
        self._bar.setFixedSize(_BAR_PX, 12)
        layout = hbox(
            self._bar, self._label, self._key, parent=self, spacing=12, margins=(14, 3, 14, 3)
        )
        layout.addStretch(1)
        self.hide()

    def begin(self, what: str, key: str = "") -> None:
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

    def words(self) -> str:
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
        self._work = SideProcess(self, helpers=True)
        self._work.advanced.connect(self.working.advance)
        self._work.finished.connect(self._finish)
        self._work.failed.connect(self._fail)

    def stop(self) -> None:
        """Cancel the work; displayed results stay."""
        if self._work.is_running() and self._work.give_up():
            self.working.end()
            self.say(tr("Stopped; nothing was changed."))

    def close_work(self) -> None:
        """Cancel the work; call it before the window closes."""
        self._work.cancel()

    def is_working(self) -> bool:
        """Return whether work is running; for tests."""
        return self._work.is_running()

    def _begin(self, what: str, work: Work) -> None:
        self._work.start(work)
        self.working.begin(what, tr("F9 stops."))

    def _fail(self, error: object) -> None:
        self.working.end()
        self.say(tr("Failed; the previous result is still shown."))
        self.failed.emit(error)

    def _finish(self, answer: object) -> None:
        self.working.end()
        self._show(answer)

    def _show(self, answer: object) -> None:
        raise NotImplementedError
