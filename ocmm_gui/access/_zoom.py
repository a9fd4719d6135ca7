"""Scale of the window, by the screen and by the user, and scrolling of larger pages.

Pages are laid out in pixels for a screen of 1080 lines. Qt multiplies everything by one factor:
text, lines, icons, hit areas, pictures. ``QT_SCALE_FACTOR`` sets it before the application starts,
the only documented way. To change it at run time, Qt has a function exported for its own modules
only (``QHighDpiScaling::setGlobalFactor``), which is looked up by name: with a Qt that lacks it the
zoom takes effect at the next start, with a message.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import PySide6
from PySide6.QtCore import QEvent, QLibraryInfo, QObject, QSize, Qt, Signal, qInstallMessageHandler
from PySide6.QtGui import QResizeEvent, QScreen
from PySide6.QtWidgets import QApplication, QFrame, QScrollArea, QScroller, QStackedWidget, QWidget

LEAST_PERCENT, MOST_PERCENT, STEP_PERCENT = 80, 200, 10
_SCALE = "QT_SCALE_FACTOR"
_LAID_OUT = QSize(1920, 1080)
"""The screen that pages are made for; smaller ones are handled by the layouts."""
_TRIED = QSize(1280, 760)
"""The smallest size that pages are tried in, with the title of the window."""
_LEAST, _MOST = 0.5, 4.0
_STEP = 0.05
_NAMES = {
    "linux": ("libQt6Gui.so.6", "_ZN15QHighDpiScaling15setGlobalFactorEd"),
    "win32": ("Qt6Gui.dll", "?setGlobalFactor@QHighDpiScaling@@SAXN@Z"),
}
_MARK = "ocmm_factor"


def zoom_before_start(percent: int) -> None:
    """Set the zoom, per cent, of a starting application if Qt cannot change it later."""
    if _setter() is None and percent != 100 and _SCALE not in os.environ:
        os.environ[_SCALE] = f"{percent / 100.0:g}"


def screen_factor(size: QSize) -> float:
    """Return the scale of a screen, ``size`` in system pixels, over the layout's, at least 1."""
    whole = min(size.width() / _LAID_OUT.width(), size.height() / _LAID_OUT.height(), _MOST)
    return max(1.0, int(whole / _STEP + 1e-6) * _STEP)


def fitting_factor(size: QSize) -> float:
    """Return how much smaller everything is on a screen too small for pages, at most 1."""
    share = min(size.width() / _TRIED.width(), size.height() / _TRIED.height(), 1.0)
    return max(_LEAST, int(share / _STEP + 1e-6) * _STEP)


class Zoom(QObject):
    """Zoom of the application, common to all its windows. `app`: stores the current factor."""

    changed = Signal()

    def __init__(self, app: QApplication) -> None:
        super().__init__(app)
        self._app = app
        self.percent = 100

    def can_change(self) -> bool:
        """Return whether a change takes effect immediately."""
        return _setter() is not None

    def factor(self) -> float:
        """Return the scale factor in addition to those of system and user."""
        kept = self._app.property(_MARK)
        return float(kept) if isinstance(kept, float) else 1.0

    def use(self, percent: int, screen: QScreen | None = None) -> bool:
        """Set the zoom; return whether anything changed. `screen`: None for the first one."""
        self.percent = min(max(percent, LEAST_PERCENT), MOST_PERCENT)
        screen = screen or self._app.primaryScreen()
        setter = _setter()
        if setter is None or screen is None:
            return False
        before = self.factor()
        own = QSize(
            round(screen.geometry().width() * before), round(screen.geometry().height() * before)
        )
        after = self.percent / 100.0 * screen_factor(own)
        if self._app.platformName() != "offscreen":
            # Pictures are made and tests run on a screen of 800 x 800 that nobody sees.
            after *= fitting_factor(own)
        if abs(after - before) < 1e-6:
            return False
        self._change(setter, before, after)
        self.changed.emit()
        return True

    def _change(self, setter: Callable[[float], None], before: float, after: float) -> None:
        tops = [one for one in self._app.topLevelWidgets() if one.windowHandle() is not None]
        shown = [one.isVisible() for one in tops]
        active, focus = self._app.activeWindow(), self._app.focusWidget()
        for one in tops:
            one.hide()
        # Qt warns that windows exist; they are recreated below.
        told = qInstallMessageHandler(lambda *_: None)
        try:
            setter(_of_user() * after)
        finally:
            qInstallMessageHandler(told)
        self._app.setProperty(_MARK, after)
        for one, visible in zip(tops, shown, strict=True):
            least = _rescaled(one, "least", one.minimumSize(), before, after)
            size = _rescaled(one, "size", one.size(), before, after)
            handle = one.windowHandle()
            if handle is not None:
                # The window keeps its size on the screen; its contents change.
                handle.destroy()
            one.setMinimumSize(least)
            if not (one.isMaximized() or one.isFullScreen()):
                one.resize(size)
            if visible:
                one.show()
        if active is not None and active.isVisible():
            active.activateWindow()
            if focus is not None:
                focus.setFocus()


def _rescaled(window: QWidget, what: str, size: QSize, before: float, after: float) -> QSize:
    """Return a size in pixels of another factor, reversibly."""
    kept = window.property(f"ocmm_{what}")
    dots, led_to = kept if isinstance(kept, tuple) else (None, None)
    if dots is None or led_to != (size.width(), size.height()):
        # Changed by the user since; otherwise rounding would accumulate.
        dots = (size.width() * before, size.height() * before)
    found = QSize(round(dots[0] / after), round(dots[1] / after))
    window.setProperty(f"ocmm_{what}", (dots, (found.width(), found.height())))
    return found


def _of_user() -> float:
    """Return the user's scale factor for all Qt programs."""
    try:
        found = float(os.environ.get(_SCALE, "1"))
    except ValueError:
        return 1.0
    return found if 0.1 <= found <= 10.0 else 1.0


@cache
def _setter() -> Callable[[float], None] | None:
    """Return Qt's function that changes the factor; None if missing."""
    names = _NAMES.get(sys.platform)
    if names is None:
        return None
    file, symbol = names
    # In the package it is next to PySide6.
    own = Path(PySide6.__file__).parent
    for folder in (
        Path(QLibraryInfo.path(QLibraryInfo.LibraryPath.LibrariesPath)), own / "Qt" / "lib", own,
    ):  # fmt: skip
        if not (folder / file).exists():
            continue
        try:
            found = ctypes.CDLL(str(folder / file))[symbol]
        except (OSError, AttributeError):
            continue
        found.argtypes, found.restype = (ctypes.c_double,), None
        return lambda factor: found(factor)
    return None


TRIED = QSize(1280, 720)
"""The smallest tested screen: zoomed pages are never laid out smaller, but scrolled."""


class PageStack(QStackedWidget):
    """Stacked pages of which only the current one determines the size."""

    def __init__(self) -> None:
        super().__init__()
        self.currentChanged.connect(lambda _index: self.updateGeometry())

    def minimumSizeHint(self) -> QSize:
        page = self.currentWidget()
        if page is None:
            return QSize(0, 0)
        return page.minimumSizeHint().expandedTo(page.minimumSize())

    def sizeHint(self) -> QSize:
        page = self.currentWidget()
        return QSize(0, 0) if page is None else page.sizeHint()


class _Holder(QWidget):
    """Holder of the whole window, with its minimum size.

    A scroll area with a layout would use the preferred height of texts. Every page was tested at
    the smallest size, at which it hides what is least needed, and gets no more, unless its buttons
    are made for gloves.
    """

    def __init__(self, whole: QWidget) -> None:
        super().__init__()
        self._gives_up = True
        self._whole = whole
        whole.setParent(self)

    def minimumSizeHint(self) -> QSize:
        needed = self._whole.minimumSizeHint().expandedTo(self._whole.minimumSize())
        return needed.boundedTo(TRIED) if self._gives_up else needed

    def give_up(self, *, wanted: bool) -> None:
        """Allow or forbid pages to hide what is least needed."""
        self._gives_up = wanted
        self.updateGeometry()

    def event(self, event: QEvent) -> bool:
        """Pass on changes of the required size, which happens automatically only with a layout."""
        if event.type() is QEvent.Type.LayoutRequest:
            self.updateGeometry()
        return super().event(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._whole.setGeometry(self.rect())


class ZoomArea(QScrollArea):
    """Show the whole window, or parts of it with scroll bars."""

    def __init__(self, whole: QWidget) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._whole = _Holder(whole)
        self.setWidget(self._whole)

    def use(self, *, enlarged: bool, far: bool) -> None:
        """Use the tested layout for zoomed pages; the far view always fits."""
        least = TRIED if enlarged and not far else QSize(0, 0)
        if self._whole.minimumSize() != least:
            self._whole.setMinimumSize(least)

    def use_bars(self, target_px: int) -> None:
        """Use scroll bars for gloves and finger dragging; zero for a mouse."""
        self._whole.give_up(wanted=not target_px)
        wide = target_px // 2
        upright, lying = self.verticalScrollBar(), self.horizontalScrollBar()
        for bar, side in ((upright, "width"), (lying, "height")):
            bar.setStyleSheet(f"QScrollBar {{ {side}: {wide}px; }}" if target_px else "")
        if target_px:
            QScroller.grabGesture(self.viewport(), QScroller.ScrollerGestureType.TouchGesture)
        else:
            QScroller.ungrabGesture(self.viewport())

    def scrolls(self) -> bool:
        return self.horizontalScrollBar().maximum() > 0 or self.verticalScrollBar().maximum() > 0

    def minimumSizeHint(self) -> QSize:
        """Return next to nothing: what does not fit is scrolled."""
        return QSize(80, 60)
