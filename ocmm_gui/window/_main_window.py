"""The main window: far view and desk view of one running inspection, and its maintenance.

Sheets, Maintain and wizards are loaded in the background.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent, QKeyEvent
from PySide6.QtWidgets import QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.settings import LoadedSettings, SettingsStore
from ocmm_gui.access import HandsAndEyes, ZoomArea
from ocmm_gui.bridge import StationBridge
from ocmm_gui.home import FindAction
from ocmm_gui.kit import (
    THEMES,
    Mode,
    NoticeCentre,
    NoticeWindow,
    SoundPlayer,
    apply_theme,
    bind_actions,
    dress,
    hbox,
    make_actions,
    show_mode,
    usable_keys,
    use_shortcuts,
    vbox,
)
from ocmm_gui.led import HandControl, LedProbe
from ocmm_gui.operator import DeskView, FarView, Feedback, PointChoice, ServiceStrip
from ocmm_gui.window._acceptance import AcceptanceRooms
from ocmm_gui.window._maintenance import Maintenance
from ocmm_gui.window._pages import Pages
from ocmm_gui.window._running_job import Output, RunningJob
from ocmm_gui.window._sheets import Sheets

if TYPE_CHECKING:
    from ocmm_core.composition import AcceptanceBench
    from ocmm_gui.wizards import PracticeRoom


_LATER = (
    ("ocmm_gui.results", "ResultsSheet ReportSheet CompareSheet AlignmentSheet"),
    ("ocmm_gui.plan_editor", "PlanSheet"),
    ("ocmm_gui.maintain", "MaintainView BusPage CalibrationPage ProbePage FitsPage RecallSheet"),
    ("ocmm_gui.wizards", "WIZARDS Wizard"),
    ("ocmm_gui.wizards.pages", "DefinitionPage"),
)
"""Packages and their public names, in order."""


class Preload:
    """Load packages on a thread before their first use; widgets are made by the window."""

    def __init__(self) -> None:
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-preload")

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Stop after the current package, some tenths of a second at most."""
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        for room, names in _LATER:
            for name in names.split():
                if self._stopping.is_set():
                    return
                getattr(import_module(room), name)


START, REOPEN = "start", "reopen"
_SHEETS = (
    "results", "plan", "alignment", "keys", "support", "recall", "archive", "settings", "screen",
)  # fmt: skip
"""Sheets that a key of their name opens."""


class MainWindow(NoticeWindow):
    """Inspect in two densities, Maintain, each on one key; closing it stops the station.

    None of ``sounds`` is silence, of ``out`` asks for the folder of reports, of ``bench`` and
    ``practice`` offers no tests or practice, of ``hand`` is a real probe.
    """

    closed = Signal()

    def __init__(
        self,
        bridge: StationBridge,
        notices: NoticeCentre,
        *,
        sounds: SoundPlayer | None = None,
        theme: str = "dark",
        out: Path | None = None,
        bench: AcceptanceBench | None = None,
        store: SettingsStore | None = None,
        hand: LedProbe | None = None,
        practice: PracticeRoom | None = None,
    ) -> None:
        super().__init__()
        self.after = ""
        """Request for after closing: `START`, `REOPEN`, or nothing."""
        self._bridge, self._hand = bridge, hand
        self._notices = notices
        self.close_seconds = 0.0
        self.actions_by_key = make_actions(self)
        self.desk = DeskView(
            bridge.station.instruments.rig, bridge.station.instruments.body, self.actions_by_key
        )
        self.far = FarView(self.actions_by_key)
        self._use_plan()
        self._feedback = Feedback(
            sounds, notices,
            lambda: self.far.readout if self.is_far() else self.desk.readout,
        )  # fmt: skip
        self.hand = HandControl(
            hand, bridge, self.desk.points, self.actions_by_key, notices,
            lambda: self.pages.to_desk(), lambda: self.pages.name(), self,
        )  # fmt: skip
        self.service = ServiceStrip()
        self.choice = PointChoice(bridge, self.desk, notices)
        self.output = Output(bridge, notices, out, self.is_far)
        self._store = store or SettingsStore.of_this_user()
        self._sounds = sounds
        self.sheets = Sheets(
            bridge, notices, self.output.folder, self.output.tell_written, self._store
        )
        self.search = FindAction(self)
        self.tests = AcceptanceRooms(bench, bridge, notices, self._feedback, self.output.folder)
        self.maintenance = Maintenance(
            bridge, notices, self._feedback, self.actions_by_key, self.tests, practice
        )
        self.pages = Pages(
            self.desk, self.far, self.sheets, self.maintenance, self.tests, self.actions_by_key,
            self.banner,
        )  # fmt: skip
        self.running = RunningJob(
            bridge, notices, self.banner, self._feedback, self.pages, self.desk, self.far,
            self.sheets, self.maintenance, self.choice, self.hand,
        )  # fmt: skip
        self._lines = (
            self.banner, self.output.question, self.output.export_panel, self.output.bus_panel,
            self.choice.panel, self.tests.papers.panel,
        )  # fmt: skip
        self._preload = Preload()
        # Parents delete the listeners: Qt keeps connections of one without a parent, and with them
        # window and station, for the life of the program.
        for part in (
            self.choice, self.output, self.sheets, self.tests, self.maintenance, self.pages,
            self.running,
        ):  # fmt: skip
            part.setParent(self)
        self._lay_out()
        self._connect(bridge)
        self.eyes = HandsAndEyes(self, self.area, self._store, notices)
        self.eyes.kept.connect(self.sheets.read_settings)
        bind_actions(self.actions_by_key, self._calls())
        settings = self._store.load().settings
        self.eyes.use(settings)
        use_shortcuts(self.actions_by_key, usable_keys(settings.window_keys))
        self.output.use_formats(settings.report_formats, self.actions_by_key["export"])
        show_mode(self.actions_by_key, Mode.INSPECT)
        self.use_theme(theme)

    def _lay_out(self) -> None:
        self.sheets.made.connect(self._add)
        self.maintenance.made.connect(self._add)
        central = QWidget()
        whole = hbox(parent=central, spacing=0, margins=0)
        layout = vbox(spacing=0)
        for widget in (
            self.hand.strip,
            self.service,
            self.running.trust,
            self.running.tip_line,
            *self._lines,
            self.output.work,
            self.running.work,
            self.tests.papers.line,
        ):
            layout.addWidget(widget)
        layout.addWidget(self.pages.stack, 1)
        whole.addWidget(self.running.simulated)
        self.pages.stack.currentChanged.connect(lambda _page: self._on_page())
        whole.addLayout(layout, 1)
        self.area = ZoomArea(central)
        self.setCentralWidget(self.area)

    def _connect(self, bridge: StationBridge) -> None:
        self.desk.plan.feature_chosen.connect(bridge.choice.select)
        # Methods, which Qt references weakly: a lambda would keep the window forever.
        self.pages.mode_wanted.connect(self.output.hide)
        self.sheets.settings_changed.connect(self._on_settings)
        self.sheets.reopen_wanted.connect(self._reopen)
        self.search.closed.connect(self.pages.focus)
        self.search.other_wanted.connect(self.pages.do_elsewhere)
        self._notices.posted.connect(self.banner.show_notice)
        self._notices.ended.connect(self.banner.end)
        bridge.plan_changed.connect(self._use_plan)
        bridge.serving.changed.connect(self.service.show_state)
        self.service.pressed.connect(bridge.serving.operate)
        self.service.stop_wanted.connect(bridge.serving.stop)

    def _reopen(self) -> None:
        self._close_for(REOPEN)

    def _add(self, view: QWidget) -> None:
        self.pages.stack.addWidget(view)
        dress(view, self._theme)

    def show_mode(self, mode: Mode) -> None:
        """Show Inspect, in its last state, or Maintain."""
        self.pages.show_mode(mode)

    def mode(self) -> Mode:
        return self.pages.mode()

    def show_far(self, far: bool) -> None:
        self.pages.show_far(far)

    def use_theme(self, name: str) -> None:
        self._theme = THEMES[name]
        apply_theme(self, self._theme)

    def is_far(self) -> bool:
        return self.pages.is_far()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Hide with Esc what asks for a place, once no notice is shown."""
        if event.key() == Qt.Key.Key_Escape and not self.banner.dismiss():
            for widget in (*self._lines, self.search):
                widget.hide()
        elif event.key() != Qt.Key.Key_Escape:
            super().keyPressEvent(event)

    def load_the_rest(self) -> None:
        """Load sheets, Maintain and wizards in the background; call it once."""
        self._preload.start()

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop the station before the window closes; every point is stored already."""
        begun = time.monotonic()
        self._preload.close()
        self.hand.close()
        self.sheets.close_work()
        self.output.close_work()
        self.maintenance.close_work()
        self._bridge.close()
        self._feedback.close()
        self.close_seconds = time.monotonic() - begun
        event.accept()
        self.closed.emit()

    def _calls(self) -> dict[str, Callable[[], None]]:
        bridge, choice, sheets = self._bridge, self.choice, self.sheets
        return {
            "undo": bridge.job.undo,
            "finish": bridge.job.finish,
            "flip": bridge.job.flip,
            "skip": bridge.job.skip,
            "repeat": bridge.job.repeat,
            "reopen": bridge.job.reopen,
            "order": bridge.job.toggle_order,
            "pause": bridge.job.toggle_pause,
            "side": bridge.job.next_side,
            "redo": bridge.job.redo,
            "refit": bridge.results.refit,
            "previous": lambda: bridge.choice.select_neighbour(-1),
            "next": lambda: bridge.choice.select_neighbour(1),
            "tone": self._feedback.toggle_tone,
            "point_after": lambda: choice.step(1),
            "point_before": lambda: choice.step(-1),
            "delete": choice.delete,
            "restore": choice.restore,
            "job": sheets.open_job,
            "manual": self._open_manual,
            "what_to_do": sheets.open_what_to_do,
            "view": lambda: self.pages.show_far(not self.pages.is_far()),
            "cameras": self.desk.toggle_cameras,
            "part_mode": self.desk.points.next_mode,
            "fit": self.desk.points.fit,
            "closeup": self.desk.points.close_up,
            "theme": self._next_theme,
            "serve": self._serve,
            "start": lambda: self._close_for(START),
            "find": self._find,
            "mode": self.pages.other_mode,
            **{name: partial(sheets.show_sheet, name) for name in _SHEETS},
            **self.eyes.calls(),
            **self.hand.calls(),
            **self.output.calls(),
            **self.maintenance.calls(),
        }

    def _serve(self) -> None:
        serving, hand, settings = self._bridge.serving, self._hand, self._store.load().settings
        if serving.runs:
            serving.stop()
        else:
            self._bridge.jobs.serve(lambda: serving.start(hand, settings))

    def _use_plan(self) -> None:
        plan, file = self._bridge.station.job.plan, self._bridge.station.job.plan_file
        self.setWindowTitle(f"OCMM – {plan.part}")
        self.desk.use_plan(plan, None if file is None else file.parent)

    def _next_theme(self) -> None:
        names = list(THEMES)
        after = names[(names.index(self._theme.name) + 1) % len(names)]
        self.use_theme(after)
        # Kept for the next start; a failure is not worth a message while measuring.
        with contextlib.suppress(OcmmError):
            self._store.change({"window.theme": after})

    def _on_settings(self, loaded: LoadedSettings) -> None:
        settings = loaded.settings
        if settings.window_theme != self._theme.name:
            self.use_theme(settings.window_theme)
        if self._sounds is not None:
            self._sounds.enable(settings.window_sounds, settings.window_volume)
        self.eyes.use(settings)
        use_shortcuts(self.actions_by_key, usable_keys(settings.window_keys))
        self.output.use_formats(settings.report_formats, self.actions_by_key["export"])
        self.sheets.use_settings(loaded)

    def _find(self) -> None:
        self.search.ask(self.pages.keys(), self.pages.others())

    def _open_manual(self) -> None:
        self.sheets.open_manual(self.pages.shown())

    def _on_page(self) -> None:
        far = self.pages.is_far()
        self.running.simulated.show_far(far)
        self.eyes.show_far(far)
        self.hand.show_practice(practises=self.pages.practises())

    def _close_for(self, after: str) -> None:
        self.after = after
        self.close()

    def may_take_files(self) -> bool:
        return self.pages.may_be_left()

    def take_file(self, path: Path) -> None:
        """Open a job, or ask for the operator of a plan; the running measurement continues."""
        if path.suffix.lower() == ".ocmm":
            self.sheets.look_at(path)
        else:
            self.sheets.measure_by(path)
