"""What a procedure found, ready to be shown, compared and accepted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.records import CameraRecord, Finding, VerificationRecord
from ocmm_core.camera import Rig
from ocmm_core.geometry import Pixels, Points3


@dataclass(frozen=True, slots=True)
class CameraResiduals:
    """What one camera's spots leave over: arrows on its picture."""

    name: str
    uv: Pixels
    residuals_px: Pixels
    """`uv`, `residuals_px`: (n, 2), px: where, and observed minus predicted."""
    used: NDArray[np.bool_]
    """(n,): False for outliers."""


@dataclass(frozen=True, slots=True)
class CameraChange:
    """How one camera differs from the running calibration, after the frames were matched."""

    name: str
    shift_mm: float
    turn_rad: float
    """`shift_mm`, `turn_rad`: Distance of the centres, and angle between the attitudes, after the
    best common rigid motion of all cameras; these remain of a frame that was moved as a whole."""
    focal_mm: float
    u0_px: float
    v0_px: float
    """`focal_mm`, `u0_px`, `v0_px`: After less before."""


@dataclass(frozen=True, slots=True)
class CalibrationComparison:
    """The new calibration beside the one in force."""

    moved_mm: float
    turned_rad: float
    """`moved_mm`, `turned_rad`: The common motion of all cameras."""
    cameras: tuple[CameraChange, ...]
    """What is left of each camera."""
    nodes_world: Points3
    differences_world: Points3
    """`nodes_world`, `differences_world`: (n, 3), mm: points of the volume, and where the new
    calibration locates what the old one located there, after the common motion was taken out."""
    length_sigma_before_mm: float
    length_sigma_after_mm: float
    """`length_sigma_before_mm`, `length_sigma_after_mm`: Predicted standard uncertainty of a length
    in the volume, by either covariance."""


@dataclass(frozen=True, slots=True)
class CalibrationOutcome:
    """A calibration that waits for being accepted."""

    record: CameraRecord
    """What would be stored."""
    rig: Rig
    residuals: tuple[CameraResiduals, ...]
    """One for each camera."""
    errors_at_world: Points3
    errors_world: Points3
    """`errors_at_world`, `errors_world`: (n, 3), mm: points that were not used for the calibration,
    and located minus known (for known points), or the bar's and control points' misfits at their
    places."""
    warnings: tuple[Finding, ...]
    """What speaks against it and was not refused."""
    comparison: CalibrationComparison | None
    """With the calibration in force; None where there is none."""


@dataclass(frozen=True, slots=True)
class VerificationOutcome:
    """A verdict that waits for being stored."""

    record: VerificationRecord
    """What would be stored, with all checks."""
    largest: int
    """Index of the check that is nearest to its limit, or farthest beyond."""
    failed: tuple[int, ...]
    """Indices of the checks that do not conform by the rule of the verification."""
    warnings: tuple[Finding, ...]
    """What makes the verdict weaker."""
