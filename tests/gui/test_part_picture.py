"""The picture of a part: a click hits the visible face, and colours are the requested ones."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QObject, QPoint, QPointF, QSize, Qt
from PySide6.QtGui import QColor, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from ocmm_core.geometry import RigidTransform
from ocmm_core.part_model import PartModel
from ocmm_gui.kit import THEMES
from ocmm_gui.rendering import NO_FACE, RenderMode
from ocmm_gui.scene._part_scene import MOVING_TRIANGLES, PartDrawing
from ocmm_gui.views import PartPicture
from tests.host import HANG_MS
from tests.made_parts import PartMaker

TOP = 5


@pytest.fixture
def block() -> PartModel:
    return PartMaker().box((0.0, 0.0, 0.0), (60.0, 40.0, 30.0)).part()


@pytest.fixture
def picture(qtbot: QtBot, block: PartModel) -> PartPicture:
    widget = PartPicture()
    qtbot.addWidget(widget)
    widget.resize(500, 400)
    widget.show_part(block)
    widget.show()
    painted(widget)
    return widget


def painted(widget: PartPicture) -> QImage:
    """Return the picture once the slices of it are all painted."""
    widget.grab()
    while not widget.is_painted():
        QApplication.processEvents()
        widget.grab()
    return widget.grab().toImage()


def place_of(widget: PartPicture, x: float, y: float, z: float) -> QPoint:
    return QPointF(*widget.projected(np.array([[x, y, z]]))[0].tolist()).toPoint()


def settled(qtbot: QtBot, widget: PartPicture) -> QImage:
    qtbot.waitUntil(lambda: not widget.is_moving(), timeout=HANG_MS)
    return painted(widget)


def test_the_face_that_is_clicked_is_told(qtbot: QtBot, picture: PartPicture) -> None:
    with qtbot.waitSignal(picture.face_clicked) as told:
        QTest.mouseClick(
            picture, Qt.MouseButton.LeftButton, pos=place_of(picture, 30.0, 20.0, 30.0)
        )
    assert told.args == [TOP]
    with qtbot.waitSignal(picture.face_clicked) as told:
        QTest.mouseClick(picture, Qt.MouseButton.LeftButton, pos=QPoint(8, 8))
    assert told.args == [NO_FACE]


def test_the_face_under_the_mouse_is_told_once(qtbot: QtBot, picture: PartPicture) -> None:
    told: list[int] = []
    picture.face_hovered.connect(told.append)
    for x in (25.0, 30.0, 35.0):
        QTest.mouseMove(picture, place_of(picture, x, 20.0, 30.0))
        qtbot.wait(5)
    QTest.mouseMove(picture, QPoint(6, 6))
    qtbot.waitUntil(lambda: told[-1:] == [NO_FACE], timeout=HANG_MS)
    assert told == [TOP, NO_FACE]


def test_a_turn_is_no_click(qtbot: QtBot, picture: PartPicture) -> None:
    told: list[int] = []
    picture.face_clicked.connect(told.append)
    start = place_of(picture, 30.0, 20.0, 30.0)
    before = picture.projected(np.array([[60.0, 40.0, 30.0]]))
    QTest.mousePress(picture, Qt.MouseButton.LeftButton, pos=start)
    QTest.mouseMove(picture, start + QPoint(20, 0))
    QTest.mouseMove(picture, start + QPoint(60, 10))
    QTest.mouseRelease(picture, Qt.MouseButton.LeftButton, pos=start + QPoint(60, 10))
    assert not told
    assert np.abs(picture.projected(np.array([[60.0, 40.0, 30.0]])) - before).max() > 5.0
    settled(qtbot, picture)


def test_faces_and_vertices_have_the_colours_asked_for(
    picture: PartPicture, block: PartModel
) -> None:
    place = place_of(picture, 30.0, 20.0, 30.0)
    plain = painted(picture).pixelColor(place)
    assert plain.saturation() < 60
    picture.highlight({TOP: "#00ff00"})
    green = painted(picture).pixelColor(place)
    assert (green.red(), green.blue()) == (0, 0)
    assert green.green() > 100
    picture.highlight({})
    assert painted(picture).pixelColor(place) == plain
    colours = np.zeros((len(block.vertices), 3), dtype=np.uint8)
    colours[:, 0] = np.where(block.vertices[:, 0] > 30.0, 255, 0)
    colours[:, 2] = 255 - colours[:, 0]
    picture.colour(colours)
    image = painted(picture)
    low, high = (image.pixelColor(place_of(picture, x, 20.0, 30.0)) for x in (5.0, 55.0))
    assert high.red() > 4 * high.blue()
    assert low.blue() > 4 * low.red()


@pytest.mark.parametrize("theme", sorted(THEMES))
@pytest.mark.parametrize("mode", list(RenderMode))
def test_every_mode_in_every_theme_shows_the_part(
    picture: PartPicture, theme: str, mode: RenderMode
) -> None:
    picture.set_theme(THEMES[theme])
    picture.set_mode(mode)
    image = painted(picture)
    corner = place_of(picture, 60.0, 0.0, 30.0)
    near = [
        image.pixelColor(corner + QPoint(x, y)).lightness() for x in (-2, 0, 2) for y in (-2, 0, 2)
    ]
    ground = QColor(THEMES[theme].panel).lightness()
    # An edge ends there; it contrasts with the background.
    assert max(abs(value - ground) for value in near) > 80


def test_keys_turn_zoom_and_fit(qtbot: QtBot, picture: PartPicture, block: PartModel) -> None:
    corners = np.concatenate([block.box, block.box])
    for _ in range(9):
        QTest.keyClick(picture, Qt.Key.Key_Plus)
    settled(qtbot, picture)
    assert not picture.shows(corners)
    QTest.keyClick(picture, Qt.Key.Key_F)
    painted(picture)
    assert picture.shows(corners)
    QTest.keyClick(picture, Qt.Key.Key_Left)
    settled(qtbot, picture)
    assert picture.shows(corners), "a turned view is fitted as before"


def test_a_face_can_be_looked_at(qtbot: QtBot, picture: PartPicture) -> None:
    for axis in range(3):
        for end in (0, 1):
            picture.look_at((2 * end - 1) * np.eye(3)[axis])
            settled(qtbot, picture)
            middle = np.array([30.0, 20.0, 15.0])
            middle[axis] = (0.0, (60.0, 40.0, 30.0)[axis])[end]
            assert picture.face_at(QPointF(place_of(picture, *middle))) == 2 * axis + end


def test_a_large_part_gets_a_coarser_mesh_for_moving(qtbot: QtBot) -> None:
    ball = PartMaker().ball((0.0, 0.0, 0.0), 30.0, steps=130).part()
    assert len(ball.triangles) > MOVING_TRIANGLES
    parent = QObject()
    drawing = PartDrawing(parent)
    with qtbot.waitSignal(drawing.changed, timeout=HANG_MS):
        drawing.use(ball)
    place, theme = RigidTransform.identity(), THEMES["light"]
    still = drawing.scene(place, theme, RenderMode.SHADED)
    assert still is not None
    assert still.mesh is drawing.mesh
    assert drawing.scene(place, theme, RenderMode.SHADED) is still
    moving = drawing.scene(place, theme, RenderMode.SHADED, moving=True)
    assert moving is not None
    assert 10_000 < len(moving.mesh.triangles) <= MOVING_TRIANGLES
    # A screen of 3840 x 2160 is painted with about half the pixels a side while the view moves.
    screen = QSize(1920, 1080)
    assert [one.scale(screen, 2.0, 1.0) for one in (still, moving)] == pytest.approx(
        [2.0, 2.0 * (2_200_000 / (4 * 1920 * 1080)) ** 0.5]
    )
    # A smaller one has fewer pixels on a computer that has no time for them.
    assert [moving.scale(screen, 1.0, share) for share in (1.0, 0.7)] == [1.0, 0.7]
    assert still.scale(screen, 1.0, 0.5) == 1.0


def test_without_a_part_nothing_can_be_chosen(picture: PartPicture) -> None:
    place = QPointF(place_of(picture, 30.0, 20.0, 30.0))
    assert picture.face_at(place) == TOP
    picture.show_part(None)
    painted(picture)
    assert picture.face_at(place) == NO_FACE
