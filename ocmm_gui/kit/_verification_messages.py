"""Facts of a verification session, in words."""

from __future__ import annotations

import numpy as np

from ocmm_core.calibration.records import VerificationRecord
from ocmm_gui.kit._texts import said, tr


def session_of(record: VerificationRecord) -> tuple[tuple[str, str], ...]:
    """Return facts about corners and repeated seats; none for earlier versions."""
    facts: list[tuple[str, str]] = []
    if record.corners:
        missing = [one for one in record.corners if not one.reached]
        corners = tr("{reached} of {count} reached").format(
            reached=len(record.corners) - len(missing), count=len(record.corners)
        )
        for one in missing:
            corners += f"; {one.name}: " + (said(one.reason) or tr("no reason"))
        facts.append((tr("Corners"), corners))
    if record.repeats:
        shifts = (
            f"{_seat(one.place)} {1e3 * float(np.linalg.norm(one.shift_mm)):.0f} µm"
            f"{'' if one.square <= one.limit else ' ▲'}"
            for one in record.repeats
        )
        facts.append((tr("Repeats"), ", ".join(shifts)))
    forms = [one for one in record.checks if one.name.endswith(", form")]
    if forms:
        worst = max(forms, key=lambda one: one.error_mm)
        facts.append(
            (
                tr("Form"),
                tr("{error_mm:.1f} µm, limit {limit_mm:.1f} µm").format(
                    error_mm=1e3 * worst.error_mm, limit_mm=1e3 * worst.limit_mm
                ),
            )
        )
    return tuple(facts)


def _seat(place: str) -> str:
    return tr("seat {number}").format(number=place.removeprefix("seat "))
