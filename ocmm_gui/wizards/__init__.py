"""Wizards: guided calibration, relocation and verification, as pages over core procedures."""
