"""Default validity of a tip, for commands to show without loading the package."""

from __future__ import annotations

VALID_DAYS = 30
