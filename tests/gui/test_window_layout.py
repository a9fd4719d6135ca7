"""Nothing that is written on a page is cut off, on any page, in any theme, on both screens."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QRect
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QPushButton, QWidget

from ocmm_core.calibration.guided import ProcedureKind
from ocmm_gui.kit import CAP_HEIGHT, THEMES, Mode
from ocmm_gui.kit._theme import FAR_SHARE
from ocmm_gui.window import MainWindow

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

SIZES = ((1280, 720), (1920, 1080))
_SLACK_PX = 2
TURNS = 50
"""In which a page comes to rest; half a second."""


def _pages(window: MainWindow) -> Iterator[tuple[str, Callable[[], None]]]:
    """Give every page of the window with how it is opened."""
    sheets, maintenance = window.sheets, window.maintenance
    yield "desk", lambda: window.show_far(False)
    yield "far", lambda: window.show_far(True)
    yield "job", sheets.open_job
    yield "plan", sheets.open_plan
    yield "results", sheets.open_results
    yield "keys", sheets.open_keys
    for sheet in (sheets.report, sheets.batch, sheets.alignment):
        yield sheet.accessibleName(), partial(sheets.wanted.emit, sheet)
    for kind in ProcedureKind:
        yield kind.name, partial(maintenance.open_wizard, kind)
    yield "definition", maintenance.open_definition
    window.show_mode(Mode.MAINTAIN)
    for row in range(maintenance.view.list.count()):

        def open_page(row: int = row) -> None:
            window.show_mode(Mode.MAINTAIN)
            maintenance.view.list.setCurrentRow(row)

        yield f"Maintain {row}", open_page


def _faults(window: MainWindow) -> Iterator[str]:
    for widget in window.findChildren(QWidget):
        if not widget.isVisible() or widget.visibleRegion().isEmpty():
            continue
        room, metrics = widget.contentsRect(), widget.fontMetrics()
        if isinstance(widget, QLabel) and widget.text():
            if widget.wordWrap():
                need = widget.heightForWidth(widget.width())
                if need > widget.height() + _SLACK_PX:
                    yield f"{widget.text()!r} needs {need} px of height, has {widget.height()}"
            elif widget.sizeHint().width() > widget.width() + _SLACK_PX:
                yield f"{widget.text()!r} needs {widget.sizeHint().width()}, has {widget.width()}"
        elif isinstance(widget, QPushButton) and widget.text():
            box = metrics.boundingRect(QRect(0, 0, 2000, 200), 0, widget.text())
            if box.width() > room.width() - 4 or box.height() > room.height():
                yield f"button {widget.text()!r} needs {box.width()} px, has {room.width()}"
        elif isinstance(widget, QLineEdit) and not widget.text():
            need = metrics.horizontalAdvance(widget.placeholderText())
            if need > room.width() - 8:
                yield f"hint {widget.placeholderText()!r} needs {need} px, has {room.width()}"


def test_nothing_is_cut_off(open_window: OpenWindow, qapp: QApplication) -> None:
    window = open_window(speed=0.1).window
    found = []
    # A theme costs more than a page: it is changed seldom.
    for theme in THEMES:
        window.use_theme(theme)
        for size in SIZES:
            window.resize(*size)
            for name, open_page in _pages(window):
                open_page()
                # The layout settles in one turn, what follows from it in a second one; what a
                # thread has read for the page may come between. What is cut off stays so.
                faults = []
                for _ in range(TURNS):
                    qapp.processEvents()
                    faults = list(_faults(window))
                    if not faults:
                        break
                    time.sleep(0.01)
                found += [f"{name}, {theme}, {size[1]} px: {fault}" for fault in faults]
    assert not found, "\n".join(found)


def test_the_far_view_is_read_at_three_metres(open_window: OpenWindow, qapp: QApplication) -> None:
    window = open_window(speed=0.1).window
    window.show_far(True)
    for size in SIZES:
        window.resize(*size)
        qapp.processEvents()
        qapp.processEvents()
        # A capital of 17.5 mm on a 24-inch screen, whatever its resolution is; a pixel is lost
        # where sizes of type are whole.
        least = FAR_SHARE * size[1] - 1.0
        for text, pixels in window.far.type_pixels().items():
            assert CAP_HEIGHT * pixels >= least, (text, size)
        assert window.far.readout().cap_height() >= least
