"""Drawing without a window: in a process that has no application yet, and needs no screen."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from PySide6.QtGui import QGuiApplication


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
        del application
