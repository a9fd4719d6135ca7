"""The sheets of the window: results, reports, plan, alignment, job."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QWidget

from ocmm_core.calibration.records import RecordStore, default_folder
from ocmm_core.inspection.evaluation import JobView
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre, Sheet
from ocmm_gui.maintain import RecallSheet
from ocmm_gui.operator import JobSheet
from ocmm_gui.plan_editor import PlanSheet
from ocmm_gui.results import AlignmentSheet, CompareSheet, JobSource, ReportSheet, ResultsSheet
from ocmm_gui.window._keys_sheet import KeysSheet


class Sheets(QObject):
    """Make all sheets and join them to the station.

    Parameters
    ----------
    bridge
        The running inspection.
    notices
        Where errors and news go.
    folder
        Where files go unless somebody says otherwise.
    """

    wanted = Signal(object)
    """Emits the `Sheet` that is to be shown."""
    left = Signal()
    """Back to the measuring."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: NoticeCentre,
        folder: Callable[[], Path],
    ) -> None:
        super().__init__()
        running = JobSource.of_bridge(bridge)
        records = partial(_records, bridge)
        self.results = ResultsSheet(running, lambda: calibration_words(bridge), records)
        self.report = ReportSheet(folder)
        self.alignment = AlignmentSheet(bridge)
        self.job = JobSheet(bridge)
        self.batch = CompareSheet(records)
        self.keys = KeysSheet()
        station = bridge.station
        self.recall = RecallSheet(
            lambda: station.job.path.parent,
            lambda: records()[1] or default_folder(),
            lambda: records()[0],
            lambda: bridge.shown.job.operator,
        )
        self.plan = PlanSheet(station.job.plan, station.job.plan_file, lambda: station.job.path)
        self.plan.saved.connect(self._on_plan_saved)
        self.plan.measure_wanted.connect(self._measure_by)
        bridge.plan_changed.connect(
            lambda: self.plan.use_plan(station.job.plan, station.job.plan_file)
        )
        bridge.jobs.job_left.connect(notices.inform)
        self._notices = notices
        self._bridge = bridge
        bridge.jobs.job_begun.connect(self._on_begun)
        for sheet in self.all():
            sheet.left.connect(self.left)
            sheet.failed.connect(notices.error)
            sheet.told.connect(notices.inform)
        # It is opened from Maintain, and left to there.
        self.recall.left.disconnect(self.left)
        self.report.left.disconnect(self.left)
        self.report.left.connect(self.open_results)
        self.batch.left.disconnect(self.left)
        self.batch.left.connect(self.open_results)
        self.results.report_wanted.connect(self._open_report)
        self.results.batch_wanted.connect(self._open_batch)

    def all(self) -> tuple[Sheet, ...]:
        """Return every sheet, for the stack of the window."""
        return (
            self.results, self.report, self.batch, self.job, self.plan, self.alignment, self.keys,
            self.recall,
        )  # fmt: skip

    def holds(self, widget: QWidget | None) -> bool:
        """Return whether a widget is one of the sheets."""
        return any(sheet is widget for sheet in self.all())

    def open_results(self) -> None:
        """Show the results of the running job, or of the file that was opened before."""
        self.wanted.emit(self.results)
        self.results.open()

    def open_job(self) -> None:
        """Ask for operator and part."""
        self.wanted.emit(self.job)
        self.job.open(self._bridge.shown.job)

    def open_plan(self) -> None:
        """Write or change a plan."""
        self.wanted.emit(self.plan)
        self.plan.open()

    def open_alignment(self) -> None:
        """Show how the part lies."""
        self.wanted.emit(self.alignment)
        self.alignment.open()

    def open_keys(self) -> None:
        """Show all keys of the window."""
        self.wanted.emit(self.keys)
        self.keys.open()

    def open_recall(self) -> None:
        """Recalculate older jobs whose calibration failed later."""
        self.wanted.emit(self.recall)
        self.recall.open()

    def job_changed(self, job: JobView) -> None:
        """Let the sheets show what was measured since."""
        self.results.job_changed()
        self.report.job_changed()

    def close_work(self) -> None:
        """Give up what is being calculated; call it before the window goes."""
        self.results.close_work()
        self.report.close_work()
        self.job.close_work()
        self.batch.close_work()
        self.plan.close_work()
        self.alignment.close_work()
        self.recall.close_work()

    def _on_plan_saved(self, path: Path) -> None:
        self.job.offer(path)
        self._notices.inform(f"Plan saved in {path}. Shift+F8 starts a job with it.")

    def _measure_by(self, path: Path) -> None:
        self.open_job()
        self.job.choose_plan(path)

    def _on_begun(self) -> None:
        self.results.forget_file()
        self.left.emit()

    def _open_report(self, source: JobSource) -> None:
        self.wanted.emit(self.report)
        self.report.open(source)

    def _open_batch(self, folder: Path) -> None:
        self.wanted.emit(self.batch)
        self.batch.open(folder)


def _records(bridge: StationBridge) -> tuple[Path | None, Path | None]:
    """Return where records of probes and of calibrations are kept; None for that of this user."""
    instruments = bridge.station.instruments
    return (
        _folder_of(instruments.probe_in_use.store),
        _folder_of(instruments.calibration_in_use.store),
    )


def _folder_of(store: RecordStore[Any] | None) -> Path | None:
    """Return the folder that holds a store and those of other rigs or probes."""
    return None if store is None else store.folder.parent


def calibration_words(bridge: StationBridge) -> str:
    """Return how cameras and probe stand now, in one line."""
    instruments = bridge.station.instruments
    return f"Cameras: {instruments.calibration().label}. Probe: {instruments.probe().label}."
