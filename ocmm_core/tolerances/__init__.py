"""Characteristics: their values, uncertainties and verdicts."""
