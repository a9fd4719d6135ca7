"""Reports of a job with a preview of their contents."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QPlainTextEdit, QStackedWidget

from ocmm_core.errors import OcmmError
from ocmm_core.export import DEFAULT_FORMAT, FORMATS, PDF
from ocmm_core.export.report import ReportData
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.reports import FormatText, PagePicture, PagePreview, preview_formats
from ocmm_gui.results._job_source import JobSource
from ocmm_gui.results._report_writer import PaperForm, ReportWriter
from ocmm_gui.work import SideProcess, WorkLine

_KEYS = (
    kit.ActionInfo("mark", later("Mark"), later("Select or clear this format"), ("F6", "Space")),
    kit.ActionInfo(
        "write", later("Write"), later("Write the selected formats to the folder"), ("F8", "E")
    ),
)
_NAME = Qt.ItemDataRole.UserRole
_LIST_PX, _ROW_PX = 320, 36
_GIVE_UP = later("F8 cancels.")
_SETTLE_MS = 300
"""Delay after a change of the window's size."""
_TYPED_MS = 600
"""Delay after typing."""


class ReportSheet(kit.Sheet):
    """Formats on the left, preview of the selected one on the right."""

    written = Signal(object)

    def __init__(self, folder: Callable[[], Path]) -> None:
        super().__init__(tr("Report"), _KEYS)
        self._source: JobSource | None = None
        self._folder = folder
        tip = tr("Up and down show a preview, Space selects a format")
        self.formats = kit.dressed(QListWidget(), tr("Formats"), tip, font=kit.text_font(16))
        for name in FORMATS:
            item = QListWidgetItem(self.formats)
            item.setData(_NAME, name)
            item.setSizeHint(QSize(_LIST_PX - 20, _ROW_PX))
        self._marked = {DEFAULT_FORMAT}
        self._write_marks()
        self.formats.setCurrentRow(0)
        self.formats.setFixedWidth(_LIST_PX)
        self.question = kit.AnswerPanel(tr("The job is not complete"), tr("Write"))
        self.work = WorkLine(tr("Report"))
        self._writer = ReportWriter(self)
        self._writer.asked.connect(self.question.ask)
        self.question.agreed.connect(self._writer.agree)
        self._writer.begun.connect(lambda: self.work.start(tr("Writing the report"), tr(_GIVE_UP)))
        self._writer.advanced.connect(self.work.advance)
        self._writer.ended.connect(self._on_ended)
        self._writer.written.connect(self.written)
        self._writer.failed.connect(self.failed)
        self._texts: dict[str, str] = {}
        self._asked = 0
        self._fresh = True
        self._previewing = SideProcess(
            self, self._on_previewed, self._on_no_preview, self._on_advanced, self._on_part
        )
        self._settling = QTimer(self, singleShot=True, interval=_SETTLE_MS)
        self._settling.timeout.connect(self.preview)
        self.folder = kit.form_field(tr("Report folder"), tr("Report folder"))
        self.text = kit.dressed(QPlainTextEdit(), tr("Preview"))
        self.text.setReadOnly(True)
        self.text.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.text.setFont(kit.digit_font(14, bold=False))
        self.paper = PaperForm()
        self.paper.setFixedWidth(_LIST_PX)
        self.paper.changed.connect(self._on_paper)
        self.paper.left.connect(self.left)
        left = kit.vbox((self.formats, 1), self.paper)
        self.pages = PagePreview()
        self.pages.widened.connect(self._on_widened)
        self.shown = QStackedWidget()
        self.shown.addWidget(self.text)
        self.shown.addWidget(self.pages)
        right = kit.vbox(self.paper.fault, (self.shown, 1))
        right.addLayout(kit.hbox(kit.caption(tr("Folder"), self.folder), (self.folder, 1)))
        kit.fill(self.body, self.question, self.work, (kit.hbox(left, (right, 1)), 1))
        self.formats.currentRowChanged.connect(lambda _row: self._show_chosen())
        self.formats.itemDoubleClicked.connect(lambda _item: self.mark())
        self.folder.returnPressed.connect(self.write)
        self.folder.left.connect(self.left)
        self.use_keys({"mark": self.mark, "write": self.write}, primary="write")

    def open(self, source: JobSource) -> None:
        self._source = source
        self._texts = {}
        self.pages.clear()
        self.question.hide()
        self.show_message(source.title(source.view()), warns=source.read_only)
        if not self.folder.text():
            self.folder.setText(str(self._folder().expanduser().absolute()))
        try:
            self.paper.open(source.path)
        except OcmmError as error:
            self.failed.emit(error)
        self.preview()
        self.formats.setFocus()

    def preview(self) -> None:
        """Preview all formats of the current job in the background."""
        source = self._source
        if source is None:
            return
        self._asked += 1
        self._fresh = True
        self._show_chosen()
        if not self._writer.is_busy():
            self.work.start(tr("Preparing the preview"))
        asked = self._asked

        def done(data: ReportData) -> None:
            if asked != self._asked:
                return
            try:
                paper = self.paper.paper()
            except OcmmError as error:
                # Next to the field: the path may be incomplete while typing.
                self.paper.show_fault(error)
                self._on_ended()
                return
            self.paper.show_fault(None)
            self._keep()
            width = self.pages.width_in(self.shown.width())
            self._previewing.start(partial(preview_formats, replace(data, paper=paper), width))

        def failed(error: Exception) -> None:
            if asked == self._asked:
                self._on_no_preview(error)

        source.report(done, failed)

    def job_changed(self) -> None:
        """Update the preview of the running job."""
        if self.isVisible() and self._source is not None and not self._source.read_only:
            self._fresh = False
            if not self._previewing.is_running():
                self._settling.start(_SETTLE_MS)

    def is_previewing(self) -> bool:
        return self._previewing.is_running()

    def close_work(self) -> None:
        self._asked += 1
        self._settling.stop()
        self._previewing.cancel()
        self._writer.cancel()

    def mark(self) -> None:
        """Toggle the mark of the selected format."""
        if self.formats.currentRow() >= 0:
            self._marked ^= {str(self.formats.currentItem().data(_NAME))}
            self._write_marks()

    def mark_formats(self, names: Sequence[str]) -> None:
        """Mark exactly these formats: those of the station."""
        self._marked = set(names)
        self._write_marks()

    def marked(self) -> tuple[str, ...]:
        return tuple(name for name in FORMATS if name in self._marked)

    def write(self) -> None:
        """Write the marked formats, verified by reading back, or cancel writing."""
        if self._writer.is_busy():
            if self._writer.give_up():
                self.told.emit(tr("The report was not written."))
        elif self._source is not None:
            self.question.hide()
            folder = Path(self.folder.text().strip())
            try:
                paper = self.paper.paper()
                self.paper.keep_template()
            except OcmmError as error:
                self.failed.emit(error)
                return
            self._keep()
            self._writer.write(self._source, self.marked(), folder, paper)

    def _keep(self) -> None:
        """Store the typed data with the job; if that fails, the report is still written."""
        try:
            self.paper.keep()
        except OcmmError as error:
            self.failed.emit(error)

    def is_writing(self) -> bool:
        return self._writer.is_busy()

    def _write_marks(self) -> None:
        for row in range(self.formats.count()):
            item = self.formats.item(row)
            name = str(item.data(_NAME))
            item.setText(
                f"{'☑' if name in self._marked else '☐'}  {kit.said_word(FORMATS[name].title)}"
            )

    def _chosen(self) -> str:
        row = self.formats.currentRow()
        return "" if row < 0 else str(self.formats.item(row).data(_NAME))

    def _show_chosen(self) -> None:
        name = self._chosen()
        self.shown.setCurrentWidget(self.pages if name == PDF.name else self.text)
        self.text.setPlainText(self._texts.get(name, ""))

    def _on_part(self, part: object) -> None:
        if isinstance(part, FormatText):
            self._texts[part.name] = part.text
            if self._chosen() == part.name:
                self.text.setPlainText(part.text)
        elif isinstance(part, PagePicture):
            self.pages.show_page(part)

    def _on_advanced(self, what: str, share: float) -> None:
        if not self._writer.is_busy():
            self.work.advance(what, share)

    def _on_previewed(self, _none: object) -> None:
        if not self._writer.is_busy():
            self.work.end()
        if not self._fresh:
            self._settling.start(_SETTLE_MS)

    def _on_no_preview(self, error: object) -> None:
        self._on_ended()
        self.failed.emit(error)

    def _on_ended(self) -> None:
        if self._previewing.is_running() and not self._writer.is_busy():
            self.work.start(tr("Preparing the preview"))
        elif not self._writer.is_busy():
            self.work.end()

    def _on_paper(self) -> None:
        """Update the preview after a pause in typing."""
        if self._source is not None:
            self._fresh = False
            self._settling.start(_TYPED_MS)

    def _on_widened(self) -> None:
        if self.isVisible() and self._source is not None:
            self._settling.start(_SETTLE_MS)
