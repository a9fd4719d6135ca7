"""Background loading of sheets, Maintain and wizards."""

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
"""Packages and their public names, in order."""


class Preload:
    """Load packages on a thread before their first use; widgets are made by the window."""

    def __init__(self) -> None:
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-preload")

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Stop after the current package, some tenths of a second at most."""
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        for room, names in _LATER:
            for name in names.split():
                if self._stopping.is_set():
                    return
                getattr(import_module(room), name)
