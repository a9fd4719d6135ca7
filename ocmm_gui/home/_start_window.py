"""Window before there is a station: Start page, settings, and files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from PySide6.QtCore import QTimer, Signal
from PySide6.QtGui import QAction, QCloseEvent
from PySide6.QtWidgets import QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.settings import LoadedSettings, Settings, SettingsStore
from ocmm_gui import kit
from ocmm_gui.access import HandsAndEyes, PageStack, ZoomArea
from ocmm_gui.home._file_browser import FileBrowser, FileType
from ocmm_gui.home._start_lists import PlanChoice, listed_jobs, listed_plans
from ocmm_gui.home._start_page import StartPage
from ocmm_gui.kit import tr
from ocmm_gui.work import Worker

if TYPE_CHECKING:
    from ocmm_core.composition import StationState
    from ocmm_core.inspection.finished import LastJob
    from ocmm_gui.archive import ArchiveSheet
    from ocmm_gui.help import AboutSheet
    from ocmm_gui.home._camera_sheet import CameraSheet
    from ocmm_gui.home._settings_page import SettingsPage
    from ocmm_gui.manual import ManualSheet


S = TypeVar("S", bound=kit.Sheet)

_ANEW = ("window_language", "window_decimal", "window_units")
"""Settings that affect every text of a window."""


_STATE_MS = 20_000
"""Status refresh interval: records expire, or other programs make them suspect."""


class StartPurpose(Enum):
    """Purpose of the user."""

    NEW = "new"
    CONTINUE = "continue"
    LOOK = "look"
    PLANS = "plans"
    CALIBRATE = "calibrate"
    DEMO = "demo"
    MEASURE = "measure"
    """Directly from the command line."""
    START = "start"


@dataclass(frozen=True, slots=True)
class StartChoice:
    errand: StartPurpose
    path: Path | None = None
    """Plan of a new job, or job to resume or view."""
    otherwise: StartChoice | None = None
    """Fallback if impossible; None for the Start page."""
    section: str = ""
    """Section of the settings opened by the Start page; empty for the page itself."""


class StartWindow(kit.NoticeWindow):
    """Choose what to open; `choice` is set when the window has closed."""

    closed = Signal()

    def __init__(
        self,
        store: SettingsStore,
        notices: kit.NoticeCentre,
        recent: kit.RecentPlaces | None = None,
    ) -> None:
        super().__init__()
        self.setWindowTitle("OCMM")
        self.choice: StartChoice | None = None
        self._store, self._notices = store, notices
        self._recent = recent or kit.RecentPlaces()
        self._lists = Worker("ocmm-start", self)
        self._state: StationState | None = None
        self._state_comes = False
        self._look = QTimer(self, interval=_STATE_MS)
        self._look.timeout.connect(self.read_state)
        self.loaded = store.load()
        kit.dress_application(kit.THEMES[self.loaded.settings.window_theme])
        self.page = StartPage(
            {
                "new": self._new,
                "continue": self._continue,
                "open": self._open,
                "plans": lambda: self._leave_for(StartPurpose.PLANS),
                "calibrate": lambda: self._leave_for(StartPurpose.CALIBRATE),
                "archive": self._archive,
                "demo": lambda: self._leave_for(StartPurpose.DEMO),
                "settings": self.show_settings,
                "cameras": self._open_cameras,
                "manual": self._open_manual,
                "about": self._open_about,
                "theme": self._next_theme,
                "quit": self._quit,
            }
        )
        self.page.jobs.judging.failed.connect(notices.error)
        self.page.job_chosen.connect(lambda path: self._leave_for(StartPurpose.CONTINUE, path))
        self.plans = PlanChoice()
        self.plans.left.connect(self.show_start)
        self.plans.chosen.connect(lambda path: self._leave_for(StartPurpose.NEW, path))
        self.plans.other_wanted.connect(self._other_plan)
        self.browser = FileBrowser(self._recent)
        self.browser.left.connect(self.show_start)
        self.browser.chosen.connect(self.take_file)
        self._archive_sheet: ArchiveSheet | None = None
        self.manual: ManualSheet | None = None
        self._stack = PageStack()
        for page in (self.page, self.plans, self.browser):
            self._stack.addWidget(page)
        central = QWidget()
        kit.vbox(self.banner, (self._stack, 1), parent=central)
        area = ZoomArea(central)
        self.setCentralWidget(area)
        self.eyes = HandsAndEyes(self, area, store, notices)
        self._stack.currentChanged.connect(lambda _page: self.eyes.show_far(False))
        self.eyes.kept.connect(self._read_settings)
        self._keys = self._make_keys()
        notices.posted.connect(self.banner.show_notice)
        for note in self.loaded.notes:
            notices.warn(note.what, note.remedy)
        # The Start page has its own key for it; this is for all other pages.
        manual = self._keys["manual"]
        self._stack.currentChanged.connect(
            lambda _page: manual.setEnabled(self._stack.currentWidget() is not self.page)
        )
        manual.setEnabled(False)
        self._dress()
        self.eyes.use(self.loaded.settings)
        self.page.setFocus()

    def read(self) -> None:
        """Read station status and recent jobs in the background."""
        settings, recent = self.loaded.settings, self._recent.jobs()
        folder = settings.job_folder
        self._lists.do(
            lambda: listed_jobs(folder, recent),
            lambda jobs: self._show_jobs(jobs, folder),
            self._notices.error,
        )
        self.read_state()
        self._look.start()
        self._lists.do(lambda: _hand_over(settings), self.page.show_hand_over, self._notices.error)
        # Preload the job's imports while the user reads.
        self._lists.do(_warm, lambda _none: None, self._notices.error)

    def _show_jobs(self, jobs: tuple[LastJob, ...], folder: Path) -> None:
        self.page.show_jobs(jobs, folder)
        settings = self.loaded.settings
        self.page.jobs.judge(settings.instrument_probes, settings.instrument_calibrations)

    def read_state(self) -> None:
        """Read the station status, unless already running."""
        if self._state_comes:
            return
        self._state_comes = True
        settings = self.loaded.settings

        def came(state: StationState) -> None:
            self._state_comes = False
            if state != self._state:
                self._state = state
                self.page.show_state(state)

        def failed(error: Exception) -> None:
            self._state_comes = False
            self._notices.error(error)

        self._lists.do(lambda: _state(settings), came, failed)

    def show_start(self) -> None:
        self._stack.setCurrentWidget(self.page)
        self.page.setFocus()

    def take_file(self, path: Path) -> None:
        """View a job, or start one with a plan."""
        errand = StartPurpose.LOOK if path.suffix.lower() == ".ocmm" else StartPurpose.NEW
        self._leave_for(errand, path)

    def closeEvent(self, event: QCloseEvent) -> None:
        self._look.stop()
        if self._has_settings():
            self.settings.close_work()
        if self._archive_sheet is not None:
            self._archive_sheet.close_work()
        self.browser.close_work()
        if "cameras" in vars(self):
            self.cameras.close_work()
        self.page.jobs.judging.cancel()
        self._lists.close(5.0)
        event.accept()
        self.closed.emit()

    def _leave_for(self, errand: StartPurpose, path: Path | None = None) -> None:
        self.choice = StartChoice(errand, path)
        self.close()

    def _quit(self) -> None:
        self.close()

    def _new(self) -> None:
        self._stack.setCurrentWidget(self.plans)
        self.plans.open()
        folder, recent = self.loaded.settings.job_plans, self._recent.plans()
        self._lists.do(
            lambda: listed_plans(recent, folder), self.plans.show_plans, self._notices.error
        )

    def _continue(self) -> None:
        path = self.page.chosen_job()
        if path is not None:
            self._leave_for(StartPurpose.CONTINUE, path)

    def _open(self) -> None:
        self._stack.setCurrentWidget(self.browser)
        self.browser.ask(
            tr("Open a job to look at it, or a plan to measure by it"), FileType.OPEN,
            self.loaded.settings.job_folder,
        )  # fmt: skip

    def _other_plan(self) -> None:
        self._stack.setCurrentWidget(self.browser)
        self.browser.ask(tr("Plan of the new job"), FileType.PLAN, self.loaded.settings.job_plans)

    def _archive(self) -> None:
        if self._archive_sheet is None:
            # Imported on demand.
            from ocmm_gui.archive import ArchiveSheet
            from ocmm_shop.archiving import archive_place

            sheet = ArchiveSheet(
                lambda: archive_place(settings=self.loaded.settings),
                lambda: self.loaded.settings.job_folder,
            )
            sheet.told.connect(self._notices.inform)
            self._archive_sheet = self._added(sheet, self.show_start)
        self._stack.setCurrentWidget(self._archive_sheet)
        self._archive_sheet.open()

    def _open_manual(self) -> None:
        shown = self._stack.currentWidget()
        # Its documents are read on demand.
        from ocmm_gui.manual import ManualSheet, place_of

        if self.manual is None:
            self.manual = self._added(ManualSheet(), self._leave_manual)
        self.manual.come_from(shown)
        self._stack.setCurrentWidget(self.manual)
        self.manual.open(place_of(shown))

    def _leave_manual(self) -> None:
        before = None if self.manual is None else self.manual.came_from()[0]
        page = before or self.page
        self._stack.setCurrentWidget(page)
        page.setFocus()

    @cached_property
    def settings(self) -> SettingsPage:
        """Return the settings page; its many rows are created on demand."""
        from ocmm_gui.home._settings_page import SettingsPage

        page = SettingsPage(self._store)
        page.told.connect(self._notices.warn)
        page.changed.connect(self._on_settings)
        return self._added(page, self.show_start)

    @cached_property
    def about(self) -> AboutSheet:
        """Return the page about this program, created on demand."""
        from ocmm_core.support import site_of_this_user
        from ocmm_gui.help import AboutSheet

        return self._added(AboutSheet(lambda: site_of_this_user(self._store)), self.show_start)

    @cached_property
    def cameras(self) -> CameraSheet:
        """Return the page that sets up cameras, created on demand."""
        from ocmm_gui.home._camera_sheet import CameraSheet

        return self._added(CameraSheet(lambda: self.loaded.settings), self.show_start)

    def _open_cameras(self) -> None:
        self._stack.setCurrentWidget(self.cameras)
        self.cameras.open()

    def _open_about(self) -> None:
        self._stack.setCurrentWidget(self.about)
        self.about.open()

    def _added(self, sheet: S, left: Callable[[], None]) -> S:
        sheet.left.connect(left)
        sheet.failed.connect(self._notices.error)
        self._stack.addWidget(sheet)
        kit.dress(sheet, kit.THEMES[self.loaded.settings.window_theme])
        return sheet

    def _has_settings(self) -> bool:
        # `cached_property` stores its value under its name.
        return "settings" in vars(self)

    def _read_settings(self) -> None:
        if self._has_settings():
            self.settings.read_again()

    def show_settings(self, section: str = "") -> None:
        """Show the settings, optionally a section."""
        self._stack.setCurrentWidget(self.settings)
        self.settings.open(section)

    def _on_settings(self, loaded: LoadedSettings) -> None:
        before, self.loaded = self.loaded, loaded
        if any(getattr(before.settings, name) != getattr(loaded.settings, name) for name in _ANEW):
            # Nothing is measured: recreate the window at the same place.
            self.choice = StartChoice(StartPurpose.START, section="window")
            self.close()
            return
        if before.settings.window_theme != loaded.settings.window_theme:
            self._dress()
        self.eyes.use(loaded.settings)
        if before.settings != loaded.settings:
            self.read()

    def _make_keys(self) -> dict[str, QAction]:
        """Add the keys for size, gloves and manual to all pages, without buttons."""
        calls = {**self.eyes.calls(), "manual": self._open_manual}
        changed = kit.usable_keys(self.loaded.settings.window_keys)
        made: dict[str, QAction] = {}
        for info in kit.ACTIONS:
            if info.key in calls:
                made[info.key] = action = kit.make_action(info, self, changed, everywhere=True)
                action.triggered.connect(lambda _checked, call=calls[info.key]: call())
        return made

    def _next_theme(self) -> None:
        names = list(kit.THEMES)
        after = names[(names.index(self.loaded.settings.window_theme) + 1) % len(names)]
        try:
            for note in self._store.change({"window.theme": after}):
                self._notices.warn(note.what, note.remedy)
        except OcmmError as error:
            self._notices.error(error)
        self._read_settings()
        self._on_settings(self._store.load())

    def _dress(self) -> None:
        kit.apply_theme(self, kit.THEMES[self.loaded.settings.window_theme])


def _state(settings: Settings) -> StationState:
    from ocmm_core.composition import station_state

    return station_state(settings)


def _warm() -> None:
    """Preload the imports of a job."""
    from ocmm_core import composition
    from ocmm_gui import bridge

    getattr(composition, "build_station")  # noqa: B009 - a door loads what is asked for
    getattr(bridge, "StationBridge")  # noqa: B009


def _hand_over(settings: Settings) -> str:
    """Return the status of archive uploads in a line; empty in good order."""
    from ocmm_shop.archive.outbox import hand_over
    from ocmm_shop.archiving import archive_place

    place = archive_place(settings=settings)
    return "" if place is None else hand_over(place.outbox).line
