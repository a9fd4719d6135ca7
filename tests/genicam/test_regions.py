"""Parts of a sensor that show the probe, and the network card of an address."""

from __future__ import annotations

import numpy as np
import pytest

from ocmm_core.camera import load_rig, on_sensor, project
from ocmm_core.documents import resource
from ocmm_core.geometry import rotation_from_vector
from ocmm_core.tracking import load_probe
from ocmm_genicam import volume_window

_SHARE = np.array([[0.35], [0.65]])
"""Small part of the volume."""


@pytest.mark.parametrize("seed", range(3))
def test_every_led_of_a_probe_in_the_volume_is_in_the_window(seed: int) -> None:
    """N = 2000 poses, the ball anywhere in the volume, the probe in any direction."""
    rig = load_rig(resource("rigs", "recommended.toml"))
    probe = load_probe(resource("probes", "standard.toml"))
    low, high = rig.volume_world
    volume = low + _SHARE * (high - low)
    reach_mm = float(np.linalg.norm(probe.leds_probe - probe.tip_probe, axis=1).max())
    draws = np.random.default_rng(seed)
    balls = draws.uniform(volume[0], volume[1], (2000, 3))
    turns = draws.uniform(-np.pi, np.pi, (2000, 3))
    arms = probe.leds_probe - probe.tip_probe
    leds = np.concatenate(
        [
            ball + arms @ rotation_from_vector(turn).T
            for ball, turn in zip(balls, turns, strict=True)
        ]
    )
    for camera in rig.cameras:
        window = volume_window(camera, volume, reach_mm)
        uv = project(camera, leds)
        seen = uv[on_sensor(camera, uv)]
        first = np.array([window.left, window.top])
        last = first + np.array([window.width, window.height]) - 1
        assert ((seen >= first) & (seen <= last)).all()
        assert window.width * window.height < camera.width * camera.height
