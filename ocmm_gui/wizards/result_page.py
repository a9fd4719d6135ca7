"""The result of a calibration: what it leaves over, and how it differs from the one in force."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QButtonGroup,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from ocmm_core.calibration.outcome import CalibrationOutcome, CameraChange, Comparison
from ocmm_core.calibration.procedure import ProcedureView
from ocmm_core.calibration.procedure_views import KnownPointsView, RelocationView
from ocmm_core.camera.model import N_PARAMETERS, PARAMETERS
from ocmm_core.camera.rig import Rig
from ocmm_gui.maintain.parts import Table, panel, sentence_label
from ocmm_gui.operator.fit_text import FitText
from ocmm_gui.operator.marks import Mark
from ocmm_gui.theme import DEFAULT_THEME, THEMES, Theme, digit_font, text_font
from ocmm_gui.wizards.driver import Seen
from ocmm_gui.wizards.facts import Facts
from ocmm_gui.wizards.pages import StepPage
from ocmm_gui.wizards.residual_plots import AllSensors, Histogram
from ocmm_gui.wizards.space_plot import SpaceArrows

_SIDE_PX = 360
_CHANGES = (
    ("Camera", "which camera"),
    ("Shift mm", "distance of its centres, after the common motion was taken out"),
    ("Turn mrad", "angle between its attitudes, after the common motion was taken out"),
    ("f mm", "focal length, after less before"),
    ("u0 px", "principal point, after less before"),
    ("v0 px", "principal point, after less before"),
)


class ChangeTable(Table):
    """How each camera differs from the calibration in force."""

    def __init__(self) -> None:
        super().__init__("Changes of the cameras", _CHANGES)
        self.setFont(digit_font(15, bold=False))
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)

    def set_theme(self, theme: Theme) -> None:
        """Write in the colours of ``theme`` from now on."""
        self._colours = theme
        for row in range(self.rowCount()):
            for column, word in enumerate(self.words(row)):
                self._write(row, column, word)

    def show_changes(self, changes: Sequence[CameraChange]) -> None:
        """Show one row for each camera, and be as high as they are."""
        self.setRowCount(len(changes))
        for row, one in enumerate(changes):
            words = (
                one.name,
                f"{one.shift_mm:.4f}",
                f"{1e3 * one.turn_rad:.4f}",
                f"{one.focal_mm:+.5f}",
                f"{one.u0_px:+.3f}",
                f"{one.v0_px:+.3f}",
            )
            for column, word in enumerate(words):
                self._write(row, column, word)
        self.resizeColumnsToContents()
        self.horizontalHeader().setStretchLastSection(True)
        head = self.horizontalHeader().sizeHint().height()
        self.setFixedHeight(head + self.rowHeight(0) * len(changes) + 6)


class CompareView(QWidget):
    """The new calibration beside the one in force.

    Parameters
    ----------
    rig
        Says what is in front and what is above.
    """

    def __init__(self, rig: Rig) -> None:
        super().__init__()
        self.setAccessibleName("Before and after")
        self.summary = sentence_label("What changes", 16)
        self.cameras = ChangeTable()
        self.space = SpaceArrows("Points of the volume, after less before", rig)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self.summary)
        layout.addWidget(self.cameras)
        layout.addWidget(self.space, 1)

    def show_comparison(self, comparison: Comparison | None) -> None:
        """Show what changes; None where there is nothing to compare with."""
        self.cameras.setVisible(comparison is not None)
        self.space.setVisible(comparison is not None)
        if comparison is None:
            self.summary.setText("These cameras were never calibrated: nothing to compare with.")
            return
        before, after = comparison.length_sigma_before_mm, comparison.length_sigma_after_mm
        self.summary.setText(
            f"All cameras together moved by {comparison.moved_mm:.3f} mm and turned by "
            f"{1e3 * comparison.turned_rad:.3f} mrad; below is what is left of each camera. "
            f"Standard uncertainty of a length: {_um(before)} before, {_um(after)} after."
        )
        self.cameras.show_changes(comparison.cameras)
        self.space.show_vectors(comparison.nodes_world, comparison.differences_world, "no points")


class ResultPage(StepPage):
    """Plots on the left, chosen with the keys 1 to 4; the verdict in words on the right.

    Parameters
    ----------
    rig
        What the session started from.
    errors
        What the errors in space are.
    """

    keys = ("back", "calculate", "keep", "accept", "plot1", "plot2", "plot3", "plot4")
    plots = ("Sensors", "Histogram", "Space", "Before/after")

    def __init__(self, rig: Rig, errors: str) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self._outcome: CalibrationOutcome | None = None
        self._base: ProcedureView | None = None
        self._seen: Seen | None = None
        self.sensors = AllSensors(rig)
        self.histogram = Histogram()
        self.space = SpaceArrows(errors, rig)
        self.compare = CompareView(rig)
        self._stack = QStackedWidget()
        self._buttons = QButtonGroup(self)
        tabs = QHBoxLayout()
        tabs.setSpacing(6)
        views: tuple[QWidget, ...] = (self.sensors, self.histogram, self.space, self.compare)
        for number, (title, view) in enumerate(zip(self.plots, views, strict=True), start=1):
            button = QPushButton(f"{title}  [{number}]")
            button.setAccessibleName(title)
            button.setFont(text_font(14, bold=True))
            button.setProperty("role", "tool")
            button.setMinimumHeight(40)
            button.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
            button.setCheckable(True)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            self._buttons.addButton(button, number - 1)
            tabs.addWidget(button, 1)
            self._stack.addWidget(view)
        self._buttons.idClicked.connect(self.show_plot)
        self._word = FitText("Result", limit=30)
        self._word.setFixedHeight(42)
        self.sentence = sentence_label("What the calculation says", 18)
        self.facts = Facts("Figures of the result")
        self.warnings = sentence_label("What speaks against it", 16)
        left = QVBoxLayout()
        left.setSpacing(8)
        left.addLayout(tabs)
        left.addWidget(self._stack, 1)
        self._plots = panel(left)
        right = QVBoxLayout()
        right.setSpacing(12)
        right.addWidget(self._word)
        right.addWidget(self.sentence)
        right.addWidget(self.facts)
        right.addWidget(self.warnings)
        right.addStretch(1)
        side = panel(right)
        side.setFixedWidth(_SIDE_PX)
        self._waiting = QLabel("")
        self._waiting.setAccessibleName("No plots yet")
        self._waiting.setProperty("role", "muted")
        self._waiting.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._waiting.setFont(text_font(20))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self._plots, 1)
        layout.addWidget(self._waiting, 1)
        layout.addWidget(side)
        self.show_plot(0)
        self._show_outcome(None)

    def show_plot(self, number: int) -> None:
        """Show one of the plots."""
        self._stack.setCurrentIndex(number)
        button = self._buttons.button(number)
        if button is not None:
            button.setChecked(True)

    def plot(self) -> str:
        """Return which plot is shown."""
        return self.plots[self._stack.currentIndex()]

    def word(self) -> str:
        """Return the large word."""
        return self._word.text()

    def show_seen(self, seen: Seen) -> None:
        """Show the result, or how far it is."""
        view = seen.view
        if not isinstance(view, KnownPointsView | RelocationView):
            return
        self._seen = seen
        if view.outcome is not self._outcome:
            self._show_outcome(view.outcome)
        self._show_word()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._show_word()

    def _show_word(self) -> None:
        theme, seen = self._theme, self._seen
        if seen is None:
            return
        error = seen.view.base.error
        if seen.calculating_s is not None:
            word = f"CALCULATING  {seen.calculating_s:.0f} s"
            self._word.show_text(word, theme.accent, Mark.ACTIVE)
            text = "The window and the session stay as they are; C gives the calculation up."
        elif error is not None:
            self._word.show_text("NO RESULT", theme.bad, Mark.BAD)
            text = f"{error.what} {error.remedy}"
        elif self._outcome is None:
            self._word.show_text("NOT CALCULATED", theme.muted, Mark.OPEN)
            text = "Press R to calculate."
        elif self._outcome.warnings:
            self._word.show_text("USABLE, LOOK", theme.warn, Mark.DOUBT)
            text = "The calibration may be used, but something speaks against it; see below."
        else:
            self._word.show_text("GOOD", theme.good, Mark.GOOD)
            text = "Nothing speaks against this calibration. After accepting, verify it."
        if text != self.sentence.text():
            self.sentence.setText(text)
        waiting = "Calculating …" if seen.calculating_s is not None else "No result to show"
        self._waiting.setText(waiting)

    def _show_outcome(self, outcome: CalibrationOutcome | None) -> None:
        self._outcome = outcome
        self._plots.setVisible(outcome is not None)
        self._waiting.setVisible(outcome is None)
        if outcome is None:
            self.facts.show_facts(())
            self.warnings.setText("")
            return
        record, comparison = outcome.record, outcome.comparison
        self.sensors.show_residuals(outcome.residuals)
        self.histogram.show_residuals(outcome.residuals)
        self.space.show_vectors(
            outcome.errors_at_world, outcome.errors_world, "no points were held back"
        )
        self.compare.show_comparison(comparison)
        focal = PARAMETERS.index("focal")
        variance = np.diag(outcome.rig.parameter_covariance)[focal::N_PARAMETERS]
        left_out = ", ".join(record.outliers[:4]) + (" …" if len(record.outliers) > 4 else "")
        facts = [
            ("Residuals", f"{record.rms_px:.4f} px RMS"),
            ("chi² / dof", f"{record.chi2_per_dof:.3f}"),
            ("Used", f"{record.points} positions"),
            ("Left out", f"{len(record.outliers)}  {left_out}" if record.outliers else "none"),
            ("Focal length", f"± {1e3 * float(np.sqrt(variance.max())):.2f} µm (k = 1)"),
        ]
        if len(outcome.errors_world):
            rms = 1e3 * np.sqrt(np.mean(outcome.errors_world**2, axis=0))
            facts.append(("Errors RMS", "X {:.1f}, Y {:.1f}, Z {:.1f} µm".format(*rms)))
        if comparison is not None:
            before, after = comparison.length_sigma_before_mm, comparison.length_sigma_after_mm
            facts.append(("Length", f"{_um(before)} before, {_um(after)} after (k = 1)"))
        self.facts.show_facts(facts)
        said = "\n".join(f"▲ {one.what} {one.remedy}" for one in outcome.warnings)
        self.warnings.setText(said)


def _um(value_mm: float) -> str:
    return f"{1e3 * value_mm:.1f} µm"
