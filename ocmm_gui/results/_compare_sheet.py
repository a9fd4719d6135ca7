"""Comparison of the jobs of a batch: a table of characteristics, and a chart."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError
from ocmm_core.export import batch_table
from ocmm_core.inspection.evaluation import SIMULATED_LINE
from ocmm_core.inspection.finished import Comparison, Trend, compare_folder
from ocmm_gui import kit
from ocmm_gui.charts import TrendChart
from ocmm_gui.kit import later, tr
from ocmm_gui.reports import write_batch
from ocmm_gui.work import WorkSheet

_KEYS = (
    kit.ActionInfo(
        "folder", later("Choose a folder"), later("Compare the jobs in a folder"), ("F7",)
    ),
    kit.ActionInfo(
        "feature", later("Feature"), later("Show only what is about one feature"), ("F6",)
    ),
    kit.ActionInfo(
        "export",
        later("Export"),
        later("Write a table (.csv) or pages with the charts (.pdf)"),
        ("F8", "E"),
    ),
    kit.ActionInfo("stop", later("Stop reading"), later("Stop reading the jobs"), ("F9",)),
)
_COLUMNS = (
    (later("Characteristic"), later("as in the plan")),
    (later("Parts"), later("included")),
    (later("Mean"), later("{unit}, or degrees for angles")),
    (later("Cp"), later("tolerance relative to the scatter of the parts")),
    (later("Cpk"), later("relative to the nearer limit")),
    (later("95 %"), later("confidence interval of Cpk")),
    (later("Signals"), later("of the control chart")),
)
_NUMBERS = range(1, 7)
_MOST_REASONS = 8
"""Reasons for not counting values: the chart needs the room."""
_MOST_TOLD = 4
"""Of the last signals: the table has all of them."""


class TrendTable(kit.DataTable):
    """One row per characteristic."""

    def __init__(self) -> None:
        super().__init__(tr("Characteristics of the batch"), kit.with_unit(kit.tr_all(_COLUMNS)))
        self._trends: tuple[Trend, ...] = ()

    def show_trends(self, trends: tuple[Trend, ...]) -> None:
        self._trends = trends
        self.setRowCount(len(trends))
        for row, trend in enumerate(trends):
            warned = trend.chart is not None and trend.chart.signals
            self.show_words(row, _cells(trend), {len(_COLUMNS) - 1: "warn"} if warned else None)
            for column in _NUMBERS:
                self._cell(row, column).setFont(kit.digit_font(13, bold=False))
        self.resizeColumnsToContents()

    def _paint(self) -> None:
        super()._paint()
        self.resizeColumnsToContents()

    def chosen(self) -> Trend | None:
        row = self.currentRow()
        return self._trends[row] if 0 <= row < len(self._trends) else None


class CompareSheet(WorkSheet):
    """Compare the jobs of a folder in a side process; ``records`` returns record folders."""

    def __init__(
        self, records: Callable[[], tuple[Path | None, Path | None]] = lambda: (None, None)
    ) -> None:
        super().__init__(tr("Batch"), _KEYS, tr("Reading the jobs"))
        self._records = records
        self.file = kit.PathPanel(
            tr("Compare the jobs from the folder"), tr("Folder of the jobs"), tr("Compare")
        )
        self.feature = kit.form_field(tr("Feature"), tr("Feature; empty for all"))
        self.target = kit.PathPanel(
            tr("Write the table of the batch to"), tr("File of the table"), tr("Write")
        )
        self.table = TrendTable()
        self.chart = TrendChart()
        self.words = kit.sentence_label(tr("Findings of the chart"), 15)
        self.left_out = kit.sentence_label(tr("Excluded"), 14, role="muted")
        right = kit.vbox((self.chart, 1), self.words, self.left_out)
        row = kit.hbox((self.table, 50), (right, 50), spacing=10)
        chosen = kit.hbox(kit.caption(tr("Feature"), self.feature), (self.feature, 1))
        kit.fill(self.body, self.file, self.target, self.working, chosen, (row, 1))
        self._folder = Path.home()
        self._left_out: tuple[str, ...] = ()
        self._found: Comparison | None = None
        self._shown: Comparison | None = None
        self.feature.textEdited.connect(lambda _text: self._filter())
        self.feature.left.connect(self.table.setFocus)
        self.target.given.connect(self._write)
        self.file.given.connect(self.read)
        self.table.itemSelectionChanged.connect(self._choose)
        self.use_keys(
            {
                "folder": lambda: self.file.ask(self._folder),
                "feature": self.feature.setFocus,
                "export": self.export,
                "stop": self.stop,
            },
            primary="folder",
        )
        self.show_message(tr("Select the folder with the jobs of the batch."))

    def open(self, folder: Path) -> None:
        """Propose a folder, and read it."""
        self._folder = folder
        self.read(folder)

    def read(self, folder: Path) -> None:
        """Read the jobs of a folder in the background."""
        self._folder = folder
        probes, calibrations = self._records()
        work = partial(compare_folder, folder, probes=probes, calibrations=calibrations)
        self._start(tr("Starting"), work)

    def _show(self, answer: object) -> None:
        if isinstance(answer, Path):
            self.show_message(tr("Pages of the batch written to {path}.").format(path=answer))
            return
        if not isinstance(answer, Comparison):
            return
        jobs = answer.jobs
        origin = f"{kit.said(SIMULATED_LINE)} " if answer.simulated else ""
        self.show_message(
            tr(
                "{origin}%n jobs of plan {plan}, {first} to {last}.",
                "{origin}1 job of plan {plan}, {first} to {last}.",
                len(jobs),
            ).format(origin=origin, plan=answer.plan, first=jobs[0], last=jobs[-1])
        )
        self._found, self._left_out = answer, answer.left_out
        self._filter()
        self.table.setFocus()

    def export(self) -> None:
        if self._shown is None:
            self.show_message(tr("Select the folder with the jobs of the batch."))
            return
        self.target.ask(self._folder / f"{self._shown.plan}_batch.csv")

    def _write(self, path: Path) -> None:
        if self._shown is None:
            return
        self.target.hide()
        if path.suffix.lower() == ".pdf":
            self._start(tr("Writing the pages"), partial(write_batch, self._shown, path))
            return
        try:
            write_atomic(path, batch_table(self._shown))
        except OSError as error:
            self.show_message(
                tr("{path}: the file cannot be written ({reason}).").format(
                    path=path, reason=error.strerror
                )
            )
            return
        self.show_message(tr("Table of the batch written to {path}.").format(path=path))

    def _filter(self) -> None:
        """Show the trends of the feature in the field; all without one."""
        if self._found is None:
            return
        try:
            self._shown = self._found.about(self.feature.text().strip())
        except InputError as error:
            self.show_message(kit.said(f"{error.what} {error.remedy}"))
            self._shown = self._found
        self.table.show_trends(self._shown.trends)
        if self._shown.trends:
            self.table.selectRow(0)
        self._choose()

    def _choose(self) -> None:
        trend = self.table.chosen()
        self.chart.show_trend(trend)
        if trend is None:
            return
        able = trend.capability
        told = [kit.said(able.summary if able is not None else trend.why_not)]
        if trend.chart is not None:
            counted = [part for part in trend.parts if part.value is not None]
            # Names of the rules are those of the literature, and not translated.
            told += [kit.said(trend.caution)] if trend.caution else []
            told += [
                f"{counted[i].job}: {why.rule}, {kit.said_word(why.value)}."
                for i, why in trend.chart.signals[-_MOST_TOLD:]
            ]
        self.words.setText(" ".join(told))
        # Unreadable jobs first.
        why = (*self._left_out, *trend.left_out)
        more = tr("And %n more.", "", len(why) - _MOST_REASONS) if len(why) > _MOST_REASONS else ""
        self.left_out.setText(" ".join((*why[:_MOST_REASONS], more)).strip())


def _cells(trend: Trend) -> tuple[str, ...]:
    values, able = trend.values, trend.capability
    signals = "–" if trend.chart is None else str(len(trend.chart.signals) or tr("none"))
    return (
        trend.name,
        tr("{included} of {count}").format(included=len(values), count=len(trend.parts)),
        kit.kind_value(trend.kind, float(values.mean()), 4) if len(values) else "–",
        kit.localised(f"{able.cp:.2f}") if able is not None and able.cp is not None else "–",
        kit.localised(f"{able.cpk:.2f}") if able is not None else "–",
        kit.localised(f"{able.cpk_low:.2f} – {able.cpk_high:.2f}") if able is not None else "–",
        signals,
    )
