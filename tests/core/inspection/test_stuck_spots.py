"""Spots that stick for one exposure or for a whole touch, seen by a session."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.measuring import MeasuredPoint, Refusal, Touch, TouchCollector
from ocmm_core.storage import JobFile
from ocmm_core.tracking import TrackingPipeline
from ocmm_sim.scene import VirtualRig, load_part
from tests.core.inspection.conftest import FRAME_RATE_HZ, Bench


def stuck_touches(bench: Bench, *, back: int, length: int, whole_camera: bool) -> tuple[Touch, ...]:
    """Return the bench's touches with spots that repeat those ``back`` exposures earlier.

    In each touch an LED in one camera, or all LEDs of it, for ``length`` exposures.
    """
    part = load_part(resource("parts", "demo.toml"))
    script = [(feature.name, feature.points) for feature in bench.plan.features]
    virtual = VirtualRig(bench.rig, bench.body, part, script, seed=1, frame_rate_hz=FRAME_RATE_HZ)
    frames = virtual.frames(0, virtual.n_frames)
    uv, rng = frames.uv.copy(), np.random.default_rng(38)
    for touch in bench.touches:
        first = int(np.searchsorted(frames.counter, touch.first_frame))
        # One exposure in the middle of the window, or all from the trigger on.
        first += len(touch.window) // 2 if length == 1 else 0
        old, camera = frames.uv[first - back], int(rng.integers(uv.shape[1]))
        seen = np.isfinite(old[camera, :, 0]) & np.isfinite(uv[first, camera, :, 0])
        stuck = seen if whole_camera else int(rng.choice(np.flatnonzero(seen)))
        uv[first : first + length, camera, stuck] = old[camera, stuck]
    collector = TouchCollector(1.0 / FRAME_RATE_HZ, SessionOptions().point)
    pipeline = TrackingPipeline(bench.rig, bench.body)
    return tuple(collector.push(pipeline.process(replace(frames, uv=uv))))


@pytest.mark.parametrize("back", [1, 50, 150])
@pytest.mark.parametrize("whole_camera", [False, True])
def test_spots_that_stick_for_one_exposure_move_no_point(
    bench: Bench, job: JobFile, back: int, whole_camera: bool
) -> None:
    """14 touches of each kind: all recorded, none refused."""
    session = bench.session(job)
    stuck = stuck_touches(bench, back=back, length=1, whole_camera=whole_camera)
    assert len(stuck) == len(bench.touches) == 14
    # Without one of 125 frames a mean of 20 µm of noise moves by 0.2 µm; five times that.
    for touch, honest in zip(stuck, bench.touches, strict=True):
        assert not np.array_equal(touch.window.tip_world, honest.window.tip_world)
        found = session.touches.record_touch(touch)
        with bench.job_at(bench.folder / "honest.ocmm") as other:
            expected = bench.session(other).touches.record_touch(honest)
        (bench.folder / "honest.ocmm").unlink()
        assert isinstance(found, MeasuredPoint), found
        assert isinstance(expected, MeasuredPoint)
        assert np.abs(found.tip_world - expected.tip_world).max() < 1e-3


@pytest.mark.parametrize("whole_camera", [False, True])
def test_spots_that_stick_for_a_touch_are_refused(
    bench: Bench, job: JobFile, whole_camera: bool
) -> None:
    """14 touches of each kind with the spots of 0.1 s before the trigger."""
    session = bench.session(job)
    stuck = stuck_touches(bench, back=50, length=200, whole_camera=whole_camera)
    found = [session.touches.record_touch(touch) for touch in stuck]
    assert len(found) == 14
    assert all(isinstance(one, Refusal) for one in found)
