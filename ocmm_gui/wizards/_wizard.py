"""The wizards as one view of the window: begin or go on, then the running procedure."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QStackedWidget, QWidget

from ocmm_core.calibration.cameras import KnownPointsProcedure
from ocmm_core.calibration.guided import Kind
from ocmm_core.calibration.relocation import RelocationProcedure
from ocmm_core.calibration.sweeping import PivotProcedure, PivotView
from ocmm_core.calibration.tip import TipCheckProcedure, TipQualificationProcedure, TouchView
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.errors import OcmmError
from ocmm_gui.kit import DEFAULT_THEME, THEMES, Theme, Themed
from ocmm_gui.wizards._driver import WizardDriver
from ocmm_gui.wizards._runner import Runner
from ocmm_gui.wizards._sessions import begin, fields, offers, require_store, resume
from ocmm_gui.wizards._site import Offer, Opened, WizardSite
from ocmm_gui.wizards._start_page import StartPage
from ocmm_gui.wizards.pages import (
    BarPage,
    ConePage,
    FirstConePage,
    PivotResultPage,
    ResultPage,
    SpherePage,
    SpheresPage,
    SweepPage,
    TipCheckResultPage,
    TipResultPage,
    VerdictPage,
    WavePage,
    WorldPage,
    repeat_worst,
)
from ocmm_gui.wizards.parts import (
    TEXTS,
    Field,
    KnownPointsPage,
    LinesPage,
    PreparePage,
    ProbePreparePage,
    SeatsPage,
    StepPage,
)


class Wizard(QStackedWidget):
    """One wizard at a time.

    Parameters
    ----------
    site
        Rig, probe, store and frames.
    clock
        The time of day, with its zone.
    """

    left = Signal()
    """The wizard was left; what ran has ended."""
    taken = Signal()
    """An observation is on the disk."""
    sounded = Signal(object)
    """Emits a `Sound` that is to be heard."""
    failed = Signal(object)
    """Emits the `OcmmError` of a command."""

    def __init__(
        self, site: WizardSite, clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    ) -> None:
        super().__init__()
        self.setAccessibleName("Wizard")
        self._site = site
        self._clock = clock
        self._theme = THEMES[DEFAULT_THEME]
        self._kind = Kind.KNOWN_POINTS
        self.runner: Runner | None = None
        self.start = StartPage()
        self.addWidget(self.start)
        self.start.begun.connect(self._begin)
        self.start.resumed.connect(self._resume)
        self.start.left.connect(self.leave)

    def open(self, kind: Kind) -> None:
        """Show the first page of a wizard, with what was not finished."""
        self.close_runner()
        self._kind = kind
        texts, trouble = TEXTS[kind], ""
        asked: tuple[Field, ...] = ()
        offered: tuple[Offer, ...] = ()
        try:
            asked, offered = fields(self._site, kind), offers(self._site, kind)
            require_store(self._site, kind)
        except OcmmError as error:
            trouble = f"{error.what} {error.remedy}"
        self.start.ask(texts.title, texts.purpose, asked, offered)
        self.setCurrentWidget(self.start)
        self.start.show_trouble(trouble)

    def leave(self) -> None:
        """End what runs and give the window back; the session can be resumed."""
        self.close_runner()
        self.left.emit()

    def close_runner(self) -> bool:
        """End what runs within bounded time and say whether it ended."""
        runner, self.runner = self.runner, None
        if runner is None:
            return True
        ended = runner.close_driver()
        self.removeWidget(runner)
        runner.deleteLater()
        return ended

    def set_theme(self, theme: Theme) -> None:
        """Remember the theme for pages that are made later."""
        self._theme = theme

    def _begin(self, values: dict[str, str]) -> None:
        self._run(lambda: begin(self._site, self._kind, values, self._clock()))

    def _resume(self, path: Path) -> None:
        self._run(lambda: resume(self._site, self._kind, path))

    def _run(self, make: Callable[[], Opened]) -> None:
        try:
            opened = make()
        except OcmmError as error:
            self.start.show_trouble(f"{error.what} {error.remedy}")
            return
        driver = WizardDriver(
            opened.procedure, self._site.tap, opened.calculation, opened.predict,
            self._site.warmth, self._clock,
        )  # fmt: skip
        pages, extra = _pages(opened, self._site), _extra(opened, driver)
        runner = Runner(driver, TEXTS[self._kind].title, pages, extra)
        runner.left.connect(self.leave)
        runner.sounded.connect(self.sounded)
        driver.taken.connect(self.taken)
        driver.failed.connect(self.failed)
        self.runner = runner
        for widget in (runner, *runner.findChildren(QWidget)):
            if isinstance(widget, Themed):
                widget.set_theme(self._theme)
        self.addWidget(runner)
        self.setCurrentWidget(runner)
        driver.start()
        runner.setFocus()


def _pages(opened: Opened, site: WizardSite) -> dict[str, StepPage]:
    """Return the page of every step."""
    rig, procedure = opened.rig, opened.procedure
    pages: dict[str, StepPage]
    if isinstance(procedure, PivotProcedure):
        pages = {
            "first": SweepPage(rig, second=False),
            "second": SweepPage(rig, second=True),
            "again": FirstConePage(rig),
            "result": PivotResultPage(rig),
        }
    elif isinstance(procedure, TipQualificationProcedure):
        pages = {"sphere": SpherePage(rig), "cone": ConePage(rig), "result": TipResultPage(rig)}
    elif isinstance(procedure, TipCheckProcedure):
        pages = {"sphere": SpherePage(rig), "cone": ConePage(rig), "result": TipCheckResultPage()}
    elif isinstance(procedure, KnownPointsProcedure):
        pages = {
            "collect": KnownPointsPage(rig, procedure),
            "result": ResultPage(rig, "Errors at points that were held back"),
        }
    elif isinstance(procedure, RelocationProcedure):
        pages = {
            "seats": SeatsPage(rig, again=False),
            "wave": WavePage(rig),
            "bar": BarPage(rig),
            "world": WorldPage(rig),
            "again": SeatsPage(rig, again=True),
            "result": ResultPage(rig, "Misfits of bar and control points"),
        }
    else:
        pages = {
            "seats": SeatsPage(rig, again=False),
            "lines": LinesPage(rig),
            "spheres": SpheresPage(rig),
            "again": SeatsPage(rig, again=True),
            "result": VerdictPage(),
        }
    return {"prepare": _prepare(opened, site), **pages}


def _prepare(opened: Opened, site: WizardSite) -> StepPage:
    """Return the page on which the session is shown before it goes on."""
    view = opened.procedure.view
    facts: tuple[tuple[str, str], ...]
    if isinstance(view, PivotView):
        facts = (("Probe", view.probe), ("Tip", view.tip))
    elif isinstance(view, TouchView):
        sphere = f"{view.sphere_diameter_mm:.4f} mm, U {1e3 * view.sphere_expanded_mm:.1f} µm"
        facts = (
            ("Probe", view.probe), ("Tip", view.tip), ("Ball", f"{view.nominal_mm:g} mm"),
            (view.sphere_name, sphere),
        )  # fmt: skip
    else:
        return PreparePage(opened.rig)
    return ProbePreparePage(site.body if site.probe is None else site.probe.design, facts)


def _extra(opened: Opened, driver: WizardDriver) -> dict[str, Callable[[], None]]:
    """Return what the actions do that only some procedures have."""
    procedure = opened.procedure
    if isinstance(procedure, KnownPointsProcedure):
        return {"skip": lambda: driver.do(procedure.skip)}
    if isinstance(procedure, VerificationProcedure):
        return {"repeat": lambda: driver.do(repeat_worst(procedure, procedure.view))}
    if isinstance(procedure, PivotProcedure):
        return {"anew": lambda: driver.do(procedure.sweep_anew)}
    return {}
