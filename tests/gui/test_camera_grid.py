"""Sixteen cameras in the window, and the table of 64 LEDs."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtWidgets import QApplication

from ocmm_core.camera import MAX_CAMERAS, MAX_LEDS, load_rig, project
from ocmm_core.tracking import LedEntry, load_probe
from ocmm_gui.views import CameraViews
from ocmm_gui.wizards.pages._definition_form import LedTable
from tests.large_rig import write_probe, write_rig


@pytest.mark.parametrize(("n_leds", "words"), [(8, 8), (MAX_LEDS, 0)])
def test_sixteen_cameras_stand_in_a_square(
    qapp: QApplication, tmp_path: Path, n_leds: int, words: int
) -> None:
    rig = load_rig(write_rig(tmp_path, MAX_CAMERAS))
    leds = load_probe(write_probe(tmp_path, MAX_LEDS)).leds_probe[:n_leds]
    views = CameraViews(rig)
    views.resize(900, 640)
    views.show()
    spots = np.stack([project(camera, leds) for camera in rig.cameras])
    names = np.tile(np.arange(n_leds), (MAX_CAMERAS, 1))
    live = SimpleNamespace(spots=spots, slot_leds=names, slot_references=None)
    # A few cameras at a time: after four snapshots all were drawn.
    for _ in range(4):
        views.show_live(live)  # type: ignore[arg-type] # the used fields of a snapshot
    qapp.processEvents()
    plots = views.plots()
    assert len({plot.x() for plot in plots}) == len({plot.y() for plot in plots}) == 4
    # A quarter of the window each, but for the gaps.
    assert min(plot.width() for plot in plots) > 200
    assert min(plot.height() for plot in plots) > 140
    assert {len(plot.labels()) for plot in plots} == {words}
    views.close()


def test_the_table_of_leds_scrolls_and_ends_at_the_most(qapp: QApplication) -> None:
    table = LedTable()
    table.resize(600, 300)
    table.show()
    led = LedEntry(position=(1.0, 2.0, 3.0), direction=(0.0, -1.0, 0.0))
    table.show_leds([led] * (MAX_LEDS - 1))
    table.add()
    table.add()
    qapp.processEvents()
    assert table.rowCount() == len(table.leds()) == MAX_LEDS
    assert table.verticalScrollBar().maximum() > 0
    # The newest row is in sight.
    bar = table.verticalScrollBar()
    at_the_end = bar.value() == bar.maximum()
    table.close()
    assert at_the_end
