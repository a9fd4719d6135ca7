"""Ctrl-C while a station measures, or a guided procedure is under way."""

from __future__ import annotations

import signal
import threading
from types import FrameType


class DeferredInterrupt:
    """Raises KeyboardInterrupt at the next `check`; a second Ctrl-C raises it at once.

    Raised between two steps of any code, it could leave a lock of the station taken, and closing
    the station would wait for that lock forever. `words`: what is kept, and how to continue.
    """

    def __init__(self, words: str = "") -> None:
        self._asked, self._words = False, words
        self._before = None
        # Only the main thread receives signals, and jobs in the background of a shell ignore this.
        in_main = threading.current_thread() is threading.main_thread()
        if in_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._before = signal.signal(signal.SIGINT, self._note)

    def check(self) -> bool:
        """Raise KeyboardInterrupt with the words if it was asked for; return False otherwise."""
        if self._asked:
            raise KeyboardInterrupt(self._words)
        return False

    def close(self) -> None:
        """Restore the handler of before."""
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        self.check()
        self._asked = True
