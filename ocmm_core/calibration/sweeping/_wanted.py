"""What a sweep wants where nobody asks for more; a command names it before it loads."""

from __future__ import annotations

CHANGE_LIMIT_MM = 0.03
POSES_WANTED = 400
VALID_DAYS = 365
