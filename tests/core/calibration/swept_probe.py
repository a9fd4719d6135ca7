"""A virtual probe swept about its ball, and a plain peer of the adjustment, for the tests."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ocmm_core.calibration.pivot import PivotSweep
from ocmm_core.camera import (
    N_PARAMETERS,
    Rig,
    distortion_jacobian,
    ideal_from_pixels,
    load_rig,
    project,
)
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, Pixels, Points3, rigid_fit, rotation_xyz
from ocmm_core.tracking import ProbeBody, load_probe
from ocmm_sim.scene import draw_pattern

SIGMA_PX = 0.0105
CONE_WORLD = np.array([0.0, 0.0, -150.0])


@cache
def rig() -> Rig:
    return load_rig(resource("rigs", "thesis.toml"))


@cache
def probe(name: str = "thesis") -> ProbeBody:
    return load_probe(resource("probes", f"{name}.toml"))


def attitudes(n: int, range_deg: float, rng: np.random.Generator) -> Float:
    """Return rotations (n, 3, 3): uniform tilts about X and Y, up to 10 degrees about Z."""
    angles = np.radians(rng.uniform(-1.0, 1.0, (n, 3)) * [range_deg, range_deg, 10.0])
    return np.stack([rotation_xyz(*row) for row in angles])


def waved_attitudes(n: int, range_deg: float, rng: np.random.Generator) -> Float:
    """Return rotations (n, 3, 3) of a hand that moves on slowly, a turn or two in 1000 frames."""
    phase = np.arange(n) / 500.0 + rng.random()
    angles = np.stack([np.sin(7.1 * phase), np.sin(5.3 * phase + 1.0), np.sin(2.9 * phase)], axis=1)
    return np.stack([rotation_xyz(*row) for row in np.radians(angles * [range_deg, range_deg, 10])])


def spots(
    cameras_of: Rig, body: ProbeBody, rotations: Float, balls: Float, rng: np.random.Generator
) -> Pixels:
    """Return noisy spots (n, C, L, 2), px; ``balls`` is (n, 3) or (3,), mm, world."""
    arms = body.leds_probe - body.tip_probe
    points = np.einsum("nij,lj->nli", rotations, arms) + np.broadcast_to(
        balls, (len(rotations), 3)
    )[:, None]  # fmt: skip
    uv = np.stack([project(camera, points) for camera in cameras_of.cameras], axis=1)
    noisy: Pixels = uv + SIGMA_PX * rng.standard_normal(uv.shape)
    return noisy


def patterned(uv: Pixels, rng: np.random.Generator) -> Pixels:
    """Return spots on sensors with individual patterns."""
    known = rig()
    found = uv.copy()
    for c, camera in enumerate(known.cameras):
        pattern = draw_pattern(known.noise, camera.width, camera.height, rng)
        place = uv[:, c] / pattern.step_px
        low = np.floor(place).astype(np.int64)
        g, h = (place - low)[..., 0], (place - low)[..., 1]
        column, row = low[..., 0], low[..., 1]
        for axis, nodes in enumerate(pattern.nodes):
            found[:, c, :, axis] += (
                (1 - g) * (1 - h) * nodes[row, column] + g * (1 - h) * nodes[row, column + 1]
                + (1 - g) * h * nodes[row + 1, column] + g * h * nodes[row + 1, column + 1]
            )  # fmt: skip
    return found


def sweep(
    n: int, range_deg: float, seed: int, cone: Float = CONE_WORLD, body: ProbeBody | None = None,
    true_rig: Rig | None = None,
) -> PivotSweep:  # fmt: skip
    rng = np.random.default_rng(seed)
    rotations = attitudes(n, range_deg, rng)
    return PivotSweep.even(
        spots(true_rig or rig(), body or probe(), rotations, cone, rng), SIGMA_PX
    )


def disturbed(known: Rig, rng: np.random.Generator) -> Rig:
    """Return the true cameras: those of the rig, with a draw from its covariance."""
    off = rng.multivariate_normal(
        np.zeros(len(known.parameter_covariance)), known.parameter_covariance, method="cholesky"
    )
    cameras = tuple(
        camera.perturbed(off[N_PARAMETERS * i : N_PARAMETERS * (i + 1)])
        for i, camera in enumerate(known.cameras)
    )
    return Rig(
        known.name, cameras, known.aliases, known.frame_rate_hz, known.noise, known.volume_world,
        known.parameter_covariance, known.identity,
    )  # fmt: skip


def tip_of(arms: Points3, body: ProbeBody) -> Float:
    """Return the tip in the frame of the body, (3,), mm."""
    return rigid_fit(arms, body.leds_probe)[1]


@dataclass(frozen=True, slots=True)
class Plain:
    """What `plain_adjust` found."""

    centre: Float
    arms: Points3
    cost: float


def plain_adjust(
    known: Rig, uv: Pixels, centre: Float, arms: Points3, rotations: Float, iterations: int
) -> Plain:
    """Adjust a sweep without gaps as one writes it in numpy: Schur complement of 3 x 3 blocks."""
    n, _, n_leds, _ = uv.shape
    k = 3 + 3 * n_leds
    ideals = [ideal_from_pixels(camera, uv[:, c]) for c, camera in enumerate(known.cameras)]
    jacobian = [
        np.array([[camera.sx], [camera.sy]]) / SIGMA_PX * distortion_jacobian(camera, ideal)
        for camera, ideal in zip(known.cameras, ideals, strict=True)
    ]
    cost = np.inf
    for _ in range(iterations):
        places = np.einsum("nij,lj->nli", rotations, arms)
        common, turns, off = [], [], []
        for camera, ideal, slope in zip(known.cameras, ideals, jacobian, strict=True):
            pose = camera.T_camera_from_world
            seen = pose.apply(places + centre)
            depth = seen[..., 2]
            predicted = camera.focal * seen[..., :2] / depth[..., None]
            pinhole = np.zeros((n, n_leds, 2, 3))
            pinhole[..., 0, 0] = pinhole[..., 1, 1] = camera.focal / depth
            pinhole[..., :, 2] = -predicted / depth[..., None]
            by_point = slope @ pinhole @ pose.rotation
            rows = np.zeros((n, n_leds, 2, k))
            rows[..., :3] = by_point
            by_arm = by_point @ rotations[:, None]
            for led in range(n_leds):
                rows[:, led, :, 3 + 3 * led : 6 + 3 * led] = by_arm[:, led]
            common.append(rows.reshape(n, -1, k))
            turns.append(np.cross(places[:, :, None], by_point).reshape(n, -1, 3))
            off.append(np.einsum("nlij,nlj->nli", slope, predicted - ideal).reshape(n, -1))
        a, b = np.concatenate(common, axis=1), np.concatenate(turns, axis=1)
        r = np.concatenate(off, axis=1)
        cost = float(np.sum(r**2))
        bt = b.transpose(0, 2, 1)
        inverse = np.linalg.inv(bt @ b)
        w, g = bt @ a, (bt @ r[..., None])[..., 0]
        gain = inverse @ w
        flat = a.reshape(-1, k)
        normal = flat.T @ flat - w.reshape(-1, k).T @ gain.reshape(-1, k)
        gradient = flat.T @ r.ravel() - np.einsum("nik,ni->k", gain, g)
        step = -np.linalg.lstsq(normal, gradient, rcond=1e-10)[0]
        own = -np.einsum("nij,nj->ni", inverse, g) - gain @ step
        rotations = _turns(own) @ rotations
        centre, arms = centre + step[:3], arms + step[3:].reshape(-1, 3)
    return Plain(centre, arms, cost)


def _turns(vectors: Float) -> Float:
    """Return the rotations (n, 3, 3) of rotation vectors (n, 3), rad."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = vectors.T
    o = np.zeros_like(x)
    k = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)
    safe = np.maximum(angle, 1e-12)
    turned: Float = np.eye(3) + np.sin(safe) / safe * k + (1.0 - np.cos(safe)) / safe**2 * (k @ k)
    return turned
