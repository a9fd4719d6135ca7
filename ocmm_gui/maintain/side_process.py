"""A calculation of some seconds in a process of its own, watched by a timer of the window.

The window stays free, and a calculation that is given up is gone at once.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess

from PySide6.QtCore import QObject, QTimer, Signal

from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.failure import contained

_LOOK_MS = 50
_END_S = 1.0

Tell = Callable[[str, float], None]
"""Told what is calculated next, and the share that is done."""

Work = Callable[[Tell], object]
"""What is calculated; can be sent to another process, and its answer back."""


@dataclass(frozen=True, slots=True)
class _Step:
    what: str
    share: float


@dataclass(frozen=True, slots=True)
class _Done:
    answer: object


class SideProcess(QObject):
    """One calculation at a time; a new one ends the one before."""

    advanced = Signal(str, float)
    """What is calculated next, and the share that is done."""
    finished = Signal(object)
    """The answer."""
    failed = Signal(object)
    """An `OcmmError`: why there is none."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._process: SpawnProcess | None = None
        self._receiver: Connection | None = None
        self._timer = QTimer(self)
        self._timer.setInterval(_LOOK_MS)
        self._timer.timeout.connect(self._look)

    def is_running(self) -> bool:
        """Return whether something is calculated."""
        return self._process is not None

    def start(self, work: Work) -> None:
        """Calculate; the answer comes by signal."""
        self.cancel()
        context = multiprocessing.get_context("spawn")
        self._receiver, sender = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_run, args=(work, sender), name="ocmm-examination", daemon=True
        )
        self._process.start()
        sender.close()
        self._timer.start()

    def cancel(self) -> None:
        """Give up what is calculated; nothing is told any more."""
        self._timer.stop()
        process, receiver = self._process, self._receiver
        self._process = self._receiver = None
        if process is not None:
            process.terminate()
            process.join(_END_S)
            if process.is_alive():
                process.kill()
                process.join()
            process.close()
        if receiver is not None:
            receiver.close()

    def _look(self) -> None:
        while self._receiver is not None and self._receiver.poll():
            try:
                said = self._receiver.recv()
            except EOFError:
                self.cancel()
                self.failed.emit(
                    CalibrationError(
                        "examination.died",
                        "The calculation ended unexpectedly; the computer may be short of memory.",
                        "Close other programs and calculate again.",
                    )
                )
                return
            if isinstance(said, _Step):
                self.advanced.emit(said.what, said.share)
                continue
            self.cancel()
            if isinstance(said, OcmmError):
                self.failed.emit(said)
            else:
                self.finished.emit(said.answer)


def _run(work: Work, sender: Connection) -> None:
    """Calculate and answer; what runs in the process."""
    said: _Done | OcmmError
    try:
        said = _Done(work(lambda what, share: sender.send(_Step(what, share))))
    except Exception as error:
        said = contained(error, "The calculation")
    sender.send(said)
    sender.close()
