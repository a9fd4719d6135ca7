"""Base of result pages: plots on the left, verdict and figures on the right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QButtonGroup, QSizePolicy, QStackedWidget, QVBoxLayout, QWidget

from ocmm_core.calibration.records import Finding
from ocmm_gui import kit
from ocmm_gui.kit import said, tr
from ocmm_gui.wizards.pages._pages import StepPage
from ocmm_gui.wizards.pages._shown import Facts, StepSnapshot, figures_area

_SIDE_PX = 360
Outcome = TypeVar("Outcome")
Filled = tuple[Sequence[tuple[str, str]], Sequence[Finding]]
"""Figures and warnings."""


@dataclass(frozen=True, slots=True)
class ResultVerdict:
    """Verdict in large letters, with its meaning."""

    word: str
    mark: kit.Mark
    sentence: str


def passed(sentence: str) -> ResultVerdict:
    return ResultVerdict(tr("PASSED"), kit.Mark.GOOD, sentence)


def failed(sentence: str) -> ResultVerdict:
    return ResultVerdict(tr("FAILED"), kit.Mark.BAD, sentence)


class PlotTabs(QWidget):
    """Several plots, one visible; selected with buttons or the keys 1 to 4."""

    def __init__(self, plots: Sequence[tuple[str, QWidget]]) -> None:
        super().__init__()
        self.setAccessibleName(tr("Plots"))
        self.titles = tuple(title for title, _ in plots)
        self._stack = QStackedWidget()
        self._buttons = QButtonGroup(self)
        tabs = kit.hbox(spacing=6)
        for number, (title, view) in enumerate(plots, start=1):
            button, font = kit.NarrowButton(f"{title}  [{number}]"), kit.text_font(14, bold=True)
            kit.dressed(button, title, font=font, role="tool", high=40)
            button.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
            button.setCheckable(True)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            self._buttons.addButton(button, number - 1)
            tabs.addWidget(button, 1)
            self._stack.addWidget(view)
            if len(plots) == 1:
                button.hide()
        self._buttons.idClicked.connect(self.show_plot)
        kit.vbox(tabs, (self._stack, 1), parent=self, spacing=8, margins=0)
        self.show_plot(0)

    def show_plot(self, number: int) -> None:
        """Show a plot; an invalid number does nothing."""
        button = self._buttons.button(number)
        if button is not None:
            self._stack.setCurrentIndex(number)
            button.setChecked(True)

    def plot(self) -> str:
        return self.titles[self._stack.currentIndex()]


class ResultFrame(kit.Themed, StepPage, Generic[Outcome]):
    """Plots on the left, selected with the keys 1 to 4; the verdict on the right."""

    keys: tuple[str, ...] = (
        "back", "calculate", "keep", "accept", "plot1", "plot2", "plot3", "plot4",
    )  # fmt: skip
    shows: type[Outcome]
    """Results of another type are not shown."""

    def __init__(self, plots: Sequence[tuple[str, QWidget]]) -> None:
        super().__init__()
        self._shown: object | None = None
        self._seen: StepSnapshot | None = None
        self.tabs = PlotTabs(plots)
        self._word = kit.FitText(tr("Result"), limit=40)
        self._word.setFixedHeight(50)
        self.sentence = kit.sentence_label(tr("Result of the calculation"), 18)
        self.facts = Facts(tr("Figures of the result"))
        self.warnings = kit.sentence_label(tr("Objections"), 16)
        self._plots = kit.panel(kit.vbox((self.tabs, 1)))
        figures = kit.vbox(spacing=12, margins=(0, 0, 6, 0))
        for widget in (self.sentence, self.facts, self.warnings):
            figures.addWidget(widget)
        figures.addStretch(1)
        self.right = right = QVBoxLayout()
        kit.fill(right, self._word, (figures_area(figures), 1))
        side = kit.panel(right)
        side.setFixedWidth(_SIDE_PX)
        waiting, font = kit.PlainLabel(""), kit.text_font(20)
        self._waiting = kit.dressed(waiting, tr("No plots yet"), font=font, role="muted")
        self._waiting.setAlignment(Qt.AlignmentFlag.AlignCenter)
        kit.hbox((self._plots, 1), (self._waiting, 1), side, parent=self, spacing=8, margins=0)
        self._show(None)

    def judge(self, outcome: Outcome) -> ResultVerdict:
        raise NotImplementedError

    def fill(self, outcome: Outcome) -> Filled:
        """Show a result in the plots; return its figures and warnings."""
        raise NotImplementedError

    def show_plot(self, number: int) -> None:
        self.tabs.show_plot(number)

    def plot(self) -> str:
        return self.tabs.plot()

    def word(self) -> str:
        return self._word.text()

    def show_seen(self, seen: StepSnapshot) -> None:
        self._seen = seen
        if seen.view.outcome is not self._shown:
            self._show(seen.view.outcome)
        self._show_word()

    def set_theme(self, theme: kit.Theme) -> None:
        self._theme = theme
        self._show_word()

    def _show_word(self) -> None:
        seen = self._seen
        if seen is None:
            return
        said = self._said(seen)
        self._word.show_text(said.word, kit.mark_colour(self._theme, said.mark), said.mark)
        if said.sentence != self.sentence.text():
            self.sentence.setText(said.sentence)
        waiting = tr("Calculating …") if seen.calculating_s is not None else tr("No result to show")
        self._waiting.setText(waiting)

    def _said(self, seen: StepSnapshot) -> ResultVerdict:
        error = seen.view.base.error
        if seen.calculating_s is not None:
            return ResultVerdict(
                tr("CALCULATING  {calculating_s:.0f} s").format(calculating_s=seen.calculating_s),
                kit.Mark.ACTIVE,
                tr("Window and session stay as they are; C cancels the calculation."),
            )
        if error is not None:
            return ResultVerdict(
                tr("NO RESULT"), kit.Mark.BAD, said(f"{error.what} {error.remedy}")
            )
        if self._shown is None:
            return ResultVerdict(tr("NOT CALCULATED"), kit.Mark.OPEN, tr("Press R to calculate."))
        if not isinstance(self._shown, self.shows):
            return ResultVerdict("", kit.Mark.OPEN, "")
        return self.judge(self._shown)

    def _show(self, outcome: object | None) -> None:
        self._shown = outcome
        self._plots.setVisible(outcome is not None)
        self._waiting.setVisible(outcome is None)
        facts: Sequence[tuple[str, str]] = ()
        findings: Sequence[Finding] = ()
        if isinstance(outcome, self.shows):
            facts, findings = self.fill(outcome)
        self.facts.show_facts(facts)
        self.warnings.setText(
            "\n".join(f"▲ {said(one.what)} {said(one.remedy)}" for one in findings)
        )
