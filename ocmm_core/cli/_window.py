"""The window in the place of this process."""

from __future__ import annotations

import os
import sys


def open_window(*arguments: str) -> None:
    """Become the window.

    In the place of this process: whoever ends or kills it ends or kills the window, and nobody
    waits in between.
    """
    command = [sys.executable, "-m", "ocmm_gui", *arguments]
    sys.stdout.flush()
    os.execv(command[0], command)  # noqa: S606 - our own interpreter and module


def has_display() -> bool:
    """Return whether a window can be shown; asked of the environment, without loading Qt."""
    if sys.platform != "linux":
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"))
