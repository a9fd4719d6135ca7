"""A hand at the instrument: a thread that shows frames while somebody watches."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable

from ocmm_core.acquisition.frames import FrameBlock
from ocmm_core.errors import OcmmError
from ocmm_core.failure import REOPEN, contained

Watcher = Callable[[FrameBlock], None]

BLOCK = 80
"""So many frames are shown at once: 10 ms at 8 kHz."""
IDLE_S = 0.002
"""How often a hand looks whether what it shows was taken."""


class Hand(ABC):
    """Who touches where it is wanted, on a thread of its own, and waits until that counts.

    Called with who watches it shows frames; called with None it stops. What a kind of hand shows is
    in `_show`, and when something is wanted at all in `_wanted`.

    Parameters
    ----------
    failed
        Told why no frames come any more.
    thread
        Name of the thread.
    safe
        What is not lost where it fails, as for `contained`.
    idle_s
        How often it looks whether something is wanted, s.
    """

    def __init__(
        self, failed: Callable[[OcmmError], None], *, thread: str, safe: str, idle_s: float
    ) -> None:
        self._failed = failed
        self._named_thread, self._safe, self._idle_s = thread, safe, idle_s
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def __call__(self, watcher: Watcher | None) -> None:
        """Begin to show frames, or stop and wait until that is so."""
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
        """End what the frames come from; where there is nothing, nothing happens."""
        return

    @property
    @abstractmethod
    def named(self) -> str:
        """Return what shows the frames, as the beginning of a sentence."""

    @abstractmethod
    def _wanted(self) -> bool:
        """Return whether something is wanted of the hand now."""

    @abstractmethod
    def _show(self, watcher: Watcher) -> None:
        """Show frames until what is wanted was shown, or nothing is wanted any more."""

    def _run(self, watcher: Watcher) -> None:
        try:
            while not self._stop.wait(self._idle_s):
                if self._wanted():
                    self._show(watcher)
        except Exception as error:
            self._failed(contained(error, self.named, self._safe, remedy=REOPEN))
        finally:
            self.close()
