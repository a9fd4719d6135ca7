"""Points and a job head to store."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobHead

HEAD = JobHead(
    job_uuid="0d2b2d3c-55b5-4f2c-9b5e-0c8f6c0d1a11",
    created_utc="2024-05-06T07:08:09.123456+00:00",
    software_version="0.1.0",
    operator="Zoë Müller",
    part="Block",
    serial="4711",
    plan_text='schema = "ocmm.plan/1"\r\n',
    rig_text='schema = "ocmm.rig/1"\n',
    probe_text='schema = "ocmm.probe/1"\n',
)


def sample_point(number: int) -> MeasuredPoint:
    """Return a point whose every number follows from ``number``; some spots are not seen."""
    rng = np.random.default_rng(number)
    spots = rng.normal(1000.0, 300.0, (2, 5, 2))
    spots[0, 3] = np.nan
    spots[1, 0] = -0.0
    return MeasuredPoint(
        number=number,
        feature="BORE-1",
        time_s=float(rng.random()) * 1e4,
        first_frame=800 * number,
        last_frame=800 * number + 399,
        n_frames=400,
        tip_world=rng.normal(0.0, 300.0, 3),
        random_covariance=rng.normal(0.0, 1e-6, (3, 3)),
        direction=rng.normal(0.0, 1.0, 3),
        tip_radius=1.5003,
        rotation_world_from_probe=rng.normal(0.0, 1.0, (3, 3)),
        spots=spots,
        chi2_per_dof=float(rng.random()),
        approach="trail",
    )


@pytest.fixture
def make_point() -> Callable[[int], MeasuredPoint]:
    return sample_point


@pytest.fixture
def head() -> JobHead:
    return HEAD
