"""The main window: far view and desk view of one running inspection, and its maintenance."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QKeyEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QMainWindow,
    QVBoxLayout,
    QWidget,
)

from ocmm_core.calibration.records import ProbeView
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.evaluation import JobView, LiveView, withdrawn
from ocmm_core.settings import LoadedSettings, SettingsStore
from ocmm_gui.access import HandsAndEyes, PageStack, ZoomArea
from ocmm_gui.bridge import StationBridge
from ocmm_gui.home import FindAction
from ocmm_gui.kit import (
    ACTIONS,
    THEMES,
    Banner,
    Level,
    Mode,
    Notice,
    NoticeCentre,
    Sheet,
    Sound,
    SoundPlayer,
    WorkLine,
    apply_theme,
    bind_actions,
    dress,
    dropped_file,
    make_actions,
    reference_words,
    said,
    said_word,
    show_mode,
    tr,
    usable_keys,
    use_shortcuts,
)
from ocmm_gui.led import HandControl, LedProbe
from ocmm_gui.operator import (
    DeskView,
    FarView,
    Feedback,
    PointChoice,
    SimulatedBand,
    TipLine,
    TrustBar,
    TrustPlace,
)
from ocmm_gui.window._acceptance import AcceptanceRooms
from ocmm_gui.window._maintenance import Maintenance
from ocmm_gui.window._output import Output
from ocmm_gui.window._preload import Preload
from ocmm_gui.window._sheets import Sheets

if TYPE_CHECKING:
    from ocmm_core.composition import AcceptanceBench
    from ocmm_core.composition.practice import Practice

_PART = "The window"
START, REOPEN = "start", "reopen"
_IN_WIZARDS = ("theme", "log", "manual", "zoom_in", "zoom_out", "zoom_reset", "gloves")
"""Actions of the window that a wizard leaves as they are."""
_ON_SHEETS = (*_IN_WIZARDS, "settings", "start", "find", "what_to_do", "support")
"""The same of a sheet, on which nothing is lost."""


class MainWindow(QMainWindow):
    """Inspect in two densities, Maintain, each on one key; closing it stops the station.

    Parameters
    ----------
    bridge
        The running inspection.
    notices
        Where errors and news go.
    sounds
        Player, or None for silence.
    theme
        Name of the theme to begin with.
    out
        Folder of the report; None asks for one in the window.
    bench
        Acceptance tests that can be made; None where there are none.
    store
        The settings; None for those of this user.
    hand
        The probe of a virtual rig, for whoever wants to hold it; None where it is real.
    practice
        Where wizards are practised at a virtual rig; None where they are meant.
    """

    closed = Signal()
    """The station has stopped and the window is going away."""

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
        practice: Practice | None = None,
    ) -> None:
        super().__init__()
        self.setMinimumSize(1024, 640)
        self.setAcceptDrops(True)
        self.after = ""
        """What is wanted once it has closed: `START`, `REOPEN`, or nothing."""
        self._bridge = bridge
        self._notices = notices
        self._job: JobView | None = None
        self._live: LiveView | None = None
        self.close_seconds = 0.0
        self.actions_by_key = make_actions(self)
        self.desk = DeskView(
            bridge.station.instruments.rig, bridge.station.instruments.body, self.actions_by_key
        )
        self.far = FarView(self.actions_by_key)
        self._inspect: QWidget = self.desk
        self._use_plan()
        self._feedback = Feedback(
            sounds, notices,
            lambda: self.far.readout if self.is_far() else self.desk.readout,
        )  # fmt: skip
        self.hand = HandControl(
            hand, bridge, self.desk.points, self.actions_by_key, notices, self._to_desk,
            self._page_name, self,
        )  # fmt: skip
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
        self.trust = TrustBar()
        self.tip_line = TipLine()
        self.banner = Banner()
        self.simulated = SimulatedBand()
        self._stack = PageStack()
        self._lines = (
            self.banner, self.output.question, self.output.export_panel, self.output.bus_panel,
            self.choice.panel, self.tests.papers.panel,
        )  # fmt: skip
        self._work = WorkLine(tr("Results"))
        self._preload = Preload()
        # What listens goes with the window: Qt keeps the calls of one that has no parent, and in
        # them the window with the whole station, for as long as the program lives.
        for part in (self.choice, self.output, self.sheets, self.tests, self.maintenance):
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
        for view in (self.desk, self.far):
            self._stack.addWidget(view)
        self.sheets.made.connect(self._add)
        self.maintenance.made.connect(self._add)
        central = QWidget()
        whole = QHBoxLayout(central)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.setSpacing(0)
        layout = QVBoxLayout()
        layout.setSpacing(0)
        for widget in (
            self.hand.strip,
            self.trust,
            self.tip_line,
            *self._lines,
            self.output.work,
            self._work,
            self.tests.papers.line,
        ):
            layout.addWidget(widget)
        layout.addWidget(self._stack, 1)
        whole.addWidget(self.simulated)
        self._stack.currentChanged.connect(lambda _page: self._on_page())
        whole.addLayout(layout, 1)
        self.area = ZoomArea(central)
        self.setCentralWidget(self.area)

    def _connect(self, bridge: StationBridge) -> None:
        self.desk.plan.feature_chosen.connect(bridge.choice.select)
        self.sheets.wanted.connect(self._leave_keys_to)
        # Methods, which Qt holds weakly: a lambda with the window in it would keep it for ever.
        self.sheets.left.connect(self._to_inspect)
        self.sheets.settings_changed.connect(self._on_settings)
        self.sheets.reopen_wanted.connect(self._reopen)
        self.search.closed.connect(self._to_page)
        self.sheets.left_manual.connect(self._leave_manual)
        self.sheets.left_to_maintain.connect(self._to_maintain)
        self.maintenance.wanted.connect(self._leave_keys_to)
        self.maintenance.left.connect(self._to_maintain)
        self.tip_line.turned.connect(self._on_tip_turned)
        self._notices.posted.connect(self.banner.show_notice, Qt.ConnectionType.QueuedConnection)
        bridge.failed.connect(self._notices.error)
        bridge.live_changed.connect(self._on_live)
        bridge.evaluating.connect(self._on_evaluating)
        bridge.plan_changed.connect(self._use_plan)
        bridge.job_changed.connect(self._on_job)
        bridge.point_taken.connect(self._feedback.taken)
        bridge.point_refused.connect(self._feedback.refused)
        for view in (self.desk, self.far):
            bridge.coach_changed.connect(view.show_coach)
            bridge.point_refused.connect(view.show_refusal)
            bridge.point_taken.connect(lambda _point, view=view: view.forget_refusal())

    def _to_inspect(self) -> None:
        self.show_mode(Mode.INSPECT)

    def _to_maintain(self) -> None:
        self.show_mode(Mode.MAINTAIN)

    def _reopen(self) -> None:
        self._close_for(REOPEN)

    def _add(self, view: QWidget) -> None:
        """Take a view into the stack that was made because it is wanted."""
        self._stack.addWidget(view)
        dress(view, self._theme)

    def show_mode(self, mode: Mode) -> None:
        """Show Inspect, as it was left, or Maintain."""
        maintain = mode is Mode.MAINTAIN
        show_mode(self.actions_by_key, mode)
        self.output.hide()
        self.actions_by_key["mode"].setText(tr((Mode.INSPECT if maintain else Mode.MAINTAIN).value))
        if not maintain:
            self.show_far(self._inspect is self.far)
            return
        self._stack.setCurrentWidget(self.maintenance.view)
        self.banner.use_far(far=False)
        if self._live is not None:
            self._on_live(self._live)
        self.maintenance.view.list.setFocus()

    def _leave_keys_to(self, view: QWidget) -> None:
        kept = _ON_SHEETS if self.sheets.holds(view) else _IN_WIZARDS
        for info in ACTIONS:
            if info.key in kept:
                self.actions_by_key[info.key].setEnabled(True)
            else:
                self.actions_by_key[info.key].setEnabled(False)
        self._stack.setCurrentWidget(view)
        self.banner.use_far(far=False)

    def mode(self) -> Mode:
        """Return what the window is for at the moment."""
        shown = self._stack.currentWidget()
        inspects = shown in (self.desk, self.far) or self.sheets.holds(shown)
        return Mode.INSPECT if inspects else Mode.MAINTAIN

    def show_far(self, far: bool) -> None:
        """Show the far view or the desk view."""
        self._inspect = self.far if far else self.desk
        self._stack.setCurrentWidget(self._inspect)
        self.banner.use_far(far=far)
        text = tr("Desk view") if far else tr("Far view")
        self.actions_by_key["view"].setText(text)
        if self._job is not None:
            self._show_job(self._job)
        if self._live is not None:
            self._on_live(self._live)
        self._inspect.setFocus()

    def use_theme(self, name: str) -> None:
        """Dress the application in a theme of the table."""
        self._theme = THEMES[name]
        apply_theme(self, self._theme)

    def is_far(self) -> bool:
        """Return whether the far view is shown."""
        return self._stack.currentWidget() is self.far

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Let Esc put a notice or the export panel away, and nothing else."""
        if event.key() == Qt.Key.Key_Escape:
            for widget in (*self._lines, self.search):
                widget.hide()
            return
        super().keyPressEvent(event)

    def load_the_rest(self) -> None:
        """Load what sheets, Maintain and wizards need, behind the window; call it once."""
        self._preload.start()

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop the station before the window goes; every point is stored already."""
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
            "results": sheets.open_results,
            "job": sheets.open_job,
            "plan": sheets.open_plan,
            "alignment": sheets.open_alignment,
            "keys": sheets.open_keys,
            "manual": self._open_manual,
            "what_to_do": sheets.open_what_to_do,
            "support": sheets.open_support,
            "recall": sheets.open_recall,
            "archive": sheets.open_archive,
            "view": lambda: self.show_far(not self.is_far()),
            "cameras": self.desk.toggle_cameras,
            "part_mode": self.desk.points.next_mode,
            "fit": self.desk.points.fit,
            "closeup": self.desk.points.close_up,
            "theme": self._next_theme,
            "settings": sheets.open_settings,
            "start": lambda: self._close_for(START),
            "find": self._find,
            "mode": lambda: self.show_mode(
                Mode.INSPECT if self.mode() is Mode.MAINTAIN else Mode.MAINTAIN
            ),
            **self.eyes.calls(),
            **self.hand.calls(),
            **self.output.calls(),
            **self.maintenance.calls(),
        }

    def _use_plan(self) -> None:
        plan, file = self._bridge.station.job.plan, self._bridge.station.job.plan_file
        self.setWindowTitle(f"OCMM – {plan.part}")
        self.desk.use_plan(plan, None if file is None else file.parent)

    def _on_live(self, live: LiveView) -> None:
        self._live = live
        try:
            self._show_live(live)
        except Exception as error:
            # What cannot be shown must not leave standing what was shown before it.
            self._bridge.station.faults.fail(error, _PART)
            for readout in (self.desk.readout, self.far.readout):
                readout.withdraw(self._why_failed())

    def _why_failed(self) -> str:
        fault = self._bridge.station.faults.measuring
        return "" if fault is None else said(fault.error.what)

    def _show_live(self, live: LiveView) -> None:
        place = TrustPlace.FAR if self.is_far() else TrustPlace.DESK
        if self.mode() is Mode.MAINTAIN:
            place = TrustPlace.MAINTAIN
        self.trust.show_calibration(
            self._bridge.station.instruments.calibration(), place, reference_words(live)
        )
        self.tip_line.show_probe(self._bridge.station.instruments.probe(), place)
        shown = self._stack.currentWidget()
        for view in (self.far, self.desk):
            if view is shown:
                view.show_live(live)
        if self.maintenance.is_made("view") and self.maintenance.view is shown:
            self.maintenance.view.show_live(live)
        self.hand.show_live(live)
        measures = self._stack.currentWidget() in (self.desk, self.far)
        target = self._job.target if measures and self._job is not None else None
        self._feedback.way(target, live.tip_world)

    def _on_evaluating(self, busy: bool) -> None:
        if busy:
            self._work.begin(tr("Calculating the results"))
        else:
            self._work.end()

    def _on_job(self, job: JobView) -> None:
        try:
            self._take_job(job)
        except Exception as error:
            self._bridge.station.faults.fail(error, _PART)
            with contextlib.suppress(Exception):
                self._show_job(withdrawn(job, self._why_failed()))

    def _take_job(self, job: JobView) -> None:
        previous, self._job = self._job, job
        self.simulated.setVisible(job.simulated)
        self._show_job(job)
        self.choice.show_job(job)
        self.sheets.job_changed(job)
        if previous is not None:
            self._feedback.announce(previous, job)

    def _show_job(self, job: JobView) -> None:
        for view in (self.far, self.desk):
            if view is self._stack.currentWidget():
                view.show_job(job)

    def _on_tip_turned(self, view: ProbeView) -> None:
        if view.blocking_reason is None:
            self._notices.inform(
                tr("Points are taken again: {title} is {word}.").format(
                    title=view.title, word=said_word(view.word.value)
                )
            )
            return
        self._feedback.play(Sound.REFUSED)
        # It stands on every screen as long as it lasts.
        self._notices.keep(
            Notice(
                Level.ERROR,
                view.blocking_reason.what,
                view.blocking_reason.remedy,
                "",
                datetime.now().astimezone(),
            )
        )

    def _next_theme(self) -> None:
        names = list(THEMES)
        after = names[(names.index(self._theme.name) + 1) % len(names)]
        self.use_theme(after)
        # It is the same next time; where it cannot be kept, nobody who measures needs to know.
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
        page = self._stack.currentWidget()
        own = page.keys if isinstance(page, Sheet) else {}
        self.search.ask({**own, **self.actions_by_key})

    def _open_manual(self) -> None:
        """Open the manual at the section of the page one is on."""
        self.sheets.open_manual(self._stack.currentWidget())

    def _leave_manual(self) -> None:
        """Show what was shown before, with the keyboard where it was."""
        page, focus = self.sheets.manual.came_from()
        if page is None or page in (self.desk, self.far):
            self.show_mode(Mode.INSPECT)
        elif self.maintenance.is_made("view") and page is self.maintenance.view:
            self.show_mode(Mode.MAINTAIN)
        else:
            self._leave_keys_to(page)
            page.setFocus()
        if focus is not None and focus.isVisible():
            focus.setFocus()

    def _to_desk(self) -> None:
        self.show_mode(Mode.INSPECT)
        self.show_far(False)

    def _on_page(self) -> None:
        self.simulated.show_far(self.is_far())
        self.eyes.show_far(self.is_far())
        shown = self._stack.currentWidget()
        guided = (self.maintenance.is_made("wizard") and shown is self.maintenance.wizard) or (
            self.tests.is_made("desk") and shown is self.tests.desk
        )
        self.hand.show_practice(practises=guided and self.maintenance.practises)

    def _page_name(self) -> str:
        shown = self._stack.currentWidget()
        return "desk" if shown is self.desk else "far" if shown is self.far else "other"

    def _to_page(self) -> None:
        page = self._stack.currentWidget()
        if page is not None:
            page.setFocus()

    def _close_for(self, after: str) -> None:
        self.after = after
        self.close()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take one plan or job."""
        if dropped_file(event.mimeData()) is not None:
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Look at a job, or ask who measures by a plan; what is measured goes on."""
        path = dropped_file(event.mimeData())
        if path is None:
            return
        event.acceptProposedAction()
        if path.suffix.lower() == ".ocmm":
            self.sheets.look_at(path)
        else:
            self.sheets.measure_by(path)
