"""Alignment of the part: residuals and open degrees of freedom, before acceptance."""

from __future__ import annotations

from functools import partial

import numpy as np

from ocmm_core.alignment import AlignmentReport, Residual, report_lines
from ocmm_core.inspection.evaluation import JobView
from ocmm_gui import kit
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import later, tr
from ocmm_gui.results._job_source import alignment_of_file
from ocmm_gui.work import SideProcess

_KEYS = (
    kit.ActionInfo("again", later("Recalculate"), later("With the points taken so far"), ("F6",)),
    kit.ActionInfo(
        "accept",
        later("Accept"),
        later("Record in the job that this alignment was accepted"),
        ("F8",),
    ),
)
_COLUMNS = (
    (later("Feature"), later("in brackets: not used for the frame, only checks it")),
    ("dx", later("{unit}, deviation from nominal, in the frame")),
    ("dy", "{unit}"),
    ("dz", "{unit}"),
    (later("off"), later("{unit}, length of the deviation vector")),
    ("U (k=2)", later("{unit}, U of the distance, in its least certain direction")),
    (later("turned, °"), later("angular deviation")),
)


class AlignmentSheet(kit.Sheet):
    """Residuals on the left; on the right the frame, open degrees of freedom, and remarks."""

    def __init__(self, bridge: StationBridge) -> None:
        super().__init__(tr("Alignment"), _KEYS)
        self._bridge = bridge
        self._report: AlignmentReport | None = None
        self._of: JobView | None = None
        self._is_old = False
        self.table = kit.NumberTable(
            tr("Residuals"), kit.with_unit(kit.tr_all(_COLUMNS)), whole=False
        )
        self.table.right_heads(range(1, len(_COLUMNS)))
        self.state = kit.FitText(tr("Degrees of freedom"), limit=28, high=40)
        self.words = kit.sentence_label(tr("Notes"), 15)
        self._spread = kit.sentence_label(tr("Uncertainty of the frame"), 14, role="muted")
        self.progress = kit.WorkBar(tr("Progress of the calculation"))
        self._process = SideProcess(self, self._on_report, self._on_failed)
        left, right = kit.vbox(self.table), kit.vbox(self.words, self._spread, 1, self.progress)
        kit.fill(
            self.body, self.state, (kit.hbox((left, 62), (kit.panel(right), 38), spacing=10), 1)
        )
        self.use_keys({"again": self.compute, "accept": self.accept}, primary="accept")
        self._paint()

    def open(self) -> None:
        self.compute()
        self.table.setFocus()

    def compute(self) -> None:
        """Compute residuals and freedom from the job file, in a side process."""
        self._report, self._of, self._is_old = None, self._bridge.shown.job, False
        self._paint()
        self.progress.start()
        self._process.start(partial(alignment_of_file, self._bridge.station.job.path))

    def accept(self) -> None:
        """Store the displayed alignment and its acceptance in the job file."""
        report = self._report
        if report is None or self._is_old or not report.can_be_accepted:
            self.told.emit(tr("No alignment to accept yet."))
        else:
            words = tr("The alignment was accepted: results are in the {frame}.").format(
                frame=report.frame
            )
            self._bridge.results.accept_alignment(
                "; ".join(report_lines(report)), lambda: self.told.emit(words)
            )
            self.left.emit()

    def job_changed(self, job: JobView) -> None:
        """Warn if the frame now depends on other points than shown."""
        report = self._report
        if report is None or self._of is None or self._is_old:
            return
        names = {item.feature for item in report.residuals if item.aligned}
        if _points_of(job, names) != _points_of(self._of, names):
            self._is_old = True
            self._paint()

    def close_work(self) -> None:
        self._process.cancel()
        self.progress.hide()

    def is_busy(self) -> bool:
        return self._process.is_running()

    def _on_report(self, report: object) -> None:
        self.progress.hide()
        if isinstance(report, AlignmentReport):
            self._report = report
            self._paint()
            self.job_changed(self._bridge.shown.job)

    def _on_failed(self, error: object) -> None:
        self.progress.hide()
        self.failed.emit(error)

    def _paint(self) -> None:
        report = self._report
        acceptable = report is not None and report.can_be_accepted and not self._is_old
        self.keys["accept"].setEnabled(acceptable)
        if report is None:
            self.state.show_text("")
            self.words.setText("")
            self._spread.setText("")
            self.table.show_rows([])
            return
        self.show_message(tr("Results are in the {frame}.").format(frame=report.frame))
        if self._is_old:
            told = tr("Points have changed since: recalculate (F6)")
            self.state.show_text(told, mark=kit.Mark.DOUBT)
        elif not report.can_be_accepted:
            self.state.show_text(tr("No frame yet"), mark=kit.Mark.DOUBT)
        elif report.free:
            told = tr("Still free: {free}").format(free=", ".join(report.free))
            self.state.show_text(told, mark=kit.Mark.DOUBT)
        else:
            self.state.show_text(tr("Fully constrained"), mark=kit.Mark.GOOD)
        self.words.setText("\n".join(map(kit.said, report.advice)))
        self._spread.setText(_spread_words(report))
        self.table.show_rows([_row(item) for item in report.residuals])
        for row in range(self.table.rowCount()):
            self.table.show_digits(row, range(1, len(_COLUMNS)), 15)
            for column, font in ((0, kit.text_font(15)), (_OFF, kit.digit_font(15))):
                cell = self.table.item(row, column)
                if cell is not None:
                    cell.setFont(font)


def _points_of(job: JobView, names: set[str]) -> object:
    """Return job and point numbers of features; of all points if one is constructed.

    The inputs of a constructed feature are not available here.
    """
    all_of_them = not names <= {item.name for item in job.features}
    return job.job, tuple(
        point.number
        for item in job.features
        if all_of_them or item.name in names
        for point in item.points
    )


_OFF = 4


def _row(item: Residual) -> tuple[str, ...]:
    name = item.feature if item.aligned else f"({item.feature})"
    turned = kit.localised(f"{np.degrees(item.angle):.3f}") if item.angle else kit.DASHES
    return (
        name,
        *(kit.millimetres(float(value), signed=True) for value in item.offset),
        kit.millimetres(item.distance),
        kit.millimetres(item.distance_uncertainty),
        turned,
    )


def _spread_words(report: AlignmentReport) -> str:
    if report.origin_uncertainty is None or report.turn_uncertainty is None:
        return ""
    shifts = "  ".join(kit.length_number(float(value)) for value in report.origin_uncertainty)
    turns = "  ".join(
        kit.localised(f"{value:.4f}") for value in np.degrees(report.turn_uncertainty)
    )
    return tr(
        "U (k=2) of the origin, x y z: {shifts} {unit}. Of rotations about x y z: {turns}°."
    ).format(shifts=shifts, unit=kit.unit_word(), turns=turns)
