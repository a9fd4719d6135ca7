"""One guided procedure at a time behind its first page: begun, run, left, whatever it is about."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QStackedWidget, QWidget

from ocmm_gui.kit import DEFAULT_THEME, THEMES, Theme, Themed
from ocmm_gui.wizards._driver import WizardDriver
from ocmm_gui.wizards._runner import Runner


class GuidedStack(QStackedWidget):
    """The first page, and the procedure that runs."""

    left = Signal()
    """It was left; what ran has ended and can be resumed."""
    taken = Signal()
    """An observation is on the disk."""
    sounded = Signal(object)
    """Emits a `Sound` that is to be heard."""
    told = Signal(str)
    """Emits what somebody should know who resumes a session."""
    failed = Signal(object)
    """Emits the `OcmmError` of a command."""

    def __init__(self) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self.runner: Runner | None = None

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

    def _show_runner(self, runner: Runner, driver: WizardDriver, torn: str) -> None:
        """Run a procedure; ``torn`` is what is missing of its session since it was interrupted."""
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
        if torn:
            self.told.emit(torn)
