"""The operator touches the true surfaces with the true ball, and moves like a hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody
from ocmm_sim.scene import Part, VirtualRig
from ocmm_sim.scene._operator import Touches
from ocmm_sim.scene._surfaces import (
    Artefact,
    BoreEntry,
    ConeEntry,
    CylinderEntry,
    LineEntry,
    PlaneEntry,
    PointEntry,
    SphereEntry,
)

MakeRig = Callable[..., VirtualRig]


@pytest.fixture
def rig(make_rig: MakeRig, every_surface: Touches) -> VirtualRig:
    return make_rig(every_surface, seed=5)


def signed_distance(entry: Artefact, place: Float) -> float:
    """Return the distance of a place (3,) from a surface, positive outside the material."""
    offset = place - np.array(entry.point)
    axis = np.array(entry.direction)
    height = float(offset @ axis)
    radial = float(np.linalg.norm(offset - height * axis))
    if isinstance(entry, PlaneEntry | PointEntry):
        return height
    if isinstance(entry, SphereEntry):
        return float(np.linalg.norm(offset)) - 0.5 * entry.diameter
    if isinstance(entry, BoreEntry):
        assert -entry.depth < height < 0.0
        return 0.5 * entry.diameter - radial
    if isinstance(entry, CylinderEntry):
        assert 0.0 < height < entry.height
        return radial - 0.5 * entry.diameter
    if isinstance(entry, ConeEntry):
        slope = 0.5 * (entry.diameter - entry.top_diameter) / entry.height
        assert 0.0 < height < entry.height
        return (radial - 0.5 * entry.diameter + slope * height) / float(np.hypot(1.0, slope))
    assert isinstance(entry, LineEntry)
    assert 0.0 < height < entry.length
    return float(offset @ np.array(entry.normal))


def test_the_ball_touches_every_surface_at_its_true_radius(
    rig: VirtualRig, demo_part: Part, every_surface: Touches
) -> None:
    truth = rig.truth
    part_from_world = truth.T_world_from_part.inverse()
    assert len(truth.touches) == sum(count for _, count in every_surface)
    for touch in truth.touches:
        entry = demo_part.artefact(touch.feature)
        # Rounding of coordinates of a few hundred mm is about 1e-13 mm.
        assert signed_distance(entry, part_from_world.apply(touch.tip_world)) == pytest.approx(
            truth.tip_radius, abs=1e-9
        )
        assert abs(signed_distance(entry, part_from_world.apply(touch.surface_world))) < 1e-9
        np.testing.assert_allclose(
            touch.surface_world + truth.tip_radius * touch.normal_world, touch.tip_world, atol=1e-12
        )


def test_the_ball_slides_in_contact_but_for_hops(
    recommended: Rig, standard: ProbeBody, demo_part: Part
) -> None:
    """Stops, uneven pace and hops of 0.06 to 0.3 mm; the button is held throughout."""
    names = ("BED", "SPHERE", "BORE_A", "CYLINDER", "CONE")
    lifted = frames = 0
    for seed in range(3):
        rig = VirtualRig(
            recommended, standard, demo_part, [(name, 60) for name in names], seed,
            paths=dict.fromkeys(names, 1.0),
        )  # fmt: skip
        part_from_world = rig.truth.T_world_from_part.inverse()
        assert [touch.feature for touch in rig.truth.touches] == list(names)
        for touch in rig.truth.touches:
            motion = rig.motion(touch.first_frame, touch.last_frame - touch.first_frame)
            assert motion.button.all()
            assert motion.in_contact.all()
            entry = demo_part.artefact(touch.feature)
            heights = np.array([
                signed_distance(entry, tip) for tip in part_from_world.apply(motion.tip_world[::40])
            ]) - rig.tip_radius  # fmt: skip
            # Straight steps of 0.1 mm cut the smallest surface, of 11 mm, by 0.1 um.
            assert heights.min() > -2e-4
            assert heights.max() < 0.7
            lifted += int(np.sum(heights > 0.02))
            frames += len(heights)
            way = np.linalg.norm(np.diff(motion.tip_world[::40], axis=0), axis=1)
            assert way.sum() > 60.0
            assert way.min() < 0.02 < way.max()
    assert 0.001 < lifted / frames < 0.05


def test_points_on_planes_lie_in_the_free_areas(rig: VirtualRig, demo_part: Part) -> None:
    part_from_world = rig.truth.T_world_from_part.inverse()
    for touch in rig.truth.touches:
        entry = demo_part.artefact(touch.feature)
        if isinstance(entry, PlaneEntry):
            u, v, w = part_from_world.apply(touch.surface_world) - np.array(entry.point)
            assert abs(w) < 1e-9
            assert any(u0 < u < u1 and v0 < v < v1 for u0, v0, u1, v1 in entry.areas)


def test_the_ball_rests_while_the_hand_trembles(rig: VirtualRig) -> None:
    for touch in rig.truth.touches:
        motion = rig.motion(touch.first_frame, touch.last_frame - touch.first_frame + 1)
        assert motion.in_contact.all()
        np.testing.assert_allclose(
            motion.tip_world, np.broadcast_to(touch.tip_world, motion.tip_world.shape), atol=1e-9
        )
        turn = motion.rotation_world_from_probe @ motion.rotation_world_from_probe[0].T
        angle = np.arccos(np.clip(0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0), -1.0, 1.0))
        assert 2e-4 < angle.max() < 2e-2
        assert len(motion.tip_world) == pytest.approx(0.37 * 8000, abs=2)


def test_the_ball_bounces_a_little_on_contact_and_never_enters_the_material(
    rig: VirtualRig,
) -> None:
    for touch in rig.truth.touches:
        start = int(np.ceil(touch.contact_s * 8000.0))
        motion = rig.motion(start, touch.first_frame - start)
        lift = (motion.tip_world - touch.tip_world) @ touch.normal_world
        assert lift.min() > -1e-9
        assert 0.005 < lift.max() < 0.05


def test_the_last_millimetres_before_contact_run_along_the_normal(rig: VirtualRig) -> None:
    for touch in rig.truth.touches:
        start = int(touch.contact_s * 8000.0) - 1200
        trail = rig.motion(start, 1200).tip_world - touch.tip_world
        height = trail @ touch.normal_world
        aside = np.linalg.norm(trail - height[:, None] * touch.normal_world, axis=1)
        near = height < 3.0
        assert height.min() > -1e-6
        assert height.max() > 3.0
        # What remains is the tremor of the hand in free air, 0.1 mm per axis.
        assert aside[near].max() < 0.35


def test_the_motion_is_smooth_from_home_to_home(rig: VirtualRig) -> None:
    tip = rig.motion(0, rig.n_frames).tip_world
    speed = np.linalg.norm(np.diff(tip, axis=0), axis=1) * 8000.0
    assert speed.max() < 800.0, "mm/s: a quick hand"
    change = np.abs(np.diff(speed)) * 8000.0
    assert change.max() < 2.5e4, "mm/s^2: no jump in speed"
    rest = 4000
    np.testing.assert_allclose(tip[:rest], np.broadcast_to(tip[0], (rest, 3)), atol=1e-9)
    np.testing.assert_allclose(tip[-rest + 1 :], np.broadcast_to(tip[0], (rest - 1, 3)), atol=1e-9)


def test_the_handle_leans_out_of_the_material_and_keeps_facing_the_cameras(
    rig: VirtualRig, demo_part: Part
) -> None:
    for touch in rig.truth.touches:
        rotation = rig.motion(touch.first_frame, 1).rotation_world_from_probe[0]
        handle = rotation[:, 2]
        tilt = np.degrees(np.arccos(handle[2]))
        assert tilt < 40.0
        if isinstance(demo_part.artefact(touch.feature), BoreEntry):
            assert tilt < 10.0, "the stylus must not meet the mouth of the bore"
        else:
            assert handle @ touch.normal_world > 0.2, "the stylus must not pass through the part"
        assert rotation[:, 1] @ [0.0, 1.0, 0.0] > np.cos(np.radians(40.0))


def test_the_same_seed_touches_the_same_places_and_another_one_others(make_rig: MakeRig) -> None:
    first, again, other = (
        make_rig([("BED", 4), ("BORE_A", 4)], seed=seed).truth.touches for seed in (3, 3, 4)
    )
    for a, b, c in zip(first, again, other, strict=True):
        np.testing.assert_array_equal(a.tip_world, b.tip_world)
        assert not np.allclose(a.tip_world, c.tip_world, atol=1e-3)


def test_spheres_are_touched_from_the_pole_to_the_equator(make_rig: MakeRig) -> None:
    for count in (6, 17):
        rig = make_rig([("SPHERE", count)])
        axis = rig.truth.features_world["SPHERE"].direction
        heights = sorted(float(touch.normal_world @ axis) for touch in rig.truth.touches)
        assert heights[0] == pytest.approx(0.0, abs=1e-9)
        assert heights[-1] == pytest.approx(1.0, abs=1e-9)
        assert len({round(height, 6) for height in heights}) == (3 if count == 6 else 4)
