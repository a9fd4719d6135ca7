"""Defaults of a relocation, for commands to show before loading it."""

POSES_WANTED, BARS_WANTED = 300, 10
LENGTH_LIMIT_MM = 0.005
