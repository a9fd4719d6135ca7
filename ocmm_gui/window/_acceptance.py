"""Acceptance tests, artefacts, studies and certificates, joined to the window.

All are made, and loaded, at their first use: the window is shown before that. Certificates are
written by a key: pages, DCC and signature, in a side process.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from PySide6.QtCore import QObject, Signal

from ocmm_core.errors import InputError, OcmmError
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import PROCEDURE, LateParts, NoticeCentre, PathPanel, Sheet, Sound, tr
from ocmm_gui.operator import Feedback
from ocmm_gui.reports import certify_records
from ocmm_gui.work import SideProcess, WorkLine


class Certificates(QObject):
    """Ask for the place of certificates, and write them. `notices`: shows errors and news."""

    written = Signal(object)
    """Emits the written files, ``tuple[Path, ...]``."""

    def __init__(self, notices: NoticeCentre, parent: QObject) -> None:
        super().__init__(parent)
        self._notices = notices
        self._source, self._tip = Path(), ""
        self.panel = PathPanel(
            tr("Write the certificate into the folder"), tr("Folder of the certificate"),
            tr("Write"),
        )  # fmt: skip
        self.line = WorkLine(tr("Certificate"))
        self._work = SideProcess(self, self._finish, self._fail, self.line.advance)
        self.panel.given.connect(self._write)

    def ask(self, source: Path, tip: str, proposal: Path) -> None:
        """Ask for the folder of the certificates of ``source``."""
        self._source, self._tip = source, tip
        self.panel.ask(proposal)

    def cancel(self) -> None:
        self._work.cancel()

    def _write(self, folder: Path) -> None:
        self.line.start(tr("Writing the certificate"))
        self._work.start(partial(certify_records, self._source, folder.absolute(), self._tip))

    def _finish(self, answer: object) -> None:
        self.line.end()
        if isinstance(answer, tuple):
            self._notices.inform(
                tr("Certificate written: {path}, with DCC and signature.").format(path=answer[0])
            )
            self.written.emit(answer)

    def _fail(self, error: object) -> None:
        self.line.end()
        self._notices.error(error)  # type: ignore[arg-type]  # the signal carries an OcmmError


if TYPE_CHECKING:
    from ocmm_core.composition import AcceptanceBench
    from ocmm_gui.acceptance import AcceptanceDesk, ArtefactSheet, StudySheet, TestsPage

S = TypeVar("S", bound=Sheet)


class AcceptanceRooms(LateParts):
    """Make the desk and the sheets on demand; without a bench there are no tests."""

    made = Signal(object)
    """Emits a new page, for the stack of the window."""
    wanted = Signal(object)
    """Emits the page to be shown with its own keys."""
    left = Signal()
    """Back to the pages of Maintain."""

    def __init__(
        self,
        bench: AcceptanceBench | None,
        bridge: StationBridge,
        notices: NoticeCentre,
        feedback: Feedback,
        folder: Callable[[], Path],
    ) -> None:
        super().__init__()
        self.bench, self._bridge = bench, bridge
        self._notices, self._feedback, self._folder = notices, feedback, folder
        self.papers = Certificates(notices, self)

    @cached_property
    def desk(self) -> AcceptanceDesk:
        from ocmm_gui.acceptance import AcceptanceDesk

        bridge = self._bridge
        desk = AcceptanceDesk(
            self._required(), bridge.station.maintenance.set_frame_tap,
            lambda: bridge.shown.job.operator,
        )  # fmt: skip
        desk.left.connect(lambda: self._notices.ended.emit(PROCEDURE))
        desk.left.connect(self.left)
        desk.taken.connect(lambda: self._feedback.play(Sound.TAKEN))
        desk.sounded.connect(self._feedback.play)
        desk.failed.connect(self._on_failed)
        desk.told.connect(self._notices.inform)
        desk.paper_wanted.connect(lambda path: self.papers.ask(path, "", self._folder()))
        self.made.emit(desk)
        return desk

    @cached_property
    def page(self) -> TestsPage:
        from ocmm_gui.acceptance import TestsPage

        return TestsPage(self._required())

    @cached_property
    def artefacts(self) -> ArtefactSheet:
        from ocmm_gui.acceptance import ArtefactSheet

        bridge = self._bridge
        return self._join(ArtefactSheet(self._required(), lambda: bridge.shown.job.operator))

    @cached_property
    def study(self) -> StudySheet:
        from ocmm_gui.acceptance import StudySheet

        station, instruments = self._bridge.station, self._bridge.station.instruments
        stores = (instruments.probe_in_use.store, instruments.calibration_in_use.store)
        probes, cameras = (None if one is None else one.folder.parent for one in stores)
        return self._join(StudySheet(lambda: station.job.path.parent, probes, cameras))

    def calls(self) -> dict[str, Callable[[], None]]:
        return {
            "acceptance": lambda: self._open_desk(""),
            "interim": lambda: self._open_desk("INTERIM"),
            "artefacts": lambda: self._open_sheet("artefacts"),
            "study": lambda: self._open_sheet("study"),
        }

    def ask_for_paper(self, source: Path | None, tip: str, why_not: str) -> None:
        """Ask for the place of a certificate of records; report why if there are none."""
        if source is None:
            self._notices.error(
                InputError("certificate.none", tr("No certificate can be written."), why_not)
            )
            return
        self.papers.ask(source, tip, self._folder())

    def close_work(self) -> None:
        self.papers.cancel()
        for name in ("desk", "page", "artefacts", "study"):
            if self.is_made(name):
                getattr(self, name).close_work()

    def _open_desk(self, first: str) -> None:
        if self._is_there():
            self.wanted.emit(self.desk)
            self.desk.open(first)

    def _open_sheet(self, name: str) -> None:
        if self._is_there():
            sheet = getattr(self, name)
            self.wanted.emit(sheet)
            sheet.open()

    def _join(self, sheet: S) -> S:
        sheet.left.connect(self.left)
        sheet.failed.connect(self._notices.error)
        sheet.told.connect(self._notices.inform)
        self.made.emit(sheet)
        return sheet

    def _is_there(self) -> bool:
        if self.bench is None:
            self._notices.inform(tr("This window was opened without acceptance tests."))
        return self.bench is not None

    def _required(self) -> AcceptanceBench:
        assert self.bench is not None  # noqa: S101 - asked before anything is made
        return self.bench

    def _on_failed(self, error: OcmmError) -> None:
        self._feedback.play(Sound.REFUSED)
        self._notices.error(error, PROCEDURE)
