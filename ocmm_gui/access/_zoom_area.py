"""A window whose page is scrolled where it has less room than it needs."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QScrollArea, QScroller, QStackedWidget, QWidget

TRIED = QSize(1280, 720)
"""The smallest screen on which every page is looked at; enlarged, a page is never laid out smaller.

A page that is seen through a window of half its size is scrolled, as with a magnifying glass.
"""


class PageStack(QStackedWidget):
    """Pages of which the one that is shown says how much room is needed, and no other."""

    def __init__(self) -> None:
        super().__init__()
        self.currentChanged.connect(lambda _index: self.updateGeometry())

    def minimumSizeHint(self) -> QSize:
        """Return what the page that is shown needs."""
        page = self.currentWidget()
        if page is None:
            return QSize(0, 0)
        return page.minimumSizeHint().expandedTo(page.minimumSize())

    def sizeHint(self) -> QSize:
        """Return what the page that is shown likes."""
        page = self.currentWidget()
        return QSize(0, 0) if page is None else page.sizeHint()


class _Holder(QWidget):
    """Holds the whole of a window, and asks for what that needs at least.

    An area that scrolls a layout directly gives it the height that its words would like. Every page
    was tried at the smallest size: there it gives up what is least missed, and asks for no more
    than that, unless its buttons are made for gloves.
    """

    def __init__(self, whole: QWidget) -> None:
        super().__init__()
        self._gives_up = True
        self._whole = whole
        whole.setParent(self)

    def minimumSizeHint(self) -> QSize:
        """Return what is needed at least."""
        needed = self._whole.minimumSizeHint().expandedTo(self._whole.minimumSize())
        return needed.boundedTo(TRIED) if self._gives_up else needed

    def give_up(self, *, wanted: bool) -> None:
        """Let pages give up what is least missed where they were tried without it, or do not."""
        self._gives_up = wanted
        self.updateGeometry()

    def event(self, event: QEvent) -> bool:
        """Pass on that the whole needs more or less than it did: without a layout nobody does."""
        if event.type() is QEvent.Type.LayoutRequest:
            self.updateGeometry()
        return super().event(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give it all the room."""
        self._whole.setGeometry(self.rect())


class ZoomArea(QScrollArea):
    """Shows the whole of a window where it has room, and parts of it with bars where not."""

    def __init__(self, whole: QWidget) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._whole = _Holder(whole)
        self.setWidget(self._whole)

    def use(self, *, enlarged: bool, far: bool) -> None:
        """Lay pages out as they were tried where they are enlarged; the far view fits always."""
        least = TRIED if enlarged and not far else QSize(0, 0)
        if self._whole.minimumSize() != least:
            self._whole.setMinimumSize(least)

    def use_bars(self, target_px: int) -> None:
        """Have bars for gloves, and pages that a finger pulls; zero for a mouse."""
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
        """Return whether less than all is seen."""
        return self.horizontalScrollBar().maximum() > 0 or self.verticalScrollBar().maximum() > 0

    def minimumSizeHint(self) -> QSize:
        """Return next to nothing: what does not fit is scrolled."""
        return QSize(80, 60)
