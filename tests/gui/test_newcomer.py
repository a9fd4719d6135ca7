"""A newcomer with fresh settings: the first own point, by following the screen."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QPushButton, QWidget

from ocmm_gui._start import parser
from ocmm_gui.app import run
from ocmm_gui.home import StartWindow
from ocmm_gui.window import MainWindow
from tests.host import BUSY, HANG_S

# Sixty seconds are the requirement.
pytestmark = pytest.mark.timing

FIRST_POINT_S = 60.0
_LOOK_MS = 50
_RING = 8
"""Pixels from the edge of a picture inwards."""
W = TypeVar("W", bound=QWidget)
Step = Callable[[], bool]


def _shown(kind: type[W]) -> W | None:
    """Return the window of a kind that is on the screen."""
    for widget in QApplication.topLevelWidgets():
        if isinstance(widget, kind) and widget.isVisible():
            return widget
    return None


class _Newcomer:
    """Reads and follows; every step begins when the screen shows a new text."""

    def __init__(self, pictures: Path) -> None:
        self.pictures = pictures
        self.begun = time.monotonic()
        self.first_point_s = float("inf")
        self.fault: BaseException | None = None
        self._walk = self._steps()
        self._waits: Step = lambda: True
        self._timer = QTimer()
        self._timer.setInterval(_LOOK_MS)
        self._timer.timeout.connect(self._look)
        self._timer.start()

    def _look(self) -> None:
        try:
            if time.monotonic() - self.begun > HANG_S:
                raise TimeoutError("The screen says nothing new.")
            if self._waits():
                self._waits = next(self._walk)
        except StopIteration:
            self._end()
        except BaseException as error:
            self.fault = error
            self._end()

    def _end(self) -> None:
        self._timer.stop()
        for widget in QApplication.topLevelWidgets():
            if isinstance(widget, StartWindow | MainWindow):
                widget.close()
        QApplication.quit()

    def _keep(self, window: QWidget, name: str) -> None:
        window.grab().save(str(self.pictures / f"{name}.png"))

    def _steps(self) -> Iterator[Step]:
        yield lambda: _shown(StartWindow) is not None
        start = _shown(StartWindow)
        assert start is not None
        yield lambda: "New here?" in start.page.hint.text()
        self._keep(start, "1_start")
        said = re.search(r"Press (\w+) \((\w+)\)", start.page.hint.text())
        assert said is not None
        _button(start, said.group(1)).click()

        yield lambda: _shown(MainWindow) is not None
        window = _shown(MainWindow)
        assert window is not None
        strip = window.hand.strip
        yield lambda: strip.isVisible() and "robot hand" in strip.text.text()
        self._keep(window, "2_demo")
        assert "Take over" in strip.text.text()
        _button(window, "Take over").click()

        yield lambda: "click to touch" in strip.text.text()
        view = window.desk.points
        yield view.is_painted
        self._keep(window, "3_taken")
        # "Next: touch 9 points on BED": the feature of that name is blue in the picture.
        step = re.search(r"on (\w+)\.", window.desk.guidance.step.text())
        assert step is not None
        place = _marked(window)
        assert place is not None
        QTest.mouseMove(view, place)
        yield _after(0.5)
        QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=place)

        # The panel next to it shows one dot filled: "1 / 9".
        yield lambda: any(
            "1 of 9 points" in window.desk.plan.item(row).text()
            for row in range(window.desk.plan.count())
        )
        self.first_point_s = time.monotonic() - self.begun
        yield _after(0.5)
        self._keep(window, "4_point")


def _button(window: QWidget, name: str) -> QPushButton:
    """Return the button by its visible name."""
    found = [
        one
        for one in window.findChildren(QPushButton)
        if one.isVisible() and one.text().startswith(name)
    ]
    assert found, name
    return found[0]


def _after(seconds: float) -> Step:
    until = time.monotonic() + seconds
    return lambda: time.monotonic() >= until


def _marked(window: MainWindow) -> QPoint | None:
    """Return the middle of the largest run of the marked colour in the 3-D view."""
    view = window.desk.points
    image = view.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    pixels = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1, 4)
    blue, green, red = (pixels[..., k].astype(int) for k in range(3))
    marked = (blue > 150) & (blue - red > 70) & (green > 100)
    # The focus ring also has that colour, and marks nothing on the part.
    for edge in (marked[:_RING], marked[-_RING:], marked[:, :_RING], marked[:, -_RING:]):
        edge[...] = False
    best, place = 0, None
    for y in range(0, image.height(), 6):
        row = marked[y].astype(np.int8)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], row, [0]])))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            if last - first > best:
                best, place = int(last - first), QPoint(int(first + last) // 2, y)
    return place if best > 20 else None


def test_the_first_own_point_within_a_minute_by_the_screen_alone(
    qapp: QApplication, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    walker = _Newcomer(tmp_path)
    code = run(
        parser().parse_args(
            ["--start", "--silent", "--size", "1280x720", "--out", str(tmp_path / "jobs")]
        )
    )
    if walker.fault is not None:
        raise walker.fault
    assert code == 0
    record_property("first own point, s", f"{walker.first_point_s:.1f}")
    assert walker.first_point_s < BUSY * FIRST_POINT_S
