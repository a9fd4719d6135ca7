"""Contribution of the hand's force to points, against a probe that really bends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.probe_design import ContactForce, contact_force, load_design
from ocmm_core.camera import Rig, project
from ocmm_core.documents import resource
from ocmm_core.geometry import Float, rotation_xyz
from ocmm_core.measuring import MeasuredPoint, contributions, joint_factors
from ocmm_core.measuring._contributions import FORCE
from ocmm_core.tracking import ProbeBody, TipSensitivity, tip_sensitivity
from tests.core.measuring.test_temperature import point

TIPS = np.array([[20.0, 0.0, 10.0], [40.0, 0.0, 10.0]])
SIDES = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
"""Both sides of a bore, probed square to the panel's weak side."""


@pytest.fixture(scope="module")
def contact(standard_probe: ProbeBody) -> ContactForce:
    return contact_force(
        load_design(resource("designs", "standard.toml"), standard_probe), standard_probe
    )


def turned() -> Float:
    """Return the attitude in which the panel's weak side lies along X."""
    return rotation_xyz(0.2, 0.1, np.radians(30.0))


def touches(rig: Rig, body: ProbeBody) -> tuple[list[MeasuredPoint], list[TipSensitivity]]:
    points, found = [], []
    for tip, side in zip(TIPS, SIDES, strict=True):
        leds = (body.leds_probe - body.tip_probe) @ turned().T + tip
        spots = np.stack([project(camera, leds) for camera in rig.cameras])
        points.append(replace(point(tip, side), rotation_world_from_probe=turned(), spots=spots))
        found.append(tip_sensitivity(spots, rig, body))
    return points, found


def test_the_stated_covariance_is_that_of_a_probe_that_bends(
    recommended: Rig, standard_probe: ProbeBody, contact: ContactForce
) -> None:
    body = standard_probe
    stiff = replace(contact, largest_n=200.0)
    points, found = touches(recommended, body)
    row = []
    for tip, side in zip(TIPS, SIDES, strict=True):
        moved = (stiff.by_force @ (turned().T @ side) * stiff.largest_n).reshape(-1, 3)
        # The ball stays in place; the LEDs move relative to it.
        bent = body.leds_probe + moved[:-1] - moved[-1] - body.tip_probe
        spots = np.stack(
            [project(camera, bent @ turned().T + tip) for camera in recommended.cameras]
        )
        row.append(tip_sensitivity(spots, recommended, body).tip_world - tip)
    # Mean square of forces that are as likely from 0 to F: F^2 / 3.
    expected = np.concatenate(row) ** 2 / 3.0
    parts = contributions(points, found, recommended, body, stiff)
    force = next(part for part in parts if part.source is FORCE)
    stated = force.covariance_of(np.eye(3 * len(points) + 1))[:-1, :-1]
    assert np.diag(stated) == pytest.approx(expected, rel=0.02, abs=1e-9)
    # Both sides give way to the outside: a bore comes out too large, and that does not average.
    across = np.array([1.0, 0, 0, -1.0, 0, 0])
    common = float(across @ stated @ across)
    apart = float(across @ np.diag(np.diag(stated)) @ across)
    assert common > 1.5 * apart


def test_without_a_design_nothing_is_added(
    recommended: Rig, standard_probe: ProbeBody, contact: ContactForce
) -> None:
    points, found = touches(recommended, standard_probe)
    whole = np.eye(3 * len(points) + 1)
    plain = joint_factors(points, found, recommended, standard_probe)
    with_force = joint_factors(points, found, recommended, standard_probe, contact)
    added = with_force.covariance_of(whole) - plain.covariance_of(whole)
    assert np.linalg.eigvalsh(added)[0] > -1e-18
    # Less than a micrometre at one newton: documented as negligible, and counted all the same.
    assert 1e-5 < np.sqrt(added[:-1, :-1].diagonal().max()) < 5e-4
