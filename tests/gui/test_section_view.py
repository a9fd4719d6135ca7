"""The picture of a section: measured line, limits and scale in the plane that the plan names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtGui import QColor, QImage
from pytestqt.qtbot import QtBot

from ocmm_core.alignment import BoundAlignment, DatumReferenceFrame
from ocmm_core.features.shapes import Shape, nominal_geometry
from ocmm_core.measuring import PointFactors
from ocmm_core.tolerances.decisions import CharacteristicResult, evaluate_all
from ocmm_gui.kit import THEMES
from ocmm_gui.results._result_table import SectionView
from ocmm_gui.views import is_section
from ocmm_gui.views._section_view import section_axes
from tests.core.tolerances.known_part import KnownPart, asked, face, motion, ring


def section(bulge: float) -> CharacteristicResult:
    """Return the profile of a shaft, 30 mm, that is too thick by ``bulge``, mm, within 0.1 mm."""
    part = KnownPart().add("TOP", Shape.PLANE, face(motion(0, 0, 20)), point=(0, 0, 20))
    surface, normals = ring(motion(0, 0, 0), 15.0 + bulge, (-8.0, 0.0, 8.0))
    part.add("SHAFT", Shape.CYLINDER, (surface, normals), diameter=30.0)
    item = asked("line profile", "SHAFT", "TOP", cut=(0, 0, 1), upper=0.1)
    rule = BoundAlignment(
        DatumReferenceFrame(datums=("TOP", "SHAFT")),
        {one.name: one.shape for one in part.nominals},
        {one.name: nominal_geometry(one) for one in part.nominals},
    )
    count = len(part.points)
    factors = PointFactors(np.zeros((3 * count + 1, 1)), np.tile(1e-6 * np.eye(3), (count, 1, 1)))
    return evaluate_all([item], rule, part.actual(), factors, "simple")[0]


def painted(view: SectionView) -> set[str]:
    """Return the colours above the scale."""
    view.resize(500, 400)
    image = view.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    pixels = np.frombuffer(image.constBits(), "<u4").reshape(image.height(), -1)[:300]
    return {f"#{one:06x}" for one in np.unique(pixels & 0xFFFFFF).tolist()}


@pytest.mark.parametrize(("bulge", "is_bad"), [(0.02, False), (0.08, True)])
def test_points_outside_are_red(qtbot: QtBot, bulge: float, is_bad: bool) -> None:
    result, view, theme = section(bulge), SectionView(), THEMES["light"]
    qtbot.addWidget(view)
    view.set_theme(theme)
    assert view.show_result(result)
    assert result.seen is not None
    assert result.seen.deviations == pytest.approx(np.full(12, bulge), abs=1e-6)
    colours = painted(view)
    assert (QColor(theme.bad).name() in colours) == is_bad
    assert QColor(theme.text).name() in colours


def test_only_a_section_has_this_picture(qtbot: QtBot) -> None:
    result = section(0.02)
    view = SectionView()
    qtbot.addWidget(view)
    assert view.show_result(result)
    seen = result.seen
    assert seen is not None
    whole = replace(result, seen=replace(seen, across=None))
    assert not view.show_result(whole)
    assert not is_section(None)
    assert not is_section(replace(result, seen=None))


@pytest.mark.parametrize("across", [(1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.6, 0.0, 0.8)])
def test_a_section_is_upright(across: tuple[float, float, float]) -> None:
    normal = np.array(across)
    axes = section_axes(normal)
    assert np.cross(axes[0], axes[1]) @ normal == pytest.approx(1.0)
    assert axes @ normal == pytest.approx([0.0, 0.0], abs=1e-12)
    if abs(normal[2]) < 0.9:
        assert axes[1][2] > 0.5
