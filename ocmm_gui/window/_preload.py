"""What the sheets, Maintain and the wizards need, loaded behind the shown window."""

from __future__ import annotations

import threading
from importlib import import_module

_LATER = (
    ("ocmm_gui.results", "ResultsSheet ReportSheet CompareSheet AlignmentSheet"),
    ("ocmm_gui.plan_editor", "PlanSheet"),
    ("ocmm_gui.maintain", "MaintainView BusPage CalibrationPage ProbePage FitsPage RecallSheet"),
    ("ocmm_gui.wizards", "WIZARDS Wizard"),
    ("ocmm_gui.wizards.pages", "DefinitionPage"),
)
"""Rooms, and the names on their faces; the first is wanted first."""


class Preload:
    """Load them one after the other on a thread, so that the first look at them waits for none.

    A thread that imports makes no widget; the window makes each when it is wanted.
    """

    def __init__(self) -> None:
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-preload")

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """Stop after the room that is being loaded, some tenths of a second at the most."""
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        for room, names in _LATER:
            for name in names.split():
                if self._stopping.is_set():
                    return
                getattr(import_module(room), name)
