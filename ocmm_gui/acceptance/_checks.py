"""Judged values of an acceptance test as checks for an error chart."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.acceptance import JudgedValue
from ocmm_core.calibration.records import Check


def checks_of(values: Sequence[JudgedValue]) -> tuple[Check, ...]:
    """Return values as checks; a chart groups them by the text before the comma."""
    return tuple(
        Check(
            name=f"{one.position}, {one.quantity} {one.name}", measured_mm=one.error_mm,
            certified_mm=0.0, expanded_mm=one.expanded_mm, limit_mm=one.limit_mm,
        )
        for one in values
    )  # fmt: skip
