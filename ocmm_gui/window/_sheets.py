"""The sheets of the window: results, reports, plan, alignment, job; made when first looked at."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from PySide6.QtCore import QObject, Signal, SignalInstance
from PySide6.QtWidgets import QWidget

from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre, Sheet

if TYPE_CHECKING:
    from ocmm_core.calibration.records import RecordStore
    from ocmm_gui.maintain import RecallSheet
    from ocmm_gui.operator import JobSheet
    from ocmm_gui.plan_editor import PlanSheet
    from ocmm_gui.results import (
        AlignmentSheet,
        CompareSheet,
        JobSource,
        ReportSheet,
        ResultsSheet,
    )
    from ocmm_gui.window._keys_sheet import KeysSheet

S = TypeVar("S", bound=Sheet)


class Sheets(QObject):
    """Make each sheet when it is asked for first, and join it to the station.

    What a sheet needs is imported then, too: before the first look at the window that would be
    half of the waiting. A sheet asks the station for its state when it is made and when it is
    opened, so it misses nothing that came before.

    Parameters
    ----------
    bridge
        The running inspection.
    notices
        Where errors and news go.
    folder
        Where files go unless somebody says otherwise.
    """

    made = Signal(object)
    """Emits a `Sheet` that is new, before it is shown."""
    wanted = Signal(object)
    """Emits the `Sheet` that is to be shown."""
    left = Signal()
    """Back to the measuring."""
    left_recall = Signal()
    """Back to Maintain, where the recall is opened."""
    written = Signal(object)
    """Emits what was `ocmm_gui.results.Written` by the sheet of the reports."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: NoticeCentre,
        folder: Callable[[], Path],
    ) -> None:
        super().__init__()
        self._bridge, self._notices, self._folder = bridge, notices, folder
        self._made: list[Sheet] = []
        bridge.jobs.job_left.connect(notices.inform)
        bridge.jobs.job_begun.connect(self.left)

    @cached_property
    def results(self) -> ResultsSheet:
        """The verdicts of the running job, or of a file."""
        from ocmm_gui.results import JobSource, ResultsSheet

        bridge = self._bridge
        sheet = ResultsSheet(
            JobSource.of_bridge(bridge), lambda: calibration_words(bridge), self._records
        )
        bridge.jobs.job_begun.connect(sheet.forget_file)
        sheet.report_wanted.connect(self._open_report)
        sheet.batch_wanted.connect(self._open_batch)
        return self._joined(sheet, self.left)

    @cached_property
    def report(self) -> ReportSheet:
        """The reports, opened from the results."""
        from ocmm_gui.results import ReportSheet

        sheet = ReportSheet(self._folder)
        sheet.written.connect(self.written)
        return self._joined(sheet, self.open_results)

    @cached_property
    def batch(self) -> CompareSheet:
        """The jobs of a folder beside each other, opened from the results."""
        from ocmm_gui.results import CompareSheet

        return self._joined(CompareSheet(self._records), self.open_results)

    @cached_property
    def job(self) -> JobSheet:
        """The start of a job."""
        from ocmm_gui.operator import JobSheet

        return self._joined(JobSheet(self._bridge), self.left)

    @cached_property
    def plan(self) -> PlanSheet:
        """The editor of the plan."""
        from ocmm_gui.plan_editor import PlanSheet

        job = self._bridge.station.job
        sheet = PlanSheet(job.plan, job.plan_file, lambda: job.path)
        sheet.saved.connect(self._on_plan_saved)
        sheet.measure_wanted.connect(self._measure_by)
        self._bridge.plan_changed.connect(lambda: sheet.use_plan(job.plan, job.plan_file))
        return self._joined(sheet, self.left)

    @cached_property
    def alignment(self) -> AlignmentSheet:
        """How the part lies."""
        from ocmm_gui.results import AlignmentSheet

        return self._joined(AlignmentSheet(self._bridge), self.left)

    @cached_property
    def keys(self) -> KeysSheet:
        """All keys of the window."""
        from ocmm_gui.window._keys_sheet import KeysSheet

        return self._joined(KeysSheet(), self.left)

    @cached_property
    def recall(self) -> RecallSheet:
        """Jobs that are calculated again, opened from Maintain."""
        from ocmm_core.calibration.records import default_folder
        from ocmm_gui.maintain import RecallSheet

        sheet = RecallSheet(
            lambda: self._bridge.station.job.path.parent,
            lambda: self._records()[1] or default_folder(),
            lambda: self._records()[0],
            lambda: self._bridge.shown.job.operator,
        )
        return self._joined(sheet, self.left_recall)

    def _joined(self, sheet: S, back: SignalInstance | Callable[[], None]) -> S:
        """Return a new sheet that tells of itself and leads back to where it was opened."""
        sheet.left.connect(back)
        sheet.failed.connect(self._notices.error)
        sheet.told.connect(self._notices.inform)
        self._made.append(sheet)
        self.made.emit(sheet)
        return sheet

    def holds(self, widget: QWidget | None) -> bool:
        """Return whether a widget is one of the sheets."""
        return any(sheet is widget for sheet in self._made)

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

    def job_changed(self) -> None:
        """Let the sheets show what was measured since."""
        for sheet in self._made:
            sheet.job_changed()

    def close_work(self) -> None:
        """Give up what is being calculated; call it before the window goes."""
        for sheet in self._made:
            sheet.close_work()

    def _on_plan_saved(self, path: Path) -> None:
        self.job.offer(path)
        self._notices.inform(f"Plan saved in {path}. Shift+F8 starts a job with it.")

    def _measure_by(self, path: Path) -> None:
        self.open_job()
        self.job.choose_plan(path)

    def _open_report(self, source: JobSource) -> None:
        self.wanted.emit(self.report)
        self.report.open(source)

    def _open_batch(self, folder: Path) -> None:
        self.wanted.emit(self.batch)
        self.batch.open(folder)

    def _records(self) -> tuple[Path | None, Path | None]:
        """Return where records of probes and of calibrations are kept; None for this user's."""
        instruments = self._bridge.station.instruments
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
