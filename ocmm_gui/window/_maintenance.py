"""What looks after rig and probe: the pages of Maintain, the wizards, and what they lead to."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QWidget

from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.calibration.probe_design import definition_of
from ocmm_core.errors import OcmmError
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre, Sound
from ocmm_gui.maintain import (
    BusPage,
    CalibrationPage,
    ConfirmedActions,
    FitsPage,
    MaintainView,
    Page,
    ProbeDesignPage,
    ProbePage,
    plain_body,
)
from ocmm_gui.operator import Feedback
from ocmm_gui.wizards import WIZARDS, Subject, Wizard, site_of
from ocmm_gui.wizards.pages import DefinitionPage


class Maintenance(QObject):
    """Make the pages and the wizards, and join them to the station.

    Parameters
    ----------
    bridge
        The running inspection.
    notices
        Where errors and news go.
    feedback
        What is heard in the wizards.
    actions
        By key.
    """

    wanted = Signal(object)
    """Emits the widget that is to be shown with keys of its own."""
    left = Signal()
    """Back to the pages."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: NoticeCentre,
        feedback: Feedback,
        actions: dict[str, QAction],
    ) -> None:
        super().__init__()
        self._bridge, self._notices, self._feedback = bridge, notices, feedback
        self.bus = BusPage(bridge.station.looks.bus)
        self.calibration = CalibrationPage(
            bridge.station.instruments.rig,
            bridge.station.instruments.calibration,
            bridge.station.instruments.calibration_overview,
        )
        self.probe = ProbePage(
            bridge.station.instruments.probe, bridge.station.instruments.probe_overview
        )
        self.probe_design = ProbeDesignPage(
            bridge.station.instruments.rig, plain_body(bridge.station.instruments.probe_in_use)
        )
        self.fits = FitsPage()
        pages = (
            Page("Bus", "The cameras on their wire", self.bus, ("bus_text",)),
            Page(
                "Calibration", "Calibration status of the cameras", self.calibration,
                (*_wizards(Subject.CAMERAS), "recall", "write_cameras"),
            ),
            Page(
                "Probe", "Status of probe and tip", self.probe,
                ("define", "mount", *_wizards(Subject.PROBE)),
            ),
            Page("Probe design", "Uncertainty of the tip and its causes", self.probe_design),
            Page("Fits", "Check of the fits against certified pairs", self.fits),
        )  # fmt: skip
        self._deeds = ConfirmedActions(bridge, notices, self.probe)
        self.view = MaintainView(pages, actions)
        self.wizard = Wizard(site_of(bridge))
        self.definition = DefinitionPage()
        self.definition.left.connect(self.left)
        self.definition.saved.connect(self._on_defined)
        self.wizard.left.connect(self._on_wizard_left)
        self.wizard.taken.connect(lambda: feedback.play(Sound.TAKEN))
        self.wizard.sounded.connect(feedback.play)
        self.wizard.failed.connect(self._on_wizard_failed)
        bridge.maintenance.cameras_written.connect(
            lambda: notices.inform("The cameras now store the intrinsics of the calibration.")
        )

    def all(self) -> tuple[QWidget, ...]:
        """Return everything that fills the window, for its stack."""
        return (self.view, self.wizard, self.definition)

    def calls(self) -> dict[str, Callable[[], None]]:
        """Return what the keys of Maintain do, by key of the action."""
        deeds: dict[str, Callable[[], None]] = {
            "mount": self._deeds.mount_tip,
            "define": self.open_definition,
            "write_cameras": self._deeds.write_cameras,
        }
        return deeds | {wizard.action: partial(self.open_wizard, wizard.kind) for wizard in WIZARDS}

    def open_wizard(self, kind: ProcedureKind) -> None:
        """Show the first page of a wizard; its keys are its own until it is left."""
        self.wanted.emit(self.wizard)
        self.wizard.open(kind)

    def open_definition(self) -> None:
        """Show the page on which a probe is defined, filled in with the one that is measured with.

        Its keys are its own until it is left.
        """
        in_use = self._bridge.station.instruments.probe_in_use
        records = in_use.records
        self.wanted.emit(self.definition)
        self.definition.open(
            definition_of(in_use.design), Path.home() / "probe.toml",
            None if records is None else records.calibration,
        )  # fmt: skip

    def close_work(self) -> None:
        """Give up what is being calculated or taken; call it before the window goes."""
        self.probe_design.cancel()
        self.fits.cancel()
        self.wizard.close_runner()
        self.definition.close_examination()

    def _on_wizard_failed(self, error: OcmmError) -> None:
        self._feedback.play(Sound.REFUSED)
        self._notices.error(error)

    def _on_wizard_left(self) -> None:
        self._bridge.maintenance.look_at_probe_records()
        self.left.emit()

    def _on_defined(self, path: Path) -> None:
        self._notices.inform(
            f"Probe saved in {path}. Start OCMM with --probe {path} and calibrate it."
        )


def _wizards(subject: Subject) -> tuple[str, ...]:
    """Return the actions that begin the wizards about a subject."""
    return tuple(wizard.action for wizard in WIZARDS if wizard.subject is subject)
