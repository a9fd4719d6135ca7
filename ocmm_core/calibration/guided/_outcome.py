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
    """What one camera's spots leave over: arrows on its picture.

    Attributes
    ----------
    name
        Of the camera.
    uv, residuals_px
        (n, 2), px: where, and observed minus predicted.
    used
        (n,): False for outliers.
    """

    name: str
    uv: Pixels
    residuals_px: Pixels
    used: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class CameraChange:
    """How one camera differs from the running calibration, after the frames were matched.

    Attributes
    ----------
    name
        Of the camera.
    shift_mm, turn_rad
        Distance of the centres, and angle between the attitudes, after the best common rigid
        motion of all cameras; these remain of a frame that was moved as a whole.
    focal_mm, u0_px, v0_px
        After less before.
    """

    name: str
    shift_mm: float
    turn_rad: float
    focal_mm: float
    u0_px: float
    v0_px: float


@dataclass(frozen=True, slots=True)
class CalibrationComparison:
    """The new calibration beside the one in force.

    Attributes
    ----------
    moved_mm, turned_rad
        The common motion of all cameras.
    cameras
        What is left of each camera.
    nodes_world, differences_world
        (n, 3), mm: points of the volume, and where the new calibration locates what the old one
        located there, after the common motion was taken out.
    length_sigma_before_mm, length_sigma_after_mm
        Predicted standard uncertainty of a length in the volume, by either covariance.
    """

    moved_mm: float
    turned_rad: float
    cameras: tuple[CameraChange, ...]
    nodes_world: Points3
    differences_world: Points3
    length_sigma_before_mm: float
    length_sigma_after_mm: float


@dataclass(frozen=True, slots=True)
class CalibrationOutcome:
    """A calibration that waits for being accepted.

    Attributes
    ----------
    record
        What would be stored.
    rig
        The rig with it.
    residuals
        One for each camera.
    errors_at_world, errors_world
        (n, 3), mm: points that were not used for the calibration, and located minus known (for
        known points), or the bar's and control points' misfits at their places.
    warnings
        What speaks against it and was not refused.
    comparison
        With the calibration in force; None where there is none.
    """

    record: CameraRecord
    rig: Rig
    residuals: tuple[CameraResiduals, ...]
    errors_at_world: Points3
    errors_world: Points3
    warnings: tuple[Finding, ...]
    comparison: CalibrationComparison | None


@dataclass(frozen=True, slots=True)
class VerificationOutcome:
    """A verdict that waits for being stored.

    Attributes
    ----------
    record
        What would be stored, with all checks.
    largest
        Index of the check that is nearest to its limit, or farthest beyond.
    failed
        Indices of the checks that do not conform by the rule of the verification.
    warnings
        What makes the verdict weaker.
    """

    record: VerificationRecord
    largest: int
    failed: tuple[int, ...]
    warnings: tuple[Finding, ...]
