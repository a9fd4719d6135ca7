"""Defaults of a pivot calibration, for commands to show before loading it."""

CHANGE_LIMIT_MM = 0.03
POSES_WANTED = 400
VALID_DAYS = 365
