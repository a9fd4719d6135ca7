"""The reports of a job: what will be in them is shown before anything is written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtWidgets import (
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QPlainTextEdit,
    QStackedWidget,
    QVBoxLayout,
)

from ocmm_core.export.registry import EXPORTERS, preview, preview_text, write_report
from ocmm_core.export.report_data import ReportData
from ocmm_gui.actions import ActionInfo
from ocmm_gui.reports.pdf import write_pdf
from ocmm_gui.reports.preview import PagePreview
from ocmm_gui.results.job_source import JobSource
from ocmm_gui.sheet import Sheet, caption, form_field
from ocmm_gui.theme import digit_font, text_font

_KEYS = (
    ActionInfo("mark", "Mark", "Mark this format to be written, or do not", ("F6", "Space")),
    ActionInfo("write", "Write", "Write the marked formats into the folder", ("F8", "E")),
)
_NAME = Qt.ItemDataRole.UserRole
_PDF = "pdf"
_TITLES = {**{name: item.title for name, item in EXPORTERS.items()}, _PDF: "PDF"}
"""By the name of the format; the PDF is drawn here, the others come from the core."""
_LIST_PX, _ROW_PX = 320, 36
_MOST_LINES = 400
"""A cloud of points is shown by its beginning."""


class ReportSheet(Sheet):
    """Formats on the left, on the right what the chosen one will hold.

    Parameters
    ----------
    folder
        Where reports go, as far as that is known.
    """

    written = Signal(object)
    """Emits the written files, ``tuple[Path, ...]``."""

    def __init__(self, folder: Callable[[], Path]) -> None:
        super().__init__("Report", _KEYS)
        self._source: JobSource | None = None
        self._folder = folder
        self.formats = QListWidget()
        self.formats.setAccessibleName("Formats")
        self.formats.setAccessibleDescription("Up and down show a preview, Space marks a format")
        self.formats.setFont(text_font(16))
        for name in _TITLES:
            item = QListWidgetItem(self.formats)
            item.setData(_NAME, name)
            item.setSizeHint(QSize(_LIST_PX - 20, _ROW_PX))
        self._marked = {"polyworks"} & set(EXPORTERS)
        self._write_marks()
        self.formats.setCurrentRow(0)
        self.formats.setFixedWidth(_LIST_PX)
        self.folder = form_field("Folder of the report", "Folder of the report")
        self.text = QPlainTextEdit()
        self.text.setAccessibleName("Preview")
        self.text.setReadOnly(True)
        self.text.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.text.setFont(digit_font(14, bold=False))
        left = QVBoxLayout()
        left.addWidget(self.formats, 1)
        self.pages = PagePreview()
        self.shown = QStackedWidget()
        self.shown.addWidget(self.text)
        self.shown.addWidget(self.pages)
        right = QVBoxLayout()
        right.addWidget(self.shown, 1)
        where = QHBoxLayout()
        where.addWidget(caption("Folder", self.folder))
        where.addWidget(self.folder, 1)
        right.addLayout(where)
        row = QHBoxLayout()
        row.addLayout(left)
        row.addLayout(right, 1)
        self.body.addLayout(row, 1)
        self.formats.currentRowChanged.connect(lambda _row: self._show_preview())
        self.formats.itemDoubleClicked.connect(lambda _item: self.mark())
        self.folder.returnPressed.connect(self.write)
        self.folder.left.connect(self.left)
        self.use_keys({"mark": self.mark, "write": self.write}, primary="write")

    def open(self, source: JobSource) -> None:
        """Show what would be written about a job."""
        self._source = source
        if not self.folder.text():
            self.folder.setText(str(self._folder()))
        self._show_preview()
        self.formats.setFocus()

    def mark(self) -> None:
        """Mark the chosen format to be written, or not."""
        if self.formats.currentRow() >= 0:
            self._marked ^= {str(self.formats.currentItem().data(_NAME))}
            self._write_marks()

    def marked(self) -> tuple[str, ...]:
        """Return the names of the marked formats."""
        return tuple(name for name in _TITLES if name in self._marked)

    def write(self) -> None:
        """Write the marked formats; every file is read back and compared before it counts."""
        source = self._source
        if source is None:
            return
        folder = Path(self.folder.text().strip()).expanduser()
        paths = self.attempt(lambda: self._written(source.report(), folder))
        if paths is not None:
            self.written.emit(paths)

    def _written(self, data: ReportData, folder: Path) -> tuple[Path, ...]:
        tables = [name for name in self.marked() if name != _PDF]
        paths = write_report(data, tables, folder) if tables or _PDF not in self._marked else ()
        return (*paths, write_pdf(data, folder)) if _PDF in self._marked else paths

    def _write_marks(self) -> None:
        for row in range(self.formats.count()):
            item = self.formats.item(row)
            name = str(item.data(_NAME))
            item.setText(f"{'☑' if name in self._marked else '☐'}  {_TITLES[name]}")

    def _show_preview(self) -> None:
        row, source = self.formats.currentRow(), self._source
        if row < 0 or source is None:
            return
        name = str(self.formats.item(row).data(_NAME))
        self.shown.setCurrentWidget(self.pages if name == _PDF else self.text)
        if name == _PDF:
            data = self.attempt(source.report)
            if data is not None:
                self.pages.show_report(data)
            return
        tables = self.attempt(lambda: preview(source.report(), name))
        lines = [] if tables is None else preview_text(tables).splitlines()
        more = len(lines) - _MOST_LINES
        shown = "\n".join(lines[:_MOST_LINES])
        self.text.setPlainText(f"{shown}\n… and {more} more lines" if more > 0 else shown)
