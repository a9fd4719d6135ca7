"""The pages of the report on the screen, before anything is written."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QPixmap, QResizeEvent
from PySide6.QtWidgets import QLabel, QScrollArea, QVBoxLayout, QWidget

from ocmm_gui.reports._side import PagePicture

_GAP_PX = 12
_LEAST_PX, _MOST_PX = 300, 1240
"""A page that is wider than that is no easier to read, and costs the window its time."""
_SAME_PX = 8


class PagePreview(QScrollArea):
    """All pages below each other, as wide as there is room; Page up and down move on."""

    widened = Signal()
    """There is another room for the pages than they were drawn for."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Pages of the report")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
        self.setWidgetResizable(True)
        inside = QWidget()
        self._pages = QVBoxLayout(inside)
        self._pages.setSpacing(_GAP_PX)
        self.setWidget(inside)
        self._pictures: list[tuple[QLabel, PagePicture]] = []
        self.verticalScrollBar().valueChanged.connect(lambda _value: self._show_near())
        self._width = 0

    def width_in(self, room: int) -> int:
        """Return how wide a page is to be drawn where there is ``room``, pixels."""
        inside = room - self.verticalScrollBar().sizeHint().width() - 2 * _GAP_PX
        return min(max(inside, _LEAST_PX), _MOST_PX)

    def show_page(self, picture: PagePicture) -> None:
        """Show a page; the first one begins a report, and what was shown before goes."""
        if picture.index == 0:
            self.clear()
            self.verticalScrollBar().setValue(0)
            self._width = picture.width
        page = QLabel()
        page.setAccessibleName(f"Page {picture.index + 1} of {picture.count}")
        page.setFixedSize(picture.width, picture.height)
        self._pages.addWidget(page, 0, Qt.AlignmentFlag.AlignHCenter)
        self._pictures.append((page, picture))
        self._show_near()

    def page_count(self) -> int:
        """Return how many pages are shown; for tests."""
        return self._pages.count()

    def unpacked(self) -> list[bool]:
        """Return which pages have their pixels in the window now; for tests."""
        return [not page.pixmap().isNull() for page, _ in self._pictures]

    def clear(self) -> None:
        """Show no page."""
        self._pictures.clear()
        while (item := self._pages.takeAt(0)) is not None:
            old = item.widget()
            if old is not None:
                old.deleteLater()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Ask for pages that are as wide as there is room now."""
        super().resizeEvent(event)
        self._show_near()
        if self._width and abs(self.width_in(self.width()) - self._width) > _SAME_PX:
            self.widened.emit()

    def _show_near(self) -> None:
        """Unpack the pages that are looked at, and those beside them; let all others go."""
        if not self._pictures:
            return
        top, high = self.verticalScrollBar().value(), max(self.viewport().height(), _LEAST_PX)
        y = self._pages.contentsMargins().top()
        for page, picture in self._pictures:
            # By their sizes: pages that have just come are not laid out yet.
            near = y < top + 2 * high and y + picture.height > top - high
            if near and page.pixmap().isNull():
                page.setPixmap(QPixmap.fromImage(picture.image()))
            elif not near and not page.pixmap().isNull():
                page.setPixmap(QPixmap())
            y += picture.height + _GAP_PX

    def minimumSizeHint(self) -> QSize:
        """Return the size below which nothing can be read."""
        return QSize(_LEAST_PX, _LEAST_PX)
