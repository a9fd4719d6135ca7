"""Replace this process with the window."""

from __future__ import annotations

import os
import sys


def open_window(*arguments: str) -> None:
    """Replace this process with the window, so that signals reach it directly."""
    command = [sys.executable, "-m", "ocmm_gui", *arguments]
    sys.stdout.flush()
    os.execv(command[0], command)  # noqa: S606 - our own interpreter and module


def has_display() -> bool:
    """Return whether a window can be shown, by the environment, without loading Qt."""
    if sys.platform != "linux":
        return True
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"))
