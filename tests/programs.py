"""Observe programs that a test starts: frame rings, handled signals."""

from __future__ import annotations

import signal
from pathlib import Path


def rings_of(pid: int) -> set[Path]:
    """Return the frame rings that a process maps; empty once it has ended."""
    try:
        maps = Path(f"/proc/{pid}/maps").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return set()
    return {Path(line.split()[5]) for line in maps.splitlines() if "ocmm-ring-" in line}


def handles(pid: int, number: signal.Signals) -> bool:
    """Return whether a process has its own handler for a signal."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    caught = next(line.split()[1] for line in status if line.startswith("SigCgt:"))
    return bool(int(caught, 16) >> (number - 1) & 1)
