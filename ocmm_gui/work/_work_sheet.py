"""A sheet whose work is done by a process of its own, and can be stopped."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_gui.kit import ActionInfo, Sheet, tr
from ocmm_gui.work._side_process import SideProcess, Work
from ocmm_gui.work._work_line import WorkLine


class WorkSheet(Sheet):
    """Show how far the work is; F9 stops it, and what was shown stays.

    Whoever is made of it puts ``working`` into its body and answers in `_show`.

    Parameters
    ----------
    title, infos
        As those of `Sheet`; one of ``infos`` is ``stop``.
    working
        Accessible name of the line that says how far it is.
    """

    def __init__(self, title: str, infos: Sequence[ActionInfo], working: str) -> None:
        super().__init__(title, infos)
        self.working = WorkLine(working)
        self._work = SideProcess(self, helpers=True)
        self._work.advanced.connect(self.working.advance)
        self._work.finished.connect(self._finish)
        self._work.failed.connect(self._fail)

    def stop(self) -> None:
        """Give up what is computed; what was shown stays."""
        if self._work.is_running() and self._work.give_up():
            self.working.end()
            self.say(tr("Stopped; nothing was changed."))

    def close_work(self) -> None:
        """Give up what is computed; call it before the window goes."""
        self._work.cancel()

    def is_working(self) -> bool:
        """Return whether something is computed; for tests."""
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
        """Show what came of the work."""
        raise NotImplementedError
