"""Bus page: wire, cameras, cycle counts and shares that add up, clocks and events."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QHideEvent, QPainter, QPaintEvent, QShowEvent
from PySide6.QtWidgets import QStackedWidget, QWidget

from ocmm_core import station
from ocmm_core.fieldbus.report import (
    BusPhase,
    BusReport,
    microseconds,
    pace_words,
    shares,
    trouble_words,
    unaccounted,
)
from ocmm_gui import kit
from ocmm_gui.charts import Curve, HistogramChart, RecentChart
from ocmm_gui.kit import later, tr
from ocmm_gui.maintain._wire_view import BusEventTable, CameraTable, WireView

_ROW_PX = 19.0
_BAR_PX = 12.0
_NAMES = (later("good"), later("late"), later("lost"), later("bad"))


class CycleAccounts(kit.PaintedWidget):
    """A bar of the four verdicts, a line per verdict, and their sum."""

    def __init__(self) -> None:
        high, least = (round(_BAR_PX + rows * _ROW_PX) for rows in (7.5, 6.6))
        super().__init__(tr("Bus cycles"), (240, high), (220, least))
        self._counts = (0, 0, 0, 0)
        self._elapsed = 0
        self._gap = 0

    def show_report(self, report: BusReport) -> None:
        self._counts = (report.good, report.late, report.lost, report.bad)
        self._elapsed, self._gap = report.elapsed, unaccounted(report)
        self.setAccessibleDescription("; ".join(" ".join(row) for row in self.rows()))
        self.update()

    def rows(self) -> tuple[tuple[str, str, str], ...]:
        """Return name, count and share of every line."""
        lines = [
            (tr(name), str(count), kit.localised(f"{share:.3f} %"))
            for name, count, share in zip(_NAMES, self._counts, shares(self._counts), strict=True)
        ]
        if self._gap:
            lines.append((tr("NO VERDICT"), str(self._gap), tr("wrong")))
        return (*lines, (tr("elapsed"), str(self._elapsed), "100.000 %" if self._elapsed else "–"))

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        theme = self._theme
        kit.ink(painter, QColor(theme.muted), font=kit.text_font(13))
        painter.drawText(QRectF(0.0, 0.0, self.width(), _ROW_PX), kit.LEFT, tr("Bus cycles"))
        colours = (theme.good, theme.warn, theme.accent, theme.bad)
        self._paint_bar(painter, colours)
        top = _ROW_PX + _BAR_PX + 5.0
        rows = self.rows()
        pitch = min(max((self.height() - top) / len(rows), 0.8 * _ROW_PX), 1.6 * _ROW_PX)
        for index, (name, count, share) in enumerate(rows):
            line = QRectF(0.0, top + index * pitch, self.width(), pitch)
            known = index < len(colours)
            if known:
                square = QRectF(0.0, line.center().y() - 5.0, 10.0, 10.0)
                painter.fillRect(square, QColor(colours[index]))
            # Cycles without verdict are shown between the verdicts and the sum.
            wrong = not known and index < len(rows) - 1
            painter.setPen(QColor(theme.bad if wrong else theme.text))
            painter.setFont(kit.text_font(13, bold=not known))
            painter.drawText(line.adjusted(16.0, 0.0, 0.0, 0.0), kit.LEFT, name)
            painter.setFont(kit.digit_font(13, bold=not known))
            painter.drawText(line.adjusted(0.0, 0.0, -84.0, 0.0), kit.RIGHT, count)
            painter.drawText(line, kit.RIGHT, share)

    def _paint_bar(self, painter: QPainter, colours: tuple[str, ...]) -> None:
        bar = QRectF(0.0, _ROW_PX + 1.0, self.width(), _BAR_PX)
        painter.fillRect(bar, QColor(self._theme.border))
        total = sum(self._counts)
        if not total:
            return
        # Visible even if rare: two pixels at least.
        widths = [max(bar.width() * count / total, 2.0) if count else 0.0 for count in self._counts]
        widths[widths.index(max(widths))] -= sum(widths) - bar.width()
        left = 0.0
        for width, colour in zip(widths, colours, strict=True):
            painter.fillRect(QRectF(left, bar.top(), width, bar.height()), QColor(colour))
            left += width


_MARKS = {BusPhase.OPERATION: kit.Mark.GOOD, BusPhase.FAILED: kit.Mark.BAD}
REFRESH_MS = 250
_OLD_S = 1.0
"""A live bus process reports every 50 ms."""

_FACTS = (
    (later("Frames"), later("frames taken from all cameras")),
    (later("Frames lost"), later("frames lost: sent by a camera, not received")),
    (later("Recoveries"), later("number of recoveries to operation")),
    (later("Stray answers"), later("late, duplicate or out-of-order answers, discarded")),
    (later("Objects done"), later("transfers of camera objects")),
    (later("Objects failed"), later("transfers of camera objects that failed")),
    (later("Cycle"), later("time from one exchange to the next")),
    (later("Exposure"), later("time from one exposure to the next")),
)


class BusPage(QStackedWidget):
    """The bus report, refreshed four times a second while visible."""

    def __init__(self, pull: Callable[[], station.BusView | None]) -> None:
        super().__init__()
        self.setAccessibleName(tr("Bus"))
        self._pull = pull
        self.phase = kit.FitText(tr("Phase of the bus"), limit=34, high=44)
        self._trouble = kit.sentence_label(tr("Bus fault"), 15)
        self.wire = WireView()
        self.cameras = CameraTable()
        self.accounts = CycleAccounts()
        self.lateness = HistogramChart(tr("Cycle starts late, µs"))
        self.round_trip = HistogramChart(tr("Round trip, µs"))
        self.clocks = (
            RecentChart(tr("Cycle to bus clock, µs"), 5.0, station.TREND_S, "+.1f"),
            RecentChart(tr("Drift, ppm"), 0.5, station.TREND_S, "+.2f"),
            RecentChart(tr("Clocks, ns"), 50.0, station.TREND_S, "+.0f"),
        )
        self.facts = {name: kit.value_label(tr(name), tr(tip)) for name, tip in _FACTS}
        self.events = BusEventTable()
        self.notes = kit.sentence_label(tr("Notes on the privileges of the bus process"), 13)
        self._absent = kit.sentence_label(tr("Why no data are shown"), 20)
        self._absent.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._absent.setMargin(40)
        self.addWidget(self._absent)
        self.addWidget(self._contents())
        self._timer = QTimer(self, interval=REFRESH_MS)
        self._timer.timeout.connect(self.refresh)

    def trouble(self) -> str:
        """Return the sentences next to the word; without a report, the reason."""
        shown = self._trouble if self.currentIndex() else self._absent
        return shown.text()

    def refresh(self) -> None:
        view = self._pull()
        if view is None or view.report is None:
            pair = (
                (station.NO_BUS, station.NO_BUS_REMEDY)
                if view is None
                else (station.NO_REPORT, station.NO_REPORT_REMEDY)
            )
            if view is not None and view.ended:
                pair = (view.ended, tr("Remove the cause, then open the job again."))
            self._absent.setText("\n\n".join(map(kit.said, pair)))
            self.setCurrentIndex(0)
            return
        self.setCurrentIndex(1)
        self._show_report(view, view.report)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.refresh()
        self._timer.start()

    def hideEvent(self, event: QHideEvent) -> None:
        self._timer.stop()
        super().hideEvent(event)

    def _show_report(self, view: station.BusView, report: BusReport) -> None:
        self._show_phase(view, report)
        self.wire.show_report(report)
        self.cameras.show_report(report)
        self.accounts.show_report(report)
        period_us = report.cycle_period_ns / 1e3
        self.lateness.show_histogram(report.lateness, period_us)
        self.round_trip.show_histogram(report.round_trip, period_us)
        self._show_clocks(view.trend, [camera.name for camera in report.cameras])
        for name, value in (
            ("Frames", str(sum(camera.frames for camera in report.cameras))),
            ("Frames lost", str(sum(camera.frames_lost for camera in report.cameras))),
            ("Recoveries", str(report.recoveries)),
            ("Stray answers", str(report.stray_answers)),
            ("Objects done", str(report.objects_done)),
            ("Objects failed", str(report.objects_failed)),
            ("Cycle", microseconds(report.cycle_period_ns / 1e3)),
            ("Exposure", microseconds(report.frame_period_ns / 1e3)),
        ):
            self.facts[name].setText(value)
        self.events.show_report(report)
        notes = []
        if report.pace is not None:
            waits = tr("The time of this virtual bus waits for this computer: no cycle is late.")
            notes.append(pace_words(report.pace) or waits)
        if report.notes:
            notes.append(tr("On this computer: {names}.").format(names="; ".join(report.notes)))
        if report.events_dropped:
            notes.append(
                tr(
                    "%n older events were dropped.",
                    "1 older event was dropped.",
                    report.events_dropped,
                )
            )
        self.notes.tell("  ".join(notes))

    def _show_phase(self, view: station.BusView, report: BusReport) -> None:
        what, remedy = trouble_words(report)
        word = kit.said_word(report.phase.value).upper()
        mark = _MARKS.get(report.phase, kit.Mark.DOUBT)
        if view.ended:
            word, mark = tr("ENDED"), kit.Mark.BAD
            what, remedy = view.ended, tr("These are the last values.")
        elif view.age_s > _OLD_S:
            word, mark = tr("NO REPORT"), kit.Mark.BAD
            what = tr("No report from the bus process for {age_s:.0f} s.").format(age_s=view.age_s)
            remedy = tr("These are its last values. If this persists, open the job again.")
        self.phase.show_text(word, mark=mark)
        text = f"{what} {remedy}".strip() or _in_order(report)
        if text != self._trouble.text():
            self._trouble.setText(text)

    def _show_clocks(self, trend: tuple[station.BusSample, ...], names: list[str]) -> None:
        times = [sample.time_s for sample in trend]
        phase, drift, offsets = self.clocks
        phase.show_curves(times, (Curve("", tuple(s.phase_ns / 1e3 for s in trend)),))
        drift.show_curves(times, (Curve("", tuple(s.drift_ppm for s in trend)),))
        offsets.show_curves(
            times,
            [Curve(name, tuple(s.offsets_ns[i] for s in trend)) for i, name in enumerate(names)],
        )

    def _contents(self) -> QWidget:
        contents = QWidget()
        layout = kit.vbox(parent=contents, spacing=8, margins=0)
        words = kit.vbox(self.phase, (self._trouble, 1))
        head = kit.hbox((kit.panel(words), 2), (kit.panel(kit.stacked(self.wire)), 3), spacing=8)
        kit.fill(layout, (head, 2), self.cameras)
        facts = kit.form_grid(self.facts.values(), pixels=13)
        facts.setHorizontalSpacing(8)
        facts.setVerticalSpacing(0)
        charts = kit.hbox(spacing=8)
        for part, stretch in (
            (kit.stacked(self.accounts), 5),
            (kit.stacked(self.lateness), 6),
            (kit.stacked(self.round_trip), 6),
            (kit.stacked(*self.clocks), 6),
            (facts, 4),
        ):
            charts.addWidget(kit.panel(part), stretch)
        kit.fill(layout, (charts, 6), (self.events, 6), self.notes)
        return contents


def _in_order(report: BusReport) -> str:
    counts = (report.good, report.late, report.lost, report.bad)
    minutes = report.elapsed * report.cycle_period_ns / 60e9
    lost = sum(camera.frames_lost for camera in report.cameras)
    good = shares(counts)[0]
    if not lost:
        return tr("{minutes:.1f} minutes, {good:.3f} % of the cycles good, no frames lost.").format(
            minutes=minutes, good=good
        )
    return tr(
        "{minutes:.1f} minutes, {good:.3f} % of the cycles good, %n frames lost.",
        "{minutes:.1f} minutes, {good:.3f} % of the cycles good, 1 frame lost.",
        lost,
    ).format(minutes=minutes, good=good)
