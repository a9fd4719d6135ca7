"""The sheets of the window: results, reports, plan, alignment, job; loaded at first use."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from PySide6.QtCore import Signal, SignalInstance
from PySide6.QtWidgets import QWidget

from ocmm_core.calibration.records import RecordStore, default_folder
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.settings import LoadedSettings, SettingsStore
from ocmm_gui.bridge import StationBridge
from ocmm_gui.help import KeysSheet
from ocmm_gui.kit import LateParts, NoticeCentre, RecentPlaces, Sheet, said, tr, usable_keys
from ocmm_gui.operator import JobSheet

if TYPE_CHECKING:
    from ocmm_core.support import SupportSite
    from ocmm_gui.archive import ArchiveSheet
    from ocmm_gui.help import AboutSheet, SecondScreenSheet, SupportSheet, WhatToDoSheet
    from ocmm_gui.home import SettingsPage
    from ocmm_gui.maintain import RecallSheet
    from ocmm_gui.manual import ManualSheet
    from ocmm_gui.plan_editor import PlanSheet
    from ocmm_gui.results import (
        AlignmentSheet,
        CompareSheet,
        JobSource,
        ReportSheet,
        ResultsSheet,
        WrittenReports,
    )

S = TypeVar("S", bound=Sheet)


class Sheets(LateParts):
    """Make each sheet when it is first wanted, and join it to the station."""

    made = Signal(object)
    """Emits a new `Sheet`, for the stack of the window."""
    wanted = Signal(object)
    left = Signal()
    """Back to measuring."""
    settings_changed = Signal(object)
    """Emits the current `LoadedSettings`."""
    reopen_wanted = Signal()
    """Reopen the job with the current settings."""
    left_manual = Signal()
    """Back to the page from which the manual was opened."""
    left_to_maintain = Signal()
    """Back to the pages of Maintain."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: NoticeCentre,
        folder: Callable[[], Path],
        written: Callable[[WrittenReports], None],
        store: SettingsStore,
    ) -> None:
        super().__init__()
        self._store = store
        self._notices, self._bridge = notices, bridge
        self._folder, self._written = folder, written
        self._made: list[Sheet] = []
        self._loaded = store.load()
        bridge.plan_changed.connect(self._use_plan)
        bridge.jobs.job_left.connect(notices.inform)
        bridge.jobs.job_begun.connect(self._on_begun)
        bridge.jobs.only_to_look.connect(self.look_at)

    @cached_property
    def results(self) -> ResultsSheet:
        """Return the results of the running job or of a file."""
        from ocmm_gui.results import JobSource, ResultsSheet

        bridge = self._bridge
        running = JobSource.of_bridge(bridge)
        sheet = ResultsSheet(running, lambda: calibration_words(bridge), partial(_records, bridge))
        sheet.report_wanted.connect(self._open_report)
        sheet.batch_wanted.connect(self._open_batch)
        return self._join(sheet, self.left)

    @cached_property
    def report(self) -> ReportSheet:
        from ocmm_gui.results import ReportSheet

        sheet = ReportSheet(self._folder)
        sheet.mark_formats(self._store.load().settings.report_formats)
        sheet.written.connect(self._written)
        return self._join(sheet, self._back_to_results)

    @cached_property
    def alignment(self) -> AlignmentSheet:
        from ocmm_gui.results import AlignmentSheet

        return self._join(AlignmentSheet(self._bridge), self.left)

    @cached_property
    def job(self) -> JobSheet:
        sheet = JobSheet(self._bridge)
        sheet.propose_operators(self._loaded.settings.job_operators)
        return self._join(sheet, self.left)

    @cached_property
    def batch(self) -> CompareSheet:
        from ocmm_gui.results import CompareSheet

        return self._join(CompareSheet(partial(_records, self._bridge)), self._back_to_results)

    @cached_property
    def keys(self) -> KeysSheet:
        return self._join(
            KeysSheet(lambda: usable_keys(self._loaded.settings.window_keys)), self.left
        )

    @cached_property
    def manual(self) -> ManualSheet:
        from ocmm_gui.manual import ManualSheet

        return self._join(ManualSheet(), self.left_manual)

    @cached_property
    def settings(self) -> SettingsPage:
        from ocmm_gui.home import SettingsPage

        page = SettingsPage(self._store, self.reopen_wanted.emit)
        page.changed.connect(self.settings_changed)
        return self._join(page, self.left)

    def read_settings(self) -> None:
        """Update the settings page, if made, after a change by a key."""
        if self.is_made("settings"):
            self.settings.read_again()

    @cached_property
    def what_to_do(self) -> WhatToDoSheet:
        from ocmm_gui.help import WhatToDoSheet

        return self._join(WhatToDoSheet(partial(self.show_sheet, "support")), self.left)

    @cached_property
    def support(self) -> SupportSheet:
        from ocmm_gui.help import SupportSheet

        sheet = SupportSheet(self._support_site, self._folder, partial(self.show_sheet, "about"))
        return self._join(sheet, self.left)

    @cached_property
    def about(self) -> AboutSheet:
        from ocmm_gui.help import AboutSheet

        return self._join(AboutSheet(self._support_site), partial(self.show_sheet, "support"))

    @cached_property
    def recall(self) -> RecallSheet:
        """Return the recall of older jobs, opened from Maintain."""
        from ocmm_gui.maintain import RecallSheet

        bridge, station = self._bridge, self._bridge.station
        sheet = RecallSheet(
            lambda: station.job.path.parent,
            lambda: _records(bridge)[1] or default_folder(),
            lambda: _records(bridge)[0],
            lambda: bridge.shown.job.operator,
        )
        return self._join(sheet, self.left_to_maintain)

    @cached_property
    def archive(self) -> ArchiveSheet:
        """Return the archive of all stations, opened from Maintain."""
        from ocmm_gui.archive import ArchiveSheet
        from ocmm_shop.archiving import archive_place

        sheet = ArchiveSheet(lambda: archive_place(settings=self._loaded.settings), self._folder)
        return self._join(sheet, self.left_to_maintain)

    @cached_property
    def plan(self) -> PlanSheet:
        from ocmm_gui.plan_editor import PlanSheet

        station = self._bridge.station
        sheet = PlanSheet(
            station.job.plan, station.job.plan_file, lambda: station.job.path,
            lambda: (station.instruments.rig, station.instruments.body),
        )  # fmt: skip
        sheet.saved.connect(self._on_plan_saved)
        sheet.warned.connect(self._notices.warn)
        sheet.measure_wanted.connect(self.measure_by)
        return self._join(sheet, self.left)

    def _join(self, sheet: S, left: SignalInstance | Callable[[], None]) -> S:
        sheet.left.connect(left)
        sheet.failed.connect(self._notices.error)
        sheet.told.connect(self._notices.inform)
        self._made.append(sheet)
        self.made.emit(sheet)
        return sheet

    def holds(self, widget: QWidget | None) -> bool:
        return any(sheet is widget for sheet in self._made)

    def show_sheet(self, name: str) -> None:
        """Show the sheet of this name."""
        sheet = getattr(self, name)
        self.wanted.emit(sheet)
        sheet.open()

    def _back_to_results(self) -> None:
        self.wanted.emit(self.results)
        self.results.resume()

    def open_job(self) -> None:
        """Ask for operator and part."""
        self.wanted.emit(self.job)
        self.job.open(self._bridge.shown.job)

    @cached_property
    def screen(self) -> SecondScreenSheet:
        from ocmm_gui.help import SecondScreenSheet

        screen = self._bridge.screen
        sheet = SecondScreenSheet(
            lambda: screen.start_beside(self._store.load().settings), screen.stop
        )
        screen.changed.connect(sheet.show_state)
        return self._join(sheet, self.left)

    def open_manual(self, page: QWidget | None) -> None:
        from ocmm_gui.manual import place_of

        self.manual.come_from(page)
        self.wanted.emit(self.manual)
        self.manual.open(place_of(page))

    def open_what_to_do(self) -> None:
        """Search remedies, starting with the last refusal."""
        self.wanted.emit(self.what_to_do)
        refusal = self._bridge.shown.job.refusal
        self.what_to_do.open("" if refusal is None else refusal.code.value)

    def _support_site(self) -> SupportSite:
        from ocmm_core.support import site_of_this_user

        station = self._bridge.station
        live = station.looks.live()
        state = (
            f"{live.status.value} {live.reason}\n{calibration_words(self._bridge)}\n"
            f"{live.acquisition}\n{chr(10).join(live.faults)}\n"
        )
        header = self._bridge.shown.job.header
        return site_of_this_user(
            self._store,
            station.history,
            {"window.log": self._notices.text(), "state.txt": state},
            people=(header.operator, self._bridge.shown.job.operator),
        )

    def use_settings(self, loaded: LoadedSettings) -> None:
        """Propose the names of the settings."""
        self._loaded = loaded
        if self.is_made("job"):
            self.job.propose_operators(loaded.settings.job_operators)

    def job_changed(self, job: JobView) -> None:
        """Update the sheets; sheets made later read the job themselves."""
        if self.is_made("results"):
            self.results.job_changed()
        if self.is_made("report"):
            self.report.job_changed()
        if self.is_made("alignment"):
            self.alignment.job_changed(job)

    def close_work(self) -> None:
        for sheet in self._made:
            sheet.close_work()

    def _use_plan(self) -> None:
        if self.is_made("plan"):
            station = self._bridge.station
            self.plan.use_plan(station.job.plan, station.job.plan_file)

    def _on_plan_saved(self, path: Path) -> None:
        self.job.offer(path)
        self._notices.inform(
            tr("Plan saved in {path}. Shift+F8 starts a job with it.").format(path=path)
        )
        RecentPlaces().note_plan(path)

    def measure_by(self, path: Path) -> None:
        """Ask for operator and part of a job by a plan."""
        self.open_job()
        self.job.choose_plan(path)

    def _on_begun(self) -> None:
        self.left.emit()

    def look_at(self, path: Path) -> None:
        """Show a job that cannot be resumed, read-only."""
        RecentPlaces().note_job(path)
        self.show_sheet("results")
        self.results.open_file(path)

    def _open_report(self, source: JobSource) -> None:
        self.wanted.emit(self.report)
        self.report.open(source)

    def _open_batch(self, folder: Path) -> None:
        self.wanted.emit(self.batch)
        self.batch.open(folder)


def _records(bridge: StationBridge) -> tuple[Path | None, Path | None]:
    """Return the folders of records of probes and calibrations; None for that of this user."""
    instruments = bridge.station.instruments
    return (
        _folder_of(instruments.probe_in_use.store),
        _folder_of(instruments.calibration_in_use.store),
    )


def _folder_of(store: RecordStore[Any] | None) -> Path | None:
    return None if store is None else store.folder.parent


def calibration_words(bridge: StationBridge) -> str:
    """Return the state of cameras, probe and plan, in one line."""
    instruments = bridge.station.instruments
    return tr("Cameras: {cameras}. Probe: {probe}. Plan: {release}.").format(
        cameras=said(instruments.calibration().label),
        probe=said(instruments.probe().label),
        release=said(bridge.station.job.release.summary),
    )
