"""The dial of a round feature: a touch always lies on a sector that is painted as touched."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPointF
from PySide6.QtGui import QColor
from pytestqt.qtbot import QtBot

from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.evaluation import FeatureState, FeatureView, coverage_of
from ocmm_gui.kit import DEFAULT_THEME, THEMES
from ocmm_gui.operator._feature_details import CoverageView
from tests.core.inspection.test_guidance import point_at

SIDE = 400


@pytest.mark.parametrize("phase_deg", [0.0, 7.0, 22.5, 38.0])
@pytest.mark.parametrize("steps", [(0, 1, 2, 3, 4, 5, 6, 7), (0, 1, 3, 6)])
def test_each_touch_lies_on_a_sector_painted_as_touched(
    phase_deg: float, steps: tuple[int, ...], qtbot: QtBot
) -> None:
    bore = NominalFeature(
        name="B", shape=Shape.CIRCLE, points=8, point=(0.0, 0.0, 0.0), diameter=20.0
    )
    angles = np.array(steps) * np.pi / 4.0 + np.radians(phase_deg)
    tips = np.stack([10.0 * np.cos(angles), 10.0 * np.sin(angles), np.zeros(len(steps))], axis=1)
    fit = fit_shape(Shape.CIRCLE, tips, direction_hint=np.array([0.0, 0.0, 1.0]))
    points = tuple(point_at(tip, number) for number, tip in enumerate(tips, start=1))
    found = coverage_of(bore, fit, points)
    view = CoverageView()
    qtbot.addWidget(view)
    view.resize(SIDE, SIDE)
    view.show_feature(
        FeatureView(
            "B", Shape.CIRCLE, 8, FeatureState.ACTIVE, points, fit, note="", coverage=found
        ),
        chosen=0,
    )
    picture = view.grab().toImage()
    middle = QPointF(0.5 * SIDE, 0.5 * SIDE)

    def colour_at(place: QPointF, turn_deg: float = 0.0) -> str:
        # Outside of the points, within the rim; positive turns are counter-clockwise.
        arm = (place - middle) / np.hypot(place.x() - middle.x(), place.y() - middle.y())
        cos, sin = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
        along = QPointF(cos * arm.x() + sin * arm.y(), cos * arm.y() - sin * arm.x())
        at = middle + along * (0.44 * SIDE)
        scale = picture.devicePixelRatio()
        return picture.pixelColor((at * scale).toPoint()).name()

    theme = THEMES[DEFAULT_THEME]
    touched, empty = QColor(theme.zone_good).name(), QColor(theme.background).name()
    assert touched != empty
    for number in range(1, len(steps) + 1):
        # The sector reaches to both sides of a touch that is spread evenly with the others.
        for turn_deg in (-18.0, 0.0, 18.0):
            assert colour_at(view.place_of(number), turn_deg) == touched
    first = view.place_of(1)
    for step in set(range(8)) - set(steps):
        assert colour_at(first, 45.0 * step) == empty


def test_the_share_of_a_plane_stands_below_its_points(qtbot: QtBot) -> None:
    tips = np.array([[x, y, 0.0] for x in (0.0, 10.0, 20.0) for y in (0.0, 10.0, 20.0)])
    plane = NominalFeature(name="P", shape=Shape.PLANE, points=9, point=(0.0, 0.0, 0.0))
    fit = fit_shape(Shape.PLANE, tips, direction_hint=np.array([0.0, 0.0, 1.0]))
    points = tuple(point_at(tip, number) for number, tip in enumerate(tips, start=1))
    view = CoverageView()
    qtbot.addWidget(view)
    view.resize(SIDE, SIDE)
    found = coverage_of(plane, fit, points)
    assert found is not None
    view.show_feature(
        FeatureView("P", Shape.PLANE, 9, FeatureState.ACTIVE, points, fit, note="", coverage=found),
        chosen=0,
    )
    lowest = max(view.place_of(point.number).y() for point in points)
    # The letters are in the last fifth of the side, above the margin of 0.16.
    assert lowest <= (1.0 - 0.16 - 0.2) * SIDE + 1e-9
