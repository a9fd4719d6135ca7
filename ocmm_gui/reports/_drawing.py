"""Drawing without a window: in a process that has no application yet, and needs no screen."""

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
    """Have what fonts and painters need, for as long as it is held."""
    if sys.platform == "linux":
        # A report needs no screen, and a screen may not be there.
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    application = QGuiApplication.instance() or QGuiApplication([])
    try:
        yield
    finally:
        forget_faces()
        del application


def draw(write: Callable[[], None], part: str, safe: str) -> int:
    """Draw and write in a program of its own, and return its exit code.

    It is 0, 2 where it could not be done, and 3 where nobody foresaw why; a line of the standard
    error says so then.

    Parameters
    ----------
    part, safe
        What failed, and what is not lost, as for `contained`.
    """
    try:
        with drawing():
            write()
    except Exception as error:
        told = contained(error, part, safe)
        sys.stderr.write(f"{told.what} {told.remedy}\n")
        return EXIT_INTERNAL if isinstance(told, InternalError) else 2
    return 0
