"""Old views are shown only while they are current."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.acquisition.frames import AcquisitionState, AcquisitionStatus, FrameBlock, StopReason
from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import LiveView, StatusWord
from ocmm_core.measuring import PointOptions
from ocmm_core.station import _live
from ocmm_core.station._live import LiveState
from ocmm_core.tracking import ProbeBody, TrackingPipeline, load_probe
from ocmm_sim.scene import Part, VirtualRig, load_part
from tests.waiting import let_pass

RUNNING = AcquisitionStatus(
    AcquisitionState.RUNNING, StopReason.NONE, "", elapsed=0, good=0, late=0, lost=0, bad=0,
    frames=0, frames_lost=0, overrun=0,
)  # fmt: skip
STOPPED = replace(RUNNING, state=AcquisitionState.STOPPED)
BLOCK = 100
Parts = tuple[Rig, ProbeBody, Part]


class _Eye:
    """The live state of a virtual rig, shown blocks of its frames by the test."""

    def __init__(self, rig: Rig, body: ProbeBody, part: Part) -> None:
        self.virtual = VirtualRig(rig, body, part, (("BED", 2), ("SPHERE", 2)), 0, None, 1000)
        self.live = LiveState(rig, body, PointOptions(), None)
        self._pipeline = TrackingPipeline(rig, body)

    def see(self, first: int, *, hidden: bool = False) -> FrameBlock:
        """Show a block from a frame on, of the probe or of nothing."""
        block = self.virtual.frames(first, BLOCK)
        if hidden:
            block = replace(
                block, valid=np.zeros_like(block.valid), uv=np.full_like(block.uv, np.nan)
            )
        track = self._pipeline.process(block)
        self.live.push(block, track, self._pipeline, collecting=False)
        return block

    def now(self, acquisition: AcquisitionStatus = RUNNING) -> LiveView:
        """Return the present view."""
        return self.live.view(acquisition, "")


@pytest.fixture
def parts() -> Parts:
    return (
        load_rig(resource("rigs", "recommended.toml")),
        load_probe(resource("probes", "standard.toml")),
        load_part(resource("parts", "demo.toml")),
    )


@pytest.fixture
def eye(parts: Parts) -> _Eye:
    return _Eye(*parts)


def test_without_new_frames_neither_spots_nor_a_rate_are_shown(
    eye: _Eye, monkeypatch: pytest.MonkeyPatch
) -> None:
    eye.see(0)
    eye.see(BLOCK)
    seen = eye.now()
    assert seen.status is StatusWord.READY
    assert seen.frames_per_second > 0.0
    for gone in (eye.now(STOPPED), _when_it_waits_too_long(eye, monkeypatch)):
        assert gone.status is StatusWord.NOT_READY
        assert gone.tip_world is None
        assert not np.isfinite(gone.spots).any()
        assert gone.spots.shape == seen.spots.shape
        assert (gone.slot_leds < 0).all()
        assert gone.frames_per_second == 0.0


def _when_it_waits_too_long(eye: _Eye, monkeypatch: pytest.MonkeyPatch) -> LiveView:
    # The limit is shortened, not waited for.
    monkeypatch.setattr(_live, "_WAITS_S", 0.0)
    return eye.now()


def test_after_a_loss_the_uncertainty_is_that_of_the_new_place(eye: _Eye, parts: Parts) -> None:
    last = eye.virtual.n_frames // 2
    eye.see(0)
    before = eye.now()
    let_pass(1.1 * _live._UNCERTAINTY_EVERY_S)  # noqa: SLF001
    eye.see(BLOCK, hidden=True)
    # Whoever looks meanwhile keeps the number of the last place.
    assert eye.now().status is StatusWord.LOST
    eye.see(last)
    found = eye.now()
    alone = _Eye(*parts)
    alone.see(last)
    assert found.tip_uncertainty == pytest.approx(alone.now().tip_uncertainty, rel=1e-6)
    assert found.tip_uncertainty != pytest.approx(before.tip_uncertainty, rel=1e-3)


def test_outside_the_volume_the_coach_has_no_number(parts: Parts) -> None:
    rig, body, part = parts
    low, high = rig.volume_world
    small = replace(rig, volume_world=np.stack([low, low + 0.01 * (high - low)]))
    inside, outside = (_Eye(one, body, part) for one in (rig, small))
    for eye in (inside, outside):
        eye.see(0)
    assert outside.now().status is StatusWord.INACCURATE
    seen = inside.live.probe_now()
    assert seen is not None
    assert seen.good
    seen = outside.live.probe_now()
    assert seen is not None
    assert not seen.good
    assert not seen.lost
