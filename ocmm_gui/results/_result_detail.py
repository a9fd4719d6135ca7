"""Details of a result: decision, calibration, budget, and trials on demand."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QRectF, Signal
from PySide6.QtGui import QColor, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QFrame

from ocmm_core.geometry import Float
from ocmm_core.inspection.causes import EXPLAINED, Cause, Explanation
from ocmm_core.tolerances.decisions import CharacteristicResult, rule_words
from ocmm_core.tolerances.monte_carlo import MonteCarloValue
from ocmm_core.tolerances.uncertainty import Budget, BudgetRow
from ocmm_gui import kit
from ocmm_gui.charts import ToleranceBar
from ocmm_gui.kit import later, tr
from ocmm_gui.results._job_source import Budgets, JobSource, budgets_of_file, trials_of_file
from ocmm_gui.work import SideProcess

_COLUMNS = (
    (later("Source"), later("of the uncertainty")),
    (
        later("Kind"),
        later("A: from the observations of this job; B: from other sources; distribution"),
    ),
    ("u, µm", later("standard uncertainty contributed to the result; m° for angles")),
    (later("Share"), later("of the variance")),
)
_ROW_PX, _LINE_PX = 26.0, 23
_LEAST_SHARE, _MOST_ROWS = 1e-4, 9


class BudgetTable(kit.NumberTable):
    """The sources, greatest first."""

    def __init__(self) -> None:
        super().__init__(
            tr("Uncertainty budget"), kit.tr_all(_COLUMNS), whole=False, font=kit.text_font(13)
        )
        self.verticalHeader().setDefaultSectionSize(_LINE_PX)
        self.setMinimumHeight(round(4.5 * _LINE_PX))
        self.right_heads((2, 3))

    def show_budget(self, budget: Budget | None) -> None:
        """Show the sources of one result; None hides the table."""
        rows = shown_rows(budget)
        self.setVisible(bool(rows))
        # Rest of the height for the bars.
        self.setMaximumHeight(round((len(rows) + 1.6) * _LINE_PX))
        self.show_rows(
            [
                (row.name, f"{row.kind}, {row.distribution}",
                 kit.localised(f"{1e3 * row.standard:.2f}"),
                 f"{100.0 * row.share:.0f} %")
                for row in rows
            ]
        )  # fmt: skip
        for line, row in enumerate(rows):
            self._cell(line, 0).setToolTip(kit.literal(row.origin))
            # Words in the font of digits would not fit into the narrowest window.
            for column in (0, 1):
                self._cell(line, column).setFont(kit.text_font(13))
            self.show_digits(line, (2, 3), 13)


def shown_rows(budget: Budget | None) -> tuple[BudgetRow, ...]:
    """Return the sources that fit on a screen, greatest first."""
    if budget is None:
        return ()
    return tuple(row for row in budget.rows if row.share >= _LEAST_SHARE)[:_MOST_ROWS]


class BudgetBars(kit.PaintedWidget):
    """One bar per source, as long as its standard uncertainty; below them the total."""

    def __init__(self) -> None:
        super().__init__(tr("Uncertainty budget as bars"), (240, 150), (160, 60))
        self._budget: Budget | None = None

    def show_budget(self, budget: Budget | None) -> None:
        self._budget = budget
        self.setAccessibleDescription(
            "; ".join(f"{row.name} {100.0 * row.share:.0f} %" for row in shown_rows(budget))
        )
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        budget = self._budget
        if budget is None or budget.standard <= 0.0:
            return
        painter = self._painter()
        count = max(int(self.height() / _ROW_PX) - 1, 1)
        rows = [(row.name, row.standard, self._theme.accent) for row in shown_rows(budget)[:count]]
        rows.append((tr("Together, u"), budget.standard, self._theme.text))
        pitch = min(_ROW_PX * 1.3, self.height() / len(rows))
        painter.setFont(kit.text_font(13))
        metrics = painter.fontMetrics()
        words = max(metrics.horizontalAdvance(name) for name, _, _ in rows) + 10.0
        painter.setFont(kit.digit_font(12, bold=False))
        digits = painter.fontMetrics().horizontalAdvance("0000.00") + 8.0
        reach = max(u for _, u, _ in rows)
        room = max(self.width() - words - digits, 20.0)
        for index, (name, u, colour) in enumerate(rows):
            y = index * pitch
            kit.ink(painter, QColor(self._theme.text), font=kit.text_font(13))
            painter.drawText(QRectF(0.0, y, words, pitch), kit.LEFT, name)
            bar = QRectF(words, y + 0.2 * pitch, room * u / reach, 0.6 * pitch)
            painter.fillRect(bar, QColor(colour))
            painter.setFont(kit.digit_font(12, bold=False))
            box = QRectF(self.width() - digits, y, digits, pitch)
            painter.drawText(box, kit.RIGHT, kit.localised(f"{1e3 * u:.2f}"))
        painter.setPen(QPen(QColor(self._theme.border), 1.0))
        line = (len(rows) - 1) * pitch
        painter.drawLine(0, round(line), self.width(), round(line))


_NONE = Budgets({}, {})
_ROOMY_PX = 760
_SEARCHING = later("Analysing the cause ...")
_BUSY = later("Calculating the budget from the job file.")


class ResultDetail(QFrame):
    """Verdict, sentences, budgets by a side process once per state, trials with progress."""

    explained = Signal(object)
    """Emits the `Explanation` of the shown result, or None, also during the computation."""
    failed = Signal(object)
    """An `OcmmError` of a budget or trial."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName(tr("Selected result"))
        self._source: JobSource | None = None
        self._result: CharacteristicResult | None = None
        self._of: object = None
        self._path: Path | None = None
        self._budgets = _NONE
        self._trials: dict[str, MonteCarloValue] = {}
        self._title = kit.FitText(tr("Characteristic"), limit=20, high=28)
        self._verdict = kit.FitText(tr("Verdict"), limit=28, reserve=tr("NOT MEASURED"), high=38)
        self.bar = ToleranceBar()
        self.bar.setFixedHeight(54)
        self._why = kit.sentence_label(tr("Why"), 15)
        self._now = kit.sentence_label(tr("What to do"), 16)
        self._now.setFont(kit.text_font(16, bold=True))
        self._rule = kit.sentence_label(tr("Decision rule"), 13)
        self._standing = kit.sentence_label(tr("Calibration"), 13, role="muted")
        self._note = kit.sentence_label(tr("Note"), 13)
        self.budget = BudgetTable()
        self.bars = BudgetBars()
        self.check = kit.sentence_label(tr("Monte Carlo"), 13)
        self.progress = kit.WorkBar(tr("Progress of the calculation"))
        self._drill, self._simulation = (
            SideProcess(self, done, self._on_failed, self.progress.advance)
            for done in (self._on_budgets, self._on_trials)
        )
        layout = kit.vbox(parent=self, spacing=5, margins=(12, 6, 12, 8))
        for widget in (
            self._title, self._verdict, self._why, self._now, self.bar, self._rule,
            self._standing, self._note,
        ):  # fmt: skip
            layout.addWidget(widget)
        kit.fill(layout, (self.budget, 4), (self.bars, 3), self.check, self.progress)

    def show_result(self, source: JobSource, result: CharacteristicResult, status: str) -> None:
        """Show a result of a job; ``status`` is the state of cameras and probe."""
        self._source, self._result = source, result
        self.bar.show_result(result)
        self._rule.setText(decision_words(result))
        self._standing.setText(status)
        self._note.tell(" ".join(kit.said(part) for part in (result.note, result.caution) if part))
        of = " – ".join(result.features)
        self._title.show_text(f"{result.name}: {kit.said_word(str(result.kind))} {of}")
        self._verdict.show_verdict(kit.said_word(result.verdict.value), result.verdict)
        self._look_again()
        self._show_numbers()

    def simulate(self) -> None:
        """Check the uncertainty of the shown result by trials, or cancel running ones."""
        if self._simulation.is_running():
            self._simulation.cancel()
            self.progress.hide()
            self.check.setText(tr("Simulation cancelled."))
        elif self._source is not None and self._result is not None:
            self.progress.start(tr("Monte Carlo"))
            self.check.setText(tr("Trials run in a separate process. F6 stops them."))
            self._simulation.start(partial(trials_of_file, self._source.path, self._result.name))

    def cancel(self) -> None:
        self._drill.cancel()
        self._simulation.cancel()
        self.progress.hide()

    def is_busy(self) -> bool:
        return self._drill.is_running() or self._simulation.is_running()

    def _show_numbers(self) -> None:
        name = "" if self._result is None else self._result.name
        found = self._budgets.found.get(name)
        self.budget.show_budget(found)
        self.bars.show_budget(found)
        self._show_explanation()
        trials = self._trials.get(name)
        if trials is not None and self._result is not None:
            self.check.setText(trial_words(self._result, trials))
        elif name in self._budgets.missing:
            self.check.setText(kit.said(self._budgets.missing[name]))
        elif not self._simulation.is_running():
            waits = self._drill.is_running()
            self.check.setText(tr(_BUSY) if waits else tr("F6 checks U by Monte Carlo (JCGM 101)."))

    def explanation(self) -> Explanation | None:
        """Return why the shown result is not good; None if it is, or not yet known."""
        result = self._result
        found = None if result is None else self._budgets.explained.get(result.name)
        # Explanations from before a change do not apply to the current verdict.
        return found if result is not None and found and _is_of(found, result) else None

    def up(self) -> Float | None:
        """Return the upright direction in the world of the job; None if not yet known."""
        return self._budgets.up

    def _show_explanation(self) -> None:
        found, result = self.explanation(), self._result
        asked = result is not None and result.verdict in EXPLAINED
        waits = asked and found is None and self._drill.is_running()
        self._why.tell(tr(_SEARCHING) if waits else "" if found is None else kit.said(found.why))
        self._now.tell("" if found is None else kit.said(found.suggestion))
        self._now.setToolTip(kit.literal("" if found is None else kit.said(found.finding.evidence)))
        # The note of a suspect result is the suggestion itself.
        doubted = found is not None and found.cause is Cause.DOUBT
        self._note.setVisible(bool(self._note.text()) and not doubted)
        self._make_room()
        self.explained.emit(found)

    def _make_room(self) -> None:
        """Hide the bars if words need their room: the table has the same data."""
        self.bars.setVisible(self._now.isHidden() or self.height() >= _ROOMY_PX)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._make_room()

    def _look_again(self) -> None:
        """Recompute the budgets of a changed job, after the current computation."""
        source, result = self._source, self._result
        if source is None or result is None or result.measured is None:
            return
        state = source.state()
        if state == self._of or (self._drill.is_running() and source.path == self._path):
            return
        if source.path != self._path:
            self._budgets = _NONE
        self._of, self._path, self._trials = state, source.path, {}
        self._simulation.cancel()
        self.progress.start(tr("Reading the job"))
        self._drill.start(partial(budgets_of_file, source.path))

    def _on_budgets(self, found: object) -> None:
        self.progress.setVisible(self._simulation.is_running())
        if isinstance(found, Budgets):
            self._budgets = found
        self._look_again()
        self._show_numbers()

    def _on_trials(self, found: object) -> None:
        self.progress.setVisible(self._drill.is_running())
        if isinstance(found, MonteCarloValue):
            self._trials[found.name] = found
        self._show_numbers()

    def _on_failed(self, error: object) -> None:
        self.progress.hide()
        self._show_numbers()
        self.failed.emit(error)


def _is_of(found: Explanation, result: CharacteristicResult) -> bool:
    return found.verdict is result.verdict and found.uncertainty == result.uncertainty


def decision_words(result: CharacteristicResult) -> str:
    """Return rule, interval, association and frame of a result, in sentences."""
    parts = []
    if result.rule:
        words, sign, identity = rule_words(result.rule).rpartition(" (")
        parts.append(tr("Rule: {rule}.").format(rule=f"{kit.said(words)}{sign}{identity}"))
    if result.leaning:
        inside = result.leaning == "in"
        parts.append(tr("The value lies inside.") if inside else tr("The value lies outside."))
    if result.interval is not None:
        low, high = (kit.quantity(result, value) for value in result.interval)
        parts.append(tr("95 % interval {low} to {high}.").format(low=low, high=high))
    if result.tur is not None:
        parts.append(tr("Tolerance over 2 U: {tur:.1f}.").format(tur=result.tur))
    if result.association:
        parts.append(tr("Association: {association}.").format(association=result.association))
    if result.frame:
        parts.append(tr("Frame: {frame}.").format(frame=result.frame))
    if result.floor is not None:
        parts.append(tr("Noise floor: {floor}.").format(floor=kit.quantity(result, result.floor)))
    if result.bonus:
        parts.append(tr("Bonus {bonus}.").format(bonus=kit.quantity(result, result.bonus)))
    return " ".join(parts)


def trial_words(result: CharacteristicResult, trials: MonteCarloValue) -> str:
    """Return the trials compared with linear propagation, in sentences."""
    low, high = (kit.quantity(result, value) for value in trials.symmetric)
    small = "m°" if result.unit == "deg" else "µm"
    off = 1e3 * max(trials.off_low, trials.off_high)
    found = tr(
        "Monte Carlo (JCGM 101), {trials:,} trials: 2 u = {width:.2f} {unit}, "
        "interval {low} to {high}."
    ).format(trials=trials.trials, width=2e3 * trials.sigma, unit=small, low=low, high=high)
    differ = tr("the ends differ by {off:.2f} {unit}, tolerance {tolerance:.2g} {unit}").format(
        off=off, unit=small, tolerance=1e3 * trials.tolerance
    )
    agrees = tr("It does not confirm linear propagation: {differ}.")
    if trials.validated:
        agrees = tr("It confirms linear propagation: {differ}.")
    unsettled = "" if trials.settled else tr("More trials are needed to be certain.")
    return f"{found} {agrees.format(differ=differ)} {unsettled}".rstrip()
