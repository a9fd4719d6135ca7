"""Derivatives of the tip of a pose by all its inputs.

The pose minimises the reprojection residuals, so to first order a change of spots, cameras or LEDs
moves it by the pseudo-inverse of the residuals' derivative (implicit function theorem; sensitivity
coefficients in GUM 5.1.2). Errors are truth minus assumed value. Computed by the compiled
`kernels.answer_of_poses`, for all points of a job at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import Rig
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking._body import ProbeBody
from ocmm_core.tracking._pose import arm_jacobian, require_spots
from ocmm_core.tracking.kernels import ANSWERED, N_LENS, TOO_FEW, answer_of_poses


@dataclass(frozen=True, slots=True)
class TipSensitivity:
    """Tip of one set of spots and its derivatives; m spots were seen."""

    tip_world: Float
    """(3,), mm: converged estimate."""
    camera: Int
    """(m,) int64: camera of each spot."""
    uv: Float
    by_spots: Float
    """`uv`: (m, 2), px: the spots; `by_spots`: (3, m, 2), mm/px."""
    by_cameras: Float
    """(3, 14 C): in the order of `Rig.parameter_covariance`."""
    by_geometry: Float
    """(3, 3 L + 3): in the order of `ProbeBody.geometry_covariance`."""
    by_common: Float = field(default_factory=lambda: np.zeros((3, 0)))
    """(3, k), mm: other effects common to all points of a job, one independent standard deviation a
    column: the home of a reference body; (3, 0) without one.
    """


@dataclass(frozen=True, slots=True)
class PoseSensitivity:
    """Pose of one set of spots and its derivatives; m spots were seen."""

    rotation: Float
    origin: Float
    """`rotation`, `origin`: World from body, (3, 3) and (3,), mm: converged estimate."""
    camera: Int
    uv: Float
    """`camera`, `uv`: (m,) int64 and (m, 2), px: the spots."""
    by_spots: Float
    by_cameras: Float
    by_leds: Float
    """`by_spots`, `by_cameras`, `by_leds`: (6, 2 m), (6, 14 C) and (6, 3 L): of the pose increments
    of `pose.reprojection`."""


def tip_sensitivity(spots: Float, rig: Rig, body: ProbeBody) -> TipSensitivity:
    """Return the tip of spots (C, L, 2), px by LED number, and derivatives; or TrackingError."""
    return tip_sensitivities(spots[None], rig, body)[0]


def tip_sensitivities(spots: Float, rig: Rig, body: ProbeBody) -> tuple[TipSensitivity, ...]:
    """Return `tip_sensitivity` for n sets of spots (n, C, L, 2), px."""
    poses = _answered(spots, rig, body.leds_probe)
    tips = _tips_of(poses, body)
    found = []
    for i, m in enumerate(poses.counts):
        camera, uv = _listed(spots[i])
        slopes = tips.by_spots[i, :, : 2 * m].reshape(3, m, 2)
        found.append(
            TipSensitivity(
                tips.tips_world[i], camera, uv, slopes, tips.by_cameras[i], tips.by_geometry[i]
            )
        )
    return tuple(found)


@dataclass(frozen=True, slots=True)
class TipDerivatives:
    """Tips of n sets of spots and their derivatives, as arrays for many thousand poses."""

    answered: NDArray[np.bool_]
    """(n,): False if the spots leave the pose open; its rows are not defined."""
    tips_world: Float
    """(n, 3), mm."""
    by_spots: Float
    """(n, 3, 2 C L): the first 2 m columns are those of the seen spots, camera by camera and LED by
    LED, u before v; the others are 0."""
    by_cameras: Float
    by_geometry: Float
    """`by_cameras`, `by_geometry`: (n, 3, 14 C) and (n, 3, 3 L + 3), as in `TipSensitivity`."""


def tip_derivatives(spots: Float, rig: Rig, body: ProbeBody) -> TipDerivatives:
    """Return tips and derivatives of n sets of spots (n, C, L, 2), px, NaN if unseen."""
    return _tips_of(_answers(spots, rig, body.leds_probe), body)


def _tips_of(poses: _Answers, body: ProbeBody) -> TipDerivatives:
    arms = poses.rotations @ body.tip_probe
    to_tip = arm_jacobian(arms)
    return TipDerivatives(
        poses.status == ANSWERED,
        arms + poses.origins,
        to_tip @ poses.by_spots,
        to_tip @ poses.by_cameras,
        # The estimate moves with the LEDs against the true tip, and that with its own error.
        np.concatenate([to_tip @ poses.by_leds, -poses.rotations], axis=2),
    )


def pose_sensitivity(spots: Float, rig: Rig, leds: Float) -> PoseSensitivity:
    """Return the pose of LEDs (L, 3), mm, from spots (C, L, 2), px, with derivatives.

    Raises TrackingError if the spots do not determine a pose.
    """
    return pose_sensitivities(spots[None], rig, leds)[0]


def pose_sensitivities(spots: Float, rig: Rig, leds: Float) -> tuple[PoseSensitivity, ...]:
    """Return `pose_sensitivity` for n sets of spots (n, C, L, 2), px."""
    poses = _answered(spots, rig, leds)
    return tuple(
        PoseSensitivity(
            poses.rotations[i],
            poses.origins[i],
            *_listed(spots[i]),
            poses.by_spots[i, :, : 2 * m],
            poses.by_cameras[i],
            poses.by_leds[i],
        )
        for i, m in enumerate(poses.counts)
    )


@dataclass(frozen=True, slots=True)
class _Answers:
    """Outputs of the kernel for n sets of spots."""

    status: NDArray[np.uint8]
    located: Int
    counts: Int
    rotations: Float
    origins: Float
    by_spots: Float
    by_cameras: Float
    by_leds: Float


def _answers(spots: Float, rig: Rig, leds: Float) -> _Answers:
    n, shape = len(spots), (len(rig.cameras), len(leds), 2)
    require_spots(spots, rig, len(leds))
    found = _Answers(
        status=np.empty(n, np.uint8),
        located=np.empty(n, np.int64),
        counts=np.empty(n, np.int64),
        rotations=np.zeros((n, 3, 3)),
        origins=np.zeros((n, 3)),
        by_spots=np.zeros((n, 6, 2 * shape[0] * shape[1])),
        by_cameras=np.zeros((n, 6, N_LENS * shape[0])),
        by_leds=np.zeros((n, 6, leds.size)),
    )
    answer_of_poses(
        np.ascontiguousarray(spots), rig.packed(), np.ascontiguousarray(leds), found.status,
        found.located, found.counts, found.rotations, found.origins, found.by_spots,
        found.by_cameras, found.by_leds,
    )  # fmt: skip
    return found


def _answered(spots: Float, rig: Rig, leds: Float) -> _Answers:
    """Return `_answers`; raise TrackingError if spots do not determine a pose."""
    found = _answers(spots, rig, leds)
    failed = np.flatnonzero(found.status != ANSWERED)
    if not failed.size:
        return found
    if found.status[failed[0]] == TOO_FEW:
        raise TrackingError(
            "tracking.targets",
            "Only 1 LED is seen by two cameras."
            if found.located[failed[0]] == 1
            else f"Only {found.located[failed[0]]} LEDs are seen by two cameras.",
            "At least three are needed: turn the probe towards the cameras.",
        )
    raise TrackingError(
        "tracking.open",
        "The LEDs that are seen by two cameras stand in one line and leave the pose open.",
        "Turn the probe so that more LEDs face both cameras.",
    )


def _listed(spots: Float) -> tuple[Int, Float]:
    """Return camera (m,) and place (m, 2), px, of each visible spot of (C, L, 2)."""
    seen = np.isfinite(spots).all(axis=2)
    return np.nonzero(seen)[0].astype(np.int64), spots[seen]
