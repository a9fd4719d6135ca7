"""Results of procedures, ready for display, comparison and acceptance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration.records import CameraRecord, Finding, VerificationRecord
from ocmm_core.camera import Rig
from ocmm_core.geometry import Pixels, Points3


@dataclass(frozen=True, slots=True)
class CameraResiduals:
    """Residuals of one camera's spots: arrows on its picture."""

    name: str
    uv: Pixels
    residuals_px: Pixels
    """`uv`, `residuals_px`: (n, 2), px: position, and observed minus predicted."""
    used: NDArray[np.bool_]
    """(n,): False for outliers."""


@dataclass(frozen=True, slots=True)
class CameraChange:
    """Change of one camera from the running calibration, after alignment of the frames."""

    name: str
    shift_mm: float
    turn_rad: float
    """`shift_mm`, `turn_rad`: Distance of the centres, and angle between the attitudes, after the
    best common rigid motion of all cameras, which absorbs a motion of the whole frame."""
    focal_mm: float
    u0_px: float
    v0_px: float
    """`focal_mm`, `u0_px`, `v0_px`: After less before."""


@dataclass(frozen=True, slots=True)
class CalibrationComparison:
    """Comparison of the new calibration with the one in force."""

    moved_mm: float
    turned_rad: float
    """`moved_mm`, `turned_rad`: The common motion of all cameras."""
    cameras: tuple[CameraChange, ...]
    """Remainder of each camera."""
    nodes_world: Points3
    differences_world: Points3
    """`nodes_world`, `differences_world`: (n, 3), mm: points of the volume located by the old
    calibration, and new minus old location after removal of the common motion."""
    length_sigma_before_mm: float
    length_sigma_after_mm: float
    """`length_sigma_before_mm`, `length_sigma_after_mm`: Predicted, of a length in the volume."""


@dataclass(frozen=True, slots=True)
class CalibrationOutcome:
    """A calibration awaiting acceptance."""

    record: CameraRecord
    rig: Rig
    residuals: tuple[CameraResiduals, ...]
    errors_at_world: Points3
    errors_world: Points3
    """`errors_at_world`, `errors_world`: (n, 3), mm: points not used for the calibration, and
    located minus reference (known points), or the misfits of the bar and control points at their
    places."""
    warnings: tuple[Finding, ...]
    """Findings that did not refuse it."""
    comparison: CalibrationComparison | None
    """With the calibration in force, or None."""


@dataclass(frozen=True, slots=True)
class VerificationOutcome:
    """A verdict awaiting storage."""

    record: VerificationRecord
    """To be stored, with all checks."""
    largest: int
    """Index of the check closest to, or farthest beyond, its limit."""
    failed: tuple[int, ...]
    """Indices of the nonconforming checks."""
    warnings: tuple[Finding, ...]
    """Findings that weaken the verdict."""
    due_utc: str
    """Expiry of the verified calibration, ISO 8601; empty without one."""
