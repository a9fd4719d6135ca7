"""One guided procedure at a time: start page, then rail, instruction, page, gate and buttons."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QFrame, QPushButton, QSizePolicy, QStackedWidget, QWidget

from ocmm_core.calibration.guided import ProcedureDecision, ProcedureView
from ocmm_gui import kit
from ocmm_gui.kit import tr
from ocmm_gui.wizards._driver import WizardDriver
from ocmm_gui.wizards._wizard_parts import WIZARD_ACTIONS, DecisionBar, Rail, make_wizard_actions
from ocmm_gui.wizards.pages import (
    StepPage,
    StepSnapshot,
    WizardTexts,
    gate_words,
    is_unstored,
    practice_title,
)

_RAIL_PX, _BUTTON_PX = 190, 60
_INSTRUCTION_PX = 52
_ORDER = (
    "back", "drop", "skip", "repeat", "anew", "calculate", "cancel", "automatic", "keep", "take",
    "accept", "next",
)  # fmt: skip
_PRIMARY = ("take", "accept")
GO_ON_MS = 1500
"""Delay before entering the next step automatically, for the sound."""


class Runner(kit.Themed, QWidget):
    """Show a procedure and forward commands; contains no logic.

    ``driver``: not started, closed by `close_driver`; ``extra``: commands of ``skip``, ``repeat``,
    ``anew``, if available; ``practice``: results do not count, as every heading states.
    """

    left = Signal()
    """Return to the caller; the session stays as it is."""
    sounded = Signal(object)

    def __init__(
        self,
        driver: WizardDriver,
        texts: WizardTexts,
        pages: Mapping[str, StepPage],
        extra: Mapping[str, Callable[[], None]],
        *,
        practice: bool = False,
    ) -> None:
        super().__init__()
        self.driver = driver
        self.pages = dict(pages)
        self._texts, self._practice = texts, practice
        self._seen: StepSnapshot | None = None
        self._entered: StepPage | None = None
        self._was_open = False
        self._go_on = QTimer(self, singleShot=True, interval=GO_ON_MS)
        self._go_on.timeout.connect(driver.advance)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.actions_by_key = make_wizard_actions(self, self._calls(extra))
        self.buttons = {
            info.key: self._button(self.actions_by_key[info.key])
            for info in WIZARD_ACTIONS
            if not info.key.startswith("plot")
        }
        self._heading = kit.FitText(tr("Wizard"), limit=20)
        self._heading.setFixedHeight(34)
        title = tr(texts.title)
        self._heading.show_text(practice_title(title) if practice else title)
        self.rail = Rail()
        self._title = kit.FitText(tr("Step"), limit=28)
        self._title.setFixedHeight(38)
        self.instruction = kit.sentence_label(tr("What to do"), 18)
        self.instruction.setMinimumHeight(_INSTRUCTION_PX)
        self._stack = QStackedWidget()
        for page in self.pages.values():
            page.commanded.connect(driver.do)
            page.sounded.connect(self.sounded)
            self._stack.addWidget(page)
        self._gate_mark = kit.FitText(tr("Next"), limit=22)
        self._gate_mark.setFixedSize(26, 30)
        self.gate = kit.sentence_label(tr("Why Next is locked"), 17)
        self.decision = DecisionBar()
        self.decision.decided.connect(self._decide)
        self._lay_out()
        driver.seen.connect(self.show_seen)

    def close_driver(self) -> bool:
        """Stop everything; return whether all ended; the session can be resumed."""
        ended = self.driver.close()
        self.driver.deleteLater()
        return ended

    def page(self) -> StepPage:
        page = self._stack.currentWidget()
        assert isinstance(page, StepPage)  # noqa: S101 - nothing else is in the stack
        return page

    def show_seen(self, seen: StepSnapshot) -> None:
        self._seen = seen
        base = seen.view.base
        page = self.pages[base.step.name]
        if page is not self._entered:
            self._entered = page
            self.show_page(page)
            self.driver.set_automatic(page.hands_are_full)
            self.decision.hide()
            self.setFocus()
            # Do not skip a complete step that the user has returned to.
            self._was_open = True
            self._go_on.stop()
        self._note_completion(base, page)
        self._title.show_text(kit.said_word(base.step.title))
        if self.instruction.text() != kit.said(base.step.instruction):
            self.instruction.setText(kit.said(base.step.instruction))
        self.rail.show_steps(
            base.steps, base.current, ended=base.decision is not ProcedureDecision.OPEN
        )
        page.show_seen(seen)
        self._enable(seen, page)
        self._show_gate(seen)
        if "calculate" in page.keys and self._has_to_be_calculated(seen):
            self.driver.calculate()

    def show_page(self, page: StepPage) -> None:
        self._stack.setCurrentWidget(page)
        self._show_buttons(page)

    def set_theme(self, theme: kit.Theme) -> None:
        self._theme = theme
        if self._seen is not None:
            self._show_gate(self._seen)

    def _calls(self, extra: Mapping[str, Callable[[], None]]) -> dict[str, Callable[[], None]]:
        driver = self.driver
        return {
            "take": driver.record,
            "drop": driver.drop,
            "next": driver.advance,
            "back": driver.back,
            "automatic": lambda: driver.set_automatic(not driver.now.automatic),
            "skip": extra.get("skip", _nothing),
            "repeat": extra.get("repeat", _nothing),
            "anew": extra.get("anew", _nothing),
            "calculate": driver.calculate,
            "cancel": driver.cancel,
            "accept": lambda: self._ask(accepts=True),
            "keep": lambda: self._ask(accepts=False),
            "leave": self.left.emit,
            **{f"plot{number + 1}": partial(self._show_plot, number) for number in range(4)},
        }

    def _note_completion(self, base: ProcedureView, page: StepPage) -> None:
        """Signal a completed step, and continue automatically if hands are full."""
        is_open = base.step.gate.open and base.decision is ProcedureDecision.OPEN
        if is_open and not self._was_open and base.step.wanted:
            self.sounded.emit(kit.Sound.FEATURE_COMPLETE)
            if page.goes_on_by_itself:
                self._go_on.start()
        elif not is_open:
            self._go_on.stop()
        self._was_open = is_open

    def _show_plot(self, number: int) -> None:
        self.page().show_plot(number)

    def _ask(self, *, accepts: bool) -> None:
        if self._seen is not None:
            ends = self._texts.ends
            why = self.page().must_say_why() if accepts else ""
            question = why or tr(ends.accepts if accepts else ends.keeps)
            self.decision.ask(question, "", accepts=accepts, needs_reason=bool(why))

    def _decide(self, accepts: bool, reason: str) -> None:
        if accepts:
            self.driver.accept(reason)
        else:
            self.driver.keep(reason)
        self.setFocus()

    def _has_to_be_calculated(self, seen: StepSnapshot) -> bool:
        base = seen.view.base
        nothing = seen.view.outcome is None and base.error is None and seen.calculating_s is None
        return nothing and (base.decision is ProcedureDecision.OPEN or is_unstored(base))

    def _enable(self, seen: StepSnapshot, page: StepPage) -> None:
        base = seen.view.base
        is_open = base.decision is ProcedureDecision.OPEN
        calculating = seen.calculating_s is not None
        has_outcome = seen.view.outcome is not None and not calculating
        allowed = {
            "take": is_open,
            "drop": is_open and base.step.done > 0,
            "next": is_open and base.step.gate.open,
            "back": is_open and base.current > 0,
            "automatic": is_open,
            "skip": is_open,
            "repeat": is_open and page.allows("repeat"),
            "anew": is_open and base.step.done > 0,
            "calculate": is_open and not calculating,
            "cancel": calculating,
            "accept": has_outcome and (is_open or is_unstored(base)),
            "keep": is_open and not calculating,
            "leave": True,
        }
        for key, action in self.actions_by_key.items():
            mine = key in page.keys or key == "leave" or (key == "cancel" and calculating)
            action.setEnabled(mine and allowed.get(key, True))
        for key in ("take", "next"):
            kit.use_role(
                self.buttons[key], "primary" if seen.complete is (key == "next") else "tool"
            )
        self.buttons["cancel"].setVisible(calculating)
        self.buttons["calculate"].setVisible("calculate" in page.keys and not calculating)
        self.buttons["automatic"].setText(
            tr("Automatic: ON\n[Y]") if seen.automatic else tr("Automatic: off\n[Y]")
        )
        ends = self._texts.ends
        for key, word in (("accept", tr(ends.accept)), ("keep", tr(ends.keep))):
            self.buttons[key].setText(f"{word}\n[{key[0].upper()}]")

    def _show_gate(self, seen: StepSnapshot) -> None:
        accepted = tr("Practice: the records of this station are unchanged.")
        if not self._practice:
            accepted = tr(self._texts.accepted)
        text, mark = gate_words(seen, accepted, going_on=self._go_on.isActive())
        if text != self.gate.text():
            self.gate.setText(text)
        self._gate_mark.show_text("", kit.mark_colour(self._theme, mark), mark)

    def _show_buttons(self, page: StepPage) -> None:
        for key, button in self.buttons.items():
            button.setVisible(key in page.keys)
        self.buttons["leave"].show()

    def _button(self, action: QAction) -> QPushButton:
        key = kit.key_words(action.shortcuts()[0])
        button = kit.dressed(
            kit.NarrowButton(f"{action.text()}\n[{key}]"), action.text(), action.toolTip(),
            font=kit.text_font(16, bold=True), key=action.objectName(), high=_BUTTON_PX,
            role="primary" if action.objectName() in _PRIMARY else "tool",
        )  # fmt: skip
        button.hide()
        button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        button.setEnabled(action.isEnabled())
        action.changed.connect(lambda: button.setEnabled(action.isEnabled()))
        button.clicked.connect(action.trigger)
        return button

    def _lay_out(self) -> None:
        side = kit.vbox(self._heading, (self.rail, 1), self.buttons["leave"], spacing=8)
        for widget in (self._heading, self.rail, self.buttons["leave"]):
            widget.setFixedWidth(_RAIL_PX)
        gate = QFrame()
        gate.setProperty("role", "panel")
        kit.hbox(self._gate_mark, (self.gate, 1), parent=gate, margins=(12, 6, 12, 6))
        self.gate.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        row = kit.hbox(spacing=8)
        for key in _ORDER:
            row.addWidget(self.buttons[key], 2 if key in _PRIMARY else 1)
        main = kit.vbox(
            self._title, self.instruction, (self._stack, 1), self.decision, gate, row, spacing=8
        )
        kit.hbox(side, (main, 1), parent=self, spacing=12, margins=(12, 8, 12, 10))


def _nothing() -> None:
    """Do nothing: the page has no such command."""


class GuidedStack(kit.Themed, QStackedWidget):
    left = Signal()
    """Left; the procedure has ended and can be resumed."""
    taken = Signal()
    sounded = Signal(object)
    told = Signal(str)
    """Emits a note for resumed sessions."""
    failed = Signal(object)

    def __init__(self) -> None:
        super().__init__()
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

    def set_theme(self, theme: kit.Theme) -> None:
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
            if isinstance(widget, kit.ThemedWidget):
                widget.set_theme(self._theme)
        self.addWidget(runner)
        self.setCurrentWidget(runner)
        driver.start()
        runner.setFocus()
        if torn:
            self.told.emit(torn)
