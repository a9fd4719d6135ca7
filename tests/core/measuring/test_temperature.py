"""A part at 20 °C: scaled points, their uncertainty, refusals and words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.probe_design import MaterialExpansion, Temperature, TemperatureState
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.measuring import (
    Climate,
    MeasuredPoint,
    PartTemperature,
    check_part,
    climate_of_text,
    record_text,
    reported_points,
)
from ocmm_core.measuring._temperature import scale_movement

ALUMINIUM = MaterialExpansion("aluminium", 23.1e-6, 1.0e-6)
WARM = PartTemperature(Temperature(25.0, 0.5, "test"), ALUMINIUM, compensated=True)


def point(tip: Float, direction: Float, radius: float = 3.0) -> MeasuredPoint:
    return MeasuredPoint(
        number=1, feature="any", time_s=0.0, first_frame=0, last_frame=9, n_frames=10,
        tip_world=tip, random_covariance=1e-6 * np.eye(3), direction=direction, tip_radius=radius,
        rotation_world_from_probe=np.eye(3), spots=np.full((2, 4, 2), np.nan), chi2_per_dof=1.0,
        approach="trail",
    )  # fmt: skip


def ends(length: float, place: float) -> list[MeasuredPoint]:
    """Return touches of both ends of a block, somewhere along X."""
    left, right = np.array([-1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])
    return [
        point(np.array([place - 3.0, 0.0, 0.0]), left),
        point(np.array([place + length + 3.0, 0.0, 0.0]), right),
    ]


@pytest.mark.parametrize("place", [0.0, 700.0])
def test_a_length_is_reported_as_it_is_at_20_degrees(place: float) -> None:
    # A block of 400 mm at 20 °C is so long at 25 °C (ISO 1, first order).
    warm = 400.0 * (1.0 + 23.1e-6 * 5.0)
    first, second = reported_points(ends(warm, place), WARM)
    reported = (second.surface_world - first.surface_world)[0]
    # The square of 115 ppm is 0.005 um on 400 mm.
    assert reported == pytest.approx(400.0, abs=1e-5)


@pytest.mark.parametrize("place", [0.0, 700.0])
def test_the_uncertainty_of_the_scale_is_that_of_lengths(place: float) -> None:
    points = ends(400.0, place)
    by_points = np.zeros(7)
    # Length of the surface: difference of the ball centres less two radii.
    by_points[[0, 3, 6]] = -1.0, 1.0, -2.0
    sigma = WARM.scale_sigma * abs(float(by_points @ scale_movement(points)))
    # u_th^2 = (L dT u_alpha)^2 + (L alpha u_T)^2
    assert sigma == pytest.approx(400.0 * np.hypot(5.0 * 1e-6, 23.1e-6 * 0.5), rel=1e-9)


def test_what_is_not_compensated_stays_as_it_was_measured() -> None:
    points = ends(400.0, 0.0)
    for part in (PartTemperature(), replace(WARM, compensated=False)):
        assert all(a is b for a, b in zip(reported_points(points, part), points, strict=True))
        assert part.scale_sigma == 0.0


@pytest.mark.parametrize(
    ("part", "code"),
    [
        (replace(WARM, now=None), "temperature.part_unknown"),
        (replace(WARM, expansion=None), "temperature.expansion_unknown"),
        (replace(WARM, now=Temperature(77.0, 0.5, "")), "temperature.range"),
        (replace(WARM, now=Temperature(float("nan"), 0.5, "")), "temperature.range"),
        (replace(WARM, now=Temperature(25.0, 0.0, "")), "temperature.sigma"),
    ],
)
def test_compensation_of_a_part_that_is_not_known_is_refused(
    part: PartTemperature, code: str
) -> None:
    with pytest.raises(InputError) as caught:
        check_part(part)
    assert caught.value.code == code
    assert caught.value.remedy


def test_the_record_says_everything_and_comes_back() -> None:
    temperature_state = TemperatureState(
        Temperature(24.0, 0.3, "given"), Temperature(20.5, 0.2, "record"), True
    )
    climate = Climate(temperature_state, WARM, "a design ± document")
    assert climate_of_text(record_text(climate.record())) == climate
    assert climate_of_text(record_text(Climate().record())) == Climate()
    with pytest.raises(InputError, match="record of temperatures"):
        climate_of_text("{}")


def test_words_and_label_name_both_switches() -> None:
    temperature_state = TemperatureState(
        Temperature(24.0, 0.3, ""), Temperature(20.5, 0.2, ""), True
    )
    climate = Climate(temperature_state, WARM)
    assert "24.0 ± 0.3 °C, calibrated at 20.5 °C, compensated." in climate.summary
    assert "reported at 20 °C with 23.1 ± 1.0 ppm/K (aluminium)" in climate.summary
    assert climate.label.isascii()
    assert "," not in climate.label
    assert "not compensated" in Climate(temperature_state, replace(WARM, compensated=False)).summary
    assert "No temperature compensation" in Climate().summary
