"""Writing of reports in the background: confirmed if incomplete, shown, cancelled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from ocmm_core.errors import OcmmError
from ocmm_core.export import missing_of, missing_words
from ocmm_core.export.report import ReportData
from ocmm_core.export.template import Paper, paper_of
from ocmm_gui.kit import NoticeCentre, tr
from ocmm_gui.reports import Writing
from ocmm_gui.results._job_source import JobSource
from ocmm_gui.work import SideProcess


@dataclass(frozen=True, slots=True)
class Written:
    """Written files, and missing features of the job."""

    job: str
    paths: tuple[Path, ...]
    missing: tuple[str, ...]

    def tell(self, notices: NoticeCentre) -> None:
        """Show the folder of the files, with a warning if the job is incomplete."""
        folder = self.paths[0].parent if self.paths else ""
        if self.missing:
            files = tr("%n files", "1 file", len(self.paths))
            notices.warn(
                tr("INCOMPLETE report of {job} written to {folder} ({files}).").format(
                    job=self.job, folder=folder, files=files
                ),
                tr("Not measured: {missing_words}.").format(
                    missing_words=missing_words(self.missing)
                ),
                self.job,
            )
        else:
            names = ", ".join(path.name for path in self.paths)
            told = tr("Written to {folder}: {names}").format(folder=folder, names=names)
            notices.inform(told, self.job)


@dataclass(frozen=True, slots=True)
class _Request:
    source: JobSource
    formats: tuple[str, ...]
    folder: Path
    paper: Paper
    incomplete: bool = False


class ReportWriter(QObject):
    """Write one report at a time, in a side process."""

    asked = Signal(str)
    """The job is incomplete: emits the question confirmed by `agree`."""
    begun = Signal()
    advanced = Signal(str, float)
    """Next step, and the share done."""
    ended = Signal()
    written = Signal(object)
    failed = Signal(object)
    """Emits an `OcmmError`."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._process = SideProcess(self)
        self._request: _Request | None = None
        self._data: ReportData | None = None
        self._gathers = 0
        self._gathering = False
        self._process.advanced.connect(self.advanced)
        self._process.finished.connect(self._on_written)
        self._process.failed.connect(self._on_failed)

    def is_busy(self) -> bool:
        return self._gathering or self._process.is_running()

    def write(
        self, source: JobSource, formats: tuple[str, ...], folder: Path, paper: Paper | None = None
    ) -> None:
        """Write a report of the current job, or ask first if it is incomplete.

        Without a paper, that of the station is used, with the data stored with the job.
        """
        if not self.is_busy():
            lost = source.lost()
            if lost is not None:
                self.failed.emit(lost)
                return
            try:
                sheet = paper_of(source.path) if paper is None else paper
            except OcmmError as error:
                self.failed.emit(error)
                return
            self._request = _Request(source, formats, folder.expanduser().absolute(), sheet)
            if not self._asks(source.view().job, missing_of(source.view())):
                self._gather()

    def agree(self) -> None:
        """Write the requested report of an incomplete job."""
        if self._request is not None and not self.is_busy():
            self._request = replace(self._request, incomplete=True)
            self._gather()

    def give_up(self) -> bool:
        """Cancel writing; return whether in time; files are complete or absent."""
        if not self._process.give_up():
            return False
        self._end()
        return True

    def cancel(self) -> None:
        self._process.cancel()
        self._end()

    def _asks(self, job: str, missing: tuple[str, ...]) -> bool:
        if not missing or (self._request is not None and self._request.incomplete):
            return False
        self.asked.emit(
            tr(
                "INCOMPLETE: {missing_words} not measured. Write the report of {job} anyway?"
            ).format(missing_words=missing_words(missing), job=job)
        )
        return True

    def _gather(self) -> None:
        request = self._request
        if request is None:
            return
        self._gathers += 1
        number, self._gathering = self._gathers, True
        self.begun.emit()

        def done(data: ReportData) -> None:
            if number != self._gathers or not self._gathering:
                return
            self._gathering = False
            if self._asks(data.job, missing_of(data.view)):
                # It was complete when the key was pressed.
                self.ended.emit()
                return
            self._data = data = replace(data, paper=request.paper)
            self._process.start(Writing(data, request.formats, request.folder, request.incomplete))

        def failed(error: Exception) -> None:
            if number == self._gathers and self._gathering:
                self._on_failed(error)

        request.source.report(done, failed)

    def _on_written(self, files: object) -> None:
        data, request = self._data, self._request
        self._end()
        lost = None if request is None else request.source.lost()
        if lost is not None and isinstance(files, tuple):
            # No report may refer to a job that cannot be found.
            for file in files:
                file.remove()
            self.failed.emit(lost)
        elif isinstance(files, tuple) and data is not None:
            paths = tuple(file.path for file in files)
            self.written.emit(Written(data.job, paths, missing_of(data.view)))

    def _on_failed(self, error: object) -> None:
        self._end()
        self.failed.emit(error)

    def _end(self) -> None:
        was_busy = self._data is not None or self._gathering
        self._gathering, self._data = False, None
        if was_busy:
            self.ended.emit()
