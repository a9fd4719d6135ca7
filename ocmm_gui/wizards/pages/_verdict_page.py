"""The verdict of a verification: every error against its limit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Protocol

from ocmm_core.calibration.guided import VerificationOutcome, VerificationView
from ocmm_core.calibration.records import Check, Finding
from ocmm_gui.charts import ErrorChart, check_words, group_of, session_of
from ocmm_gui.kit import Mark, day_words, said, said_word, tr
from ocmm_gui.wizards.pages._result_frame import ResultFrame, ResultVerdict

_BACK_TO_LINES = 3


def _count(checks: int, failed: int) -> str:
    return (
        tr("{failed} of {checks} failed").format(failed=failed, checks=checks)
        if failed
        else str(checks)
    )


def _error(check: Check) -> str:
    return f"{said_word(check.name)} {check_words(check)}"


class RepeatsLines(Protocol):
    """A procedure with repeatable lines."""

    def repeat_line(self, line: int, now: datetime) -> None: ...

    def back(self, now: datetime) -> None: ...


class VerdictPage(ResultFrame):
    """Pass or fail, the margin, and the decision rule."""

    keys = ("back", "repeat", "calculate", "keep", "accept")

    def __init__(self) -> None:
        self.chart = ErrorChart()
        super().__init__(((tr("Errors and limits"), self.chart),))

    def judge(self, outcome: object) -> ResultVerdict:
        """Return the verdict."""
        if not isinstance(outcome, VerificationOutcome):
            return ResultVerdict("", Mark.OPEN, "")
        record = outcome.record
        if record.passed:
            text = tr(
                "Store the verdict; the calibration can then be used. Certificate: Ctrl+P in "
                "Maintain, page Calibration."
            )
            return ResultVerdict(tr("PASSED"), Mark.GOOD, text)
        if record.objections:
            remedies = dict.fromkeys(said(one.remedy) for one in record.objections)
            text = "\n".join((*(said(one.what) for one in record.objections), *remedies))
        elif record.superseded:
            text = tr(
                "A line was repeated and the verification failed: store it and calibrate again."
            )
        else:
            text = tr(
                "If only one line failed, repeat it once. If it fails again, store the verdict "
                "and calibrate again. Jobs since the last good verification are then suspect: "
                "Recall jobs (F12), on page Calibration, shows which of their verdicts hold."
            )
        return ResultVerdict(tr("FAILED"), Mark.BAD, text)

    def fill(self, outcome: object) -> tuple[Sequence[tuple[str, str]], Sequence[Finding]]:
        if not isinstance(outcome, VerificationOutcome):
            return (), ()
        record = outcome.record
        self.chart.show_checks(record.checks, outcome.largest)
        worst = record.checks[outcome.largest]
        artefacts = ", ".join(f"{one.name} ({one.serial})" for one in record.artefacts)
        facts = [
            (tr("Checks"), _count(len(record.checks), len(outcome.failed))),
            (tr("Worst"), said_word(worst.name)),
            (tr("Error"), check_words(worst)),
            *session_of(record),
            (tr("Artefacts"), artefacts),
            (tr("Rule"), said(record.rule)),
        ]
        if record.passed and outcome.due_utc:
            facts.insert(3, (tr("Valid until"), day_words(outcome.due_utc)))
        if record.arose is not None:
            facts.insert(1, (tr("Since"), said(record.arose.sentence)))
        if record.superseded:
            facts.append((tr("First"), "\n".join(map(_error, record.superseded))))
        return facts, outcome.warnings


def repeat_worst(procedure: RepeatsLines, view: VerificationView) -> Callable[[datetime], None]:
    """Return the command that repeats the line of the worst check; may be refused."""
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
