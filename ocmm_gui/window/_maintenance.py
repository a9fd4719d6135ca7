"""Maintenance of rig and probe: Maintain, wizards, follow-ups; all loaded at their first use."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Signal
from PySide6.QtGui import QAction

from ocmm_core.calibration.probe_design import definition_of
from ocmm_core.errors import OcmmError
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import ACTIONS, PROCEDURE, LateParts, NoticeCentre, Sound, tr
from ocmm_gui.operator import Feedback
from ocmm_gui.window._acceptance import AcceptanceRooms

if TYPE_CHECKING:
    from ocmm_core.calibration.guided import ProcedureKind
    from ocmm_gui.maintain import (
        BusPage,
        CalibrationPage,
        ConfirmedActions,
        FitsPage,
        MaintainView,
        Page,
        ProbeDesignPage,
        ProbePage,
        RigPlanPage,
    )
    from ocmm_gui.wizards import PracticeRoom, Wizard
    from ocmm_gui.wizards.pages import DefinitionPage


class Maintenance(LateParts):
    """Make pages and wizards at their first use, and join them to the station.

    ``feedback``: sounds of wizards; ``actions`` by key; ``tests``: acceptance tests and
    certificates; ``practice``: virtual rig for practising; None for real work.
    """

    made = Signal(object)
    """Emits a new page, for the stack of the window."""
    wanted = Signal(object)
    """Emits the page to be shown with its own keys."""
    left = Signal()
    """Back to the pages."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: NoticeCentre,
        feedback: Feedback,
        actions: dict[str, QAction],
        tests: AcceptanceRooms,
        practice: PracticeRoom | None = None,
    ) -> None:
        super().__init__()
        self.tests, self._practice = tests, practice
        tests.made.connect(self.made)
        tests.wanted.connect(self.wanted)
        tests.left.connect(self.left)
        self._bridge, self._notices, self._feedback = bridge, notices, feedback
        self._actions = actions
        bridge.maintenance.cameras_written.connect(
            lambda: notices.inform(tr("The cameras now store the intrinsics of the calibration."))
        )

    @cached_property
    def bus(self) -> BusPage:
        from ocmm_gui.maintain import BusPage

        return BusPage(self._bridge.station.looks.bus)

    @cached_property
    def calibration(self) -> CalibrationPage:
        from ocmm_gui.maintain import CalibrationPage

        instruments = self._bridge.station.instruments
        return CalibrationPage(
            instruments.rig, instruments.calibration, instruments.calibration_overview
        )

    @cached_property
    def probe(self) -> ProbePage:
        from ocmm_gui.maintain import ProbePage

        instruments = self._bridge.station.instruments
        return ProbePage(instruments.probe, instruments.probe_overview)

    @cached_property
    def probe_design(self) -> ProbeDesignPage:
        from ocmm_gui.maintain import ProbeDesignPage, plain_body

        instruments = self._bridge.station.instruments
        return ProbeDesignPage(instruments.rig, plain_body(instruments.probe_in_use))

    @cached_property
    def rig_plan(self) -> RigPlanPage:
        from ocmm_gui.maintain import RigPlanPage

        return RigPlanPage(self._bridge.station.instruments.rig)

    @cached_property
    def fits(self) -> FitsPage:
        from ocmm_gui.maintain import FitsPage

        return FitsPage()

    @cached_property
    def view(self) -> MaintainView:
        from ocmm_gui.maintain import MaintainView, Page
        from ocmm_gui.wizards import WIZARDS, Subject

        rig = self._bridge.station.instruments.rig

        def wizards(subject: Subject) -> tuple[str, ...]:
            return tuple(
                one.action for one in WIZARDS if one.subject is subject and one.applies(rig)
            )

        # A tracker has neither a bus nor cameras to write into.
        bus: tuple[Page, ...] = ()
        of_cameras: tuple[str, ...] = ()
        planned: tuple[Page, ...] = ()
        if rig.markers is None:
            wire = tr("The cameras on their wire")
            bus, of_cameras = (Page(tr("Bus"), wire, self.bus, ("bus_text",)),), ("write_cameras",)
            planned = (
                Page(tr("Rig plan"), tr("U of a planned rig, and as calibrated"), self.rig_plan),
            )
        pages = (
            *bus,
            Page(
                tr("Calibration"), tr("Calibration status of the cameras"), self.calibration,
                (*wizards(Subject.CAMERAS), "recall", *of_cameras, "certificate"),
            ),
            Page(
                tr("Probe"), tr("Status of probe and tip"), self.probe,
                ("define", "mount", *wizards(Subject.PROBE), "certificate"),
            ),
            *self._test_pages(),
            Page(
                tr("Probe design"), tr("Uncertainty of the tip and its causes"), self.probe_design,
            ),
            *planned,
            Page(tr("Fits"), tr("Check of the fits against certified pairs"), self.fits),
        )  # fmt: skip
        view = MaintainView(pages, self._actions)
        self.made.emit(view)
        return view

    @cached_property
    def wizard(self) -> Wizard:
        from ocmm_gui.wizards import Wizard, practice_site, site_of

        room = self._practice
        site = site_of(self._bridge) if room is None else practice_site(self._bridge, room)
        wizard = Wizard(site)
        wizard.left.connect(self._on_wizard_left)
        wizard.taken.connect(lambda: self._feedback.play(Sound.TAKEN))
        wizard.sounded.connect(self._feedback.play)
        wizard.failed.connect(self._on_wizard_failed)
        wizard.told.connect(self._notices.inform)
        self.made.emit(wizard)
        return wizard

    @cached_property
    def definition(self) -> DefinitionPage:
        from ocmm_gui.wizards.pages import DefinitionPage

        page = DefinitionPage()
        page.left.connect(self.left)
        page.saved.connect(self._on_defined)
        self.made.emit(page)
        return page

    @cached_property
    def _confirmed(self) -> ConfirmedActions:
        from ocmm_gui.maintain import ConfirmedActions

        return ConfirmedActions(self._bridge, self._notices, self.probe)

    def calls(self) -> dict[str, Callable[[], None]]:
        deeds: dict[str, Callable[[], None]] = {
            "mount": lambda: self._confirmed.mount_tip(),
            "define": self.open_definition,
            "write_cameras": lambda: self._confirmed.write_cameras(),
        }
        wizards = (info.key for info in ACTIONS if info.opens_wizard)
        deeds |= {"certificate": self._write_certificate} | self.tests.calls()
        return deeds | {key: partial(self._open_by, key) for key in wizards}

    def _test_pages(self) -> tuple[Page, ...]:
        from ocmm_gui.maintain import Page

        if self.tests.bench is None:
            return ()
        keys = ("acceptance", "interim", "artefacts", "study", "certificate")
        tip = tr("Acceptance tests, interim checks, artefacts and gauge studies")
        return (Page(tr("Acceptance"), tip, self.tests.page, keys),)

    def _write_certificate(self) -> None:
        instruments = self._bridge.station.instruments
        shown = self.view.page()
        if shown is self.calibration:
            store = instruments.calibration_in_use.store
            folder = None if store is None else store.folder
            self.tests.ask_for_paper(folder, "", tr("No calibrations of these cameras are kept."))
        elif shown is self.probe:
            in_use = instruments.probe_in_use
            folder = None if in_use.store is None else in_use.store.folder
            self.tests.ask_for_paper(folder, in_use.tip, tr("No records of this probe are kept."))
        else:
            there = self.tests.bench is not None and shown is self.tests.page
            record = self.tests.page.selected() if there else None
            why = tr("Select a test on page Acceptance, or open page Calibration or Probe.")
            self.tests.ask_for_paper(record, "", why)

    def _open_by(self, action: str) -> None:
        from ocmm_gui.wizards import WIZARDS

        self.open_wizard(next(wizard.kind for wizard in WIZARDS if wizard.action == action))

    def open_wizard(self, kind: ProcedureKind) -> None:
        """Show the first page of a wizard; its keys are its own until it is left."""
        self.wanted.emit(self.wizard)
        self.wizard.open(kind)

    def open_definition(self) -> None:
        """Show the page that defines a probe, filled with the current one, with its own keys."""
        in_use = self._bridge.station.instruments.probe_in_use
        records = in_use.records
        self.wanted.emit(self.definition)
        self.definition.open(
            definition_of(in_use.design), Path.home() / "probe.toml",
            None if records is None else records.calibration,
        )  # fmt: skip

    @property
    def practises(self) -> bool:
        """Return whether a virtual hand does the wizards' work."""
        return self._practice is not None

    def close_work(self) -> None:
        if self.is_made("view"):
            self.probe_design.cancel()
            self.fits.cancel()
        self.tests.close_work()
        if self.is_made("wizard"):
            self.wizard.close_runner()
        if self.is_made("definition"):
            self.definition.close_examination()

    def _on_wizard_failed(self, error: OcmmError) -> None:
        self._feedback.play(Sound.REFUSED)
        self._notices.error(error, PROCEDURE)

    def _on_wizard_left(self) -> None:
        self._notices.ended.emit(PROCEDURE)
        self._bridge.maintenance.look_at_probe_records()
        self.left.emit()

    def _on_defined(self, path: Path) -> None:
        self._notices.inform(
            tr(
                "Probe saved in {path}. Choose it in Settings (Instrument), then calibrate it."
            ).format(path=path)
        )
