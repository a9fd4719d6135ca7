"""Verdict of a test: word, meaning, errors against limits, certificate and record."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QHeaderView, QVBoxLayout

from ocmm_core.acceptance import AcceptanceOutcome, GuidedAcceptanceView, Verdict, worst_value
from ocmm_gui.acceptance._checks import checks_of
from ocmm_gui.charts import ErrorChart, InterimPlot
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    FitText,
    Mark,
    NarrowButton,
    NumberTable,
    Theme,
    later,
    literal,
    localised,
    mark_colour,
    panel,
    said,
    said_word,
    sentence_label,
    text_font,
    tr,
    tr_all,
)
from ocmm_gui.wizards.parts import Facts, PlotTabs, Seen, StepPage, figures_area

_SIDE_PX = 380
_MARKS = {
    Verdict.PASS: Mark.GOOD,
    Verdict.FAIL: Mark.BAD,
    Verdict.LEANING_IN: Mark.DOUBT,
    Verdict.LEANING_OUT: Mark.DOUBT,
    Verdict.VOID: Mark.DOUBT,
}
_COLUMNS = (
    (later("Quantity"), later("What is tested")),
    (later("Where"), later("Position and length")),
    (later("Error, µm"), later("Test value")),
    (later("U, µm"), later("Of the test value, k = 2")),
    (later("MPE, µm"), later("Limit")),
    (later("Verdict"), later("By the decision rule")),
)


class AcceptanceVerdictPage(StepPage):
    """Pass or fail, margin, decision rule; then certificate and record."""

    keys = ("back", "repeat", "calculate", "keep", "accept", "plot1", "plot2", "plot3")
    paper_wanted = Signal(object)
    """Emits the `Path` of the record for a certificate."""

    def __init__(self) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self._outcome: AcceptanceOutcome | None = None
        self._seen: Seen | None = None
        self._word = FitText(tr("Verdict"), limit=46)
        self._word.setFixedHeight(60)
        self._simulated = FitText(tr("Source"), limit=20)
        self._simulated.setFixedHeight(28)
        self.sentence = sentence_label(tr("Meaning of the verdict"), 17)
        self.facts = Facts(tr("Figures of the verdict"))
        self.chart = ErrorChart()
        self.interim = InterimPlot()
        self.values = NumberTable(tr("Every value"), tr_all(_COLUMNS), whole=False)
        header = self.values.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        self.values.right_heads((2, 3, 4))
        self.tabs = PlotTabs(
            (
                (tr("Errors and limits"), self.chart),
                (tr("Record"), self.values),
                (tr("Interim checks"), self.interim),
            )
        )
        self.paper = NarrowButton(tr("Certificate (PDF and DCC)  [P]"))
        self.paper.setAccessibleName(tr("Write the certificate, PDF and DCC"))
        self.paper.setToolTip(literal(tr("Write the certificate, PDF and DCC")))
        self.paper.setShortcut("P")
        self.record = NarrowButton(tr("Record  [2]"))
        self.record.setAccessibleName(tr("Show every value of the record"))
        self.paper.clicked.connect(self._want_paper)
        self.record.clicked.connect(lambda: self.show_plot(1))
        self._lay_out()

    def show_seen(self, seen: Seen) -> None:
        view = seen.view_as(GuidedAcceptanceView)
        self._seen = seen
        outcome = view.outcome
        if outcome is not self._outcome:
            self._outcome = outcome
            if outcome is not None:
                self._fill(outcome, view)
        self.paper.setEnabled(outcome is not None and outcome.file is not None)
        self._show_word(view)

    def show_plot(self, number: int) -> None:
        """Show the errors, every value, or the chart of interim checks."""
        self.tabs.show_plot(number)

    def word(self) -> str:
        return self._word.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        if self._seen is not None:
            self._show_word(self._seen.view_as(GuidedAcceptanceView))

    def _want_paper(self) -> None:
        if self._outcome is not None and self._outcome.file is not None:
            self.paper_wanted.emit(self._outcome.file)

    def _fill(self, outcome: AcceptanceOutcome, view: GuidedAcceptanceView) -> None:
        values = outcome.values
        if values:
            self.chart.show_checks(checks_of(values), worst_value(values))
        self.values.setRowCount(len(values))
        for row, one in enumerate(values):
            superseded = tr(" (repeated)") if one.superseded else ""
            words = (
                one.quantity, f"{one.position}, {one.name}{superseded}",
                localised(f"{1e3 * one.error_mm:+.1f}"), localised(f"{1e3 * one.expanded_mm:.1f}"),
                localised(f"{1e3 * one.limit_mm:.1f}"), said_word(one.verdict.value),
            )  # fmt: skip
            self.values.show_words(row, words)
        if outcome.chart is not None:
            self.interim.show_chart(outcome.chart)
            self.show_plot(2)
        facts = [
            (
                one.quantity,
                tr("{error:+.1f} ± {u:.1f} µm, limit {limit:.1f}").format(
                    error=1e3 * one.error_mm, u=1e3 * one.expanded_mm, limit=1e3 * one.limit_mm
                ),
            )
            for one in outcome.quantities
        ]  # fmt: skip
        used = ", ".join(f"{one.use.name} ({one.use.serial})" for one in view.stage.artefacts)
        facts += [
            (tr("Values"), str(len([one for one in values if not one.superseded]))),
            (tr("Retests left"), str(outcome.retests_left)),
            (tr("Method"), view.stage.procedure.wording),
            (tr("Rule"), view.stage.procedure.rule),
            (tr("Artefact"), used or tr("none")),
        ]
        if outcome.file is not None:
            facts.append((tr("Record"), outcome.file.name[:16]))
        self.facts.show_facts(facts)

    def _show_word(self, view: GuidedAcceptanceView) -> None:
        error, outcome, theme = view.base.error, view.outcome, self._theme
        instrument = view.stage.instrument
        known = ", ".join(instrument.states)
        if instrument.simulated and not instrument.unproven:
            known = tr("SIMULATED: virtual rig and artefact")
        self._simulated.show_text(known, theme.warn, Mark.DOUBT if known else None)
        self._simulated.setToolTip(literal(" ".join(instrument.unproven)))
        self._simulated.setVisible(bool(known))
        if error is not None:
            self._word.show_text(tr("NO VERDICT"), theme.bad, Mark.BAD)
            text = said(f"{error.what} {error.remedy}")
        elif outcome is None:
            self._word.show_text(tr("NOT CALCULATED"), theme.muted, Mark.OPEN)
            text = tr("Press R to calculate.")
        else:
            mark = _MARKS[outcome.verdict]
            self._word.show_text(tr(outcome.word), mark_colour(theme, mark), mark)
            text = said(outcome.sentence)
        if text != self.sentence.text():
            self.sentence.setText(text)

    def _lay_out(self) -> None:
        right = QVBoxLayout()
        right.setSpacing(10)
        told = QVBoxLayout()
        told.setContentsMargins(0, 0, 6, 0)
        told.setSpacing(10)
        told.addWidget(self.sentence)
        told.addWidget(self.facts)
        told.addStretch(1)
        right.addWidget(self._word)
        right.addWidget(self._simulated)
        right.addWidget(figures_area(told), 1)
        for button in (self.record, self.paper):
            button.setFont(text_font(15, bold=True))
            button.setMinimumHeight(44)
            right.addWidget(button)
        side = panel(right)
        side.setFixedWidth(_SIDE_PX)
        left = QVBoxLayout()
        left.addWidget(self.tabs)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(panel(left), 1)
        layout.addWidget(side)
