"""The window with a reference body: named in the images, counted, and lost in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pytestqt.qtbot import QtBot

from ocmm_core.inspection.evaluation import LiveView
from ocmm_gui.kit import DASHES, reference_words
from ocmm_sim.scene import ScriptedNudge, ScriptedOcclusion, WorldOptions
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

PATIENCE_MS = HANG_MS
NUDGE = ScriptedNudge(1600, 0, (1e-3, 0.0, 0.0), (0.6, -0.5, 0.6))
HIDDEN = ScriptedOcclusion(0, (5, 7), 8000, 10**9)


def test_the_reference_body_is_named_counted_and_lost_in_words(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    world = WorldOptions(nudges=(NUDGE,), occlusions=(HIDDEN,))
    bench = open_window(
        speed=4.0,
        stay=True,
        world=world,
        probe="standard4.toml",
        reference="plate.toml",
        start=False,
    )
    desk, trust = bench.window.desk, bench.window.running.trust
    assert not desk.strip.counter("Reference").startswith("4/4")
    bench.window.actions_by_key["cameras"].trigger()
    bench.bridge.start()
    qtbot.waitUntil(lambda: trust.isVisible(), timeout=PATIENCE_MS)
    assert trust.text() == (
        "Part and cameras have moved 1.0 mm and 0.06° relative to each other since the job "
        "started. Points follow the reference body 'plate'."
    )
    assert desk.strip.counter("Reference") == "4/4"
    qtbot.waitUntil(lambda: DASHES not in desk.readout.values(), timeout=PATIENCE_MS)
    for plot in desk.cameras.plots():
        names = {label.split(" ")[0] for label in plot.labels()}
        assert {"R1", "R2", "R3", "R4", "L1", "L2", "L3", "L4"} == names

    qtbot.waitUntil(lambda: desk.strip.status.text() == "LOST", timeout=PATIENCE_MS)
    assert desk.strip.counter("Reference") == "2/4"
    assert desk.strip.counter("Targets") == "4/4"
    qtbot.waitUntil(lambda: DASHES in desk.readout.values(), timeout=PATIENCE_MS)
    assert "Camera left does not see R2, R4" in desk.readout.accessibleDescription()
    names = {label.split(" ")[0] for label in desk.cameras.plots()[0].labels()}
    assert {"R1", "R3"} <= names
    assert not {"R2", "R4"} & names


def test_without_a_reference_body_nothing_speaks_of_one(
    qtbot: QtBot, open_window: OpenWindow
) -> None:
    bench = open_window(speed=1.0, stay=True)
    strip = bench.window.desk.strip
    shown: list[LiveView] = []
    bench.bridge.live_changed.connect(shown.append)
    qtbot.waitUntil(lambda: strip.counter("Targets") == "6/6", timeout=PATIENCE_MS)
    qtbot.waitUntil(lambda: len(shown) > 0, timeout=PATIENCE_MS)
    assert shown[-1].reference is None
    assert reference_words(shown[-1]) == ""
    assert not strip._values["Reference"].isVisible()  # noqa: SLF001 - what is hidden has no public name
