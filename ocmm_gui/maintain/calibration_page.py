"""The calibration page: may it be trusted, what is it, and how did it come to be."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from ocmm_core.calibration.in_use import CalibrationView, Word
from ocmm_core.calibration.overview import CalibrationOverview
from ocmm_core.calibration.records import CameraRecord, VerificationRecord
from ocmm_core.camera.rig import Rig
from ocmm_gui.maintain.calibration_table import HistoryTable, local_time
from ocmm_gui.maintain.history_charts import HistoryChart
from ocmm_gui.maintain.parts import panel, sentence_label, stacked, value_label
from ocmm_gui.operator.fit_text import FitText
from ocmm_gui.operator.marks import Mark
from ocmm_gui.theme import DEFAULT_THEME, THEMES, Theme, text_font

REFRESH_MS = 500

DESIGN = "The cameras are virtual: they are taken to be as the rig document says."
_IN_ORDER = "Calibrated, verified, and in date. Points may be taken."
_NO_HISTORY = "No calibration of this rig is kept on this computer."
_FACTS = (
    ("Rig", "name in the rig document"),
    ("Cameras", "with their serial numbers"),
    ("Method", "how they were calibrated"),
    ("Calibrated", "when, and by whom"),
    ("Valid until", "after that day no points are taken"),
    ("Positions", "reference positions or poses that were used; those left out as wrong"),
    ("Residuals", "root mean square of the residuals, and chi-square for each degree of freedom"),
    ("Volume", "in which points are accepted, mm"),
    ("Warmth", "of the surroundings and of the sensors while it was made"),
    ("Artefacts", "what its lengths and positions rest on, with serial numbers"),
    ("Verified", "when, and the error that came nearest to its limit"),
    ("Hash", "of the record or of the rig document; it stands in the jobs and reports"),
)


class CalibrationPage(QWidget):
    """Standing, facts, trends and history of the calibration, refreshed while it is seen.

    Parameters
    ----------
    rig
        What is measured with.
    pull
        Returns what is to be said about the calibration now.
    pull_overview
        Returns what the store holds; asked for when the page is opened and when the standing
        changed, for it reads many files.
    """

    def __init__(
        self,
        rig: Rig,
        pull: Callable[[], CalibrationView],
        pull_overview: Callable[[], CalibrationOverview],
    ) -> None:
        super().__init__()
        self.setAccessibleName("Calibration")
        self._rig = rig
        self._pull = pull
        self._pull_overview = pull_overview
        self._theme = THEMES[DEFAULT_THEME]
        self._view: CalibrationView | None = None
        self._word = FitText("Standing of the calibration", limit=34)
        self._word.setFixedHeight(44)
        self._sentence = sentence_label("What the standing means", 15)
        self._notes = sentence_label("What to watch", 14)
        self.facts = {name: value_label(name, tip) for name, tip in _FACTS}
        self.focal = HistoryChart("Focal length, Δ µm", factor=1e3, reach=2.0)
        self.principal = (
            HistoryChart("Principal point, Δu px", reach=0.2, form="+.2f"),
            HistoryChart("Principal point, Δv px", reach=0.2, form="+.2f"),
        )
        self.baseline = HistoryChart("Camera distance, Δ µm", factor=1e3, reach=5.0)
        self.error = HistoryChart(
            "Verified error, % of limit",
            factor=100.0,
            reach=100.0,
            changes=False,
            limit=100.0,
            form="+.0f",
        )
        self.history = HistoryTable()
        self._charts = QWidget()
        self._empty = sentence_label("Why there is no history", 20)
        self._empty.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._empty.setMargin(30)
        self._lay_out()
        self._timer = QTimer(self)
        self._timer.setInterval(REFRESH_MS)
        self._timer.timeout.connect(self.refresh)

    def word(self) -> str:
        """Return the large word."""
        return self._word.text()

    def sentence(self) -> str:
        """Return what stands below the word."""
        return self._sentence.text()

    def notes(self) -> str:
        """Return what to watch."""
        return self._notes.text()

    def fault(self) -> str:
        """Return why history or trends cannot be shown; empty where they are."""
        return self._empty.text()

    def refresh(self) -> None:
        """Show what is known now."""
        view = self._pull()
        if view != self._view:
            self._view = view
            self._show_overview(view, self._pull_overview())
            self._show_standing(view)

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        if self._view is not None:
            self._show_standing(self._view)

    def showEvent(self, event: QShowEvent) -> None:
        """Begin to refresh, with all files read anew."""
        super().showEvent(event)
        self._view = None
        self.refresh()
        self._timer.start()

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop refreshing."""
        self._timer.stop()
        super().hideEvent(event)

    def _show_standing(self, view: CalibrationView) -> None:
        theme = self._theme
        colour, mark = theme.bad, Mark.BAD
        if view.word is Word.VALID:
            colour, mark = theme.good, Mark.GOOD
        elif view.word is Word.DESIGN:
            colour, mark = theme.text, Mark.DONE
        elif view.word in (Word.DUE, Word.SUSPECT):
            colour, mark = theme.warn, Mark.DOUBT
        if view.uncalibrated:
            colour, mark = theme.bad, Mark.BAD
        self._word.show_text(standing_word(view), colour, mark)
        self._sentence.setText(standing_sentence(view))
        notes = list(view.warnings)
        if view.since_utc:
            notes.append(f"Points since {local_time(view.since_utc)} are in doubt.")
        self._notes.setText("  ".join(notes))
        self._notes.setVisible(bool(notes))

    def _show_overview(self, view: CalibrationView, found: CalibrationOverview) -> None:
        words = _facts(self._rig, view, found.verification)
        for name, label in self.facts.items():
            label.setText(words[name])
            label.setToolTip(words[name])
        self.focal.show_courses(found.trends.focal)
        for chart, courses in zip(
            self.principal, (found.trends.principal_u, found.trends.principal_v), strict=True
        ):
            chart.show_courses(courses)
        self.baseline.show_courses(found.trends.baseline)
        self.error.show_courses((found.trends.error,))
        self.history.show_events(found.events)
        self._empty.setText(found.fault or ("" if found.events else _NO_HISTORY))
        self._empty.setVisible(bool(found.fault) or not found.events)
        self._charts.setVisible(bool(found.trends.focal))
        self.history.setVisible(bool(found.events))

    def _lay_out(self) -> None:
        words = QVBoxLayout()
        words.addWidget(self._word)
        words.addWidget(self._sentence, 1)
        words.addWidget(self._notes)
        head = QHBoxLayout()
        head.setSpacing(8)
        head.addWidget(panel(words), 2)
        head.addWidget(panel(self._fact_grid()), 3)
        charts = QHBoxLayout(self._charts)
        charts.setContentsMargins(0, 0, 0, 0)
        charts.setSpacing(8)
        for part in (
            stacked(self.focal),
            stacked(*self.principal),
            stacked(self.baseline),
            stacked(self.error),
        ):
            charts.addWidget(panel(part), 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addLayout(head)
        layout.addWidget(self._charts, 5)
        layout.addWidget(self._empty, 2)
        layout.addWidget(self.history, 4)

    def _fact_grid(self) -> QGridLayout:
        grid = QGridLayout()
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(1)
        half = (len(self.facts) + 1) // 2
        for index, (name, label) in enumerate(self.facts.items()):
            caption = QLabel(name)
            caption.setProperty("role", "muted")
            caption.setFont(text_font(13))
            row, column = index % half, 2 * (index // half)
            grid.addWidget(caption, row, column)
            grid.addWidget(label, row, column + 1)
        for column in (1, 3):
            grid.setColumnStretch(column, 1)
        return grid


def standing_word(view: CalibrationView) -> str:
    """Return the large word."""
    return "UNCALIBRATED" if view.uncalibrated else view.word.value


def standing_sentence(view: CalibrationView) -> str:
    """Return what the standing means for who measures."""
    if view.uncalibrated:
        why = f" {view.obstacle}" if view.obstacle is not None else ""
        return f"Points are taken, and prove nothing: every verdict is NOT PROVEN.{why}"
    if view.obstacle is not None:
        return f"No points are taken. {view.obstacle}"
    return DESIGN if view.word is Word.DESIGN else _IN_ORDER


def _facts(
    rig: Rig, view: CalibrationView, verification: VerificationRecord | None
) -> dict[str, str]:
    words = dict.fromkeys((name for name, _ in _FACTS), "–")
    low, high = (" ".join(f"{value:.0f}" for value in corner) for corner in rig.volume_world)
    words |= {
        "Rig": rig.name,
        "Cameras": ", ".join(f"{camera.name} {camera.serial}" for camera in rig.cameras),
        "Volume": f"{low} to {high}",
        "Hash": view.identity[:12],
        "Method": "none, the rig document",
    }
    if view.record is not None:
        words |= _record_facts(view.record)
    if verification is not None:
        worst = max(verification.checks, key=lambda check: abs(check.error_mm) / check.limit_mm)
        words["Verified"] = (
            f"{local_time(verification.made_utc)}, {1e3 * worst.error_mm:+.1f} of "
            f"±{1e3 * worst.limit_mm:.1f} µm"
        )
    return words


def _record_facts(record: CameraRecord) -> dict[str, str]:
    left_out = f", {len(record.outliers)} left out" if record.outliers else ""
    around = "?" if record.temperature_c is None else f"{record.temperature_c:.1f}"
    sensors = "/".join(f"{value:.1f}" for value in record.sensor_temperatures_c) or "?"
    return {
        "Method": record.method,
        "Calibrated": f"{local_time(record.made_utc)}, {record.made_by}",
        "Valid until": local_time(record.valid_until_utc),
        "Positions": f"{record.points}{left_out}",
        "Residuals": f"{record.rms_px:.4f} px, chi² {record.chi2_per_dof:.2f}",
        "Warmth": f"{around} °C, sensors {sensors} °C",
        "Artefacts": ", ".join(f"{used.name} {used.serial}" for used in record.artefacts) or "none",
    }
