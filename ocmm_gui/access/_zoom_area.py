"""A window that scrolls pages larger than itself."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QScrollArea, QScroller, QStackedWidget, QWidget

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
