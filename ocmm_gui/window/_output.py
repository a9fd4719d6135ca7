from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QAction

from ocmm_core.errors import OcmmError
from ocmm_core.export import DEFAULT_FORMAT, FORMATS
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import SHORT, AnswerPanel, NoticeCentre, PathPanel, later, literal, tr
from ocmm_gui.results import JobSource, ReportWriter, WrittenReports
from ocmm_gui.work import WorkLine

_SHORT = {
    "polyworks": later("PolyWorks"), "qif": later("QIF"), "dfq": later("Q-DAS"),
    "xlsx": later("XLSX"), "json": later("JSON"), "fai": later("AS9102"), "pdf": later("PDF"),
}  # fmt: skip
"""Short names of products and formats for a button."""


class Output(QObject):
    """Write files into the folder given at the start; None asks in the window."""

    exported = Signal(object)
    """Emits the written files, ``tuple[Path, ...]``."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: NoticeCentre,
        out: Path | None,
        far: Callable[[], bool],
    ) -> None:
        super().__init__()
        self._bridge, self._notices, self._out = bridge, notices, out
        self.formats: tuple[str, ...] = (DEFAULT_FORMAT,)
        self.export_panel = PathPanel(
            tr("Write the report into the folder"),
            tr("Folder of the report"),
            tr("Write"),
            folders=True,
        )
        self.bus_panel = PathPanel(
            tr("Write the bus report into the file"), tr("File of the bus report"), tr("Write")
        )
        self.question = AnswerPanel(tr("The job is not complete"), tr("Write"))
        self.work = WorkLine(tr("Report"))
        self._source = JobSource.of_bridge(bridge)
        self._writer = ReportWriter(self)
        self._writer.asked.connect(lambda question: self.question.ask(question, far=far()))
        self._writer.begun.connect(
            lambda: self.work.begin(tr("Writing the report"), tr("E cancels."))
        )
        self._writer.advanced.connect(self.work.advance)
        self._writer.ended.connect(self.work.end)
        self._writer.written.connect(self.tell_written)
        self._writer.failed.connect(notices.error)
        self.question.agreed.connect(self._writer.agree)
        self.export_panel.given.connect(self._export_to)
        self.bus_panel.given.connect(bridge.maintenance.save_bus_text)
        bridge.jobs.job_begun.connect(self.question.hide)
        bridge.maintenance.bus_text_saved.connect(
            lambda path: notices.inform(tr("The bus report is in {path}.").format(path=path))
        )

    def calls(self) -> dict[str, Callable[[], None]]:
        return {"export": self._export, "bus_text": self._save_bus_text, "log": self._save_log}

    def use_formats(self, formats: tuple[str, ...], action: QAction) -> None:
        """Write these formats, all or none; the button names them."""
        self.formats = formats
        first, more = tr(_SHORT[formats[0]]), len(formats) - 1
        named = tr("{format} + {count}").format(format=first, count=more) if more else first
        titles = ", ".join(FORMATS[name].title for name in formats)
        # The bar has room for a word: the first format, and the number of others.
        action.setProperty(SHORT, named)
        action.setToolTip(literal(tr("Write the report files: {titles}").format(titles=titles)))

    def folder(self) -> Path:
        out = self._out if self._out is not None else Path.home() / "ocmm-out"
        return out.expanduser().absolute()

    def hide(self) -> None:
        """Hide the panels that ask for a place."""
        self.export_panel.hide()
        self.bus_panel.hide()
        self.question.hide()

    def is_writing(self) -> bool:
        return self._writer.is_busy()

    def close_work(self) -> None:
        self._writer.cancel()

    def tell_written(self, written: WrittenReports) -> None:
        written.tell(self._notices)
        self.exported.emit(written.paths)

    def _export(self) -> None:
        if self._writer.is_busy():
            if self._writer.give_up():
                self._notices.inform(tr("The report was not written."))
        elif self._out is not None:
            self._export_to(self.folder())
        else:
            self.export_panel.ask(self.folder())

    def _export_to(self, folder: Path) -> None:
        self._writer.write(self._source, self.formats, folder)

    def _save_bus_text(self) -> None:
        path = self._new_text("bus")
        if self._out is not None:
            self._bridge.maintenance.save_bus_text(path)
        else:
            self.bus_panel.ask(path)

    def _save_log(self) -> None:
        path = self._new_text("log")
        try:
            self._notices.save(path)
        except OcmmError as error:
            self._notices.error(error)
        else:
            self._notices.inform(tr("Log written to {path}.").format(path=path))

    def _new_text(self, what: str) -> Path:
        folder = self._out if self._out is not None else Path.home()
        return folder / f"ocmm-{what}-{datetime.now().astimezone():%Y%m%d-%H%M%S}.txt"
