"""What eight frames side by side must not change, and what one step leaves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.camera import Rig
from ocmm_core.errors import TrackingError
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.tracking import IdentifyOptions, ProbeBody, identify, solve
from ocmm_core.tracking.kernels import LOST, MAX_TIP_SIGMA, OK, allocate, solve_frames
from tests.core.tracking.plain_pose import solve_reference

SIGMA = 0.0317
"""px: white noise and pattern of one frame."""
Draw = Callable[..., tuple[Float, Float]]
Look = Callable[..., Float]


@pytest.mark.numerics
def test_a_frame_does_not_know_its_neighbours(
    thesis_rig: Rig, standard_probe: ProbeBody, draw_poses: Draw, look: Look
) -> None:
    """The same to the last bit for any number and content of neighbours."""
    rng = np.random.default_rng(11)
    uv = look(thesis_rig, standard_probe, *draw_poses(rng, 8), SIGMA, rng)
    # Spots of other LEDs, which no pose explains: their fit takes many more Newton steps.
    uv[[1, 4]] = uv[[1, 4]][:, :, ::-1] + 40.0 * rng.standard_normal(uv[[1, 4]].shape)
    uv[6] = np.nan
    together = solve(uv, thesis_rig, standard_probe, SIGMA)
    for first, last in ((0, 1), (1, 3), (2, 5), (5, 8)):
        part = solve(uv[first:last], thesis_rig, standard_probe, SIGMA)
        for name in PARTS:
            assert getattr(part, name).tobytes() == getattr(together, name)[first:last].tobytes()
    assert together.status[6] == LOST


PARTS = ("status", "tip_world", "tip_covariance", "rotation_world_from_probe", "chi2", "dof")


def test_the_covariance_before_the_last_step_is_that_after_it(
    thesis_rig: Rig, standard_probe: ProbeBody, draw_poses: Draw, look: Look
) -> None:
    """One more step forms it at the end of the first one."""
    rng = np.random.default_rng(12)
    uv = look(thesis_rig, standard_probe, *draw_poses(rng, 500), SIGMA, rng)
    found = []
    for steps in (1, 2):
        outputs = allocate(len(uv))
        solve_frames(
            uv, thesis_rig.packed(), standard_probe.leds_probe, standard_probe.tip_probe, SIGMA,
            MAX_TIP_SIGMA, steps, *outputs,
        )  # fmt: skip
        assert (outputs[0] == OK).all()
        found.append(np.sqrt(np.trace(outputs[2], axis1=1, axis2=2)))
    # The first step turns by the noise of the rigid fit, mrad at most: the uncertainty may be wrong
    # by that share, and it is determined only to per cent.
    assert np.abs(found[0] / found[1] - 1.0).max() < 5e-3
    assert np.abs(found[0] / found[1] - 1.0).max() > 0.0


def test_a_light_behind_a_camera_is_lost(
    thesis_rig: Rig, standard_probe: ProbeBody, draw_poses: Draw, look: Look
) -> None:
    """Its pinhole equations also hold behind the camera: spots alone do not decide."""
    rng = np.random.default_rng(13)
    # A camera turned by half a turn about its x axis looks the other way: everything is behind it.
    cameras = []
    for camera in thesis_rig.cameras:
        pose = camera.T_camera_from_world
        half = np.diag([1.0, -1.0, -1.0])
        cameras.append(
            replace(
                camera,
                T_camera_from_world=RigidTransform(half @ pose.rotation, half @ pose.translation),
                k1=0.0,
                k2=0.0,
                p1=0.0,
                p2=0.0,
            )
        )
    behind = replace(thesis_rig, cameras=tuple(cameras))
    front = replace(
        thesis_rig,
        cameras=tuple(
            replace(camera, k1=0.0, k2=0.0, p1=0.0, p2=0.0) for camera in thesis_rig.cameras
        ),
    )
    uv = look(front, standard_probe, *draw_poses(rng, 9), 0.0, rng)
    assert (solve(uv, front, standard_probe, SIGMA).status == OK).all()
    # X / Z: with Y and Z turned round, X / Z changes its sign and Y / Z does not.
    mirrored = uv.copy()
    for c, camera in enumerate(front.cameras):
        mirrored[:, c, :, 0] = 2.0 * camera.u0 - uv[:, c, :, 0]
    for method in (solve, solve_reference):
        assert (method(mirrored, behind, standard_probe, SIGMA).status == LOST).all()


@pytest.mark.parametrize("shape", [(2, 4, 2), (3, 6, 2), (2, 6, 3), (2, 6), (6, 2)])
def test_spots_of_another_rig_or_body_are_refused(
    shape: tuple[int, ...], thesis_rig: Rig, standard_probe: ProbeBody
) -> None:
    """A compiled loop would read and write beyond them."""
    assert standard_probe.leds_probe.shape == (6, 3)
    with pytest.raises(TrackingError, match=f"Spots of {' x '.join(map(str, shape))} numbers"):
        solve(np.full((1, *shape), np.nan), thesis_rig, standard_probe, SIGMA)
    if shape[:1] != (2,) or shape[2:] != (2,):
        with pytest.raises(TrackingError, match="Spots of"):
            identify(thesis_rig, standard_probe, np.full(shape, np.nan), IdentifyOptions(SIGMA))
