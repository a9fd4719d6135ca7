from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.geometry import Float
from ocmm_core.tracking import FrameStatus, ProbeBody, TrackBlock, load_probe

SIGMA_MM = np.array([0.010, 0.040, 0.010])
"""Scatter of one frame: the depth is the least certain."""


@pytest.fixture(scope="session")
def recommended() -> Rig:
    return load_rig(resource("rigs", "recommended.toml"))


@pytest.fixture(scope="session")
def standard_probe() -> ProbeBody:
    return load_probe(resource("probes", "standard.toml"))


@pytest.fixture(scope="session")
def tracked() -> Callable[..., TrackBlock]:
    """Return a maker of tracked frames at 8 kHz with the tips (n, 3), mm, that are given."""

    def make(tips: Float, first: int = 0) -> TrackBlock:
        n = len(tips)
        counter = np.arange(first, first + n, dtype=np.int64)
        return TrackBlock(
            counter=counter,
            time_ns=counter * 125_000,
            flags=np.zeros(n, dtype=np.uint32),
            status=np.full(n, FrameStatus.OK, dtype=np.uint8),
            tip_world=np.array(tips, dtype=np.float64),
            tip_covariance=np.tile(np.diag(SIGMA_MM**2), (n, 1, 1)),
            rotation_world_from_probe=np.tile(np.eye(3), (n, 1, 1)),
            origin_world=np.array(tips, dtype=np.float64),
            chi2=np.full(n, 18.0),
            dof=np.full(n, 18, dtype=np.int64),
            seen=np.full((n, 2), 0b111111, dtype=np.uint64),
            uv=np.full((n, 2, 6, 2), 1000.0),
        )

    return make


@pytest.fixture(scope="session")
def scatter() -> Callable[..., Float]:
    """Return a maker of tips (n, 3), mm, at rest at the origin, with white noise."""

    def make(rng: np.random.Generator, n: int) -> Float:
        tips: Float = SIGMA_MM * rng.standard_normal((n, 3))
        return tips

    return make
