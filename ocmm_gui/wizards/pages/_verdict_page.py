"""The verdict of a verification: every error against its limit."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from typing import Protocol

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout

from ocmm_core.calibration.guided import VerificationOutcome, VerificationView
from ocmm_core.calibration.records import Check
from ocmm_gui.charts import ErrorChart, group_of
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    FitText,
    Mark,
    Theme,
    localised,
    panel,
    said,
    sentence_label,
    session_of,
    tr,
)
from ocmm_gui.wizards.parts import Facts, Seen, StepPage, figures_area

_SIDE_PX = 380
_BACK_TO_LINES = 3


def _count(checks: int, failed: int) -> str:
    return (
        tr("{failed} of {checks} failed").format(failed=failed, checks=checks)
        if failed
        else str(checks)
    )


def _error(check: Check) -> str:
    return tr("{name} {error_mm:+.1f} µm, limit {limit_mm:.1f} µm").format(
        name=check.name, error_mm=1e3 * check.error_mm, limit_mm=1e3 * check.limit_mm
    )


class RepeatsLines(Protocol):
    """A procedure with repeatable lines."""

    def repeat_line(self, line: int, now: datetime) -> None: ...

    def back(self, now: datetime) -> None: ...


class VerdictPage(StepPage):
    """Pass or fail, the margin, and the decision rule."""

    keys = ("back", "repeat", "calculate", "keep", "accept")

    def __init__(self) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self._outcome: VerificationOutcome | None = None
        self._seen: Seen | None = None
        self._word = FitText(tr("Verdict"), limit=40)
        self._word.setFixedHeight(54)
        self.sentence = sentence_label(tr("Meaning of the verdict"), 17)
        self.facts = Facts(tr("Figures of the verdict"))
        self.warnings = sentence_label(tr("Reservations"), 14)
        self.chart = ErrorChart()
        told = QVBoxLayout()
        told.setContentsMargins(0, 0, 6, 0)
        told.addWidget(self.sentence)
        told.addWidget(self.facts)
        told.addWidget(self.warnings)
        told.addStretch(1)
        right = QVBoxLayout()
        right.addWidget(self._word)
        right.addWidget(figures_area(told), 1)
        side = panel(right)
        side.setFixedWidth(_SIDE_PX)
        left = QVBoxLayout()
        left.addWidget(self.chart)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(panel(left), 1)
        layout.addWidget(side)

    def show_seen(self, seen: Seen) -> None:
        view = seen.view_as(VerificationView)
        self._seen = seen
        if view.outcome is not None and view.outcome is not self._outcome:
            self._outcome = view.outcome
            record = view.outcome.record
            self.chart.show_checks(record.checks, view.outcome.largest)
            worst = record.checks[view.outcome.largest]
            artefacts = ", ".join(f"{one.name} ({one.serial})" for one in record.artefacts)
            self.facts.show_facts(
                (
                    (tr("Checks"), _count(len(record.checks), len(view.outcome.failed))),
                    (tr("Worst"), worst.name),
                    (
                        tr("Error"),
                        localised(
                            f"{1e3 * worst.error_mm:+.1f} ± {1e3 * worst.expanded_mm:.1f} µm"
                        ),
                    ),
                    (tr("Limit"), localised(f"± {1e3 * worst.limit_mm:.1f} µm")),
                    *session_of(record),
                    (tr("Artefacts"), artefacts),
                    (tr("Rule"), record.rule),
                )
            )
            told = [f"▲ {said(one.what)} {said(one.remedy)}" for one in view.outcome.warnings]
            told += [tr("First: {error}").format(error=_error(one)) for one in record.superseded]
            self.warnings.setText("\n".join(told))
        self._show_word()

    def word(self) -> str:
        return self._word.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._show_word()

    def _show_word(self) -> None:
        seen, theme = self._seen, self._theme
        if seen is None:
            return
        view = seen.view_as(VerificationView)
        error, outcome = view.base.error, view.outcome
        if error is not None:
            self._word.show_text(tr("NO VERDICT"), theme.bad, Mark.BAD)
            text = said(f"{error.what} {error.remedy}")
        elif outcome is None:
            self._word.show_text(tr("NOT CALCULATED"), theme.muted, Mark.OPEN)
            text = tr("Press R to calculate.")
        elif outcome.record.passed:
            self._word.show_text(tr("PASSED"), theme.good, Mark.GOOD)
            text = tr("Store the verdict; the calibration can then be used.")
        elif outcome.record.objections:
            self._word.show_text(tr("FAILED"), theme.bad, Mark.BAD)
            objections = outcome.record.objections
            remedies = dict.fromkeys(said(one.remedy) for one in objections)
            text = "\n".join((*(said(one.what) for one in objections), *remedies))
        elif outcome.record.superseded:
            self._word.show_text(tr("FAILED"), theme.bad, Mark.BAD)
            text = tr(
                "A line was repeated and the verification failed: store it and calibrate again."
            )
        else:
            self._word.show_text(tr("FAILED"), theme.bad, Mark.BAD)
            text = tr(
                "If only one line failed, repeat it once. If it fails again, store the verdict "
                "and calibrate again. Jobs since the last good verification are then suspect: "
                "Recall jobs (F12), on page Calibration, shows which of their verdicts hold."
            )
        if text != self.sentence.text():
            self.sentence.setText(text)


def repeat_worst(procedure: RepeatsLines, view: VerificationView) -> Callable[[datetime], None]:
    """Return the command that repeats the line of the worst check.

    If not allowed, the procedure refuses with a reason.
    """
    names = [line.name for line in view.lines]
    checks = () if view.outcome is None else view.outcome.record.checks
    lengths = [one for one in checks if group_of(one.name) in names]
    line = 0
    if lengths:
        worst = max(lengths, key=lambda one: abs(one.error_mm) / one.limit_mm)
        line = names.index(group_of(worst.name))

    def command(now: datetime) -> None:
        procedure.repeat_line(line, now)
        for _ in range(_BACK_TO_LINES):
            procedure.back(now)

    return command
