"""Requirements of a tip qualification, the checks of its record, and its session events.

Both procedures start or resume with the records in force for a tip.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from ocmm_core.calibration.guided import Articulation, SessionEvent, SessionHeader, Spots
from ocmm_core.calibration.records import (
    ArtefactUse,
    CameraRecord,
    Check,
    Finding,
    ProbeStore,
    Sphere,
    TipRecords,
    VerificationRecord,
    rests_on,
)
from ocmm_core.calibration.tip._fit import BallFit
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError


@dataclass(frozen=True, slots=True)
class TipLimits:
    """Requirements of a qualification."""

    nominal: float = 0.025
    """Permissible difference of the ball's diameter from its nominal one, mm."""
    diameter_sigma: float = 0.007
    """Sufficient standard uncertainty of the diameter, mm: comparison with the nominal one is then
    as certain as in a quick check."""
    points: int = 25
    places: int = 21
    """Minimum number of places of the layout; a stem may hide some."""
    attitudes: int = 5


def usual_limits(rig: Rig) -> TipLimits:
    """Return the requirements: of trackers, which are coarser, a larger uncertainty suffices."""
    return TipLimits() if rig.markers is None else TipLimits(diameter_sigma=0.010)


def qualification_checks(
    ball: BallFit, articulation: Articulation, nominal_mm: float, limits: TipLimits
) -> tuple[Check, ...]:
    """Return the checks with limits: diameter, form, misfit, and articulation."""
    return (
        Check(
            name="diameter against nominal",
            measured_mm=ball.diameter,
            certified_mm=nominal_mm,
            expanded_mm=2.0 * ball.diameter_sigma,
            limit_mm=limits.nominal,
        ),
        *form_checks(ball),
        articulation_check(articulation),
        _bounded(
            "articulation in the cone (largest)", articulation.largest, articulation.largest_limit
        ),
    )


def form_checks(ball: BallFit) -> tuple[Check, ...]:
    """Return form and misfit of the points against what their uncertainties allow."""
    return (
        _bounded("form on the sphere", ball.form, ball.form_limit),
        _bounded("misfit on the sphere", ball.misfit, ball.misfit_limit),
    )


def articulation_check(found: Articulation) -> Check:
    """Return two standard deviations of the tips against what their uncertainties allow."""
    return _bounded("articulation in the cone (2s)", found.spread_2s, found.spread_limit)


def _bounded(name: str, measured_mm: float, limit_mm: float) -> Check:
    """Return a check of a quantity with target zero and a limit from uncertainties."""
    return Check(
        name=name, measured_mm=measured_mm, certified_mm=0.0, expanded_mm=0.0, limit_mm=limit_mm
    )


def conforms(check: Check) -> bool:
    """Return whether a check is within its limit; the gates already bound its uncertainty."""
    return abs(check.error_mm) <= check.limit_mm


def nearest_to_limit(checks: Sequence[Check]) -> int:
    """Return the index of the check closest to, or farthest beyond, its limit."""
    shares = [abs(one.error_mm) / one.limit_mm for one in checks]
    return shares.index(max(shares))


def sphere_warnings(
    sphere: Sphere, calibration: CameraRecord | None, verifications: Sequence[VerificationRecord]
) -> tuple[Finding, ...]:
    """Return warnings if the sphere was used for calibration or verification (ISO 10360-5)."""
    use = sphere.artefact.use
    found = []
    if calibration is not None and rests_on(calibration.artefacts, use.serial):
        found.append(
            Finding(
                "tip.sphere_of_cameras",
                f"The cameras were calibrated with the same '{use.name}' (serial {use.serial}): "
                "a certificate error would go unnoticed.",
                "Qualify the tip on another sphere.",
                refuses=False,
            )
        )
    if any(rests_on(one.artefacts, use.serial) for one in verifications):
        found.append(
            Finding(
                "tip.sphere_of_verification",
                f"The cameras are verified with the same '{use.name}' (serial {use.serial}): a "
                "certificate error enters the tip and goes unnoticed in the verification.",
                "Use separate spheres for tips and verifications.",
                refuses=False,
            )
        )
    return tuple(found)


def doubtful_warning(ball: BallFit) -> tuple[Finding, ...]:
    """Return a warning that lists inconsistent points, or nothing."""
    if not ball.doubtful:
        return ()
    named = ", ".join(
        f"{point + 1} ({1e3 * ball.residuals[point]:+.0f} um)" for point in ball.doubtful
    )
    return (
        Finding(
            "tip.doubtful",
            f"Points on the sphere that do not fit the others: {named}. They were not excluded.",
            "Undo them and touch these places again, with the ball resting on the sphere.",
            refuses=False,
        ),
    )


class TouchBegun(SessionHeader, frozen=True, kw_only=True):
    """Common first line of both procedures."""

    tip: str
    probe_identity: str
    sphere: Sphere
    cone: ArtefactUse | None
    nominal_mm: float


class TipBegun(TouchBegun, frozen=True, kw_only=True):
    """First line of a qualification, with its limits and validity."""

    limits: TipLimits
    valid_days: int


class TipCheckBegun(TouchBegun, frozen=True, kw_only=True):
    """First line of a check, with the hash of the checked qualification."""

    qualification: str


class BallOnSphere(SessionEvent, frozen=True, kw_only=True):
    """The ball at one point of the sphere: averaged spots (C, L), px, and their sigma."""

    uv: Spots
    sigma_px: float


class BallInCone(SessionEvent, frozen=True, kw_only=True):
    """The ball in the cone in one attitude; see `BallOnSphere`."""

    uv: Spots
    sigma_px: float


class TakenBack(SessionEvent, frozen=True, kw_only=True):
    """Any one observation of a step was removed."""

    step: str
    point: int


TouchEvent: TypeAlias = TipBegun | TipCheckBegun | BallOnSphere | BallInCone | TakenBack


def mounted_records(store: ProbeStore, tip: str) -> TipRecords:
    """Return a tip's records; CalibrationError if never calibrated, or not mounted."""
    store.refresh()
    records = store.active(tip)
    if records is None:
        raise CalibrationError(
            "probe_record.none",
            f"The probe was never calibrated with tip '{tip}'.",
            "Calibrate the probe with this tip.",
        )
    if store.mounted != tip:
        raise CalibrationError(
            "tip.not_mounted",
            f"The mounted tip is recorded as '{store.mounted}', not '{tip}'.",
            "Confirm which tip is mounted.",
        )
    return records


def continued_records(store: ProbeStore, begun: TouchBegun, path: Path) -> TipRecords:
    """Return the session's records; raise CalibrationError if no longer in force."""
    records = store.active(begun.tip)
    if records is None or store.active_hash(begun.tip) != begun.running:
        raise CalibrationError(
            "session.calibration",
            f"{path}: this session was started with a probe calibration that is no longer active.",
            "Start a new session.",
        )
    return records
