"""Drawing without a window, in a process without an application or a screen."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from PySide6.QtGui import QGuiApplication

from ocmm_core.errors import InternalError
from ocmm_core.failure import EXIT_INTERNAL, contained
from ocmm_gui.reports._canvas import forget_faces


@contextmanager
def drawing() -> Iterator[None]:
    """Provide the application that fonts and painters need, while held."""
    if sys.platform == "linux":
        # A report needs no screen, and there may be none.
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    application = QGuiApplication.instance() or QGuiApplication([])
    try:
        yield
    finally:
        forget_faces()
        del application


def draw(write: Callable[[], None], part: str, safe: str) -> int:
    """Draw and write in a separate program, and return its exit code.

    0, 2 on failure, and 3 after an unexpected error, with a line on stderr. `part`, `safe`: the
    failed part and what is not lost, as for `contained`.
    """
    try:
        with drawing():
            write()
    except Exception as error:
        told = contained(error, part, safe)
        sys.stderr.write(f"{told.what} {told.remedy}\n")
        return EXIT_INTERNAL if isinstance(told, InternalError) else 2
    return 0
