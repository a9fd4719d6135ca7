"""A computation in a side process, polled by a timer; cancelled ones end immediately."""

from __future__ import annotations

import atexit
import contextlib
import shutil
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.synchronize import Lock
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.host import HOST
from ocmm_core.leftovers import keep_folder, scratch_path
from ocmm_core.processes import end_with_parent, process_context
from ocmm_gui.kit import tr

_LOOK_MS = 50
_END_S = 1.0
_NICE = 5
_TURN_S = 0.01
"""s: maximum time per poll for messages."""

Tell = Callable[[str, float], None]
"""Receives the next step, and the share done."""


class Teller:
    """Report progress by ``sender``; ``whole`` is held while the work is atomic."""

    def __init__(self, sender: Connection, whole: Lock) -> None:
        self._sender, self._whole = sender, whole

    def __call__(self, what: str, share: float) -> None:
        """Report the next step, and the share done."""
        self._sender.send(_Step(what, share))

    def give(self, part: object) -> None:
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
    """One computation at a time, a new one cancels the former; `helpers`: may start processes."""

    advanced = Signal(str, float)
    """Next step, and the share done."""
    came = Signal(object)
    """A part of the answer, ahead of the rest."""
    finished = Signal(object)
    failed = Signal(object)

    def __init__(self, parent: QObject | None = None, *, helpers: bool = False) -> None:
        super().__init__(parent)
        self._helpers = helpers
        self._process: BaseProcess | None = None
        self._whole: Lock | None = None
        self._scratch = Path()
        self._mail: deque[object] = deque()
        self._timer = QTimer(self, interval=_LOOK_MS)
        self._timer.timeout.connect(self._look)

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

    def _look(self) -> None:
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
    process.join(_END_S)
    if process.is_alive():
        process.kill()
        process.join()
    # A process that started meanwhile also reaps ended ones, and may have been first.
    with contextlib.suppress(ValueError):
        process.close()
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
