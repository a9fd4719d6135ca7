"""What a verification says of its session, in words."""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.records import VerificationRecord


def session_of(record: VerificationRecord) -> tuple[tuple[str, str], ...]:
    """Return facts about corners and repeated seats; none for records of earlier versions."""
    facts: list[tuple[str, str]] = []
    if record.corners:
        missing = [one for one in record.corners if not one.reached]
        said = f"{len(record.corners) - len(missing)} of {len(record.corners)} reached"
        for one in missing:
            said += f"; {one.name}: {one.reason or 'no reason'}"
        facts.append(("Corners", said))
    if record.repeats:
        shifts = (
            f"{one.place} {1e3 * float(np.linalg.norm(one.shift_mm)):.0f} µm"
            f"{'' if one.square <= one.limit else ' ▲'}"
            for one in record.repeats
        )
        facts.append(("Repeats", ", ".join(shifts)))
    forms = [one for one in record.checks if one.name.endswith(", form")]
    if forms:
        worst = max(forms, key=lambda one: one.error_mm)
        facts.append(
            ("Form", f"{1e3 * worst.error_mm:.1f} µm, limit {1e3 * worst.limit_mm:.1f} µm")
        )
    return tuple(facts)
