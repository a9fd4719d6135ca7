"""Runs command lines, and logs each of their processes and everything compiled in it.

``python tests/compile_log.py 'window|ocmm ARGUMENTS' ...`` runs them in turn in one process and
writes to the file named by the environment variable, with the lines that ended well. A word with a
star is replaced by the matching files. Spawned processes import this file again and log as well.
"""

from __future__ import annotations

import os
import shlex
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
        """Log the compilation."""
        function = event.data["dispatcher"].py_func
        _note(f"compiled {function.__module__} {function.__name__}")

    def on_end(self, event: Any) -> None:  # as above
        """Do nothing."""


if VARIABLE in os.environ:
    event.register("numba:compile", _Notes())
    _note("process")


def _words(line: str) -> list[str]:
    """Return the words of a command line, with stars replaced by the matching files."""
    return [
        str(found) for word in shlex.split(line)
        for found in ([word] if "*" not in word else sorted(Path().glob(word)))
    ]  # fmt: skip


def _run(what: str, *arguments: str) -> int:
    if what == "window":
        from ocmm_gui.app import main as window

        return window(list(arguments))
    from ocmm_cli import main

    sys.argv[1:] = arguments
    try:
        main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


if __name__ == "__main__":
    for line in sys.argv[1:]:
        # 1 is a verdict about the part.
        if (code := _run(*_words(line))) not in (0, 1):
            sys.exit(code)
        _note(f"ran {line}")
