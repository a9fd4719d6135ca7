"""Display form of a relocation, and assignment of bar LEDs."""

from __future__ import annotations

from itertools import product

import numpy as np

from ocmm_core.calibration.guided import CameraResiduals, Findings
from ocmm_core.calibration.relocation._data import KeptByPoints, Observations, RelocationResult
from ocmm_core.calibration.relocation._state import LENGTH_TOLERANCE
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking import triangulate


def bar_ends(rig: Rig, uv: Float, length: float) -> Float:
    """Return the two spots of a bar in each camera, (C, 2, 2), px, with matching ends.

    Only the correct pairing gives the distance of the LEDs; CalibrationError if none does. ``uv``
    (C, 2, 2), px: both spots in any order, or NaN.
    """
    seeing = [c for c in range(len(uv)) if np.isfinite(uv[c]).all()]
    best, least = uv, np.inf
    for swaps in product((False, True), repeat=max(len(seeing) - 1, 0)):
        paired = uv.copy()
        for camera, swap in zip(seeing[1:], swaps, strict=True):
            paired[camera] = uv[camera, ::-1] if swap else uv[camera]
        ends = triangulate(rig, paired)
        off = abs(float(np.linalg.norm(ends[1] - ends[0])) / length - 1.0)
        if off < least:
            best, least = paired, off
    if not least < LENGTH_TOLERANCE:
        raise CalibrationError(
            "relocation.bar",
            "The two visible points are not the ends of the bar.",
            "Cover other lights, and check that this is the selected bar.",
        )
    return best


def findings_of(rig: Rig, observed: Observations, found: RelocationResult) -> Findings:
    """Return a relocation in displayed and recorded form."""
    uv = observed.frames.uv
    residuals = []
    for c, camera in enumerate(found.cameras):
        seen = np.isfinite(found.residuals_px[:, c]).all(axis=-1)
        residuals.append(
            CameraResiduals(
                camera.name, uv[:, c][seen], found.residuals_px[:, c][seen], found.used[:, c][seen]
            )
        )
    after = found.applied_to(rig, rig.identity)
    at, errors = _misfits(after, observed, found)
    return Findings(
        cameras=found.cameras,
        covariance=found.covariance,
        volume_world=found.volume_world,
        hull_world=found.hull_world,
        residuals=tuple(residuals),
        rms_px=found.rms_px,
        chi2_per_dof=found.chi2 / found.dof,
        points=int(np.count_nonzero(found.frames_used)),
        outliers=tuple(
            f"pose {one.frame + 1}, LED {one.led + 1} in {found.cameras[one.camera].name}"
            for one in found.wrong_spots
        ),
        errors_at_world=at,
        errors_world=errors,
        warnings=found.warnings,
    )


def _misfits(
    after: Rig, observed: Observations, found: RelocationResult
) -> tuple[Points3, Points3]:
    """Return places and misfits (n, 3), mm: of shown bars along them, and of control points."""
    places: list[Float] = []
    misfits: list[Float] = []
    for shown in observed.shown_bars:
        for uv in shown.uv:
            ends = triangulate(after, uv)
            between = ends[1] - ends[0]
            size = float(np.linalg.norm(between))
            places.append(ends.mean(axis=0))
            misfits.append(between / size * (size - shown.bar.length))
    if isinstance(found.options.world, KeptByPoints):
        for name, position in found.options.world.positions_world.items():
            places.append(position)
            misfits.append(found.seats_world[name] - position)
    return np.array(places).reshape(-1, 3), np.array(misfits).reshape(-1, 3)
