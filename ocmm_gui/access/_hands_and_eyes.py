"""Zoom and gloves of one window, by its keys and settings.

Targets for gloves measure 15 mm in both directions, by the physical size of the screen.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from PySide6.QtCore import QObject, QPointF, QSize, QSizeF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QPaintEvent, QPen, QScreen
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QComboBox,
    QLineEdit,
    QListWidget,
    QMainWindow,
    QSizePolicy,
    QTabBar,
    QTableWidget,
    QWidget,
)

from ocmm_core.errors import OcmmError
from ocmm_core.settings import Settings, SettingsStore, Value
from ocmm_gui.access._zoom import LEAST_PERCENT, MOST_PERCENT, STEP_PERCENT, Zoom, ZoomArea
from ocmm_gui.kit import NoticeCentre, PaintedWidget, ink, localised, text_font, tr

RULER_PX = 500
"""Dots in the measured line: 78 mm on 3840 at 27 inch, 207 mm on 1280 at 24 inch."""

_PITCH_MM = (0.04, 1.0)
"""A telephone has 0.05 mm a dot, a television of 85 inch 0.98 mm."""
_ASPECT = 0.12
"""Tolerated relative difference of both pitches; dots are square."""
_PLACEHOLDERS = ((160, 90), (160, 100), (16, 9), (16, 10), (1600, 900), (1600, 1000))
"""Aspect ratios that screens and projectors report instead of their size, in mm or cm."""
_UNKNOWN_MM = 25.4 / 96.0
"""Default dot size of systems."""


@dataclass(frozen=True, slots=True)
class ScreenSize:
    mm_per_px: float
    known: bool
    """Measured, or plausible by the screen."""


def screen_size(screen: QScreen, ruler_mm: float | None) -> ScreenSize:
    """Return the pixel size; `ruler_mm`: measured length of `RULER_PX` dots, or None."""
    ratio = screen.devicePixelRatio()
    if ruler_mm is not None:
        return ScreenSize(ruler_mm / RULER_PX * ratio, known=True)
    dots = QSizeF(screen.geometry().size()) * ratio
    pitch = believed_pitch(screen.physicalSize(), dots)
    if pitch is None:
        # Not times the ratio: too large a target is better than too small a one.
        return ScreenSize(_UNKNOWN_MM, known=False)
    return ScreenSize(pitch * ratio, known=True)


def believed_pitch(physical: QSizeF, dots: QSizeF) -> float | None:
    """Return the size of a dot, mm; None if the reported width and height are implausible."""
    if min(physical.width(), physical.height(), dots.width(), dots.height()) <= 0.0:
        return None
    if (round(physical.width()), round(physical.height())) in _PLACEHOLDERS:
        return None
    wide, high = physical.width() / dots.width(), physical.height() / dots.height()
    if abs(wide - high) > _ASPECT * max(wide, high):
        return None
    # The smaller one gives the larger target.
    pitch = min(wide, high)
    return pitch if _PITCH_MM[0] <= pitch <= _PITCH_MM[1] else None


_HIGH_PX, _END_PX = 56, 12


class RulerLine(PaintedWidget):
    """A line of `RULER_PX` dots, and its length by the screen."""

    def __init__(self) -> None:
        super().__init__(
            tr("Line to be measured with a ruler"), (RULER_PX + 20, _HIGH_PX), (60, _HIGH_PX)
        )
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._ruler_mm: float | None = None

    def show_length(self, ruler_mm: float | None) -> None:
        self._ruler_mm = ruler_mm
        self.setAccessibleDescription(self.message())
        self.update()

    def message(self) -> str:
        size = screen_size(self.screen(), self._ruler_mm)
        length = localised(f"{size.mm_per_px * self.length_px():.0f}")
        if self._ruler_mm is not None:
            return tr("Measured: {length} mm.").format(length=length)
        if size.known:
            return tr("The screen says {length} mm. Measure it if that is wrong.").format(
                length=length
            )
        return tr("This screen does not tell its size. Measure the line with a ruler.")

    def length_px(self) -> float:
        """Return the length of the line in pixels of the layout."""
        return RULER_PX / self.devicePixelRatioF()

    def minimumSizeHint(self) -> QSize:
        """Return room for the whole line: part of it would be measured wrong."""
        return QSize(round(self.length_px()) + 4, _HIGH_PX)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        painter.setPen(QPen(QColor(self._theme.text), 1.0))
        left, right, y = 1.5, 1.5 + self.length_px(), 0.5 * _END_PX + 4.0
        painter.drawLine(QPointF(left, y), QPointF(right, y))
        for x in (left, right):
            painter.drawLine(QPointF(x, y - 0.5 * _END_PX), QPointF(x, y + 0.5 * _END_PX))
        ink(painter, QColor(self._theme.muted), font=text_font(14))
        box = self.rect().adjusted(0, _END_PX + 8, 0, 0)
        flags = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap
        painter.drawText(box, flags, self.message())


TARGET_MM = 15.0
"""A gloved finger; source in decision 74."""

_EVERY_MS = 250
"""ms: new rows and buttons may be small for as long."""
_LEAST, _MOST = "ocmm_least_before", "ocmm_most_before"
_ROW = Qt.ItemDataRole(Qt.ItemDataRole.UserRole + 97)
_MOST_PX = 16777215
_PARTS = ("qt_", "Scroll", "ExtensionButton")
"""Names of Qt's internal widgets."""


class TouchTargets(QObject):
    """Enlarge all controls of a window to a minimum size."""

    def __init__(self, window: QWidget) -> None:
        super().__init__(window)
        self._window = window
        self._px = 0
        self._timer = QTimer(self, interval=_EVERY_MS)
        self._timer.timeout.connect(self.fit)

    def pixels(self) -> int:
        """Return the minimum size of a target, px; zero for none."""
        return self._px

    def use(self, mm_per_px: float | None) -> None:
        """Use targets of `TARGET_MM`; None restores the original sizes."""
        px = 0 if mm_per_px is None else math.ceil(TARGET_MM / mm_per_px - 1e-9)
        if px == self._px:
            return
        if self._px:
            for widget in _controls(self._window):
                _restore(widget)
        self._px = px
        if px:
            self.fit()
            self._timer.start()
        else:
            self._timer.stop()

    def fit(self) -> None:
        if not self._px:
            return
        for widget in _controls(self._window):
            if widget.isVisible():
                _enlarge(widget, self._px)


def _controls(window: QWidget) -> Iterator[QWidget]:
    for kind in (QAbstractButton, QLineEdit, QComboBox, QListWidget, QTableWidget, QTabBar):
        for widget in window.findChildren(kind):
            inner = isinstance(widget, QLineEdit) and isinstance(widget.parent(), QComboBox)
            if not inner and not widget.objectName().startswith(_PARTS) and _is_ours(widget):
                yield widget


def _is_ours(widget: QWidget) -> bool:
    # The corner of a table is a button of Qt without a name.
    return not (isinstance(widget, QAbstractButton) and isinstance(widget.parent(), QTableWidget))


def _is_pressed(widget: QWidget) -> bool:
    """Return whether rows can be pressed."""
    return bool(widget.focusPolicy().value & Qt.FocusPolicy.ClickFocus.value)


def _enlarge(widget: QWidget, px: int) -> None:
    if isinstance(widget, QListWidget):
        _enlarge_rows(widget, px)
        return
    if isinstance(widget, QTableWidget):
        if _is_pressed(widget):
            header = widget.verticalHeader()
            if widget.property(_LEAST) is None:
                kept = QSize(header.minimumSectionSize(), header.defaultSectionSize())
                widget.setProperty(_LEAST, kept)
            header.setMinimumSectionSize(px)
            header.setDefaultSectionSize(max(px, header.defaultSectionSize()))
            for row in range(widget.rowCount()):
                if widget.rowHeight(row) < px and not widget.isRowHidden(row):
                    widget.setRowHeight(row, px)
        return
    least, most, hint = widget.minimumSize(), widget.maximumSize(), widget.minimumSizeHint()
    before = widget.property(_LEAST)
    if not isinstance(before, QSize):
        before = least
    # An explicit minimum size replaces that of the text: it is set only if larger.
    wanted = QSize(before)
    if max(before.height(), 0 if before.height() else hint.height()) < px:
        wanted.setHeight(px)
    if isinstance(widget, QAbstractButton):
        need = before.width() or hint.width()
        if need < px:
            wanted.setWidth(px)
    if wanted != least:
        widget.setProperty(_LEAST, before)
        widget.setMinimumSize(wanted)
    if most.height() < px or (isinstance(widget, QAbstractButton) and most.width() < px):
        widget.setProperty(_MOST, most)
        widget.setMaximumSize(most.expandedTo(QSize(px, px)))


def _enlarge_rows(view: QListWidget, px: int) -> None:
    for row in range(view.count()):
        item = view.item(row)
        if view.sizeHintForIndex(view.indexFromItem(item)).height() < px:
            if item.data(_ROW) is None:
                item.setData(_ROW, item.sizeHint())
            item.setSizeHint(QSize(max(item.sizeHint().width(), 40), px))


def _restore(widget: QWidget) -> None:
    least, most = widget.property(_LEAST), widget.property(_MOST)
    if isinstance(widget, QListWidget):
        for row in range(widget.count()):
            item = widget.item(row)
            if isinstance(item.data(_ROW), QSize):
                item.setSizeHint(item.data(_ROW))
                item.setData(_ROW, None)
        return
    if isinstance(widget, QTableWidget):
        if isinstance(least, QSize):
            header = widget.verticalHeader()
            header.setMinimumSectionSize(least.width())
            header.setDefaultSectionSize(least.height())
            for row in range(widget.rowCount()):
                widget.setRowHeight(row, least.height())
            widget.setProperty(_LEAST, None)
        return
    if isinstance(most, QSize):
        widget.setMaximumSize(most)
        widget.setProperty(_MOST, None)
    if isinstance(least, QSize):
        widget.setMinimumSize(least)
        widget.setProperty(_LEAST, None)


class HandsAndEyes(QObject):
    """Zoom of a window with central widget ``area``, and targets for gloves; both are stored."""

    kept = Signal()
    """A key changed a setting: displayed settings must be reread."""

    def __init__(
        self, window: QMainWindow, area: ZoomArea, store: SettingsStore, notices: NoticeCentre
    ) -> None:
        super().__init__(window)
        self._window, self._area = window, area
        self._store, self._notices = store, notices
        app = QApplication.instance()
        assert isinstance(app, QApplication)  # noqa: S101 - a window has one
        found = app.findChild(Zoom)
        self.zoom = found if isinstance(found, Zoom) else Zoom(app)
        self.touch = TouchTargets(window)
        self._settings: Settings | None = None
        self._far = False
        # The minimum size was given in unscaled pixels.
        window.setMinimumSize(window.minimumSize() / self.zoom.factor())
        self.zoom.changed.connect(self._fit)

    def calls(self) -> dict[str, Callable[[], None]]:
        return {
            "zoom_in": lambda: self.step(1),
            "zoom_out": lambda: self.step(-1),
            "zoom_reset": lambda: self._keep_zoom(100),
            "gloves": self.toggle_gloves,
        }

    def use(self, settings: Settings) -> None:
        self._settings = settings
        self.zoom.use(settings.window_zoom, self._window.screen())
        self._fit()

    def show_far(self, far: bool) -> None:
        """Keep the far view as large as the window; other pages may be scrolled."""
        self._far = far
        self._area.use(enlarged=self.zoom.percent > 100, far=far)
        self.touch.fit()

    def step(self, steps: int) -> None:
        """Enlarge, or reduce with negative ``steps``."""
        now = self.zoom.percent + STEP_PERCENT * steps
        self._keep_zoom(min(max(now, LEAST_PERCENT), MOST_PERCENT))

    def toggle_gloves(self) -> None:
        on = self._settings is None or not self._settings.window_gloves
        self._keep({"window.gloves": on})
        if not on:
            self._notices.inform(tr("Glove mode off."))
        elif self._size_is_known():
            self._notices.inform(tr("Glove mode on: targets of 15 mm."))
        else:
            self._notices.warn(
                tr("Glove mode on, but this screen does not tell its size."),
                tr("Measure the line in Settings, Window: then targets are 15 mm."),
            )

    def _size_is_known(self) -> bool:
        ruler = None if self._settings is None else self._settings.window_ruler_mm
        return screen_size(self._window.screen(), ruler).known

    def _keep_zoom(self, percent: int) -> None:
        self._keep({"window.zoom": percent})
        shown = tr("Zoom {percent} %.").format(percent=percent)
        if not self.zoom.can_change():
            shown += " " + tr("It is used from the next start.")
        self._notices.inform(shown)

    def _keep(self, changes: dict[str, Value]) -> None:
        # If it cannot be stored it holds until restart, without a message.
        with contextlib.suppress(OcmmError):
            self._store.change(changes)
        chosen: dict[str, Any] = {key.replace(".", "_"): new for key, new in changes.items()}
        self.use(replace(self._store.load().settings, **chosen))
        self.kept.emit()

    def _fit(self) -> None:
        settings = self._settings
        self._area.use(enlarged=self.zoom.percent > 100, far=self._far)
        if settings is None or not settings.window_gloves:
            self.touch.use(None)
        else:
            self.touch.use(screen_size(self._window.screen(), settings.window_ruler_mm).mm_per_px)
        self._area.use_bars(self.touch.pixels())
