"""Report data that are not in the job, and writing of reports in the background.

Reports that are incomplete are confirmed first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QFileSystemWatcher, QObject, Signal
from PySide6.QtWidgets import QFormLayout, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.export import missing_of, missing_words, template
from ocmm_core.export.report import ReportData
from ocmm_gui.kit import NoticeCentre, caption, form_field, later, said, sentence_label, tr
from ocmm_gui.reports import write_reports
from ocmm_gui.results._job_source import JobSource
from ocmm_gui.work import SideProcess


@dataclass(frozen=True, slots=True)
class WrittenReports:
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
    paper: template.Paper
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
        self._process = SideProcess(self, self._on_written, self._on_failed)
        self._process.advanced.connect(self.advanced)
        self._request: _Request | None = None
        self._data: ReportData | None = None
        self._gathers = 0
        self._gathering = False

    def is_busy(self) -> bool:
        return self._gathering or self._process.is_running()

    def write(
        self,
        source: JobSource,
        formats: tuple[str, ...],
        folder: Path,
        paper: template.Paper | None = None,
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
                sheet = template.paper_of(source.path) if paper is None else paper
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
            self._process.start(
                partial(write_reports, data, request.formats, request.folder, request.incomplete)
            )

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
            self.written.emit(WrittenReports(data.job, paths, missing_of(data.view)))

    def _on_failed(self, error: object) -> None:
        self._end()
        self.failed.emit(error)

    def _end(self) -> None:
        was_busy = self._data is not None or self._gathering
        self._gathering, self._data = False, None
        if was_busy:
            self.ended.emit()


_FIELDS = (
    ("template", later("Template"), later("TOML")),
    ("customer", later("Customer"), later("optional")),
    ("order", later("Order no."), later("Where the job has none")),
    ("drawing", later("Drawing"), later("Drawing of the part")),
    ("revision", later("Revision"), later("Revision of the drawing")),
    ("place", later("Place"), later("Where it was measured")),
    ("received", later("Received"), later("Date and condition")),
    ("room", later("Room, °C"), later("A number or a range")),
    ("humidity", later("Humidity, %"), later("A number or a range")),
    ("pressure", later("Pressure, hPa"), later("optional")),
    ("deviations", later("Deviations"), later("Parted by semicolons")),
)
_SEPARATOR = ";"


class PaperForm(QWidget):
    """Fields of the report; empty ones are printed as "not stated"."""

    changed = Signal()
    """A field was edited, or the file of the template was changed."""
    left = Signal()
    """Escape in a field."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Head of the report"))
        rows = QFormLayout(self)
        rows.setContentsMargins(0, 0, 0, 0)
        self.fields = {name: form_field(tr(title), tr(tip)) for name, title, tip in _FIELDS}
        for name, title, _tip in _FIELDS:
            field = self.fields[name]
            rows.addRow(caption(tr(title), field), field)
            field.textEdited.connect(lambda _text: self._on_typed())
            field.left.connect(self.left)
        # The sheet places it where there is room for a sentence.
        self.fault = sentence_label(tr("Fault of the template"), 15)
        self.fault.hide()
        self._job: Path | None = None
        self._kept = template.Particulars()
        self._typed = False
        self._watcher = QFileSystemWatcher(self)
        self._watcher.fileChanged.connect(lambda _path: self.changed.emit())

    def open(self, job: Path) -> None:
        """Show the data stored with a job; InputError if unreadable."""
        if job == self._job:
            return
        self._job, self._typed, self._kept = job, False, template.Particulars()
        try:
            self._kept = template.given_with(job)
        finally:
            for name, _title, _tip in _FIELDS[1:-1]:
                self.fields[name].setText(getattr(self._kept, name))
            self.fields["deviations"].setText(f"{_SEPARATOR} ".join(self._kept.deviations))

    def paper(self) -> template.Paper:
        """Return the report sheet as typed; InputError if template or readings are invalid."""
        path = self._template()
        self._watch(path)
        given = self._given()
        # Invalid readings are reported next to the fields, like faults of a template.
        template.ambient_conditions(given)
        return template.load_paper(path, given)

    def keep(self) -> None:
        """Store the typed data with the job; OcmmError if that fails."""
        if self._typed and self._job is not None:
            self._typed = False
            template.keep_given(self._job, self._given())

    def keep_template(self) -> None:
        """Store the typed template for every report of this station; errors as `keep`."""
        if self.fields["template"].text().strip():
            template.keep_template(self._template())

    def show_fault(self, error: OcmmError | None) -> None:
        """Show a fault of the template next to its field; None clears it."""
        self.fault.setVisible(error is not None)
        self.fault.setText("" if error is None else said(f"{error.what} {error.remedy}"))

    def _template(self) -> Path:
        typed = self.fields["template"].text().strip()
        return Path(typed).expanduser() if typed else template.template_in_use()

    def _given(self) -> template.Particulars:
        typed = {name: self.fields[name].text().strip() for name, *_ in _FIELDS[1:]}
        told = (part.strip() for part in typed.pop("deviations").split(_SEPARATOR))
        # Data without a field here, such as remarks, are kept.
        kept: dict[str, Any] = {**typed, "deviations": tuple(part for part in told if part)}
        return replace(self._kept, **kept)

    def _on_typed(self) -> None:
        self._typed = True
        self.changed.emit()

    def _watch(self, path: Path) -> None:
        """Watch the file of the template, which its author edits elsewhere."""
        # Programs that replace a file end the watch of the former one.
        old, new = self._watcher.files(), str(path.absolute())
        if old != [new]:
            if old:
                self._watcher.removePaths(old)
            if path.exists():
                self._watcher.addPath(new)
