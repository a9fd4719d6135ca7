"""Page of Maintain: finished and open tests, and the chart of interim checks."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QWidget

from ocmm_core.acceptance import FinishedTest
from ocmm_core.composition import AcceptanceBench, TestsMade
from ocmm_core.failure import contained
from ocmm_gui import kit
from ocmm_gui.charts import InterimPlot
from ocmm_gui.kit import later, said, tr
from ocmm_gui.work import Worker

_COLUMNS = (
    (later("Verdict"), later("Of the whole test")),
    (later("Procedure"), later("Title of the procedure")),
    (later("Ended"), later("Local time")),
    (later("Who"), later("As entered")),
    (later("Worst"), later("The value that is nearest to its limit or farthest beyond")),
    (later("Record"), later("Number of the record")),
)


class TestsPage(QWidget):
    """Acceptance tests of this station."""

    __test__ = False

    def __init__(
        self, bench: AcceptanceBench, clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    ) -> None:
        super().__init__()
        self._bench, self._clock = bench, clock
        self._shown: tuple[FinishedTest, ...] = ()
        # Reading verifies all hashes, and the disk may be slow.
        self._lists = Worker("ocmm-tests-made", self)
        self.about = kit.sentence_label(tr("About the tests"), 15)
        self.table = kit.NumberTable(
            tr("Acceptance tests"), kit.tr_all(_COLUMNS), whole=False, font=kit.text_font(14)
        )
        self.table.fit_columns(1)
        self.chart = kit.dressed(InterimPlot(), high=150)
        below = kit.vbox(self.chart)
        kit.vbox(
            self.about, (self.table, 3), (kit.panel(below), 2), parent=self, spacing=8, margins=0
        )

    def showEvent(self, event: QShowEvent) -> None:
        self.read()
        super().showEvent(event)

    def read(self) -> None:
        """Read the records and chart of the last check, then replace the display."""
        self.about.setText(tr("Reading the tests"))
        now = self._clock()
        self._lists.do(lambda: self._bench.made(now), self._show, self._show_failure)

    def close_work(self) -> None:
        self._lists.close(0.0)

    def _show(self, made: TestsMade) -> None:
        self._shown = made.finished
        self.about.setText(" ".join((self._summary(made), *made.unread)))
        self.table.setRowCount(len(self._shown))
        for row, one in enumerate(self._shown):
            self.table.show_words(row, _cells(one))
        if self._shown:
            self.table.selectRow(0)
        if made.chart is not None:
            self.chart.show_chart(made.chart)

    def _show_failure(self, error: Exception) -> None:
        told = contained(error, "The list of tests", "Nothing was changed.")
        self._shown = ()
        self.table.setRowCount(0)
        self.about.setText(said(f"{told.what} {told.remedy}"))

    def selected(self) -> Path | None:
        row = self.table.currentRow()
        return self._shown[row].file if 0 <= row < len(self._shown) else None

    def _summary(self, made: TestsMade) -> str:
        open_ones = sum(not one.blocker for one in made.unfinished)
        said = tr("%n tests", "1 test", len(self._shown))
        if open_ones:
            said += "; " + tr("%n not finished: F7 resumes", "", open_ones)
        if self._bench.is_virtual:
            said = tr("SIMULATED: virtual rig. {said}").format(said=said)
        return f"{said}."


def _cells(one: FinishedTest) -> tuple[str, ...]:
    record = one.record
    ended = datetime.fromisoformat(record.ended_utc).astimezone()
    worst = max(record.quantities, key=lambda q: abs(q.error_mm) / q.limit_mm, default=None)
    value = ""
    if worst is not None:
        value = tr("{quantity} {error:+.1f} of {limit:.1f} µm").format(
            quantity=worst.quantity, error=1e3 * worst.error_mm, limit=1e3 * worst.limit_mm
        )
    verdict = kit.said_word(record.verdict.value)
    if one.states:
        verdict = " ".join((*map(kit.said_word, one.states), verdict))
    return (
        verdict, record.procedure.title, kit.time_words(ended), record.made_by, value,
        record.number,
    )  # fmt: skip
