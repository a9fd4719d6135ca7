"""Frames, a rig and a source to run with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock, SourceDescription
from ocmm_core.camera import CameraModel, Rig, SpotNoise
from ocmm_core.geometry import RigidTransform

MakeBlock = Callable[[int, int], FrameBlock]


def sample_block(start: int, count: int, n_cameras: int = 2) -> FrameBlock:
    """Return frames ``start`` to ``start + count - 1``; every number follows from the counter."""
    counter = np.arange(start, start + count, dtype=np.int64)
    slots = np.arange(n_cameras * 8 * 2, dtype=np.float64).reshape(n_cameras, 8, 2)
    uv = counter[:, None, None, None] + slots / 64.0
    valid = np.where(counter % 3 == 0, 0x7F, 0xFF)[:, None].repeat(n_cameras, axis=1)
    uv[counter % 3 == 0, :, 7] = np.nan
    return FrameBlock(
        counter=counter,
        time_ns=counter * 125_000 + 10**15,
        flags=(counter % 8).astype(np.uint32),
        valid=valid.astype(np.uint64),
        uv=uv,
    )


def camera(name: str, serial: int) -> CameraModel:
    return CameraModel(
        name, serial, 2048, 2048, 0.012, 25.0, 1.0, 1023.5, 1023.5, 0.0, 0.0, 0.0, 0.0,
        RigidTransform.identity(),
    )  # fmt: skip


@pytest.fixture
def make_block() -> MakeBlock:
    return sample_block


def sample_rig() -> Rig:
    return Rig(
        name="bench",
        cameras=(camera("left", 1001), camera("right", 1002)),
        aliases=(1, 2),
        frame_rate_hz=8000,
        noise=SpotNoise(white_px=0.01, pattern_px=0.01, pattern_length_px=50.0),
        volume_world=np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]]),
        parameter_covariance=np.zeros((28, 28)),
        identity="ab" * 32,
    )


@pytest.fixture
def rig() -> Rig:
    return sample_rig()


@pytest.fixture
def description() -> SourceDescription:
    return SourceDescription("bench", (1001, 1002), 125_000, 1_000_000, live=True, simulated=False)
