"""Calls in a thread, one after the other, with answers on the window's thread.

For calls of milliseconds that may have to wait: the job is locked while it is evaluated, and a disk
may be slow. Long computations belong into a process (`_side_process`), because a long call into a
numerical library may block the window even from another thread.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import TypeVar

from PySide6.QtCore import QObject, Qt, Signal

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
