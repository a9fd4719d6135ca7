"""One guided procedure at a time: start page, then the running procedure."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QStackedWidget, QWidget

from ocmm_gui.kit import DEFAULT_THEME, THEMES, Theme, Themed
from ocmm_gui.wizards._driver import WizardDriver
from ocmm_gui.wizards._runner import Runner


class GuidedStack(QStackedWidget):
    left = Signal()
    """Left; the procedure has ended and can be resumed."""
    taken = Signal()
    sounded = Signal(object)
    told = Signal(str)
    """Emits a note for resumed sessions."""
    failed = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self.runner: Runner | None = None

    def leave(self) -> None:
        """Stop the procedure and leave; the session can be resumed."""
        self.close_runner()
        self.left.emit()

    def close_runner(self) -> bool:
        """Stop the procedure in bounded time; return whether it ended."""
        runner, self.runner = self.runner, None
        if runner is None:
            return True
        ended = runner.close_driver()
        self.removeWidget(runner)
        runner.deleteLater()
        return ended

    def set_theme(self, theme: Theme) -> None:
        """Store the theme for later pages."""
        self._theme = theme

    def _show_runner(self, runner: Runner, driver: WizardDriver, torn: str) -> None:
        """Run a procedure; ``torn`` describes data lost by an interruption."""
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
