"""Runs a command line, and notes in a file every process of it and all that is compiled in them.

``python tests/compile_log.py window|ocmm ARGUMENTS`` writes to the file that the environment
variable names. What is spawned imports this file again, and so notes, too.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from numba.core import event

VARIABLE = "OCMM_COMPILE_LOG"


def _note(words: str) -> None:
    with Path(os.environ[VARIABLE]).open("a", encoding="utf-8") as log:
        log.write(f"{words}\n")


class _Notes(event.Listener):  # type: ignore[misc] # numba ships no annotations
    def on_start(self, event: Any) -> None:  # its type is numba's
        """Note what is compiled."""
        function = event.data["dispatcher"].py_func
        _note(f"compiled {function.__module__} {function.__name__}")

    def on_end(self, event: Any) -> None:  # as above
        """Do nothing."""


if VARIABLE in os.environ:
    event.register("numba:compile", _Notes())
    _note("process")

if __name__ == "__main__":
    what, *arguments = sys.argv[1:]
    if what == "window":
        from ocmm_gui.app import main as window

        sys.exit(window(arguments))
    from ocmm_core.cli import main

    sys.argv[1:] = arguments
    main()
