"""Place errors of a tracker in the covariance of a swept probe."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.calibration.pivot._covariance import random_waves
from ocmm_core.camera import load_rig, locate_markers, place_shape, project
from ocmm_core.documents import resource

_APART_MM = 30.0


def test_place_errors_of_a_sweep_are_those_of_the_tracker() -> None:
    """N = 4,000 waves at two markers: 5 % are three standard deviations."""
    rig, rng = load_rig(resource("rigs", "tracker.toml")), np.random.default_rng(5)
    assert rig.markers is not None
    document = rig.markers.document
    places = np.array([[[0.0, 0.0, 0.0], [0.0, _APART_MM, 0.0]]])
    uv = np.stack([project(camera, places) for camera in rig.cameras], axis=1)
    waves = random_waves(rig, uv, rig.noise.pattern_px, 4000, rng)
    moved = np.array([locate_markers(rig.cameras, uv + wave)[0] for wave in waves]) - places[0]
    plain = (np.linalg.inv(place_shape(places[0], document)) @ moved[..., None])[..., 0]
    plain /= document.noise.place_sigma
    assert np.mean(plain**2) == pytest.approx(1.0, rel=0.05)
    alike = np.exp(-0.5 * (_APART_MM / document.noise.place_length) ** 2)
    assert np.mean(plain[:, 0] * plain[:, 1]) == pytest.approx(alike, abs=0.05)
