"""What a relocation wants where nobody asks for more; a command names it before it loads."""

from __future__ import annotations

POSES_WANTED, BARS_WANTED = 300, 10
LENGTH_LIMIT_MM = 0.005
