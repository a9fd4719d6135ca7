"""Check of the fits with an institute's reference pairs, worst error per folder."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.features import measured
from ocmm_core.features.measured import Convention
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.work import SideProcess, Tell

_ASK = later(
    "Select a folder of certified reference pairs (NAME.ds with NAME.fit) and the convention "
    "they follow. Every pair is fitted without a start value and compared."
)
_VERDICT = 6


def _columns() -> tuple[tuple[str, str], ...]:
    return (
        (tr("Folder"), tr("one folder of pairs")),
        (tr("Pairs"), tr("pairs fitted and compared")),
        (tr("Position"), tr("mm, worst; limit {limit:g}").format(limit=measured.POSITION_LIMIT)),
        (tr("Size"), tr("mm, worst; limit {limit:g}").format(limit=measured.SIZE_LIMIT)),
        (tr("Direction"), tr("rad, worst; limit {limit:g}").format(limit=measured.DIRECTION_LIMIT)),
        (tr("Apex"), tr("degrees, worst; limit {limit:g}").format(limit=measured.APEX_LIMIT)),
        (tr("Verdict"), tr("whether every pair is within the limits")),
    )


def verified(folder: Path, convention: Convention, tell: Tell) -> tuple[measured.SetReport, ...]:
    """Return the comparison, in a separate process. InputError as `verify_folder`."""
    tell(later("Fitting"), 0.2)
    return measured.verify_folder(folder, convention)


class FitsPage(QWidget):
    """Folder and convention above, a table of the worst errors below."""

    failed = Signal(object)
    """Emits the `OcmmError` of a failed comparison."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Fits against certified pairs"))
        self._reports: tuple[measured.SetReport, ...] = ()
        name = tr("Folder of reference pairs")
        self.folder = kit.dressed(kit.OwnKeysField(), name, font=kit.text_font(15))
        self.folder.setPlaceholderText(name)
        self.folder.returnPressed.connect(self.toggle)
        self.convention = kit.ChoiceBox(
            tr("Convention"),
            tr("Convention of the certified values"),
            [item.name for item in Convention],
        )
        self.button = kit.dressed(
            kit.NarrowButton(tr("Verify")), tr("Verify"), font=kit.text_font(15, bold=True),
            role="primary", high=40,
        )  # fmt: skip
        self.button.clicked.connect(self.toggle)
        self.outcome = kit.FitText(tr("Outcome"), limit=30, high=42)
        self._sentence = kit.sentence_label(tr("What is compared"), 14, tr(_ASK))
        self.table = kit.NumberTable(
            tr("Worst errors"), _columns(), whole=False, font=kit.text_font(15)
        )
        self.table.right_heads(range(1, _VERDICT))
        self.table.verticalHeader().setDefaultSectionSize(34)
        self.progress = kit.WorkBar(tr("Progress of the comparison"))
        self._process = SideProcess(self, self._end, self._on_failed)
        row = kit.hbox((self.folder, 1), self.convention, self.button)
        above = kit.vbox(row, self._sentence, self.progress)
        kit.vbox(kit.panel(above), self.outcome, (self.table, 1), parent=self, spacing=8, margins=0)

    def toggle(self) -> None:
        if self._process.is_running():
            self.cancel()
            return
        folder = Path(self.folder.text().strip() or ".").expanduser()
        convention = Convention[self.convention.currentText()]
        self.progress.start()
        self.button.setText(tr("Cancel"))
        self.outcome.show_text(tr("Fitting"), "muted", kit.Mark.ACTIVE)
        self._process.start(partial(verified, folder, convention))

    def cancel(self) -> None:
        self._process.cancel()
        self._end(self._reports)

    def _on_failed(self, error: OcmmError) -> None:
        self._sentence.setText(kit.said(f"{error.what} {error.remedy}"))
        self._end(())
        self.failed.emit(error)

    def _end(self, reports: tuple[measured.SetReport, ...]) -> None:
        """Show reports, of a finished comparison or an earlier one."""
        self._reports = reports
        self.progress.hide()
        self.button.setText(tr("Verify"))
        pairs = sum(len(report.results) for report in reports)
        if not reports:
            self.outcome.show_text("")
        elif all(report.passed for report in reports):
            words = tr("All {pairs} pairs within the limits").format(pairs=pairs)
            self.outcome.show_text(words, mark=kit.Mark.GOOD)
        else:
            off = sum(not result.passed for report in reports for result in report.results)
            words = tr("{beyond} of {pairs} pairs beyond the limits")
            self.outcome.show_text(words.format(beyond=off, pairs=pairs), mark=kit.Mark.BAD)
        self.table.setRowCount(len(reports))
        for row, report in enumerate(reports):
            worst = [report.worst(key) for key in ("position", "size", "direction", "apex")]
            cells = (
                report.name,
                str(len(report.results)),
                *("–" if value is None else kit.localised(f"{value:.1e}") for value in worst),
                tr("✔  AGREES") if report.passed else tr("✖  OFF"),
            )
            self.table.show_words(row, cells)
            self.table.show_digits(row, range(1, _VERDICT), 15)
