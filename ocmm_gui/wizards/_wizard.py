"""The wizards as one view of the window: begin or go on, then the running procedure."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.errors import OcmmError
from ocmm_gui.kit import said, tr
from ocmm_gui.wizards._driver import WizardDriver
from ocmm_gui.wizards._guided_stack import GuidedStack
from ocmm_gui.wizards._registry import WIZARDS, WizardSpec, wizard_of
from ocmm_gui.wizards._runner import Runner
from ocmm_gui.wizards._sessions import begin, fields, offers, resume
from ocmm_gui.wizards._site import Offer, Opened, WizardSite, require_store
from ocmm_gui.wizards._start_page import StartPage
from ocmm_gui.wizards.parts import Field


class Wizard(GuidedStack):
    """One wizard at a time.

    Parameters
    ----------
    site
        Rig, probe, store and frames.
    clock
        The time of day, with its zone.
    """

    def __init__(
        self, site: WizardSite, clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    ) -> None:
        super().__init__()
        self.setAccessibleName(tr("Wizard"))
        self._site = site
        self._clock = clock
        self._spec = WIZARDS[0]
        self.start = StartPage()
        self.addWidget(self.start)
        self.start.begun.connect(self._begin)
        self.start.resumed.connect(self._resume)
        self.start.left.connect(self.leave)

    def topic(self) -> str:
        """Return which procedure it is, for the manual."""
        return self._spec.kind.value

    def open(self, kind: ProcedureKind) -> None:
        """Show the first page of a wizard, with what was not finished."""
        self.close_runner()
        self._spec = spec = wizard_of(kind)
        trouble = ""
        asked: tuple[Field, ...] = ()
        offered: tuple[Offer, ...] = ()
        try:
            if self._site.practice is not None:
                self._site.practice.prepare(self._clock())
            asked, offered = fields(self._site, spec), offers(self._site, spec)
            require_store(self._site, spec.subject)
        except OcmmError as error:
            trouble = said(f"{error.what} {error.remedy}")
        self.start.ask(
            spec.texts.title, spec.texts.purpose, asked, offered,
            practice=self._site.practice is not None,
        )  # fmt: skip
        self.setCurrentWidget(self.start)
        self.start.show_trouble(trouble)

    def _begin(self, values: dict[str, str]) -> None:
        self._run(lambda: begin(self._site, self._spec, values, self._clock()))

    def _resume(self, path: Path) -> None:
        self._run(lambda: resume(self._site, self._spec, path))

    def _run(self, make: Callable[[], Opened]) -> None:
        try:
            opened = make()
        except OcmmError as error:
            self.start.show_trouble(said(f"{error.what} {error.remedy}"))
            return
        driver = WizardDriver(
            opened.procedure, self._site.tap_for(opened.procedure, self.failed.emit),
            opened.calculation, opened.predict,
            self._site.temperature_state, self._clock,
        )  # fmt: skip
        spec = self._spec
        pages = spec.pages(opened.place, opened.procedure)
        runner = Runner(
            driver, spec.texts, pages, _commands(spec, opened, driver),
            practice=self._site.practice is not None,
        )  # fmt: skip
        self._show_runner(runner, driver, opened.procedure.base.torn)


def _commands(
    spec: WizardSpec[Any], opened: Opened, driver: WizardDriver
) -> dict[str, Callable[[], None]]:
    """Return what the actions do that only some procedures have, by key of the action."""

    def call(key: str) -> None:
        driver.do(spec.commands[key](opened.procedure))

    return {key: partial(call, key) for key in spec.commands}
