"""The page of Maintain: tests that were made, open tests, and the chart of interim checks."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QHeaderView, QVBoxLayout, QWidget

from ocmm_core.acceptance import FinishedTest
from ocmm_core.composition import AcceptanceBench
from ocmm_core.errors import OcmmError
from ocmm_gui.charts import InterimPlot
from ocmm_gui.kit import NumberTable, later, panel, sentence_label, text_font, tr, tr_all

_COLUMNS = (
    (later("Verdict"), later("Of the whole test")),
    (later("Procedure"), later("Title of the procedure")),
    (later("Ended"), later("Local time")),
    (later("Who"), later("As entered")),
    (later("Worst"), later("The value that is nearest to its limit or farthest beyond")),
    (later("Record"), later("Number of the record")),
)


class TestsPage(QWidget):
    """Acceptance tests of this station.

    Parameters
    ----------
    bench
        Where they are kept.
    clock
        The time of day, with its zone.
    """

    __test__ = False

    def __init__(
        self,
        bench: AcceptanceBench,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        super().__init__()
        self._bench, self._clock = bench, clock
        self._shown: tuple[FinishedTest, ...] = ()
        self.about = sentence_label(tr("About the tests"), 15)
        self.table = NumberTable(tr("Acceptance tests"), tr_all(_COLUMNS), whole=False)
        self.table.setFont(text_font(14))
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        self.chart = InterimPlot()
        self.chart.setMinimumHeight(150)
        below = QVBoxLayout()
        below.addWidget(self.chart)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self.about)
        layout.addWidget(self.table, 3)
        layout.addWidget(panel(below), 2)

    def showEvent(self, event: QShowEvent) -> None:
        """Read anew what was made since."""
        self.read()
        super().showEvent(event)

    def read(self) -> None:
        """Show the records of the folder, and the chart of the last check."""
        try:
            self._shown, unread = self._bench.finished()
            told = [self._told(), *unread]
            self._show_chart()
        except OcmmError as error:
            self._shown, told = (), [f"{error.what} {error.remedy}"]
        self.about.setText(" ".join(told))
        self.table.setRowCount(len(self._shown))
        for row, one in enumerate(self._shown):
            self.table.show_words(row, _words(one))
        if self._shown:
            self.table.selectRow(0)

    def selected(self) -> Path | None:
        """Return the record that is selected; None where there is none."""
        row = self.table.currentRow()
        return self._shown[row].file if 0 <= row < len(self._shown) else None

    def _told(self) -> str:
        open_ones = len(self._bench.unfinished(self._clock()))
        said = tr("%n tests", "", len(self._shown))
        if open_ones:
            said += "; " + tr("%n not finished: F7 resumes", "", open_ones)
        if self._bench.is_virtual:
            said = tr("SIMULATED: virtual rig. {said}").format(said=said)
        return f"{said}."

    def _show_chart(self) -> None:
        for record in (one.record for one in self._shown):
            if "Interim_L" in record.procedure.limits and record.artefacts:
                self.chart.show_chart(self._bench.chart(record.artefacts[0], self._clock()))
                return


def _words(one: FinishedTest) -> tuple[str, ...]:
    record = one.record
    ended = datetime.fromisoformat(record.ended_utc).astimezone()
    worst = max(record.quantities, key=lambda q: abs(q.error_mm) / q.limit_mm, default=None)
    value = ""
    if worst is not None:
        value = tr("{quantity} {error:+.1f} of {limit:.1f} µm").format(
            quantity=worst.quantity, error=1e3 * worst.error_mm, limit=1e3 * worst.limit_mm
        )
    verdict = record.verdict.value
    if record.instrument.simulated:
        verdict = tr("SIMULATED {verdict}").format(verdict=verdict)
    return (
        verdict, record.procedure.title, f"{ended:%Y-%m-%d %H:%M}", record.made_by, value,
        record.number,
    )  # fmt: skip
