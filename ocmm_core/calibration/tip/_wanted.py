"""Default validity of a tip, separate so that commands can show it without loading the package."""

from __future__ import annotations

VALID_DAYS = 30
