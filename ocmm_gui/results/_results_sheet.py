"""Results of a job: a table of verdicts, reasons of the selected one, and driving points in 3-D."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QRectF, Signal
from PySide6.QtGui import QPaintEvent

from ocmm_core.geometry import Float
from ocmm_core.inspection.causes import Explanation, points_words
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.tolerances.decisions import CharacteristicResult
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.results._job_source import JobFileData, JobSource, opened_job
from ocmm_gui.results._result_detail import ResultDetail
from ocmm_gui.results._result_table import DeviationView, JobPicture, ResultTable, SectionView
from ocmm_gui.scene import Diamonds, Tag, paint_scene
from ocmm_gui.views import job_items
from ocmm_gui.work import SideProcess, WorkLine


class DrivingPoints(JobPicture):
    """Points that determine the value of a characteristic."""

    margin = 1.5

    def __init__(self) -> None:
        super().__init__(tr("Points that determine the value"), (420, 220), (220, 130))
        self._explained: Explanation | None = None

    def show_points(self, job: JobView | None, explained: Explanation | None, up: Float) -> None:
        """Mark the points of an explanation in a job; `up`: (3,), unit, world."""
        if job is self._job and explained == self._explained:
            return
        self._job, self._explained = job, explained
        self._renew(up)
        numbers = () if explained is None else self.marked()
        self.setVisible(bool(numbers))
        self.setAccessibleDescription(
            tr("Marked: {points_words}. Arrow keys rotate the view, plus and minus zoom.").format(
                points_words=points_words(numbers)
            )
            if numbers
            else ""
        )
        self.update()

    def marked(self) -> tuple[int, ...]:
        if self._job is None or self._explained is None:
            return ()
        there = {point.number for item in self._job.features for point in item.points}
        return tuple(number for number in self._explained.points if number in there)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        inside = self._paint_panel(painter).adjusted(2, 2, -2, -2)
        if self._job is not None:
            paint_scene(
                painter, self._items, self._orbit, QRectF(inside), kit.text_font(13),
                self._theme.panel,
            )  # fmt: skip

    def _make(self) -> None:
        if self._job is None or self._explained is None:
            self._items, self._reach = (), np.empty((0, 3))
            return
        numbers = set(self.marked())
        touched = [
            item for item in self._job.features
            if item.name in self._explained.finding.features
            or any(point.number in numbers for point in item.points)
        ]  # fmt: skip
        places = {
            point.number: point.surface_world
            for item in self._job.features for point in item.points if point.number in numbers
        }  # fmt: skip
        items, _ = job_items(self._job, self._theme)
        tags = [
            Tag(place, tr("point {number}").format(number=number), self._theme.text)
            for number, place in places.items()
        ]
        marks = (
            [Diamonds(np.stack(list(places.values())), self._theme.text, 17.0)] if places else []
        )
        # Labels of the marks have priority.
        self._items = (*tags, *items, *marks)
        near = [point.surface_world for item in touched for point in item.points]
        self._reach = np.array(near) if near else np.empty((0, 3))


_KEYS = (
    kit.ActionInfo(
        "simulate", later("Monte Carlo"), later("Check this uncertainty by Monte Carlo"), ("F6",)
    ),
    kit.ActionInfo("open", later("Open a job"), later("Open a job file read-only"), ("F7",)),
    kit.ActionInfo("running", later("Current job"), later("Show the current job"), ("F9",)),
    kit.ActionInfo("batch", later("Batch"), later("Compare the jobs in this folder"), ("F10",)),
    kit.ActionInfo("report", later("Report"), later("Preview and write the reports"), ("F8", "E")),
)


class ResultsSheet(kit.Sheet):
    """Table on the left, budget and decision of the selected characteristic on the right.

    ``running`` returns the running job, ``calibration`` the state of cameras and probe, ``records``
    the folders of records of probes and calibrations; None is that of this user.
    """

    report_wanted = Signal(object)
    """Emits the `JobSource` to be reported."""
    batch_wanted = Signal(object)
    """Emits the folder whose jobs are to be compared."""

    def __init__(
        self,
        running: JobSource,
        calibration: Callable[[], str],
        records: Callable[[], tuple[Path | None, Path | None]] = lambda: (None, None),
    ) -> None:
        super().__init__(tr("Results"), _KEYS)
        self._running = self._source = running
        self._calibration = calibration
        self._records = records
        self._job: JobView | None = None
        self.table = ResultTable()
        self.detail = ResultDetail()
        self.points = DrivingPoints()
        self.points.hide()
        self.deviations, self.section = DeviationView(), SectionView()
        self.file = kit.PathPanel(
            tr("Open the job from the file"), tr("File of the job"), tr("Open")
        )
        self.opening = WorkLine(tr("Opening a job"))
        self._opening = SideProcess(
            self, self._on_opened, self._on_not_opened, self.opening.advance
        )
        self.summary = kit.FitText(tr("Summary"), limit=26, high=36)
        kit.fill(self.body, self.file, self.opening, self.summary)
        left = kit.vbox(
            (self.table, 3), (self.section, 3), (self.deviations, 3), (self.points, 2), spacing=8
        )
        self.body.addLayout(kit.hbox((left, 62), (self.detail, 38), spacing=10), 1)
        self.table.result_chosen.connect(self._show_detail)
        self.file.given.connect(self.open_file)
        self.detail.failed.connect(self.failed)
        self.detail.explained.connect(self._show_points)
        self.use_keys(
            {
                "simulate": self.detail.simulate,
                "open": self.ask_for_file,
                "running": self.open,
                "batch": lambda: self.batch_wanted.emit(self._source.path.parent),
                "report": lambda: self.report_wanted.emit(self._source),
            },
            primary="report",
        )

    def open(self) -> None:
        """Show the current job, whatever file was shown before."""
        self._opening.cancel()
        self.opening.end()
        self._source = self._running
        self.resume()

    def resume(self) -> None:
        """Show the same job again, current or of a file, on return from its report."""
        self._refresh()
        self.table.setFocus()

    def ask_for_file(self) -> None:
        """Ask for a job to open, or cancel the current opening."""
        if self._opening.is_running():
            self._opening.cancel()
            self.opening.end()
            self.told.emit(tr("The job was not opened."))
        else:
            self.file.ask(self._source.path.parent if self._source.read_only else Path.home())

    def open_file(self, path: Path) -> None:
        """Show a job from its own file, recalculated and compared, read-only.

        That takes some seconds, in a side process, during which the former results stay.
        """
        probes, calibrations = self._records()
        self._opening.start(partial(opened_job, path, probes=probes, calibrations=calibrations))
        self.opening.start(tr("Opening {name}").format(name=path.name), tr("F7 cancels."))
        self.table.setFocus()

    def is_opening(self) -> bool:
        return self._opening.is_running()

    def job_changed(self) -> None:
        """Show the current job as it is now, unless a file is shown."""
        if self._source is self._running and self.isVisible():
            self._refresh()

    def close_work(self) -> None:
        self._opening.cancel()
        self.detail.cancel()

    def _on_opened(self, opened: object) -> None:
        self.opening.end()
        if isinstance(opened, JobFileData):
            self.show_source(JobSource.of_opened(opened))

    def show_source(self, source: JobSource) -> None:
        self._source = source
        self._refresh()

    def _on_not_opened(self, error: object) -> None:
        self.opening.end()
        self.failed.emit(error)

    def _refresh(self) -> None:
        self._job = job = self._source.view()
        self.show_message(self._source.title(job), warns=self._source.read_only)
        line = kit.counted_line(job)
        if self._source.read_only:
            line = tr("{name}: {verdict}").format(name=self._source.path.stem, verdict=line)
        self.summary.show_verdict(line, job.part_verdict.shown_as)
        self.table.show_job(job)
        self.deviations.show_job(job, self.detail.up())
        self._show_detail(self.table.chosen())

    def _show_detail(self, name: str) -> None:
        result = self._result(name)
        if result is None or self._job is None:
            return
        status = self._source.calibration or self._calibration()
        self.detail.show_result(self._source, result, status)
        is_section = self.section.show_result(result)
        self.deviations.setVisible(self.deviations.is_filled() and not is_section)

    def _show_points(self, found: object) -> None:
        up = self.detail.up()
        if isinstance(found, Explanation) and up is not None:
            self.points.show_points(self._job, found, up)
        else:
            self.points.show_points(None, None, np.array([0.0, 0.0, 1.0]))

    def _result(self, name: str) -> CharacteristicResult | None:
        if self._job is None:
            return None
        return next((item for item in self._job.characteristics if item.name == name), None)
