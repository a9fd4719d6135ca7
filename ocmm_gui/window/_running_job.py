"""The running job on any page: live readout, results so far, state of the tip."""

from __future__ import annotations

import contextlib
from datetime import datetime

from PySide6.QtCore import QObject

from ocmm_core.calibration.records import ProbeView
from ocmm_core.inspection.evaluation import JobView, LiveView, withdrawn
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import (
    Level,
    Mode,
    Notice,
    NoticeCentre,
    Sound,
    reference_words,
    said,
    said_word,
    tr,
)
from ocmm_gui.led import HandControl
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
from ocmm_gui.window._maintenance import Maintenance
from ocmm_gui.window._pages import Pages
from ocmm_gui.window._sheets import Sheets
from ocmm_gui.work import WorkLine

_PART = "The window"


class RunningJob(QObject):
    """Show the state of the station; if that fails, former values are cleared.

    `notices`, `feedback`: News, and sounds.
    `pages`: The current page, which gets the state as soon as it is shown.
    `choice`, `hand`: The selected point, and the hand of a virtual probe.
    """

    def __init__(
        self,
        bridge: StationBridge,
        notices: NoticeCentre,
        feedback: Feedback,
        pages: Pages,
        desk: DeskView,
        far: FarView,
        sheets: Sheets,
        maintenance: Maintenance,
        choice: PointChoice,
        hand: HandControl,
    ) -> None:
        super().__init__()
        self._bridge, self._notices, self._feedback = bridge, notices, feedback
        self._pages, self._desk, self._far = pages, desk, far
        self._sheets, self._maintenance = sheets, maintenance
        self._choice, self._hand = choice, hand
        self.trust = TrustBar()
        self.tip_line = TipLine()
        self.simulated = SimulatedBand()
        self.work = WorkLine(tr("Results"))
        self._job: JobView | None = None
        self._live: LiveView | None = None
        pages.turned.connect(self._again)
        self.tip_line.turned.connect(self._on_tip_turned)
        bridge.failed.connect(notices.error)
        bridge.live_changed.connect(self._on_live)
        bridge.evaluating.connect(self._on_evaluating)
        bridge.job_changed.connect(self._on_job)
        bridge.point_taken.connect(feedback.taken)
        bridge.point_refused.connect(feedback.refused)
        for view in (desk, far):
            bridge.coach_changed.connect(view.show_coach)
            bridge.point_refused.connect(view.show_refusal)
            bridge.point_taken.connect(lambda _point, view=view: view.forget_refusal())

    def _again(self) -> None:
        if self._job is not None:
            self._show_job(self._job)
        if self._live is not None:
            self._on_live(self._live)

    def _on_live(self, live: LiveView) -> None:
        self._live = live
        try:
            self._show_live(live)
        except Exception as error:
            # A failed display must not leave former values visible.
            self._bridge.station.faults.fail(error, _PART)
            for readout in (self._desk.readout, self._far.readout):
                readout.withdraw(self._why_failed())

    def _why_failed(self) -> str:
        fault = self._bridge.station.faults.measuring
        return "" if fault is None else said(fault.error.what)

    def _show_live(self, live: LiveView) -> None:
        instruments = self._bridge.station.instruments
        place = self._place()
        self.trust.show_calibration(instruments.calibration(), place, reference_words(live))
        self.tip_line.show_probe(instruments.probe(), place)
        shown = self._pages.shown()
        for view in (self._far, self._desk):
            if view is shown:
                view.show_live(live)
        if self._maintenance.is_made("view") and self._maintenance.view is shown:
            self._maintenance.view.show_live(live)
        self._hand.show_live(live)
        measures = self._pages.measures()
        target = self._job.target if measures and self._job is not None else None
        self._feedback.way(target, live.tip_world)

    def _place(self) -> TrustPlace:
        if self._pages.mode() is Mode.MAINTAIN:
            return TrustPlace.MAINTAIN
        return TrustPlace.FAR if self._pages.is_far() else TrustPlace.DESK

    def _on_evaluating(self, busy: bool) -> None:
        if busy:
            self.work.begin(tr("Calculating the results"))
        else:
            self.work.end()

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
        self._choice.show_job(job)
        self._sheets.job_changed(job)
        if previous is not None:
            self._feedback.announce(previous, job)

    def _show_job(self, job: JobView) -> None:
        for view in (self._far, self._desk):
            if view is self._pages.shown():
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
        # Shown on every screen while it lasts.
        self._notices.keep(
            Notice(
                Level.ERROR,
                view.blocking_reason.what,
                view.blocking_reason.remedy,
                "",
                datetime.now().astimezone(),
            )
        )
