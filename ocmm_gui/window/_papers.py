"""The certificates that are written on a key: pages, DCC and signature, in a process of its own."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, Signal

from ocmm_gui.kit import NoticeCentre, PathPanel, tr
from ocmm_gui.reports import CertificateWriting
from ocmm_gui.work import SideProcess, WorkLine


class Papers(QObject):
    """Ask where the files go, and write them.

    Parameters
    ----------
    notices
        Where errors and news go.
    parent
        What it goes with.
    """

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
        self._work = SideProcess(self)
        self.panel.given.connect(self._write)
        self._work.advanced.connect(self.line.advance)
        self._work.finished.connect(self._finish)
        self._work.failed.connect(self._fail)

    def ask(self, source: Path, tip: str, proposal: Path) -> None:
        """Ask for the folder of the papers of what ``source`` holds."""
        self._source, self._tip = source, tip
        self.panel.ask(proposal)

    def cancel(self) -> None:
        """Give up what is written; call it before the window goes."""
        self._work.cancel()

    def _write(self, folder: Path) -> None:
        self.line.begin(tr("Writing the certificate"))
        self._work.start(CertificateWriting(self._source, folder.absolute(), self._tip))

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
