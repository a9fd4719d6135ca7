"""Shares of one thermometer in cameras and part are added with their signs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.probe_design import MaterialExpansion, Temperature
from ocmm_core.camera import ThermalShare
from ocmm_core.measuring import PartTemperature
from ocmm_core.measuring._contributions import (
    CAMERAS,
    PART,
    THERMOMETER,
    Contribution,
    _by_thermometer,
)
from tests.core.calibration.waved_probe import probe, rig


def test_one_thermometer_cancels_between_bar_and_part() -> None:
    """Cameras scaled by a steel bar and a steel part at one thermometer: nothing remains."""
    steel, sigma = 11.5e-6, 0.5
    share = ThermalShare("T-1", sigma, np.array([1.0]))
    cameras = replace(rig(), thermal=share)
    now = Temperature(22.0, sigma, "T-1")
    part = PartTemperature(now, MaterialExpansion("steel", steel, 0.0), compensated=True)
    length = np.array([[400.0]])
    found = [
        Contribution(CAMERAS, steel * length, np.array([[sigma**2]])),
        Contribution(PART, length, np.array([[part.scale_sigma**2]])),
    ]
    one = np.array([[1.0]])
    alone = sum(float(part_.covariance_of(one)[0, 0]) for part_ in found)
    assert np.sqrt(alone) == pytest.approx(np.sqrt(2.0) * 400.0 * steel * sigma)
    shared = _by_thermometer(found, [], cameras, probe(), part)
    assert {one_.source for one_ in shared} == {CAMERAS, PART, THERMOMETER}
    assert sum(float(part_.covariance_of(one)[0, 0]) for part_ in shared) == pytest.approx(
        0.0, abs=1e-12
    )
    other = replace(part, now=replace(now, origin="T-2"))
    apart = _by_thermometer(found, [], cameras, probe(), other)
    assert sum(float(part_.covariance_of(one)[0, 0]) for part_ in apart) == pytest.approx(alone)
