"""Feature panel, updated while points arrive, with a residual bar per point."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFont, QMouseEvent, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QLayout, QSizePolicy

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import FeatureView, JobView
from ocmm_core.tolerances.decisions import U_LABEL, CharacteristicResult, Verdict
from ocmm_core.tolerances.kinds import spec_of
from ocmm_gui import kit
from ocmm_gui.charts import ToleranceBar
from ocmm_gui.kit import later, tr
from ocmm_gui.operator._feature_details import CharacteristicList, CoverageView, PointDots

_LINE_PX = 22.0
_TALLEST_PX = 90.0
_WIDEST_PX = 40.0


class ResidualChart(kit.PaintedWidget):
    """Distances of points from the fitted feature; outliers red, selection framed."""

    point_chosen = Signal(int)
    """Emits the number of the clicked point."""

    def __init__(self) -> None:
        super().__init__(
            tr("Residuals of the points from the fitted feature"), (160, 120), (160, 0)
        )
        self._residuals: Float = np.empty(0)
        self._numbers: tuple[int, ...] = ()
        self._flagged: frozenset[int] = frozenset()
        self._chosen = 0

    def show_feature(self, feature: FeatureView, chosen: int) -> None:
        """Show the residuals of a feature; without a fit the chart is empty."""
        fit = feature.fit
        self._residuals = np.empty(0) if fit is None else fit.residuals
        self._numbers = tuple(point.number for point in feature.points)
        self._flagged, self._chosen = frozenset(feature.outliers), chosen
        self.setAccessibleDescription(
            " ".join(
                f"{number}: {kit.millimetres(float(r), signed=True)}"
                for number, r in zip(self._numbers, self._residuals, strict=False)
            )
        )
        self.update()

    def place_of(self, number: int) -> QPointF:
        """Return the middle of the bar of a point; for tests."""
        pitch = self._pitch()
        return QPointF((self._numbers.index(number) + 0.5) * pitch, 0.5 * self.height())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Select the point of the clicked bar."""
        index = int(event.position().x() / self._pitch()) if len(self._residuals) else -1
        if 0 <= index < min(len(self._residuals), len(self._numbers)):
            self.point_chosen.emit(self._numbers[index])

    def paintEvent(self, event: QPaintEvent) -> None:
        top = _LINE_PX
        count = len(self._residuals)
        if not count or self.height() < 3 * top:
            return
        painter = self._painter()
        reach = max(float(np.abs(self._residuals).max()), 0.005)
        kit.ink(painter, QColor(self._theme.muted), font=kit.text_font(13))
        line = QRectF(0, 0, self.width(), top)
        painter.drawText(line, kit.LEFT, tr("Points from the fit"))
        painter.drawText(line, kit.RIGHT, f"±{kit.length_words(reach)}")
        high = min(0.5 * (self.height() - 2.0 * top), _TALLEST_PX)
        zero = top + high
        pitch = self._pitch()
        for index, residual in enumerate(self._residuals.tolist()):
            tall = high * residual / reach
            bar = QRectF(index * pitch + 0.2 * pitch, zero, 0.6 * pitch, -tall).normalized()
            self._paint_bar(painter, bar, index)
        painter.setPen(QPen(QColor(self._theme.text), 1))
        painter.drawLine(QPointF(0, zero), QPointF(count * pitch, zero))
        kit.ink(painter, QColor(self._theme.muted), font=kit.digit_font(11, bold=False))
        every = 1 if pitch >= 20.0 else 5
        for index in range(0, count, every):
            box = QRectF(index * pitch, zero + high + 2.0, pitch * every, 14.0)
            painter.drawText(box, Qt.AlignmentFlag.AlignLeft, f" {index + 1}")

    def _paint_bar(self, painter: QPainter, bar: QRectF, index: int) -> None:
        number = self._numbers[index] if index < len(self._numbers) else 0
        outlier = number in self._flagged
        painter.fillRect(bar, QColor(self._theme.bad if outlier else self._theme.accent))
        if number == self._chosen:
            kit.ink(painter, QPen(QColor(self._theme.text), 2.0), Qt.BrushStyle.NoBrush)
            painter.drawRect(bar.adjusted(-3, -3, 3, 3))

    def _pitch(self) -> float:
        return min(self.width() / max(len(self._residuals), 1), _WIDEST_PX)


_ROWS = (
    later("Measured"),
    later("Nominal"),
    later("Deviation"),
    U_LABEL,
    later("Form"),
    later("Position"),
)
_LARGE = ("Measured", "Deviation")
_ROOMY_PX = 480
"""Lower panels show no explanations."""
_TIGHT_PX = 420
"""Lower panels show no large digits."""
_PICTURE_PX, _SMALL_PX = 104, 84
_MAX_OTHERS = 6


class FeaturePanel(kit.Themed, QFrame):
    """Results of a feature: points, value, deviation, U, form, bar and verdict.

    Numbers are provisional until the feature is complete. A click on a bar selects a point.
    """

    point_chosen = Signal(int)
    """Emits the number of the clicked point."""

    def __init__(self) -> None:
        super().__init__()
        self._fitting, self._least_px = False, 0
        self._chosen = 0
        self.setProperty("role", "panel")
        self.setAccessibleName(tr("Feature"))
        self._job: JobView | None = None
        self.title = kit.FitText(tr("Feature name"), limit=26, high=36)
        self._dots = PointDots()
        self.coverage = CoverageView()
        self.coverage.setFixedSize(_PICTURE_PX, _PICTURE_PX)
        self._subject = _label(tr("Characteristic"), kit.text_font(13), muted=True)
        self._basis = _label(tr("Association and frame"), kit.text_font(12), muted=True)
        self.outliers = _label(tr("Outliers"), kit.text_font(13))
        self.outliers.setWordWrap(True)
        self.outliers.hide()
        self._bar = ToleranceBar()
        self._bar.setFixedHeight(60)
        self.verdict = kit.FitText(
            tr("Verdict"), limit=30, reserve=tr("1 of 3 NOT MEASURED"), high=42
        )
        self._note = _label(tr("Note"), kit.text_font(13), muted=True)
        self._note.setWordWrap(True)
        self._note.hide()
        self._values: dict[str, QLabel] = {}
        self._captions: dict[str, QLabel] = {}
        grid = QGridLayout()
        grid.setVerticalSpacing(2)
        grid.setColumnStretch(1, 1)
        for row, name in enumerate(_ROWS):
            value = _label(tr(name), kit.digit_font(16))
            value.setAlignment(kit.RIGHT)
            caption = _label("", kit.text_font(14), text=tr(name), muted=True)
            caption.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)
            grid.addWidget(caption, row, 0)
            grid.addWidget(value, row, 1)
            self._values[name] = value
            self._captions[name] = caption
        self._others = CharacteristicList()
        self.residuals = ResidualChart()
        layout = kit.vbox(parent=self, spacing=6, margins=(14, 8, 14, 8))
        # The panel adapts to its height; a layout that sets minimums would grow over the readout.
        layout.setSizeConstraint(QLayout.SizeConstraint.SetNoConstraint)
        self._column = layout
        self._named = kit.vbox(self.title, self._dots, self._subject, self._basis)
        kit.fill(
            layout, kit.hbox((self._named, 1), self.coverage), grid, self._bar, self.verdict,
            self._note, self.outliers, self._others, (self.residuals, 1),
        )  # fmt: skip
        self.residuals.point_chosen.connect(self.point_chosen)
        self.coverage.point_chosen.connect(self.point_chosen)
        self._fit()

    def show_job(self, job: JobView) -> None:
        """Show the active feature, or the last one when all are done."""
        self._job = job
        feature = job.shown
        if feature is None:
            return
        summary, result = job.verdict_of(feature.name), job.deciding(feature.name)
        self.title.show_text(kit.feature_title(feature))
        self._dots.show_points(feature)
        self._show_values(feature, result)
        self._bar.show_result(result)
        self._bar.setVisible(result is not None)
        self.verdict.show_verdict(kit.verdict_line(summary), summary.verdict)
        self.coverage.show_feature(feature, self._chosen)
        flagged = bool(feature.outliers)
        self.outliers.setText(kit.outlier_words(feature, self._chosen))
        self.outliers.setStyleSheet(f"color: {self._theme.bad if flagged else self._theme.text};")
        self.outliers.setVisible(bool(self.outliers.text()))
        note = kit.said(feature.note or (result.note if result is not None else ""))
        self._note.setText(note)
        # The note explains a number; without a number it is the reason and must be visible.
        explains = result is not None and result.measured is not None and not feature.note
        self._note.setVisible(bool(note) and (not explains or self.height() >= _ROOMY_PX))
        others = [item for item in kit.characteristics_of(job, feature.name) if item is not result]
        self._others.show_results(tuple(others[:_MAX_OTHERS]))
        self.residuals.show_feature(feature, self._chosen)
        self._fit()

    def choose(self, number: int) -> None:
        self._chosen = number
        if self._job is not None:
            self.show_job(self._job)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show as much as fits, never cut in half."""
        super().resizeEvent(event)
        self._fit()

    def minimumSizeHint(self) -> QSize:
        """Return the size of the least form, whatever is shown at the present height."""
        return QSize(super().minimumSizeHint().width(), self._least_px)

    def hasHeightForWidth(self) -> bool:
        """Return False: otherwise layouts ask for the height of what is shown at present."""
        return False

    def value(self, name: str) -> str:
        """Return the text next to a caption."""
        return self._values[name].text()

    def _paint(self) -> None:
        if self._job is not None:
            self.show_job(self._job)

    def _fit(self) -> None:
        # Hiding widgets can resize this panel.
        if not self._fitting:
            self._fitting = True
            try:
                self._fit_once()
            finally:
                self._fitting = False

    def _fit_once(self) -> None:
        # Least important first: the results sheet shows them as well.
        given_up = (self._row("Position"), (self._basis,), self._row("Nominal"))
        self._use_type(tight=True)
        for labels in given_up:
            for label in labels:
                label.hide()
        if self._needed() != self._least_px:
            self._least_px = self._needed()
            self.updateGeometry()
        self._use_type(tight=self.height() < _TIGHT_PX)
        if self._needed() > self.height():
            self._use_type(tight=True)
        for labels in reversed(given_up):
            for label in labels:
                label.show()
            if self._needed() > self.height():
                for label in labels:
                    label.hide()
                break

    def _use_type(self, *, tight: bool) -> None:
        for name, value in self._values.items():
            large = name in _LARGE
            pixels = (18 if tight else 26) if large else (13 if tight else 16)
            value.setFont(kit.digit_font(pixels, bold=large))
            self._captions[name].setFont(kit.text_font(13 if tight else 14))
        for widget, usual, least in (
            (self.title, 36, 26), (self._dots, 30, 22), (self._bar, 60, 44),
            (self.verdict, 42, 32),
        ):  # fmt: skip
            widget.setFixedHeight(least if tight else usual)
        side = _SMALL_PX if tight else _PICTURE_PX
        self.coverage.setFixedSize(side, side)
        self._column.setSpacing(2 if tight else 6)
        self._named.setSpacing(1 if tight else 4)

    def _needed(self) -> int:
        # Without a wrapping label the layout has no height for width, and returns -1.
        if self._column.hasHeightForWidth():
            return self._column.totalHeightForWidth(self.width())
        return self._column.totalSizeHint().height()

    def _row(self, name: str) -> tuple[QLabel, ...]:
        return (self._values[name], self._captions[name])

    def _show_values(self, feature: FeatureView, result: CharacteristicResult | None) -> None:
        fit = feature.fit
        size = ""
        if result is not None:
            self._subject.setText(f"{result.name}: {kit.said_word(str(result.kind))}")
            self._subject.setToolTip(kit.literal(f"{result.name}: {subject(result)}"))
            size = kit.quantity(result, result.measured)
        else:
            self._subject.setText(tr("No tolerance on this feature."))
            if fit is not None and fit.radius > 0.0:
                size = kit.millimetres(2.0 * fit.radius)
        self._basis.setText(kit.basis_words(feature, result))
        so_far = result is not None and result.verdict is Verdict.PROVISIONAL
        for value in self._values.values():
            value.setStyleSheet(f"color: {self._theme.muted};" if so_far else "")
        texts = {
            "Measured": size or kit.millimetres(None),
            "Nominal": kit.DASHES if result is None else kit.quantity(result, result.nominal),
            "Deviation": kit.DASHES
            if result is None
            else kit.quantity(result, result.deviation, signed=True),
            U_LABEL: kit.DASHES if result is None else kit.quantity(result, result.uncertainty),
            "Form": kit.form_words(feature),
            "Position": kit.millimetres(None)
            if fit is None
            else "  ".join(kit.millimetres(float(value), signed=True) for value in fit.point),
        }
        for name, text in texts.items():
            self._values[name].setText(text)


def subject(result: CharacteristicResult) -> str:
    return f"{kit.said_word(spec_of(result.kind).label)} {' – '.join(result.features)}"


def _label(name: str, font: QFont, *, text: str = "", muted: bool = False) -> QLabel:
    role = "muted" if muted else ""
    label = kit.dressed(kit.PlainLabel(text), name or text, font=font, role=role)
    label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
    return label
