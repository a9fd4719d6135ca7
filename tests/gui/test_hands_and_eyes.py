"""Zoom, targets for gloves and the far view, on screens of every size, on all pages."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from PySide6.QtCore import QPoint, QRect, QSize, QSizeF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QListWidget,
    QPushButton,
    QTabBar,
    QTableWidget,
    QVBoxLayout,
    QWidget,
)
from pytestqt.qtbot import QtBot

from ocmm_core.settings import SettingsStore
from ocmm_gui.access import RULER_PX, TARGET_MM, TouchTargets, Zoom, screen_factor, screen_size
from ocmm_gui.access._hands_and_eyes import _controls, _is_pressed, believed_pitch
from ocmm_gui.kit import CAP_HEIGHT, NarrowButton, text_font
from ocmm_gui.kit._theme import FAR_SHARE
from tests.gui.window_pages import faults, walk
from tests.host import HANG_MS

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

INCH_MM = 25.4


@pytest.fixture(autouse=True)
def usual_size(qapp: QApplication) -> Iterator[None]:
    """Leave the application as large as it was, and nothing of it remembered."""
    yield
    store = SettingsStore.of_this_user()
    for file in (store.user, store.station):
        file.path.unlink(missing_ok=True)
    for zoom in qapp.findChildren(Zoom):
        zoom.use(100)


def _row_heights(view: QListWidget | QTableWidget) -> Iterator[int]:
    """Yield the heights of the rows that are at least partly visible."""
    room = QRect(QPoint(0, 0), view.viewport().size())
    if isinstance(view, QListWidget):
        for row in range(view.count()):
            box = view.visualItemRect(view.item(row))
            if box.intersects(room):
                yield box.height()
        return
    for row in range(view.rowCount()):
        if not view.isRowHidden(row):
            yield view.rowHeight(row)


def small(window: QWidget, px: int) -> Iterator[str]:
    """Yield controls smaller than ``px``."""
    for widget in _controls(window):
        if not widget.isVisible() or widget.visibleRegion().isEmpty():
            continue
        if isinstance(widget, QListWidget | QTableWidget):
            if not _is_pressed(widget):
                continue
            for high in _row_heights(widget):
                if high < px:
                    yield f"row of {widget.accessibleName()!r}: {high} px"
        elif isinstance(widget, QTabBar):
            for index in range(widget.count()):
                size = widget.tabRect(index).size()
                if min(size.width(), size.height()) < px:
                    yield f"tab {widget.tabText(index)!r}: {size.width()} x {size.height()} px"
        elif min(widget.width(), widget.height()) < px:
            name = widget.accessibleName() or widget.objectName()
            yield f"{type(widget).__name__} {name!r}: {widget.width()} x {widget.height()} px"


def _dot_mm(columns: int, lines: int, inches: float) -> float:
    """Return the size of a dot of a screen, mm."""
    return inches * INCH_MM / math.hypot(columns, lines)


def test_everything_grows_by_keys_and_is_remembered(
    open_window: OpenWindow, qapp: QApplication, qtbot: QtBot
) -> None:
    window = open_window(speed=0.1).window
    dots = window.grab().size()
    for key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
        QTest.keyClick(window, key, Qt.KeyboardModifier.ControlModifier)
        # It is recreated, and has the focus again.
        qtbot.waitUntil(window.isActiveWindow, timeout=HANG_MS)
    assert window.devicePixelRatio() == pytest.approx(1.2)
    assert SettingsStore.of_this_user().load().settings.window_zoom == 120
    qapp.processEvents()
    # The window keeps place and size; its content grows.
    assert window.grab().size() == dots
    assert window.isVisible()
    for _ in range(20):
        window.eyes.step(1)
    assert SettingsStore.of_this_user().load().settings.window_zoom == 200
    for _ in range(20):
        window.eyes.step(-1)
    assert window.devicePixelRatio() == pytest.approx(0.8)
    qtbot.waitUntil(window.isActiveWindow, timeout=HANG_MS)
    QTest.keyClick(window, Qt.Key.Key_0, Qt.KeyboardModifier.ControlModifier)
    assert window.devicePixelRatio() == pytest.approx(1.0)
    assert window.size() == QSize(1280, 720)
    assert window.minimumSize() == QSize(1024, 640)
    # As shipped: nothing is kept of it.
    assert "zoom" not in SettingsStore.of_this_user().user.path.read_text()


def test_a_field_leaves_the_keys_of_the_zoom_to_the_window(
    open_window: OpenWindow, qtbot: QtBot
) -> None:
    window = open_window(speed=0.1).window
    window.sheets.show_sheet("settings")
    window.sheets.settings.show_section(0)
    field = window.sheets.settings.rows["instrument.check_after_h"].field
    field.setFocus()
    QTest.keyClick(field, Qt.Key.Key_Plus, Qt.KeyboardModifier.ControlModifier)
    qtbot.waitUntil(lambda: window.eyes.zoom.percent == 110, timeout=HANG_MS)
    # A value changed by a key appears on the open page.
    assert window.sheets.settings.rows["window.zoom"].field.text() == "110"
    assert "+" not in field.text()


@pytest.mark.parametrize(
    ("size", "factor"),
    [
        ((800, 600), 1.0),
        ((1280, 720), 1.0),
        ((1920, 1080), 1.0),
        ((1920, 1200), 1.0),
        ((2560, 1440), 1.3),
        ((3440, 1440), 1.3),
        ((3840, 2160), 2.0),
        ((1080, 1920), 1.0),
        ((15360, 8640), 4.0),
    ],
)
def test_pages_grow_with_the_screen(size: tuple[int, int], factor: float) -> None:
    assert screen_factor(QSize(*size)) == pytest.approx(factor)


@pytest.mark.slow
def test_nothing_is_cut_off_at_any_zoom(open_window: OpenWindow, qapp: QApplication) -> None:
    window = open_window(speed=0.1, tests=True).window
    found = []
    # Pages are made at the first zoom and shown at the others, as for a user of the keys.
    for percent in (150, 80, 200):
        window.eyes.zoom.use(percent)
        size = round(128000 / percent), round(72000 / percent)
        now = walk(window, qapp, ("dark",), (size,), scrolled=percent > 100)
        found += [f"{percent} %: {fault}" for fault in now]
    assert not found, "\n".join(found)


def test_enlarged_pages_are_scrolled_to_where_the_keyboard_is(
    open_window: OpenWindow, qapp: QApplication, qtbot: QtBot
) -> None:
    window = open_window(speed=0.1).window
    window.eyes.zoom.use(200)
    window.sheets.open_job()
    qtbot.waitUntil(window.area.scrolls, timeout=HANG_MS)
    page = window.sheets.job
    for _ in range(30):
        QTest.keyClick(window.focusWidget(), Qt.Key.Key_Tab)
        qapp.processEvents()
        widget = window.focusWidget()
        if page.isAncestorOf(widget):
            assert not widget.visibleRegion().isEmpty(), widget.accessibleName()
    # The far view is a picture of the whole window: it is never scrolled.
    window.show_mode(window.mode())
    window.show_far(True)
    qtbot.waitUntil(lambda: not window.area.scrolls(), timeout=HANG_MS)


SCREENS = [(1280, 720, 24.0), (3840, 2160, 27.0)]


@pytest.mark.slow
@pytest.mark.parametrize(("columns", "lines", "inches"), SCREENS)
def test_targets_are_as_large_as_a_gloved_finger_on_all_pages(
    open_window: OpenWindow, qapp: QApplication, columns: int, lines: int, inches: float
) -> None:
    window = open_window(speed=0.1, tests=True).window
    dot = _dot_mm(columns, lines, inches)
    factor = screen_factor(QSize(columns, lines))
    # The screen of tests is small: that of the test is given by its factor and its ruler.
    store = SettingsStore.of_this_user()
    ruler = round(RULER_PX * dot, 2)
    store.change(
        {"window.zoom": round(100 * factor), "window.gloves": True, "window.ruler_mm": ruler}
    )
    window.eyes.use(store.load().settings)
    least = math.ceil(TARGET_MM / (dot * factor))
    assert window.eyes.touch.pixels() in (least, least + 1)

    def look(whole: QWidget) -> Iterator[str]:
        window.eyes.touch.fit()
        yield from small(whole, least)
        # And nothing is cut off for it.
        yield from faults(whole)

    size = round(columns / factor), round(lines / factor)
    found = walk(window, qapp, ("dark",), (size,), scrolled=True, look=look)
    assert not found, "\n".join(dict.fromkeys(found))


def test_gloves_are_put_on_and_off_by_a_key(open_window: OpenWindow, qtbot: QtBot) -> None:
    bench = open_window(speed=0.1)
    window = bench.window
    buttons = window.desk.findChildren(QPushButton)
    before = [button.minimumSize() for button in buttons]
    QTest.keyClick(window, Qt.Key.Key_L, Qt.KeyboardModifier.ControlModifier)
    px = window.eyes.touch.pixels()
    # From the screen of tests, with about 100 dots an inch.
    dots = window.screen().physicalDotsPerInch()
    assert 80.0 < dots < 120.0
    assert px == pytest.approx(TARGET_MM * dots / INCH_MM, abs=1.0)
    qtbot.waitUntil(lambda: not list(small(window, px)), timeout=HANG_MS)
    assert "15 mm" in bench.notices.kept()[-1].what
    assert SettingsStore.of_this_user().load().settings.window_gloves
    QTest.keyClick(window, Qt.Key.Key_L, Qt.KeyboardModifier.ControlModifier)
    assert [button.minimumSize() for button in buttons] == before
    assert not SettingsStore.of_this_user().load().settings.window_gloves


def test_rows_and_buttons_that_come_later_are_enlarged_too(qtbot: QtBot) -> None:
    whole = QWidget()
    qtbot.addWidget(whole)
    layout = QVBoxLayout(whole)
    rows = QListWidget()
    rows.addItem("first")
    layout.addWidget(rows)
    whole.show()
    targets = TouchTargets(whole)
    targets.use(0.25)
    assert targets.pixels() == 60
    usual = rows.item(0).sizeHint().height()
    rows.addItem("second")
    button = NarrowButton("x")
    layout.addWidget(button)
    qtbot.waitUntil(lambda: not list(small(whole, 60)), timeout=HANG_MS)
    assert usual == 60
    targets.use(None)
    assert button.minimumSize() == QSize(0, 0)
    assert not rows.item(1).sizeHint().isValid()


@pytest.mark.parametrize(
    ("physical", "dots", "pitch"),
    [
        ((531.0, 299.0), (1280.0, 720.0), 0.415),
        ((598.0, 336.0), (3840.0, 2160.0), 0.1556),
        ((0.0, 0.0), (1920.0, 1080.0), None),
        ((160.0, 90.0), (1920.0, 1080.0), None),
        ((1600.0, 900.0), (1920.0, 1080.0), None),
        ((16.0, 9.0), (1920.0, 1080.0), None),
        ((300.0, 300.0), (1920.0, 1080.0), None),
        ((30.0, 17.0), (1920.0, 1080.0), None),
        ((3100.0, 1744.0), (1920.0, 1080.0), None),
    ],
)
def test_a_screen_is_believed_only_what_can_be_so(
    physical: tuple[float, float], dots: tuple[float, float], pitch: float | None
) -> None:
    found = believed_pitch(QSizeF(*physical), QSizeF(*dots))
    assert found == (None if pitch is None else pytest.approx(pitch, abs=1e-3))


def test_a_measured_line_wins_over_what_the_screen_says(qapp: QApplication) -> None:
    screen = qapp.primaryScreen()
    assert screen_size(screen, None).mm_per_px == pytest.approx(INCH_MM / 100.0)
    measured = screen_size(screen, 100.0)
    assert measured.known
    assert measured.mm_per_px == pytest.approx(0.2 * screen.devicePixelRatio())


FAR = [
    ((1280, 720), 100), ((1280, 720), 200), ((1920, 1080), 100), ((1920, 1080), 80),
    ((1920, 1080), 200), ((3840, 2160), 100), ((3840, 2160), 200), ((3440, 1440), 100),
]  # fmt: skip


def test_capitals_of_the_far_view_are_a_share_of_the_height(
    open_window: OpenWindow, qapp: QApplication
) -> None:
    window = open_window(speed=0.1).window
    window.show_far(True)
    for size, percent in FAR:
        window.eyes.zoom.use(percent)
        window.resize(round(100 * size[0] / percent), round(100 * size[1] / percent))
        for _ in range(4):
            qapp.processEvents()
        dots = window.grab().height()
        assert abs(dots - size[1]) <= 2, (size, percent)
        assert not window.area.scrolls(), (size, percent)
        # In dots of the screen; sizes of type are whole pixels, which costs one of them at most.
        ratio = window.devicePixelRatio()
        least = FAR_SHARE * size[1] - ratio
        for text, pixels in window.far.type_pixels().items():
            assert ratio * CAP_HEIGHT * pixels >= least, (size, percent, text, pixels)
        assert ratio * window.far.readout.cap_height() >= least, (size, percent)


def test_a_button_that_is_too_narrow_shows_its_whole_text(qtbot: QtBot) -> None:
    """The outermost ink of the text keeps away from the border of the button."""
    button = NarrowButton("Construct  [Shift+F6]")
    qtbot.addWidget(button)
    button.setFont(text_font(14))
    button.resize(110, 40)
    button.show()
    assert button.fontMetrics().horizontalAdvance(button.text()) > button.width()
    image = button.grab().toImage()
    button.setText("")
    empty = button.grab().toImage()
    inked = [
        x
        for x in range(image.width())
        if any(image.pixel(x, y) != empty.pixel(x, y) for y in range(image.height()))
    ]
    assert inked[0] > 1
    assert inked[-1] < image.width() - 2
