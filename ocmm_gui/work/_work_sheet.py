"""A sheet with work in a side process that can be stopped."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_gui.kit import ActionInfo, Sheet, tr
from ocmm_gui.work._side_process import SideProcess, Work
from ocmm_gui.work._work_line import WorkLine


class WorkSheet(Sheet):
    """Show progress; F9 stops the work, and displayed results stay.

    Subclasses put ``working`` into their body and answer in `_show`. `title`, `infos`: as of
    `Sheet`; one of ``infos`` is ``stop``. `working`: accessible name of the progress line.
    """

    def __init__(self, title: str, infos: Sequence[ActionInfo], working: str) -> None:
        super().__init__(title, infos)
        self.working = WorkLine(working)
        self._work = SideProcess(self, helpers=True)
        self._work.advanced.connect(self.working.advance)
        self._work.finished.connect(self._finish)
        self._work.failed.connect(self._fail)

    def stop(self) -> None:
        """Cancel the work; displayed results stay."""
        if self._work.is_running() and self._work.give_up():
            self.working.end()
            self.say(tr("Stopped; nothing was changed."))

    def close_work(self) -> None:
        """Cancel the work; call it before the window closes."""
        self._work.cancel()

    def is_working(self) -> bool:
        """Return whether work is running; for tests."""
        return self._work.is_running()

    def _begin(self, what: str, work: Work) -> None:
        self._work.start(work)
        self.working.begin(what, tr("F9 stops."))

    def _fail(self, error: object) -> None:
        self.working.end()
        self.say(tr("Failed; the previous result is still shown."))
        self.failed.emit(error)

    def _finish(self, answer: object) -> None:
        self.working.end()
        self._show(answer)

    def _show(self, answer: object) -> None:
        raise NotImplementedError
