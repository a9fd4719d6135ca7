"""The 3-D view keeps probe, target and feature in its picture, until the user turns it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.acquisition.frames import AcquisitionState, AcquisitionStatus, StopReason
from ocmm_core.camera import load_rig
from ocmm_core.composition import RECOMMENDED_RIG
from ocmm_core.documents import resource
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import LiveView, StatusWord
from ocmm_core.tracking import load_probe
from ocmm_gui.views import PointView

KEY = Qt.Key


class Bench:
    """A view of the recommended rig and the standard probe, which the test carries about."""

    def __init__(self, qtbot: QtBot) -> None:
        self.rig = load_rig(RECOMMENDED_RIG)
        self.body = load_probe(resource("probes", "standard.toml"))
        self.view = PointView(self.rig, self.body)
        self.view.resize(600, 420)
        qtbot.addWidget(self.view)
        self.view.show()
        self.middle = self.rig.volume_world.mean(axis=0)

    def carry(self, tip_world: Float) -> bool:
        """Bring the ball to a place, and return whether the picture has it."""
        self.view.show_live(live_at(tip_world, tip_world - self.body.tip_probe))
        return self.view.shows(tip_world[None])


def live_at(tip_world: Float, origin_world: Float) -> LiveView:
    return LiveView(
        status=StatusWord.READY, reason="", tip_world=tip_world, tip_uncertainty=0.01,
        rotation_world_from_probe=np.eye(3), origin_world=origin_world,
        spots=np.full((2, 6, 2), np.nan), slot_leds=np.full((2, 6), -1), frame_counter=1,
        time_s=0.0, frames_per_second=8000.0,
        acquisition=AcquisitionStatus(
            AcquisitionState.RUNNING, StopReason.NONE, "", elapsed=0, good=0, late=0, lost=0, bad=0,
            frames=0, frames_lost=0, overrun=0,
        ),
    )  # fmt: skip


@pytest.fixture
def bench(qtbot: QtBot) -> Bench:
    return Bench(qtbot)


def test_the_ball_stays_in_the_picture_wherever_it_is_carried(bench: Bench) -> None:
    rng = np.random.default_rng(20)
    low, high = bench.rig.volume_world.min(axis=0), bench.rig.volume_world.max(axis=0)
    places = rng.uniform(low, high, (50, 3))
    for start, end in pairwise(places):
        for share in np.linspace(0.0, 1.0, 10):
            assert bench.carry(start + share * (end - start))


def test_the_view_stands_still_while_the_ball_is_in_it(bench: Bench) -> None:
    bench.carry(bench.middle)
    # A place that moves on the picture if the picture moves.
    corner = bench.rig.volume_world[:1]
    before = bench.view.projected(corner)
    for step in np.linspace(0.0, 10.0, 20):
        assert bench.carry(bench.middle + np.array([step, 0.0, 0.0]))
    np.testing.assert_array_equal(bench.view.projected(corner), before)


def test_the_view_of_the_user_wins_until_it_is_given_back(bench: Bench) -> None:
    bench.carry(bench.middle)
    QTest.keyClick(bench.view, KEY.Key_Left)
    for _ in range(12):
        QTest.keyClick(bench.view, KEY.Key_Plus)
    far = bench.middle + np.array([300.0, 0.0, 0.0])
    assert not bench.carry(far)
    bench.view.fit()
    assert bench.view.shows(far[None])
    assert bench.carry(bench.middle)
