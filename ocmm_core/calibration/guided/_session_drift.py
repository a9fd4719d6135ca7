"""Detect whether a camera moved during a session, which one, and when.

Every resting position leaves residuals: spots minus those predicted by the pose. A camera that
turned leaves a pattern of them from one moment on, and a seat visited first and again at the end
appears displaced. Both are linear in the camera's three angles, so one weighted least squares fit
per camera and moment gives the improvement by such a step (generalised likelihood ratio; M.
Basseville, I. V. Nikiforov, Detection of Abrupt Changes, 1993, section 2.4). Effects shared by the
whole session (uncertainty of calibration and probe) are in the covariance, so that a calibration
error is not mistaken for a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, qr
from scipy.special import chdtri

from ocmm_core.calibration.guided._articulation import SEAT_SIGMA_MM
from ocmm_core.calibration.guided._repeats import shown_moment
from ocmm_core.calibration.guided._touches import RestingTouch, touch_of
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import N_PARAMETERS, Rig, projection_jacobians
from ocmm_core.geometry import Float, skew
from ocmm_core.tracking import ProbeBody, reprojection

STEP_CHANCE = 1e-3
"""False alarm probability of a session."""

_ANGLES = 3


@dataclass(frozen=True, slots=True)
class Rest:
    """The probe at rest somewhere."""

    touch: RestingTouch
    """The ball's centre with its sensitivities."""
    residuals: Float
    """(m - 6,): residuals of the pose, in directions orthogonal to all poses, in sigmas."""
    by_cameras: Float
    by_geometry: Float
    """`by_cameras`, `by_geometry`: (m - 6, 14 C) and (m - 6, 3 L + 3): their derivatives."""
    utc: str
    """ISO 8601 text."""


@dataclass(frozen=True, slots=True)
class CameraStep:
    """Step that explains a session best."""

    camera: int
    last: int
    first: int
    """`last`, `first`: Indices of the last rest before it and of the first one after it."""
    turn: Float
    """(3,), rad: of the camera, in its own frame."""
    gain: float
    limit: float
    """`gain`, `limit`: Decrease of chi-square with it, and the critical value at the stated
    probability over all cameras and moments.
    """

    @property
    def is_real(self) -> bool:
        """Return whether the step is significant."""
        return self.gain > self.limit


def rest_of(uv: Float, sigma_px: float, utc: str, rig: Rig, body: ProbeBody) -> Rest:
    """Return the rest of averaged spots (C, L, 2), px; TrackingError without a pose."""
    touch = touch_of(uv, sigma_px, rig, body)
    rotation = touch.rotation_world_from_probe
    origin = touch.tip_world - rotation @ body.tip_probe
    residuals, rows = reprojection(rig, body.leds_probe, uv, rotation, origin)
    across = np.asarray(qr(rows)[0][:, rows.shape[1] :].T / sigma_px, dtype=np.float64)
    by_cameras = np.zeros((len(residuals), N_PARAMETERS * len(rig.cameras)))
    by_geometry = np.zeros((len(residuals), 3 * body.n_leds + 3))
    row = 0
    for c, camera in enumerate(rig.cameras):
        seen = np.flatnonzero(np.isfinite(uv[c]).all(axis=1))
        leds = body.leds_probe[seen] @ rotation.T + origin
        d_point, d_parameters = projection_jacobians(camera, leds)
        part = slice(row, row + 2 * len(seen))
        by_cameras[part, c * N_PARAMETERS : (c + 1) * N_PARAMETERS] = d_parameters.reshape(
            -1, N_PARAMETERS
        )
        for led, slope in zip(seen, d_point @ rotation, strict=True):
            by_geometry[row : row + 2, 3 * led : 3 * led + 3] = slope
            row += 2
    return Rest(touch, across @ residuals, across @ by_cameras, across @ by_geometry, utc)


def camera_step(
    rests: Sequence[Rest],
    repeats: Sequence[tuple[int, int]],
    rig: Rig,
    body: ProbeBody,
    chance: float = STEP_CHANCE,
    seat_sigma_mm: float = SEAT_SIGMA_MM,
) -> CameraStep | None:
    """Return the turn of one camera at one moment that explains a session best, or None.

    Parameters
    ----------
    rests
        In order of time; None is returned for fewer than two.
    repeats
        Indices of rests in the same seat, first and again.
    chance
        Probability that the best step of an undisturbed session exceeds the limit, divided equally
        between cameras and moments.
    """
    n, cameras = len(rests), len(rig.cameras)
    if n < 2:
        return None
    # Columns of effects shared by the session, scaled to one standard deviation each.
    of_cameras, of_geometry = _root(rig.parameter_covariance), _root(body.geometry_covariance)
    turns = _turns(rig)
    seats = [_whitened(rests[i].touch, rests[k].touch, seat_sigma_mm) for i, k in repeats]
    parts = [
        # A rest sees all earlier steps, a repeat those between its first and second visit.
        (1, i, rest.by_cameras @ turns, rest.residuals,
         np.hstack([rest.by_cameras @ of_cameras, rest.by_geometry @ of_geometry]))
        for i, rest in enumerate(rests)
    ]  # fmt: skip
    for (first, again), (jacobian, shift, by_cameras, by_geometry) in zip(
        repeats, seats, strict=True
    ):
        shared = np.hstack([by_cameras @ of_cameras, by_geometry @ of_geometry])
        parts.append((first + 1, again, jacobian @ turns, shift, shared))
    k, size = turns.shape[1], parts[0][4].shape[1]
    shared_square, shared_data = np.eye(size), np.zeros(size)
    # Moment i: the step is before rest i = 1 .. n - 1.
    square, mixed, data = np.zeros((n, k, k)), np.zeros((n, k, size)), np.zeros((n, k))
    for low, high, rows, values, shared in parts:
        shared_square += shared.T @ shared
        shared_data += shared.T @ values
        felt = slice(low, high + 1)
        square[felt] += rows.T @ rows
        mixed[felt] += rows.T @ shared
        data[felt] += rows.T @ values
    factor = cho_factor(shared_square)
    limit = float(chdtri(_ANGLES, chance / (cameras * (n - 1))))
    best: CameraStep | None = None
    for moment in range(1, n):
        for c in range(cameras):
            own = slice(c * _ANGLES, (c + 1) * _ANGLES)
            cross = mixed[moment, own]
            information = square[moment][own, own] - cross @ cho_solve(factor, cross.T)
            score = data[moment, own] - cross @ cho_solve(factor, shared_data)
            # A camera without spots since then leaves its angles undetermined.
            turn = np.asarray(np.linalg.lstsq(information, score)[0], dtype=np.float64)
            gain = float(score @ turn)
            if best is None or gain > best.gain:
                best = CameraStep(c, moment - 1, moment, turn, gain, limit)
    return best


def step_finding(
    step: CameraStep | None, rests: Sequence[Rest], rig: Rig, remedy: str
) -> Finding | None:
    """Return the finding for a session in which a camera moved, or None."""
    if step is None or not step.is_real:
        return None
    name = rig.cameras[step.camera].name
    size = 1e6 * float(np.linalg.norm(step.turn))
    return Finding(
        "session.camera_moved",
        f"Camera '{name}' moved by about {size:.0f} urad between "
        f"{shown_moment(rests[step.last].utc)} and {shown_moment(rests[step.first].utc)} UTC.",
        remedy,
        refuses=True,
    )


def _turns(rig: Rig) -> Float:
    """Return the derivatives of all parameters by each camera's rotation, (14 C, 3 C)."""
    cameras = len(rig.cameras)
    turns = np.zeros((cameras, N_PARAMETERS, cameras, _ANGLES))
    for c, camera in enumerate(rig.cameras):
        turns[c, :3, c] = np.eye(3)
        # The centre stays: the translation turns with the camera.
        turns[c, 3:6, c] = -skew(camera.T_camera_from_world.translation)
    return turns.reshape(cameras * N_PARAMETERS, cameras * _ANGLES)


def _whitened(
    first: RestingTouch, again: RestingTouch, seat_sigma_mm: float
) -> tuple[Float, Float, Float, Float]:
    """Return step jacobian, shift and jacobians of shared effects, in units of their noise."""
    covariance = first.noise + again.noise + 2.0 * seat_sigma_mm**2 * np.eye(3)
    white = np.linalg.inv(np.linalg.cholesky(covariance))
    return (
        white @ again.by_cameras,
        white @ (again.tip_world - first.tip_world),
        white @ (again.by_cameras - first.by_cameras),
        white @ (again.by_geometry - first.by_geometry),
    )


def _root(covariance: Float) -> Float:
    """Return a square root, as columns, of a possibly singular covariance."""
    values, vectors = np.linalg.eigh(covariance)
    root: Float = vectors * np.sqrt(np.maximum(values, 0.0))
    return root
