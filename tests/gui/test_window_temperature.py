"""Temperatures in the window, near and far."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from ocmm_core.composition import ClimateRequest, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import FitText, NoticeCentre
from ocmm_gui.window import MainWindow

CLIMATE = ClimateRequest(
    probe_design=resource("designs", "standard.toml"),
    probe_c=24.0,
    part_c=23.0,
    sigma_k=0.5,
    part_expansion_ppm=11.5,
    compensate_probe=True,
    compensate_part=True,
)


@pytest.fixture(params=[CLIMATE, ClimateRequest()], ids=["compensated", "nothing known"])
def window(
    request: pytest.FixtureRequest, qtbot: QtBot, tmp_path: Path
) -> Iterator[tuple[MainWindow, ClimateRequest]]:
    asked = StationRequest(
        plan=resource("plans", "quick.toml"), out=tmp_path, frame_rate_hz=800, climate=request.param
    )
    bridge = StationBridge(build_station(asked).station)
    made = MainWindow(bridge, NoticeCentre(), out=tmp_path)
    qtbot.addWidget(made)
    made.resize(1280, 720)
    made.show()
    bridge.start()
    yield made, request.param
    made.close()


def test_both_views_say_what_is_compensated(window: tuple[MainWindow, ClimateRequest]) -> None:
    shown, asked = window
    labels = [label for label in shown.desk.findChildren(QLabel) if label.isVisible()]
    (said,) = [label.text() for label in labels if label.accessibleName() == "Temperatures"]
    shown.show_far(True)
    captions = [text.text() for text in shown.far.findChildren(FitText)]
    if asked.compensate_part:
        assert "24.0 ± 0.5 °C, calibrated at 20.0 °C, compensated." in said
        assert "reported at 20 °C with 11.5 ± 1.0 ppm/K" in said
        assert any(text.endswith(", 20 °C") for text in captions)
    else:
        assert said == "No temperature compensation (no temperatures given)."
        assert not any(text.endswith(", 20 °C") for text in captions)
