from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.camera import N_PARAMETERS, CameraModel, Rig, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.tracking import ProbeBody, load_probe
from ocmm_sim.scene import Part, load_part

LEDS = (
    (-50.0, 30.0, 118.0),
    (-50.0, -30.0, 228.0),
    (50.0, -30.0, 118.0),
    (55.0, 30.0, 228.0),
    (-20.0, 10.0, 150.0),
    (20.0, -10.0, 200.0),
    (0.0, 25.0, 130.0),
    (10.0, -20.0, 240.0),
)


@pytest.fixture(scope="session")
def thesis_rig() -> Rig:
    """Return the thesis rig with white noise of 0.0105 px and nothing else."""
    rig = load_rig(resource("rigs", "thesis.toml"))
    noise = type(rig.noise)(white_px=0.0105, pattern_px=0.0, pattern_length_px=20.0)
    return replace(rig, noise=noise)


@pytest.fixture(scope="session")
def recommended() -> Rig:
    return load_rig(resource("rigs", "recommended.toml"))


@pytest.fixture(scope="session")
def thesis_probe() -> ProbeBody:
    return load_probe(resource("probes", "thesis.toml"))


@pytest.fixture(scope="session")
def standard_probe() -> ProbeBody:
    return load_probe(resource("probes", "standard.toml"))


@pytest.fixture(scope="session")
def demo_part() -> Part:
    return load_part(resource("parts", "demo.toml"))


@pytest.fixture(scope="session")
def rig_of(thesis_rig: Rig) -> Callable[[int], Rig]:
    """Return a maker of rigs with n cameras on a line of 600 mm."""

    def make(n_cameras: int) -> Rig:
        cameras = tuple(
            _looking_at_origin(thesis_rig.cameras[0], f"camera {index}", np.array([x, -1000.0, z]))
            for index, (x, z) in enumerate(
                zip(np.linspace(-300.0, 300.0, n_cameras), (0.0, 40.0, -30.0, 20.0), strict=False)
            )
        )
        size = N_PARAMETERS * n_cameras
        return replace(
            thesis_rig,
            cameras=cameras,
            aliases=tuple(range(n_cameras)),
            parameter_covariance=np.zeros((size, size)),
        )

    return make


@pytest.fixture(scope="session")
def body_of(standard_probe: ProbeBody) -> Callable[..., ProbeBody]:
    """Return a maker of probes with n LEDs, flat or 30 mm out of plane."""

    def make(n_leds: int, *, planar: bool = False, tip: Float | None = None) -> ProbeBody:
        leds = np.array(LEDS[:n_leds])
        if planar:
            leds[:, 1] = 0.0
        return replace(
            standard_probe,
            leds_probe=leds,
            led_directions_probe=np.tile([0.0, -1.0, 0.0], (n_leds, 1)),
            tip_probe=np.zeros(3) if tip is None else tip,
            geometry_covariance=np.zeros((3 * n_leds + 3, 3 * n_leds + 3)),
        )

    return make


@pytest.fixture(scope="session")
def draw_poses() -> Callable[..., tuple[Float, Float]]:
    """Return a maker of rotations (n, 3, 3) and tips (n, 3), mm, in 400 x 200 x 400 mm."""

    def draw(
        rng: np.random.Generator, n: int, tilt_deg: tuple[float, float, float] = (45.0, 45.0, 10.0)
    ) -> tuple[Float, Float]:
        angles = rng.uniform(-1.0, 1.0, (n, 3)) * np.radians(tilt_deg)
        turns = []
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            turn = np.tile(np.eye(3), (n, 1, 1))
            turn[:, i, i] = turn[:, j, j] = np.cos(angles[:, axis])
            turn[:, j, i] = np.sin(angles[:, axis])
            turn[:, i, j] = -turn[:, j, i]
            turns.append(turn)
        tips = rng.uniform(-1.0, 1.0, (n, 3)) * [200.0, 100.0, 200.0]
        return turns[2] @ turns[1] @ turns[0], tips

    return draw


@pytest.fixture(scope="session")
def look() -> Callable[..., Float]:
    """Return a maker of spots (n, C, L, 2), px by LED, with white noise.

    With ``cone`` an LED that shines past a camera is not seen by it.
    """

    def see(
        rig: Rig, body: ProbeBody, rotations: Float, tips: Float, sigma: float,
        rng: np.random.Generator, *, cone: bool = False,
    ) -> Float:  # fmt: skip
        arms = body.leds_probe - body.tip_probe
        leds = np.einsum("nij,lj->nli", rotations, arms) + tips[:, None]
        uv = np.stack([project(camera, leds) for camera in rig.cameras], axis=1)
        noisy: Float = uv + sigma * rng.standard_normal(uv.shape)
        directions = np.einsum("nij,lj->nli", rotations, body.led_directions_probe)
        for c, camera in enumerate(rig.cameras if cone else ()):
            cosine = np.sum(unit(camera.centre_world - leds) * directions, axis=2)
            noisy[:, c][cosine < np.cos(body.emission_half_angle)] = np.nan
        return noisy

    return see


@pytest.fixture(scope="session")
def in_slots() -> Callable[..., Float]:
    """Return a maker of spots by slot (C, 8, 2) from spots by LED (C, L, 2) and slots (C, L)."""

    def put(uv: Float, slots: Float) -> Float:
        spots = np.full((len(uv), 8, 2), np.nan)
        for camera, of_leds in enumerate(slots):
            spots[camera, of_leds] = uv[camera]
        return spots

    return put


def _looking_at_origin(like: CameraModel, name: str, centre: Float) -> CameraModel:
    z = unit(-centre)
    x = unit(np.cross(z, [0.0, 0.0, 1.0]))
    rotation = np.stack([x, np.cross(z, x), z])
    pose = RigidTransform(rotation, -rotation @ centre)
    return replace(like, name=name, T_camera_from_world=pose)
