"""How the bus process is started: with which interpreter, and therefore with which rights."""

from __future__ import annotations

import sys


def bus_command() -> list[str]:
    """Return the command that runs the bus process."""
    return [sys.executable, "-m", "ocmm_core.acquisition.process"]
