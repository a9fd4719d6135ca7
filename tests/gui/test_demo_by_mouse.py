"""The demonstration part, measured by mouse alone in the window.

In the short form by the plan of three features, which has the leaned probe as well.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from ocmm_core.geometry import Float
from ocmm_sim.scene import sample
from ocmm_sim.sources import true_values
from tests.gui.mouse_at_part import Mouse
from tests.host import HANG_MS, long_form

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

LEANED = "SPHERE"
"""Touched with a leaned probe, which must not change the result."""
_QUARTER_PX = 196
"""A quarter turn of the view: it turns 0.008 rad a pixel."""
_SIDES = 4
_LEANS = (Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down)
_BACK = (Qt.Key.Key_Right, Qt.Key.Key_Left, Qt.Key.Key_Down, Qt.Key.Key_Up)


class _Inspector:
    """Touches visible faces; turns picture or probe if the face is hidden."""

    def __init__(self, mouse: Mouse) -> None:
        self.mouse = mouse
        self.turned = self.leaned = 0

    def lean(self, key: Qt.Key) -> None:
        """Lean the probe by 15°."""
        for _ in range(3):
            QTest.keyClick(self.mouse.view, key)
        self.leaned += 1

    def touch(self, place: Float, normal: Float) -> None:
        """Take a point there; on a refusal, lean the probe and touch again."""
        if self.mouse.tries(place, normal):
            return
        for key, back in zip(_LEANS, _BACK, strict=True):
            self.lean(key)
            done = self.mouse.tries(place, normal)
            self.lean(back)
            if done:
                return
        pytest.fail(f"No point at {place}: {self.mouse.bench.notices.kept()[-1:]}")

    def measure(self, name: str) -> None:
        """Touch a feature all over."""
        job = self.mouse.bench.built.station.job
        if name == LEANED:
            self.lean(_LEANS[0])
        entry = self.mouse.part.artefact(name)
        contacts = sample(entry, job.view().feature(name).needed, np.random.default_rng(7))
        left = list(zip(contacts.points, contacts.normals, strict=True))
        for _ in range(_SIDES):
            for one in [one for one in left if self.mouse.sees(*one)]:
                self.touch(*one)
                left = [other for other in left if other is not one]
            if not left:
                break
            self.turned += 1
            self.mouse.turn_view(_QUARTER_PX, 0)
        assert not left, f"{name}: no side shows {[place for place, _ in left]}"
        if name == LEANED:
            self.lean(_BACK[0])
        self.mouse.qtbot.waitUntil(lambda: job.view().active != name, timeout=HANG_MS)


@pytest.mark.slow
def test_the_demo_part_measured_by_mouse_agrees_with_the_truth_within_u(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    plan = "demo.toml" if long_form() else "quick.toml"
    bench = open_window(speed=8.0, stay=True, plan=plan, start=False, led=True)
    inspector = _Inspector(Mouse(qtbot, bench))
    inspector.mouse.take_over()
    bench.bridge.start()
    job = bench.built.station.job
    while not job.view().complete:
        inspector.measure(job.view().active)

    truth = true_values(job.plan, inspector.mouse.part)
    view = job.view()
    assert len(view.characteristics) == len(job.plan.characteristics)
    shares = {}
    for one in view.characteristics:
        assert one.measured is not None, (one.name, one.note)
        assert one.uncertainty is not None, one.name
        shares[one.name] = abs(one.measured - truth[one.name]) / one.uncertainty
    # U is 95 %, and no two hands move alike, so chance is allowed for: with an exact U 4 or more of
    # 13 results lie beyond it in 3 of 1000 runs, and 1.5 U are 3 sigma.
    assert max(shares.values()) <= 1.5, shares
    assert sum(share > 1.0 for share in shares.values()) <= 3, shares
    assert view.simulated
