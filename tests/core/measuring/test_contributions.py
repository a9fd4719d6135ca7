"""Named parts of the joint covariance: together they are it, and each is what its source makes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.probe_design import (
    MaterialExpansion,
    ProbeDesign,
    Temperature,
    TemperatureState,
    body_in_use,
    contact_force,
    load_design,
)
from ocmm_core.camera import Rig, project
from ocmm_core.documents import resource
from ocmm_core.measuring import (
    CAMERAS,
    IMAGE_NOISE,
    TIP_RADIUS,
    Contribution,
    MeasuredPoint,
    PartTemperature,
    ProbeState,
    contributions,
    factors_of,
    joint_factors,
)
from ocmm_core.measuring._contributions import FORCE, PART, PATTERN, PROBE, WARMTH, WEIGHT
from ocmm_core.tracking import ProbeBody, TipSensitivity, tip_sensitivity
from tests.core.measuring.test_temperature import point

TIPS = np.array([[20.0, 0.0, 10.0], [40.0, 5.0, 10.0], [30.0, 60.0, -20.0]])
WARM = PartTemperature(
    Temperature(25.0, 0.5, "test"), MaterialExpansion("steel", 11.5e-6, 1e-6), compensated=True
)


@pytest.fixture(scope="module")
def design(standard_probe: ProbeBody) -> ProbeDesign:
    return load_design(resource("designs", "standard.toml"), standard_probe)


def touched(rig: Rig, body: ProbeBody) -> tuple[list[MeasuredPoint], list[TipSensitivity]]:
    points, found = [], []
    for number, tip in enumerate(TIPS, start=1):
        leds = body.leds_probe - body.tip_probe + tip
        spots = np.stack([project(camera, leds) for camera in rig.cameras])
        touch = replace(point(tip, np.array([0.0, 0.0, 1.0])), number=number, spots=spots)
        points.append(touch)
        found.append(tip_sensitivity(spots, rig, body))
    return points, found


def parts_of(rig: Rig, body: ProbeBody, design: ProbeDesign) -> tuple[Contribution, ...]:
    temperature_state = TemperatureState()
    used = body_in_use(body, design, temperature_state)
    points, found = touched(rig, used)
    force = contact_force(design, body)
    return contributions(
        points, found, rig, used, force, WARM, ProbeState(design, temperature_state)
    )


def test_the_parts_are_the_joint_covariance(
    recommended: Rig, standard_probe: ProbeBody, design: ProbeDesign
) -> None:
    parts = parts_of(recommended, standard_probe, design)
    used = body_in_use(standard_probe, design, TemperatureState())
    points, found = touched(recommended, used)
    force = contact_force(design, standard_probe)
    whole = np.eye(3 * len(points) + 1)
    joint = joint_factors(points, found, recommended, used, force, WARM).covariance_of(whole)
    # Warmth and weight are taken off the probe's covariance and added again: rounding.
    assert factors_of(parts, len(points)).covariance_of(whole) == pytest.approx(
        joint, rel=1e-9, abs=1e-15
    )
    assert sum(part.covariance_of(whole) for part in parts) == pytest.approx(
        joint, rel=1e-9, abs=1e-15
    )


def test_points_that_show_other_leds_share_the_pattern_of_what_both_show(
    recommended: Rig, standard_probe: ProbeBody
) -> None:
    points, found = [], []
    for number, (tip, hidden) in enumerate(zip(TIPS, (None, 1, 3), strict=True), start=1):
        leds = standard_probe.leds_probe - standard_probe.tip_probe + tip
        spots = np.stack([project(camera, leds) for camera in recommended.cameras])
        if hidden is not None:
            # Not in the first camera alone, and two LEDs in the last point.
            spots[0, hidden - 1 : hidden + number - 2] = np.nan
        touch = replace(point(tip, np.array([0.0, 0.0, 1.0])), number=number, spots=spots)
        points.append(touch)
        found.append(tip_sensitivity(spots, recommended, standard_probe))
    assert len({np.count_nonzero(item.camera == 0) for item in found}) == 3
    parts = contributions(points, found, recommended, standard_probe)
    stated = next(part for part in parts if part.source is PATTERN).covariance_of(np.eye(10))[
        :9, :9
    ]
    noise = recommended.noise
    expected = np.zeros((9, 9))
    for i, one in enumerate(found):
        for j, other in enumerate(found):
            # An independent field on each sensor and axis, smooth over its length.
            together = one.camera[:, None] == other.camera
            apart = np.sum((one.uv[:, None] - other.uv) ** 2, axis=2)
            field = noise.pattern_px**2 * np.exp(-0.5 * apart / noise.pattern_length_px**2)
            for axis in range(2):
                left, right = one.by_spots[:, :, axis], other.by_spots[:, :, axis]
                expected[3 * i : 3 * i + 3, 3 * j : 3 * j + 3] += (
                    left @ (together * field) @ right.T
                )
    # The grid represents the field to a thousandth of a variance: half of that of its root.
    assert stated == pytest.approx(expected, abs=1e-3 * expected.max())


def test_every_source_has_its_name_once(
    recommended: Rig, standard_probe: ProbeBody, design: ProbeDesign
) -> None:
    parts = parts_of(recommended, standard_probe, design)
    assert [part.source for part in parts] == [
        IMAGE_NOISE, PATTERN, CAMERAS, PROBE, WARMTH, WEIGHT, TIP_RADIUS, FORCE, PART,
    ]  # fmt: skip
    assert [part.source.kind for part in parts].count("A") == 1
    for part in parts:
        matrix = part.covariance_of(np.eye(10))
        assert matrix.max() > 0.0, part.source.name
        floor = -1e-9 * float(np.abs(matrix).max())
        assert np.linalg.eigvalsh(matrix)[0] > floor, part.source.name


def test_the_calibration_of_the_probe_is_what_its_document_says(
    recommended: Rig, standard_probe: ProbeBody, design: ProbeDesign
) -> None:
    parts = parts_of(recommended, standard_probe, design)
    probe = next(part for part in parts if part.source is PROBE)
    assert probe.covariance == pytest.approx(standard_probe.geometry_covariance, abs=1e-15)


def test_what_a_part_gives_a_value_is_its_matrix_between_two_gradients(
    recommended: Rig, standard_probe: ProbeBody, design: ProbeDesign
) -> None:
    gradients = np.random.default_rng(0).normal(size=(2, 10))
    for part in parts_of(recommended, standard_probe, design):
        expected = gradients @ part.covariance_of(np.eye(10)) @ gradients.T
        assert part.covariance_of(gradients) == pytest.approx(expected, rel=1e-9, abs=1e-18), (
            part.source.name
        )
