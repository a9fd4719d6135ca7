"""Calibration: cameras from known points, and what may be trusted of it."""
