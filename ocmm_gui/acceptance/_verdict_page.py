"""Verdict of a test: word, meaning, errors against limits, certificate and record."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHeaderView

from ocmm_core.acceptance import (
    AcceptanceOutcome,
    AcceptanceVerdict,
    GuidedAcceptanceView,
    JudgedValue,
    worst_value,
)
from ocmm_core.calibration.records import Finding
from ocmm_gui.acceptance._checks import checks_of
from ocmm_gui.charts import ErrorChart, InterimPlot
from ocmm_gui.kit import (
    FitText,
    Mark,
    NarrowButton,
    NumberTable,
    Theme,
    later,
    literal,
    localised,
    said,
    said_word,
    text_font,
    tr,
    tr_all,
)
from ocmm_gui.wizards.parts import ResultFrame, Said, Seen

_MARKS = {
    AcceptanceVerdict.PASS: Mark.GOOD,
    AcceptanceVerdict.FAIL: Mark.BAD,
    AcceptanceVerdict.LEANING_IN: Mark.DOUBT,
    AcceptanceVerdict.LEANING_OUT: Mark.DOUBT,
    AcceptanceVerdict.VOID: Mark.DOUBT,
}
_COLUMNS = (
    (later("Quantity"), later("What is tested")),
    (later("Where"), later("Position and length")),
    (later("Error, µm"), later("Test value")),
    (later("U, µm"), later("Of the test value, k = 2")),
    (later("MPE, µm"), later("Limit")),
    (later("Verdict"), later("By the decision rule")),
)


class AcceptanceVerdictPage(ResultFrame):
    """Pass or fail, margin, decision rule; then certificate and record."""

    keys = ("back", "repeat", "calculate", "keep", "accept", "plot1", "plot2", "plot3")
    paper_wanted = Signal(object)
    """Emits the `Path` of the record for a certificate."""

    def __init__(self) -> None:
        self.chart = ErrorChart()
        self.interim = InterimPlot()
        self.values = NumberTable(tr("Every value"), tr_all(_COLUMNS), whole=False)
        header = self.values.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        self.values.right_heads((2, 3, 4))
        super().__init__(
            (
                (tr("Errors and limits"), self.chart),
                (tr("Record"), self.values),
                (tr("Interim checks"), self.interim),
            )
        )
        self._simulated = FitText(tr("Source"), limit=20)
        self._simulated.setFixedHeight(28)
        self.right.insertWidget(1, self._simulated)
        self.record = NarrowButton(tr("Record  [2]"))
        self.record.setAccessibleName(tr("Show every value of the record"))
        self.record.clicked.connect(lambda: self.show_plot(1))
        self.paper = NarrowButton(tr("Certificate (PDF and DCC)  [P]"))
        self.paper.setAccessibleName(tr("Write the certificate, PDF and DCC"))
        self.paper.setToolTip(literal(tr("Write the certificate, PDF and DCC")))
        self.paper.setShortcut("P")
        self.paper.clicked.connect(self._want_paper)
        for button in (self.record, self.paper):
            button.setFont(text_font(15, bold=True))
            button.setMinimumHeight(44)
            self.right.addWidget(button)

    def allows(self, key: str) -> bool:
        """Return whether the procedure permits another retest."""
        outcome = self._shown
        left = outcome.retests_left if isinstance(outcome, AcceptanceOutcome) else 0
        return key != "repeat" or left > 0

    def show_seen(self, seen: Seen) -> None:
        super().show_seen(seen)
        self.paper.setEnabled(self._file() is not None)
        self._show_source(seen)

    def set_theme(self, theme: Theme) -> None:
        super().set_theme(theme)
        if self._seen is not None:
            self._show_source(self._seen)

    def judge(self, outcome: object) -> Said:
        """Return the verdict."""
        if not isinstance(outcome, AcceptanceOutcome):
            return Said("", Mark.OPEN, "")
        return Said(said_word(outcome.word), _MARKS[outcome.verdict], said(outcome.sentence))

    def fill(self, outcome: object) -> tuple[Sequence[tuple[str, str]], Sequence[Finding]]:
        if not isinstance(outcome, AcceptanceOutcome) or self._seen is None:
            return (), ()
        values, stage = outcome.values, self._seen.view_as(GuidedAcceptanceView).stage
        if values:
            self.chart.show_checks(checks_of(values), worst_value(values))
        self.values.show_rows([_row(one) for one in values])
        if outcome.chart is not None:
            self.interim.show_chart(outcome.chart)
            self.show_plot(2)
        facts = [
            (
                said_word(one.quantity),
                tr("{error:+.1f} µm, U {u:.1f} µm (k = 2), limit {limit:.1f} µm").format(
                    error=1e3 * one.error_mm, u=1e3 * one.expanded_mm, limit=1e3 * one.limit_mm
                ),
            )
            for one in outcome.quantities
        ]  # fmt: skip
        used = ", ".join(f"{one.use.name} ({one.use.serial})" for one in stage.artefacts)
        facts += [
            (tr("Values"), str(len([one for one in values if not one.superseded]))),
            (tr("Retests left"), str(outcome.retests_left)),
            (tr("Method"), said(stage.procedure.wording)),
            (tr("Rule"), said(stage.procedure.rule)),
            (tr("Artefact"), used or tr("none")),
        ]
        if outcome.file is not None:
            facts.append((tr("Record"), outcome.file.name[:16]))
        return facts, ()

    def _file(self) -> Path | None:
        return self._shown.file if isinstance(self._shown, AcceptanceOutcome) else None

    def _want_paper(self) -> None:
        if self._file() is not None:
            self.paper_wanted.emit(self._file())

    def _show_source(self, seen: Seen) -> None:
        instrument = seen.view_as(GuidedAcceptanceView).stage.instrument
        known = ", ".join(map(said, instrument.states))
        if instrument.simulated and not instrument.unproven:
            known = tr("SIMULATED: virtual rig and artefact")
        self._simulated.show_text(known, self._theme.warn, Mark.DOUBT if known else None)
        self._simulated.setToolTip(literal(" ".join(map(said, instrument.unproven))))
        self._simulated.setVisible(bool(known))


def _row(one: JudgedValue) -> tuple[str, ...]:
    superseded = tr(" (repeated)") if one.superseded else ""
    return (
        said_word(one.quantity), f"{said(one.position)}, {said(one.name)}{superseded}",
        localised(f"{1e3 * one.error_mm:+.1f}"),
        localised(f"{1e3 * one.expanded_mm:.1f}") if one.expanded_mm else "–",
        localised(f"{1e3 * one.limit_mm:.1f}"), said_word(one.verdict.value),
    )  # fmt: skip
