"""The pages of the report on the screen, before anything is written."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QPixmap, QResizeEvent
from PySide6.QtWidgets import QLabel, QScrollArea, QVBoxLayout, QWidget

from ocmm_core.export.report_data import ReportData
from ocmm_gui.reports.canvas import Canvas
from ocmm_gui.reports.pdf import lay_out, page_picture

_GAP_PX = 12
_LEAST_PX = 300


class PagePreview(QScrollArea):
    """All pages below each other, as wide as there is room; Page up and down move on."""

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
        self._data: ReportData | None = None
        self._canvas = Canvas()

    def show_report(self, data: ReportData) -> None:
        """Show the pages of a report."""
        self._data, self._canvas = data, lay_out(data)
        self._paint()
        self.verticalScrollBar().setValue(0)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Paint the pages as wide as there is room now."""
        super().resizeEvent(event)
        if event.oldSize().width() != event.size().width():
            self._paint()

    def minimumSizeHint(self) -> QSize:
        """Return the size below which nothing can be read."""
        return QSize(_LEAST_PX, _LEAST_PX)

    def _paint(self) -> None:
        while (item := self._pages.takeAt(0)) is not None:
            old = item.widget()
            if old is not None:
                old.deleteLater()
        if self._data is None:
            return
        width = max(self.viewport().width() - 2 * _GAP_PX, _LEAST_PX)
        for index in range(len(self._canvas.pages)):
            page = QLabel()
            page.setAccessibleName(f"Page {index + 1} of {len(self._canvas.pages)}")
            page.setPixmap(QPixmap.fromImage(page_picture(self._canvas, index, self._data, width)))
            self._pages.addWidget(page, 0, Qt.AlignmentFlag.AlignHCenter)
