"""Base of hands: a thread that shows frames while a watcher is attached."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.errors import OcmmError
from ocmm_core.failure import REOPEN, contained

Watcher = Callable[[FrameBlock], None]

BLOCK = 80
"""Frames shown at once: 10 ms at 8 kHz."""
IDLE_S = 0.002
"""Poll interval for whether a shown touch was recorded."""


class Hand(ABC):
    """A thread that makes requested touches and waits until each counts.

    Call it with a watcher to show frames, with None to stop. Subclasses implement `_show` and
    `_wanted`. `failed`: called with the reason when frames end. `safe`: what a failure does not
    lose, as for `contained`. `idle_s`: poll interval for requested touches, s.
    """

    def __init__(
        self, failed: Callable[[OcmmError], None], *, thread: str, safe: str, idle_s: float
    ) -> None:
        self._failed = failed
        self._named_thread, self._safe, self._idle_s = thread, safe, idle_s
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def __call__(self, watcher: Watcher | None) -> None:
        """Start showing frames, or stop and wait for the thread."""
        if self._thread is not None:
            self._stop.set()
            self._thread.join()
            self._thread = None
        if watcher is not None:
            self._stop.clear()
            self._thread = threading.Thread(
                target=self._run, args=(watcher,), name=self._named_thread
            )
            self._thread.start()

    def close(self) -> None:
        return

    @property
    @abstractmethod
    def named(self) -> str:
        """Return the hand's name as the start of a sentence."""

    @abstractmethod
    def _wanted(self) -> bool:
        """Return whether a touch is requested now."""

    @abstractmethod
    def _show(self, watcher: Watcher) -> None:
        """Show frames until the requested touch was shown or is withdrawn."""

    def _run(self, watcher: Watcher) -> None:
        try:
            while not self._stop.wait(self._idle_s):
                if self._wanted():
                    self._show(watcher)
        except Exception as error:
            self._failed(contained(error, self.named, self._safe, remedy=REOPEN))
        finally:
            self.close()
