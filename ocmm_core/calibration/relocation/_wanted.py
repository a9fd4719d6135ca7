"""Defaults of a relocation, for commands to show before loading it."""

from __future__ import annotations

POSES_WANTED, BARS_WANTED = 300, 10
LENGTH_LIMIT_MM = 0.005
