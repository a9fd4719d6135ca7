"""What a pivot calibration is asked for, with the defaults that commands show before loading it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PivotRequest:
    tip_unknown: bool = False
    """The document has no place for this tip, never calibrated: only its rest in the cone is
    assumed."""
    slack: float = 0.0
    """Standard deviation of the ball in the cone, per axis, mm."""
    limit: float = 0.03
    """Change of the tip from which a reason is required, mm."""
    poses: int = 400
    tip_sigma_mm: float = 0.01
    """`poses`, `tip_sigma_mm`: with these and full coverage a sweep ends automatically."""
    valid_days: int = 365
    again: bool = True
    """False only for recordings without a final visit, which the record then states."""
