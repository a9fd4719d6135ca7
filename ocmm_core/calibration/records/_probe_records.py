"""`sealed` records of each tip: calibration, qualification and quick checks."""

from __future__ import annotations

import hashlib
from dataclasses import replace

import msgspec
import numpy as np

from ocmm_core.calibration.records._records import ArtefactUse, Check
from ocmm_core.calibration.records._sealed import record_hash
from ocmm_core.camera import Vector3
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

PROBE_SCHEMA = "ocmm.probe-calibration/1"
TIP_SCHEMA = "ocmm.tip-qualification/1"
CHECK_SCHEMA = "ocmm.tip-check/1"


class MadeRecord(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Head of every record of a probe."""

    schema: str
    """Kind, with its version."""
    probe: str
    tip: str
    """Name of the tip, as on the stylus or in the menu."""
    made_utc: str
    made_by: str
    software: str
    temperature_c: float | None
    """Ambient; None if not measured."""
    rig: str
    rig_identity: str
    """`rig`, `rig_identity`: Name of the rig, and hash of the record or document of its cameras."""
    data_sha256: str


class PivotCheck(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Result of the second, independent sweep; see `pivot.PivotValidation`."""

    difference_mm: Vector3
    sigma_mm: Vector3
    """`difference_mm`, `sigma_mm`: Between the tips of both sweeps, probe frame."""
    led_difference_mm: float
    """RMS distance of the LEDs."""
    place_mm: float
    attitude_deg: float
    """`place_mm`, `attitude_deg`: Distance of the second sweep from the first."""
    articulation_2s_mm: float | None
    articulation_max_mm: float | None
    """`articulation_2s_mm`, `articulation_max_mm`: First tip in the second sweep, or None."""


class ProbeRecord(MadeRecord, frozen=True, kw_only=True):
    """A pivot calibration of a probe with one tip."""

    valid_until_utc: str
    probe_identity: str
    """SHA-256 of the probe's document, whose frame all coordinates use."""
    leds_mm: tuple[Vector3, ...]
    tip_mm: Vector3
    """`leds_mm`, `tip_mm`: LEDs and ball centre."""
    covariance: tuple[tuple[float, ...], ...]
    """Rows (3 L + 3): LEDs, then the tip, mm^2."""
    frames: int
    left_out: int
    """`frames`, `left_out`: Frames of the first sweep, and outliers among them."""
    ranges_deg: Vector3
    attitudes: int
    """`ranges_deg`, `attitudes`: About the probe's axes; number at least two degrees apart."""
    rms_px: float
    chi2_per_dof: float
    """`rms_px`, `chi2_per_dof`: Of the residuals."""
    thesis_tip_mm: Vector3
    thesis_spread_mm: float
    """`thesis_tip_mm`, `thesis_spread_mm`: By the method of the thesis on the same frames: the tip,
    and the RMS distance of the centres of its spheres from their mean (Table 4)."""
    validation: PivotCheck
    """By the second sweep."""
    change_mm: float | None
    """Distance of the tip from the previous record's; None for the first one."""
    change_reason: str
    """User's explanation of an unusual change; else empty."""
    warnings: tuple[str, ...]
    forced: bool
    artefacts: tuple[ArtefactUse, ...]
    """The cone, if named."""
    previous: str
    """Hash of the previous record of this tip; empty for the first one."""

    @property
    def tip_sigma_mm(self) -> float:
        """Return the root of the sum of the tip's variances."""
        return float(np.sqrt(sum(self.covariance[i][i] for i in (-3, -2, -1))))


class TipRecord(MadeRecord, frozen=True, kw_only=True):
    """A qualification of a tip on a calibrated sphere, and its articulation in a cone."""

    valid_until_utc: str
    calibration: str
    """Hash of the `ProbeRecord` that the points were computed with."""
    diameter_mm: float
    diameter_sigma_mm: float
    """`diameter_mm`, `diameter_sigma_mm`: Effective diameter of the ball and its standard
    uncertainty, with that of the sphere."""
    noise_sigma_mm: float = 0.0
    """The part of it that comes from the spots alone."""
    by_cameras: tuple[float, ...] = ()
    by_geometry: tuple[float, ...] = ()
    """`by_cameras`, `by_geometry`: Derivatives of the diameter by the camera parameters (14 C) and
    by the probe's LEDs and tip (3 L + 3); a later check shares them. Empty if not kept."""
    form_mm: float
    """Largest less smallest radius over all points (ISO 10360-5)."""
    points: int
    point_sigma_mm: float
    """Standard deviation of one point along the normal, from the residuals."""
    articulation_2s_mm: float
    articulation_max_mm: float
    """`articulation_2s_mm`, `articulation_max_mm`: Two standard deviations and largest distance
    from their mean of the tips of all attitudes in the cone (ASME B89.4.22)."""
    attitudes: int
    """Attitudes in the cone."""
    checks: tuple[Check, ...]
    """All judged quantities with limits, also failed ones."""
    artefacts: tuple[ArtefactUse, ...]
    """Sphere, and cone if named."""
    passed: bool
    camera_doubts: tuple[str, ...] | msgspec.UnsetType = msgspec.UNSET
    """Unproven properties of described cameras, in sentences; unset for our own, to keep hashes."""


class TipCheckRecord(MadeRecord, frozen=True, kw_only=True):
    """A quick check that the mounted tip is still the one that was qualified."""

    calibration: str
    qualification: str
    """`calibration`, `qualification`: Hashes of the checked `ProbeRecord` and `TipRecord`."""
    checks: tuple[Check, ...]
    """Diameter and length, with limits."""
    artefacts: tuple[ArtefactUse, ...]
    """Sphere, and cone if named."""
    passed: bool


def probe_from_records(
    body: ProbeBody, calibration: ProbeRecord, tip: TipRecord | None
) -> ProbeBody:
    """Return the probe with the geometry of its records.

    Without a ``tip`` qualification, the document gives diameter and uncertainty. CalibrationError
    if the record is of another probe, or its arrays have the wrong shape.
    """
    if calibration.probe_identity != body.identity:
        raise CalibrationError(
            "probe_record.other",
            f"The calibration of probe '{calibration.probe}' with tip '{calibration.tip}' was "
            f"made with a document other than the present one of '{body.name}'.",
            "Give the document the probe was calibrated with, or calibrate the probe.",
        )
    size = 3 * body.n_leds + 3
    rows = calibration.covariance
    if len(calibration.leds_mm) != body.n_leds or {len(rows), *map(len, rows)} != {size}:
        raise _unfit(calibration)
    covariance: Float = np.array(rows)
    if not np.array_equal(covariance, covariance.T) or np.any(np.diag(covariance) < 0.0):
        raise _unfit(calibration)
    digest = record_hash(calibration)
    if tip is None:
        return replace(
            body,
            leds_probe=np.array(calibration.leds_mm),
            tip_probe=np.array(calibration.tip_mm),
            geometry_covariance=covariance,
            identity=digest,
        )
    if tip.calibration != digest:
        raise CalibrationError(
            "probe_record.tip",
            f"Tip '{tip.tip}' of probe '{tip.probe}' was not qualified with this calibration.",
            "Qualify the tip.",
        )
    return replace(
        body,
        leds_probe=np.array(calibration.leds_mm),
        tip_probe=np.array(calibration.tip_mm),
        tip_radius=0.5 * tip.diameter_mm,
        tip_radius_sigma=0.5 * tip.diameter_sigma_mm,
        geometry_covariance=covariance,
        identity=hashlib.sha256(f"{digest} {record_hash(tip)}".encode()).hexdigest(),
    )


def _unfit(calibration: ProbeRecord) -> CalibrationError:
    return CalibrationError(
        "probe_record.covariance",
        f"The record of probe '{calibration.probe}' with tip '{calibration.tip}' lacks the LEDs "
        "and covariance the probe needs.",
        "Calibrate the probe again.",
    )
