"""The main window: far view and desk view of one running inspection, and its maintenance."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent, QKeyEvent
from PySide6.QtWidgets import QApplication, QMainWindow, QStackedWidget, QVBoxLayout, QWidget

from ocmm_core.calibration.probe_definition import definition_of
from ocmm_core.calibration.probe_in_use import ProbeView
from ocmm_core.calibration.procedure import Kind
from ocmm_core.errors import OcmmError
from ocmm_core.inspection.view import JobView, LiveView
from ocmm_gui.actions import ACTIONS, Mode, make_actions, show_mode
from ocmm_gui.bridge import StationBridge
from ocmm_gui.desk_view import DeskView
from ocmm_gui.echo import Echo
from ocmm_gui.maintain.bus_page import BusPage
from ocmm_gui.maintain.calibration_page import CalibrationPage
from ocmm_gui.maintain.deeds import Deeds
from ocmm_gui.maintain.fits_page import FitsPage
from ocmm_gui.maintain.maintain_view import MaintainView, Page
from ocmm_gui.maintain.probe_design_page import ProbeDesignPage, plain_body
from ocmm_gui.maintain.probe_page import ProbePage
from ocmm_gui.notify import Banner, Notice, NoticeCentre
from ocmm_gui.operator.far_view import FarView
from ocmm_gui.operator.path_panel import PathPanel
from ocmm_gui.operator.tip_line import TipLine
from ocmm_gui.operator.trust_bar import Place, TrustBar
from ocmm_gui.point_choice import PointChoice
from ocmm_gui.sheets import Sheets
from ocmm_gui.sound import Sound, SoundPlayer
from ocmm_gui.theme import THEMES, apply_theme
from ocmm_gui.wizards.definition_page import DefinitionPage
from ocmm_gui.wizards.site import site_of
from ocmm_gui.wizards.wizard import Wizard
from ocmm_gui.words import reference_words

_IN_WIZARDS = ("theme", "log")
"""Actions of the window that a wizard leaves as they are."""


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
    ) -> None:
        super().__init__()
        self.setMinimumSize(1024, 640)
        self._bridge = bridge
        self._notices = notices
        self._out = out
        self._job: JobView | None = None
        self._live: LiveView | None = None
        self.close_seconds = 0.0
        self.actions_by_key = make_actions(self, self._calls())
        self.desk = DeskView(bridge.station.rig, bridge.station.body, self.actions_by_key)
        self.far = FarView(self.actions_by_key)
        self._use_plan()
        self._echo = Echo(
            sounds, notices,
            lambda: self.far.readout() if self.is_far() else self.desk.readout,
        )  # fmt: skip
        self.choice = PointChoice(bridge, self.desk, notices)
        self.sheets = Sheets(bridge, notices, self._folder)
        self.bus = BusPage(bridge.bus)
        self.calibration = CalibrationPage(
            bridge.station.rig, bridge.calibration, bridge.calibration_overview
        )
        self.probe = ProbePage(bridge.probe, bridge.probe_overview)
        self.probe_design = ProbeDesignPage(
            bridge.station.rig, plain_body(bridge.station.probe_in_use)
        )
        self.fits = FitsPage()
        pages = (
            Page("Bus", "The cameras on their wire", self.bus, ("bus_text",)),
            Page(
                "Calibration", "Whether the cameras can be trusted", self.calibration,
                ("calibrate", "relocate", "verify", "write_cameras"),
            ),
            Page(
                "Probe", "Whether the tip can be trusted", self.probe,
                ("define", "mount", "check_tip", "qualify", "pivot"),
            ),
            Page("Probe design", "How certain the tip is, and why not more", self.probe_design),
            Page("Fits", "Whether the fits are right, by certified pairs", self.fits),
        )  # fmt: skip
        self._deeds = Deeds(bridge, notices, self.probe)
        self.maintain = MaintainView(pages, self.actions_by_key)
        self.trust = TrustBar()
        self.tip_line = TipLine()
        self.banner = Banner()
        self.export_panel = PathPanel("report", "folder")
        self.bus_panel = PathPanel("report of the bus", "file")
        self._inspect: QWidget = self.desk
        self.wizard = Wizard(site_of(bridge))
        self.definition = DefinitionPage()
        self._stack = QStackedWidget()
        for view in (self.desk, self.far, self.maintain, self.wizard, self.definition):
            self._stack.addWidget(view)
        for sheet in self.sheets.all():
            self._stack.addWidget(sheet)
        central = QWidget()
        layout = QVBoxLayout(central)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        self._lines = (self.banner, self.export_panel, self.bus_panel, self.choice.panel)
        for widget in (self.trust, self.tip_line, *self._lines):
            layout.addWidget(widget)
        layout.addWidget(self._stack, 1)
        self.setCentralWidget(central)
        self.desk.plan.feature_chosen.connect(bridge.select)
        self.sheets.wanted.connect(self._leave_keys_to)
        self.sheets.left.connect(lambda: self.show_mode(Mode.INSPECT))
        self.export_panel.given.connect(bridge.export)
        self.bus_panel.given.connect(bridge.save_bus_text)
        notices.posted.connect(self.banner.show_notice, Qt.ConnectionType.QueuedConnection)
        bridge.failed.connect(notices.error)
        bridge.exported.connect(self._on_exported)
        bridge.bus_text_saved.connect(
            lambda path: notices.inform(f"The report of the bus is in {path}.")
        )
        self.tip_line.turned.connect(self._on_tip_turned)
        bridge.cameras_written.connect(
            lambda: notices.inform("The cameras store the intrinsics of the calibration.")
        )
        self.wizard.left.connect(self._on_wizard_left)
        self.definition.left.connect(lambda: self.show_mode(Mode.MAINTAIN))
        self.definition.saved.connect(self._on_defined)
        self.wizard.taken.connect(lambda: self._echo.play(Sound.TAKEN))
        self.wizard.sounded.connect(self._echo.play)
        self.wizard.failed.connect(self._on_wizard_failed)
        bridge.live_changed.connect(self._on_live)
        bridge.plan_changed.connect(self._use_plan)
        bridge.job_changed.connect(self._on_job)
        bridge.point_taken.connect(self._echo.taken)
        bridge.point_refused.connect(self._echo.refused)
        show_mode(self.actions_by_key, Mode.INSPECT)
        self.use_theme(theme)

    def show_mode(self, mode: Mode) -> None:
        """Show Inspect, as it was left, or Maintain."""
        maintain = mode is Mode.MAINTAIN
        show_mode(self.actions_by_key, mode)
        self.export_panel.hide()
        self.bus_panel.hide()
        self.actions_by_key["mode"].setText((Mode.INSPECT if maintain else Mode.MAINTAIN).value)
        if not maintain:
            self.show_far(self._inspect is self.far)
            return
        self._stack.setCurrentWidget(self.maintain)
        if self._live is not None:
            self._on_live(self._live)
        self.maintain.list.setFocus()

    def open_wizard(self, kind: Kind) -> None:
        """Show the first page of a wizard; its keys are its own until it is left."""
        self._leave_keys_to(self.wizard)
        self.wizard.open(kind)

    def open_definition(self) -> None:
        """Show the page on which a probe is defined, filled in with the one that is measured with.

        Its keys are its own until it is left.
        """
        in_use = self._bridge.station.probe_in_use
        records = in_use.records
        self._leave_keys_to(self.definition)
        self.definition.open(
            definition_of(in_use.design), Path.home() / "probe.toml",
            None if records is None else records.calibration,
        )  # fmt: skip

    def _leave_keys_to(self, view: QWidget) -> None:
        for info in ACTIONS:
            if info.key not in _IN_WIZARDS:
                self.actions_by_key[info.key].setEnabled(False)
        self._stack.setCurrentWidget(view)

    def mode(self) -> Mode:
        """Return what the window is for at the moment."""
        shown = self._stack.currentWidget()
        inspects = shown in (self.desk, self.far) or self.sheets.holds(shown)
        return Mode.INSPECT if inspects else Mode.MAINTAIN

    def show_far(self, far: bool) -> None:
        """Show the far view or the desk view."""
        self._inspect = self.far if far else self.desk
        self._stack.setCurrentWidget(self._inspect)
        text = "Desk view" if far else "Far view"
        self.actions_by_key["view"].setText(text)
        if self._job is not None:
            self._show_job(self._job)
        if self._live is not None:
            self._on_live(self._live)
        self._inspect.setFocus()

    def use_theme(self, name: str) -> None:
        """Dress the application in a theme of the table."""
        self._theme = THEMES[name]
        app = QApplication.instance()
        if isinstance(app, QApplication):
            apply_theme(app, self, self._theme)

    def is_far(self) -> bool:
        """Return whether the far view is shown."""
        return self._stack.currentWidget() is self.far

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Let Esc put a notice or the export panel away, and nothing else."""
        if event.key() == Qt.Key.Key_Escape:
            for widget in self._lines:
                widget.hide()
            return
        super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop the station before the window goes; every point is stored already."""
        begun = time.monotonic()
        self.probe_design.cancel()
        self.sheets.close_work()
        self.fits.cancel()
        self.wizard.close_runner()
        self.definition.close_examination()
        self._bridge.close()
        self._echo.close()
        self.close_seconds = time.monotonic() - begun
        event.accept()
        self.closed.emit()

    def _calls(self) -> dict[str, Callable[[], None]]:
        return {
            "take": self._bridge.take,
            "undo": self._bridge.undo,
            "finish": self._bridge.finish,
            "flip": self._bridge.flip,
            "skip": self._bridge.skip,
            "repeat": self._bridge.repeat,
            "order": self._bridge.toggle_order,
            "pause": self._bridge.toggle_pause,
            "side": self._bridge.next_side,
            "redo": self._bridge.redo,
            "refit": self._bridge.refit,
            "tone": lambda: self._echo.toggle_tone(),
            "point_after": lambda: self.choice.step(1),
            "point_before": lambda: self.choice.step(-1),
            "delete": lambda: self.choice.delete(),
            "restore": lambda: self.choice.restore(),
            "results": lambda: self.sheets.open_results(),
            "job": lambda: self.sheets.open_job(),
            "plan": lambda: self.sheets.open_plan(),
            "alignment": lambda: self.sheets.open_alignment(),
            "previous": lambda: self._bridge.select_neighbour(-1),
            "next": lambda: self._bridge.select_neighbour(1),
            "view": lambda: self.show_far(not self.is_far()),
            "cameras": lambda: self.desk.toggle_cameras(),
            "fit": lambda: self.desk.points.fit(),
            "closeup": lambda: self.desk.points.close_up(),
            "theme": self._next_theme,
            "export": self._export,
            "log": self._save_log,
            "bus_text": self._save_bus_text,
            "calibrate": lambda: self.open_wizard(Kind.KNOWN_POINTS),
            "relocate": lambda: self.open_wizard(Kind.RELOCATION),
            "verify": lambda: self.open_wizard(Kind.VERIFICATION),
            "pivot": lambda: self.open_wizard(Kind.PIVOT),
            "qualify": lambda: self.open_wizard(Kind.QUALIFICATION),
            "check_tip": lambda: self.open_wizard(Kind.TIP_CHECK),
            "mount": lambda: self._deeds.mount_tip(),
            "define": self.open_definition,
            "write_cameras": lambda: self._deeds.write_cameras(),
            "mode": lambda: self.show_mode(
                Mode.INSPECT if self.mode() is Mode.MAINTAIN else Mode.MAINTAIN
            ),
        }

    def _use_plan(self) -> None:
        plan, file = self._bridge.station.plan, self._bridge.station.plan_file
        self.setWindowTitle(f"OCMM – {plan.part}")
        self.desk.use_plan(plan, None if file is None else file.parent)

    def _on_live(self, live: LiveView) -> None:
        self._live = live
        place = Place.FAR if self.is_far() else Place.DESK
        if self.mode() is Mode.MAINTAIN:
            place = Place.MAINTAIN
        self.trust.show_calibration(self._bridge.calibration(), place, reference_words(live))
        self.tip_line.show_probe(self._bridge.probe(), place)
        for view in (self.far, self.desk, self.maintain):
            if view is self._stack.currentWidget():
                view.show_live(live)
        measures = self._stack.currentWidget() in (self.desk, self.far)
        target = self._job.target if measures and self._job is not None else None
        self._echo.way(target, live.tip_world)

    def _on_job(self, job: JobView) -> None:
        previous, self._job = self._job, job
        self._show_job(job)
        self.choice.show_job(job)
        self.sheets.job_changed(job)
        if previous is not None:
            self._echo.announce(previous, job)

    def _show_job(self, job: JobView) -> None:
        for view in (self.far, self.desk):
            if view is self._stack.currentWidget():
                view.show_job(job)

    def _export(self) -> None:
        if self._out is not None:
            self._bridge.export(self._out)
        else:
            self.export_panel.ask(self._folder())

    def _on_exported(self, paths: tuple[Path, ...]) -> None:
        names = ", ".join(path.name for path in paths)
        folder = paths[0].parent if paths else ""
        self._notices.inform(f"Written to {folder}: {names}")

    def _on_wizard_failed(self, error: OcmmError) -> None:
        self._echo.play(Sound.REFUSED)
        self._notices.error(error)

    def _on_tip_turned(self, view: ProbeView) -> None:
        if view.hindrance is None:
            self._notices.inform(f"Points are taken again: {view.title} is {view.word.value}.")
            return
        self._echo.play(Sound.REFUSED)
        # It stands on every screen as long as it lasts.
        self._notices.keep(
            Notice(
                True, view.hindrance.what, view.hindrance.remedy, "", datetime.now().astimezone()
            )
        )

    def _on_wizard_left(self) -> None:
        self._bridge.look_at_probe_records()
        self.show_mode(Mode.MAINTAIN)

    def _on_defined(self, path: Path) -> None:
        self._notices.inform(
            f"The probe is in {path}. Start the program with --probe {path}, and calibrate it."
        )

    def _save_bus_text(self) -> None:
        path = self._new_text("bus")
        if self._out is not None:
            self._bridge.save_bus_text(path)
        else:
            self.bus_panel.ask(path)

    def _folder(self) -> Path:
        return self._out if self._out is not None else Path.home() / "ocmm-out"

    def _new_text(self, what: str) -> Path:
        folder = self._out if self._out is not None else Path.home()
        return folder / f"ocmm-{what}-{datetime.now().astimezone():%Y%m%d-%H%M%S}.txt"

    def _save_log(self) -> None:
        path = self._new_text("log")
        try:
            self._notices.save(path)
        except OcmmError as error:
            self._notices.error(error)
        else:
            self._notices.inform(f"The log is in {path}.")

    def _next_theme(self) -> None:
        names = list(THEMES)
        self.use_theme(names[(names.index(self._theme.name) + 1) % len(names)])
