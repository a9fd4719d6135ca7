"""How long a tip holds where nobody says; a command names it before it loads the room."""

from __future__ import annotations

VALID_DAYS = 30
