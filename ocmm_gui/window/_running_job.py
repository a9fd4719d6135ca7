"""The running job on any page: live readout, results so far, state of the tip."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QAction

from ocmm_core.calibration.records import ProbeView
from ocmm_core.errors import OcmmError
from ocmm_core.export import DEFAULT_FORMAT, FORMATS
from ocmm_core.inspection.evaluation import JobView, LiveView, withdrawn
from ocmm_gui import kit, operator
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import later, tr
from ocmm_gui.led import HandControl
from ocmm_gui.results import JobSource, ReportWriter, WrittenReports
from ocmm_gui.window._maintenance import Maintenance
from ocmm_gui.window._pages import Pages
from ocmm_gui.window._sheets import Sheets
from ocmm_gui.work import WorkLine

_PART = "The window"


class RunningJob(QObject):
    """Show the events of the station; a failed display withdraws its numbers."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: kit.NoticeCentre,
        banner: kit.Banner,
        feedback: operator.Feedback,
        pages: Pages,
        desk: operator.DeskView,
        far: operator.FarView,
        sheets: Sheets,
        maintenance: Maintenance,
        choice: operator.PointChoice,
        hand: HandControl,
    ) -> None:
        super().__init__()
        self._bridge, self._notices, self._feedback = bridge, notices, feedback
        self._banner = banner
        self._pages, self._desk, self._far = pages, desk, far
        self._sheets, self._maintenance = sheets, maintenance
        self._choice, self._hand = choice, hand
        self.trust = operator.TrustBar()
        self.tip_line = operator.TipLine()
        self.simulated = operator.SimulatedBand()
        self.work = WorkLine(tr("Results"))
        self._job: JobView | None = None
        self._live: LiveView | None = None
        pages.turned.connect(self._again)
        self.tip_line.turned.connect(self._on_tip_turned)
        bridge.failed.connect(self._on_failed)
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
        return "" if fault is None else kit.said(fault.error.what)

    def _show_live(self, live: LiveView) -> None:
        instruments = self._bridge.station.instruments
        place = self._place()
        self.trust.show_calibration(instruments.calibration(), place, kit.reference_words(live))
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
        self._feedback.slide(live.path)

    def _place(self) -> operator.TrustPlace:
        if self._pages.mode() is kit.Mode.MAINTAIN:
            return operator.TrustPlace.MAINTAIN
        return operator.TrustPlace.FAR if self._pages.is_far() else operator.TrustPlace.DESK

    def _on_evaluating(self, busy: bool) -> None:
        if busy:
            self.work.start(tr("Calculating the results"))
        else:
            self.work.end()

    def _on_failed(self, error: BaseException) -> None:
        self._notices.error(error, "" if self._job is None else self._job.job)

    def _on_job(self, job: JobView) -> None:
        try:
            self._take_job(job)
        except Exception as error:
            self._bridge.station.faults.fail(error, _PART)
            with contextlib.suppress(Exception):
                self._show_job(withdrawn(job, self._why_failed()))

    def _take_job(self, job: JobView) -> None:
        previous, self._job = self._job, job
        self._banner.end_job(job.job)
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
                    title=view.title, word=kit.said_word(view.word.value)
                )
            )
            return
        self._feedback.play(kit.Sound.REFUSED)
        # Shown on every screen while it lasts.
        self._notices.keep(
            kit.Notice(
                kit.Level.ERROR,
                view.blocking_reason.what,
                view.blocking_reason.remedy,
                "",
                datetime.now().astimezone(),
            )
        )


_SHORT = {
    "polyworks": later("PolyWorks"), "qif": later("QIF"), "dfq": later("Q-DAS"),
    "xlsx": later("XLSX"), "json": later("JSON"), "fai": later("AS9102"), "pdf": later("PDF"),
}  # fmt: skip
"""Short names of products and formats for a button."""


class Output(QObject):
    """Write files into the folder given at the start; None asks in the window."""

    exported = Signal(object)
    """Emits the written files, ``tuple[Path, ...]``."""

    def __init__(
        self,
        bridge: StationBridge,
        notices: kit.NoticeCentre,
        out: Path | None,
        far: Callable[[], bool],
    ) -> None:
        super().__init__()
        self._bridge, self._notices, self._out = bridge, notices, out
        self.formats: tuple[str, ...] = (DEFAULT_FORMAT,)
        self.export_panel = kit.PathPanel(
            tr("Write the report into the folder"),
            tr("Folder of the report"),
            tr("Write"),
            folders=True,
        )
        self.bus_panel = kit.PathPanel(
            tr("Write the bus report into the file"), tr("File of the bus report"), tr("Write")
        )
        self.question = kit.AnswerPanel(tr("The job is not complete"), tr("Write"))
        self.work = WorkLine(tr("Report"))
        self._source = JobSource.of_bridge(bridge)
        self._writer = ReportWriter(self)
        self._writer.asked.connect(lambda question: self.question.ask(question, far=far()))
        self._writer.begun.connect(
            lambda: self.work.start(tr("Writing the report"), tr("E cancels."))
        )
        self._writer.advanced.connect(self.work.advance)
        self._writer.ended.connect(self.work.end)
        self._writer.written.connect(self.tell_written)
        self._writer.failed.connect(notices.error)
        self.question.agreed.connect(self._writer.agree)
        self.export_panel.given.connect(self._export_to)
        self.bus_panel.given.connect(bridge.maintenance.save_bus_text)
        bridge.jobs.job_begun.connect(self.question.hide)
        bridge.maintenance.bus_text_saved.connect(
            lambda path: notices.inform(tr("The bus report is in {path}.").format(path=path))
        )

    def calls(self) -> dict[str, Callable[[], None]]:
        return {"export": self._export, "bus_text": self._save_bus_text, "log": self._save_log}

    def use_formats(self, formats: tuple[str, ...], action: QAction) -> None:
        """Write these formats, all or none; the button names them."""
        self.formats = formats
        first, more = tr(_SHORT[formats[0]]), len(formats) - 1
        named = tr("{format} + {count}").format(format=first, count=more) if more else first
        titles = ", ".join(FORMATS[name].title for name in formats)
        # The bar has room for a word: the first format, and the number of others.
        action.setProperty(kit.SHORT, named)
        action.setToolTip(kit.literal(tr("Write the report files: {titles}").format(titles=titles)))

    def folder(self) -> Path:
        out = self._out if self._out is not None else Path.home() / "ocmm-out"
        return out.expanduser().absolute()

    def hide(self) -> None:
        """Hide the panels that ask for a place."""
        self.export_panel.hide()
        self.bus_panel.hide()
        self.question.hide()

    def is_writing(self) -> bool:
        return self._writer.is_busy()

    def close_work(self) -> None:
        self._writer.cancel()

    def tell_written(self, written: WrittenReports) -> None:
        written.tell(self._notices)
        self.exported.emit(written.paths)

    def _export(self) -> None:
        if self._writer.is_busy():
            if self._writer.give_up():
                self._notices.inform(tr("The report was not written."))
        elif self._out is not None:
            self._export_to(self.folder())
        else:
            self.export_panel.ask(self.folder())

    def _export_to(self, folder: Path) -> None:
        self._writer.write(self._source, self.formats, folder)

    def _save_bus_text(self) -> None:
        path = self._new_text("bus")
        if self._out is not None:
            self._bridge.maintenance.save_bus_text(path)
        else:
            self.bus_panel.ask(path)

    def _save_log(self) -> None:
        path = self._new_text("log")
        try:
            self._notices.save(path)
        except OcmmError as error:
            self._notices.error(error)
        else:
            self._notices.inform(tr("Log written to {path}.").format(path=path))

    def _new_text(self, what: str) -> Path:
        folder = self._out if self._out is not None else Path.home()
        return folder / f"ocmm-{what}-{datetime.now().astimezone():%Y%m%d-%H%M%S}.txt"
