"""Bundle adjustment of a swept probe.

Unknowns: ball centre, arms to the LEDs, a rotation for each pose. Rotations of the body are a gauge
freedom; the solution nearest to the last state is chosen.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration.bundle import N_CAMERA
from ocmm_core.calibration.cameras import LensCamera
from ocmm_core.calibration.pivot._data import PivotSweep
from ocmm_core.calibration.pivot._kernel import move_turns, schur_reduce_rotations
from ocmm_core.camera import Rig, project
from ocmm_core.geometry import Float, Int, Points3, skew

FIRST_DAMPING = 1e-6
LARGEST_DAMPING = 1e6
RELATIVE_DECREASE = 1e-9
ENOUGH = 1e-4
"""Chi-square; smaller decreases correspond to steps of a hundredth of the standard deviations."""

LARGEST_CONDITION = 1e13
_STANDING_FOR_ALL = 500


@dataclass(frozen=True, slots=True)
class PivotState:
    """A swept probe."""

    centre: Float
    """(3,), mm, world: the ball."""
    arms: Points3
    """(L, 3), mm, body: from the ball to the LEDs."""
    rotations: Float
    """(n, 3, 3), world from body."""
    slacks: Points3
    """(n, 3), mm, world: ball position in each pose, less the centre."""

    @property
    def columns(self) -> int:
        """Return the number of common unknowns."""
        return 3 + self.arms.size

    def turns(self) -> Float:
        """Return the derivative of the common unknowns by rotation of the body frame, (k, 3)."""
        return np.vstack([np.zeros((3, 3)), *(-skew(arm) for arm in self.arms)])

    def points(self) -> Float:
        """Return the LED positions in every pose, (n, L, 3), mm, world."""
        places: Float = np.einsum("nij,lj->nli", self.rotations, self.arms)
        return places + (self.centre + self.slacks)[:, None]


@dataclass(frozen=True, slots=True)
class PivotNormals:
    """Reduced normal equations at a state."""

    cost: float
    """Chi-square; infinite for an impossible state."""
    normals: Float
    gradients: Float
    """`normals`, `gradients`: (B, k, k) and (B, k), block by block."""
    crossed: Float
    """(B, k, 14 C): rows coupled with the cameras, if requested."""
    factors: Float
    y: Float
    z: Float
    """`factors`, `y`, `z`: Factors for back-substitution of the poses."""
    scores: Float
    """(n, k): gradient of every pose."""


@dataclass(frozen=True, slots=True)
class PivotMinimum:
    """Result of an adjustment; as `bundle.BundleMinimum`."""

    state: PivotState
    cost: float
    iterations: int
    converged: bool


def normals_at(
    rig: Rig, sweep: PivotSweep, state: PivotState, slack_mm: float, damping: float = 0.0,
    blocks: Int | None = None, with_cameras: bool = False,
) -> PivotNormals:  # fmt: skip
    """Return the normal equations at ``state``, rotations eliminated.

    ``blocks`` (n,) of poses, default one; ``with_cameras``: coupled with centre and arms.
    """
    n, k = len(sweep.uv), state.columns
    width = k + N_CAMERA * len(rig.cameras) * with_cameras
    size = 6 if slack_mm > 0.0 else 3
    of = np.zeros(n, dtype=np.int64) if blocks is None else blocks
    count = int(of.max()) + 1 if n else 1
    normals, gradients = np.zeros((count, width, width)), np.zeros((count, k))
    factors, y, z = np.empty((n, size, size)), np.empty((n, size, width)), np.empty((n, size))
    scores = np.empty((n, k))
    cameras = np.stack([LensCamera(camera).packed() for camera in rig.cameras])
    cost = schur_reduce_rotations(
        cameras, state.arms, state.centre, np.ascontiguousarray(sweep.uv), sweep.weights,
        1.0 / slack_mm if slack_mm > 0.0 else 0.0, state.rotations, state.slacks, damping, of,
        normals, gradients, factors, y, z, scores,
    )  # fmt: skip
    crossed = normals[:, k:, :k].transpose(0, 2, 1)
    normals = normals[:, :k, :k]
    normals = normals + np.tril(normals, -1).transpose(0, 2, 1)
    return PivotNormals(
        cost if np.isfinite(cost) else np.inf, normals, gradients, crossed, factors, y, z, scores
    )


def adjust_pivot(
    rig: Rig, sweep: PivotSweep, start: PivotState, slack_mm: float = 0.0, max_iterations: int = 25
) -> PivotMinimum:
    """Return the chi-square minimum from ``start`` (Levenberg-Marquardt), or infinite cost."""
    state, damping = start, FIRST_DAMPING
    here = normals_at(rig, sweep, state, slack_mm, damping)
    converged, iteration = False, 0
    while iteration < max_iterations and np.isfinite(here.cost):
        step = -solve_pinned(here.normals[0], state.turns(), here.gradients[0], damping)
        predicted = -float(step @ here.gradients[0]) + float(np.sum(here.z**2))
        iteration += 1
        trial = _moved(state, here, step)
        there = normals_at(rig, sweep, trial, slack_mm, max(0.1 * damping, 1e-12))
        if there.cost <= here.cost:
            state, here, damping = trial, there, max(0.1 * damping, 1e-12)
        small = predicted <= RELATIVE_DECREASE * here.cost + ENOUGH
        if small and damping <= 1.0:
            converged = True
            break
        if here is not there:
            if damping >= LARGEST_DAMPING:
                break
            damping = max(10.0 * damping, 1e-4)
            here = normals_at(rig, sweep, state, slack_mm, damping)
    return PivotMinimum(state, here.cost, iteration, converged)


def solve_pinned(normal: Float, turns: Float, right: Float, damping: float = 0.0) -> Float:
    """Return the normal equations' solution with least rotation of the body frame."""
    scaled, scale, _ = pinned_normal(normal, turns)
    scaled.flat[:: len(scaled) + 1] += damping
    shape = (-1,) + (1,) * (right.ndim - 1)
    return np.linalg.solve(scaled, right / scale.reshape(shape)) / scale.reshape(shape)


def inverse_pinned(normal: Float, turns: Float) -> Float | None:
    """Return the covariance (k, k) of the common unknowns, or None if undetermined."""
    scaled, scale, pinned = pinned_normal(normal, turns)
    if not np.linalg.cond(scaled) < LARGEST_CONDITION:
        return None
    inverse: Float = (np.linalg.inv(scaled) - pinned) / scale / scale[:, None]
    return 0.5 * (inverse + inverse.T)


def residuals(rig: Rig, sweep: PivotSweep, state: PivotState) -> Float:
    """Return predicted minus observed (n, C, L, 2), px; NaN if unseen."""
    points = state.points()
    return np.stack([project(camera, points) for camera in rig.cameras], axis=1) - sweep.uv


def chi2_of_cameras(
    rig: Rig, sweep: PivotSweep, state: PivotState, slack_mm: float, draws: int, seed: int
) -> Float:
    """Return the increase of chi-square by drawn camera errors, (draws,).

    Noise-free spots of drawn cameras are adjusted with the calibrated ones, on a subset of frames.
    """
    some = np.arange(0, len(sweep.uv), max(1, len(sweep.uv) // _STANDING_FOR_ALL))
    times = len(sweep.uv) / len(some)
    state = replace(state, rotations=state.rotations[some], slacks=state.slacks[some])
    sweep = replace(sweep, uv=sweep.uv[some], sigma_px=sweep.sigma_px[some])
    rng = np.random.default_rng(seed)
    root = camera_error_root(rig)
    added = np.empty(draws)
    for draw in range(draws):
        seen = spots_of_cameras(rig, sweep, state, root @ rng.standard_normal(len(root)))
        here = normals_at(rig, seen, state, slack_mm)
        step = solve_pinned(here.normals[0], state.turns(), here.gradients[0])
        added[draw] = here.cost - np.sum(here.z**2) - here.gradients[0] @ step
    return times * np.maximum(added, 0.0)


def camera_error_root(rig: Rig) -> Float:
    """Return a root (14 C, 14 C) of the covariance of the camera parameters."""
    spread = np.linalg.eigh(rig.parameter_covariance)
    root: Float = spread.eigenvectors * np.sqrt(np.maximum(spread.eigenvalues, 0.0))
    return root


def spots_of_cameras(rig: Rig, sweep: PivotSweep, state: PivotState, off: Float) -> PivotSweep:
    """Return the sweep with the noise-free spots of cameras that are wrong by ``off``, (14 C,)."""
    points = state.points()
    errors = off.reshape(len(rig.cameras), N_CAMERA)
    uv = np.stack(
        [project(c.perturbed(own), points) for c, own in zip(rig.cameras, errors, strict=True)],
        axis=1,
    )
    return replace(sweep, uv=np.where(np.isnan(sweep.uv), np.nan, uv))


def pinned_normal(normal: Float, turns: Float) -> tuple[Float, Float, Float]:
    """Return the scaled normal matrix with its gauge pinned, the scale and the pin."""
    scale = np.sqrt(np.maximum(normal.diagonal(), 0.0))
    scale[scale == 0.0] = 1.0
    basis = np.linalg.qr(scale[:, None] * turns)[0]
    pinned: Float = basis @ basis.T
    return normal / scale / scale[:, None] + pinned, scale, pinned


def _moved(state: PivotState, here: PivotNormals, step: Float) -> PivotState:
    rotations, slacks = state.rotations.copy(), state.slacks.copy()
    move_turns(here.factors, here.y, here.z, step, rotations, slacks)
    return replace(
        state,
        centre=state.centre + step[:3],
        arms=state.arms + step[3:].reshape(-1, 3),
        rotations=rotations,
        slacks=slacks,
    )
