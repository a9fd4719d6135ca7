"""The wizard that finds moved cameras again, on the virtual rig."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QComboBox
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.cameras import KnownPoints
from ocmm_core.calibration.guided import (
    CalibrationOutcome,
    ProcedureKind,
    RelocationView,
    SessionSite,
)
from ocmm_core.calibration.records import State
from ocmm_core.calibration.relocation import RelocationProcedure, RelocationRequest, RelocationSetup
from ocmm_gui.wizards.pages import BarPage, ResultPage, SeatsPage, WavePage, WorldPage
from ocmm_gui.wizards.pages._relocation_pages import example_places
from ocmm_sim.calibration_scenes import SEATS, FreeMotionScene, ShowBar, TouchSeats
from ocmm_sim.sources import VirtualSite, relocation_by_step
from tests.core.calibration.procedure_site import PROBE_DOCUMENT, RIG_DOCUMENT, SEED, show
from tests.gui.wizard_bench import WizardBench

MOVE = 7
CONTROL = KnownPoints(
    ("N1", "N2", "N3", "N4"),
    np.array([[-150.0, -60, -150], [150, -60, -150], [150, 60, -120], [-150, 60, 50]]),
    0.002,
    "nests",
)


@pytest.fixture
def bench(qtbot: QtBot, qapp: QApplication, tmp_path: Path) -> Iterator[WizardBench]:
    made = WizardBench(qtbot, tmp_path)
    yield made
    made.close()


def test_waving_fills_the_volume_without_a_key_and_says_what_is_missing(bench: WizardBench) -> None:
    bench.begin(ProcedureKind.RELOCATION)
    assert bench.wizard.runner is not None, bench.wizard.start.trouble.text()
    bench.step("seats")
    assert isinstance(bench.runner.page(), SeatsPage)
    assert "not visited" in bench.runner.gate.text()
    bench.key(Qt.Key.Key_Y)
    bench.until(lambda: bench.seen.automatic)
    low, high = bench.bench.rig.volume_world
    (x0, y0, z0), (x1, y1, z1) = (low + SEATS * (high - low)).tolist()
    assert bench.show(None, TouchSeats(tips=((x0, y0, z0), (x1, y1, z1)), seed=1)) == 2
    bench.step("wave")
    page = bench.runner.page()
    assert isinstance(page, WavePage)
    assert page.score.number() == "0 %"
    # Both hands are full: finished points are taken automatically from the beginning.
    bench.until(lambda: bench.seen.automatic)
    taken = bench.show(None, FreeMotionScene(ways=3, seed=1))
    assert taken >= 10
    view = bench.seen.view
    assert isinstance(view, RelocationView)
    bench.until(lambda: page.score.note() == f"{view.poses} poses of 300")
    assert page.score.number() == f"{100.0 * view.coverage.fraction:.0f} %"
    first = view.coverage.missing[0]
    assert page.picture.accessibleDescription().startswith(f"Missing: {first}")
    assert "upright" in page.tilts.accessibleDescription()
    assert page.length.number() == "–"
    assert "Missing probe poses" in bench.runner.gate.text()
    assert not bench.runner.buttons["next"].isEnabled()
    bench.key(Qt.Key.Key_Y)
    bench.until(lambda: not bench.seen.automatic)
    bench.key(Qt.Key.Key_Backspace)
    bench.until(lambda: page.score.note() == f"{view.poses - 1} poses of 300")


def test_the_bar_and_the_points_of_a_new_world(bench: WizardBench) -> None:
    site = bench.bench
    procedure = RelocationProcedure.start(
        SessionSite(
            bench.store / "sessions", site.rig, site.body, bench.use_store_of_bench().folder
        ),
        RelocationSetup(
            who="technician",
            request=RelocationRequest(world="set", poses=1, placements=2),
            bar=site.bar,
        ),
        site.now(),
    )
    virtual = VirtualSite(RIG_DOCUMENT, PROBE_DOCUMENT, SEED, None)
    scenes = tuple(relocation_by_step(virtual, site.rig, procedure.view, site.bar, None).values())
    first, wave, bar, seats, again = scenes
    show(procedure, site.virtual(first, wave), site.now)
    bench.go_on(ProcedureKind.RELOCATION)
    bench.step("bar")
    page = bench.runner.page()
    assert isinstance(page, BarPage)
    assert page.picture.accessibleDescription() == "A suitable next bar placement"
    bench.key(Qt.Key.Key_Y)
    bench.until(lambda: bench.seen.automatic)
    assert isinstance(bar, ShowBar)
    assert bench.show(None, bar) == 2
    bench.until(lambda: page.score.number() == "2 / 2")
    bench.step("world")
    world = bench.runner.page()
    assert isinstance(world, WorldPage)
    assert "origin" in bench.runner.instruction.text()
    bench.key(Qt.Key.Key_Y)
    bench.until(lambda: bench.seen.automatic)
    assert bench.show(None, seats) == 3
    bench.until(lambda: world.score.number() == "3 / 3")
    assert world.seats.accessibleDescription() == "3 of 3 points taken"
    bench.step("again")
    page_again = bench.runner.page()
    assert isinstance(page_again, SeatsPage)
    assert "seat 1 of 2 again" in bench.runner.instruction.text()
    assert page_again.picture.accessibleDescription() == "seat 1"
    bench.key(Qt.Key.Key_Y)
    bench.until(lambda: bench.seen.automatic)
    assert bench.show(None, again) == 2
    bench.until(lambda: page_again.picture.accessibleDescription() == "both seats visited")


@pytest.mark.slow
@pytest.mark.usefixtures("fresh_sides")
def test_a_moved_frame_is_found_again_and_accepted(bench: WizardBench) -> None:
    site = bench.bench
    site.calibrated(120)
    store = bench.use_store_of_bench()
    procedure = RelocationProcedure.start(
        SessionSite(bench.store / "sessions", bench.running(), site.body, store.folder),
        RelocationSetup(
            who="technician",
            control=CONTROL,
            request=RelocationRequest(world="points", poses=60),
            bar=site.bar,
        ),
        site.now(),
    )
    virtual = VirtualSite(RIG_DOCUMENT, PROBE_DOCUMENT, SEED, MOVE)
    scenes = tuple(
        relocation_by_step(virtual, site.rig, procedure.view, site.bar, CONTROL).values()
    )
    show(procedure, site.virtual(*scenes, move=MOVE), site.now)
    bench.go_on(ProcedureKind.RELOCATION)
    bench.step("result")
    page = bench.runner.page()
    assert isinstance(page, ResultPage)
    bench.until(lambda: page.word() in ("GOOD", "USABLE, CHECK"))
    outcome = bench.seen.view.outcome
    assert isinstance(outcome, CalibrationOutcome)
    comparison = outcome.comparison
    assert comparison is not None
    # The frame was moved by about 8 mm: the comparison reports it.
    assert comparison.moved_mm > 5.0
    assert f"moved by {comparison.moved_mm:.3f} mm" in page.compare.summary.text()
    assert page.compare.cameras.rowCount() == 2
    # Thousands of spots: arrows represent cells to stay legible.
    assert "arrows: means" in page.sensors.plots[0].word()
    bench.key(Qt.Key.Key_A)
    bench.key(Qt.Key.Key_Return)
    bench.until(lambda: bench.seen.view.base.stored)
    store = bench.use_store_of_bench()
    assert len(store.records()) == 2
    assert store.status(site.now()).state is State.SUSPECT


def test_a_world_of_known_points_needs_their_list(bench: WizardBench) -> None:
    bench.wizard.open(ProcedureKind.RELOCATION)
    world = bench.wizard.start.fields["world"]
    assert isinstance(world, QComboBox)
    world.setCurrentIndex(1)
    bench.key(Qt.Key.Key_Return, bench.wizard.start.fields["who"])
    assert bench.wizard.runner is None
    assert "control points" in bench.wizard.start.trouble.text()


def test_examples_of_placements_lie_in_the_volume(bench: WizardBench) -> None:
    volume = bench.bench.rig.volume_world
    places = example_places(volume, 10, 3)
    ends = np.array([place.ends_world for place in places])
    half = 0.5 * np.ptp(volume, axis=0)
    assert np.all(np.abs(ends.mean(axis=1) - volume.mean(axis=0)) <= half)
    assert [place.done for place in places] == [2] * 3 + [0] * 7
    # No two of the same direction at the same place.
    assert len({tuple(np.round(end, 6).ravel()) for end in ends}) == 10
