"""Preview of the report's pages on the screen."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QPixmap, QResizeEvent
from PySide6.QtWidgets import QLabel, QScrollArea, QWidget

from ocmm_gui.kit import dressed, vbox
from ocmm_gui.reports._side import PagePicture

_GAP_PX = 12
_LEAST_PX, _MOST_PX = 300, 1240
"""Wider pages are no more legible, and slow down the window."""
_SAME_PX = 8


class PagePreview(QScrollArea):
    """All pages stacked, at the available width; scrolled by Page up and down."""

    widened = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Pages of the report")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
        self.setWidgetResizable(True)
        inside = QWidget()
        self._pages = vbox(parent=inside, spacing=_GAP_PX)
        self.setWidget(inside)
        self._pictures: list[tuple[QLabel, PagePicture]] = []
        self.verticalScrollBar().valueChanged.connect(lambda _value: self._show_near())
        self._width = 0

    def width_in(self, room: int) -> int:
        """Return the width of a page for ``room``, pixels."""
        inside = room - self.verticalScrollBar().sizeHint().width() - 2 * _GAP_PX
        return min(max(inside, _LEAST_PX), _MOST_PX)

    def show_page(self, picture: PagePicture) -> None:
        """Show a page; the first one replaces an earlier report."""
        if picture.index == 0:
            self.clear()
            self.verticalScrollBar().setValue(0)
            self._width = picture.width
        page = dressed(QLabel(), f"Page {picture.index + 1} of {picture.count}")
        page.setFixedSize(picture.width, picture.height)
        self._pages.addWidget(page, 0, Qt.AlignmentFlag.AlignHCenter)
        self._pictures.append((page, picture))
        self._show_near()

    def page_count(self) -> int:
        """Return the number of pages; for tests."""
        return self._pages.count()

    def unpacked(self) -> list[bool]:
        """Return which pages are unpacked; for tests."""
        return [not page.pixmap().isNull() for page, _ in self._pictures]

    def clear(self) -> None:
        self._pictures.clear()
        while (item := self._pages.takeAt(0)) is not None:
            old = item.widget()
            if old is not None:
                old.deleteLater()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._show_near()
        if self._width and abs(self.width_in(self.width()) - self._width) > _SAME_PX:
            self.widened.emit()

    def _show_near(self) -> None:
        """Unpack the visible pages and their neighbours; release all others."""
        if not self._pictures:
            return
        top, high = self.verticalScrollBar().value(), max(self.viewport().height(), _LEAST_PX)
        y = self._pages.contentsMargins().top()
        for page, picture in self._pictures:
            # By their sizes: new pages are not laid out yet.
            near = y < top + 2 * high and y + picture.height > top - high
            if near and page.pixmap().isNull():
                page.setPixmap(QPixmap.fromImage(picture.image()))
            elif not near and not page.pixmap().isNull():
                page.setPixmap(QPixmap())
            y += picture.height + _GAP_PX

    def minimumSizeHint(self) -> QSize:
        return QSize(_LEAST_PX, _LEAST_PX)
