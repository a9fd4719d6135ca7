"""The picture of one camera, also where nothing is seen for a long time."""

from __future__ import annotations

import numpy as np
from pytestqt.qtbot import QtBot

from ocmm_core.camera.rig import MAX_SLOTS, load_rig
from ocmm_core.documents import resource
from ocmm_gui.views.camera_view import CameraPlot


def test_a_probe_that_went_away_leaves_no_trail_and_no_complaint(qtbot: QtBot) -> None:
    plot = CameraPlot(load_rig(resource("rigs", "recommended.toml")).cameras[0])
    qtbot.addWidget(plot)
    plot.resize(400, 400)
    plot.show()
    spots = np.full((MAX_SLOTS, 2), np.nan)
    nobody = np.full(MAX_SLOTS, -1, dtype=np.int64)
    spots[2] = (1000.0, 900.0)
    plot.show_spots(spots, nobody)
    assert len(plot.labels()) == 1
    gone = np.full((MAX_SLOTS, 2), np.nan)
    # Longer than the trail lasts; a warning would be an error here.
    for _ in range(400):
        plot.show_spots(gone, nobody)
    plot.grab()
    assert plot.labels() == ()
