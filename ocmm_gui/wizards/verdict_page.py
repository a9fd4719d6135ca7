"""The verdict of a verification: every error against its limit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Protocol

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QFrame, QHBoxLayout, QScrollArea, QVBoxLayout, QWidget

from ocmm_core.calibration.outcome import VerificationOutcome
from ocmm_core.calibration.procedure_views import VerificationView
from ocmm_core.calibration.records import Check, VerificationRecord
from ocmm_gui.maintain.parts import panel, sentence_label
from ocmm_gui.operator.fit_text import FitText
from ocmm_gui.operator.marks import Mark
from ocmm_gui.theme import DEFAULT_THEME, THEMES, Theme, digit_font, text_font
from ocmm_gui.wizards.facts import Facts
from ocmm_gui.wizards.pages import StepPage
from ocmm_gui.wizards.plot import Plot
from ocmm_gui.wizards.shown import Seen

_SIDE_PX = 380
_SCALE_PX = 58.0
_BACK_TO_LINES = 3


class ErrorChart(Plot):
    """Errors with their uncertainty between the limits, check by check.

    Parameters
    ----------
    whole_names
        Names of checks are wrapped instead of being cut.
    """

    def __init__(self, *, whole_names: bool = False) -> None:
        super().__init__("Errors, µm")
        self._whole_names = whole_names
        self._foot = 62.0 if whole_names else 24.0
        self._checks: tuple[Check, ...] = ()
        self._largest = 0

    def show_checks(self, checks: Sequence[Check], largest: int) -> None:
        """Show all checks; the one that is nearest to its limit is named."""
        self._checks, self._largest = tuple(checks), largest
        worst = checks[largest]
        self._say(
            f"largest: {1e3 * worst.error_mm:+.1f} µm ± {1e3 * worst.expanded_mm:.1f}, "
            f"limit {1e3 * worst.limit_mm:.1f} ({worst.name})"
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint limits as a band, and every error as a dot with its uncertainty."""
        painter = self._painter()
        box = self._paint_head(painter).adjusted(_SCALE_PX, 4.0, -4.0, -self._foot)
        theme, checks = self._theme, self._checks
        if not checks:
            return
        reach = 1.1 * max(
            max(abs(one.error_mm) + one.expanded_mm, one.limit_mm) for one in checks
        )
        pitch = box.width() / len(checks)

        def y(value: float) -> float:
            return box.center().y() - 0.5 * box.height() * value / reach

        painter.setPen(QPen(QColor(theme.border), max(theme.border_px, 1)))
        painter.setBrush(QColor(theme.background))
        painter.drawRect(box)
        for index, one in enumerate(checks):
            band = QRectF(
                box.left() + index * pitch, y(one.limit_mm), pitch,
                y(-one.limit_mm) - y(one.limit_mm),
            )  # fmt: skip
            painter.fillRect(band, QColor(theme.zone_good))
            painter.setPen(QPen(QColor(theme.text), 1.5))
            painter.drawLine(band.topLeft(), band.topRight())
            painter.drawLine(band.bottomLeft(), band.bottomRight())
        painter.setPen(QPen(QColor(theme.text), 1.0, Qt.PenStyle.DotLine))
        painter.drawLine(QPointF(box.left(), y(0.0)), QPointF(box.right(), y(0.0)))
        for index, one in enumerate(checks):
            x = box.left() + (index + 0.5) * pitch
            colour = QColor(theme.text)
            if abs(one.error_mm) + one.expanded_mm > one.limit_mm:
                colour = QColor(theme.bad if abs(one.error_mm) > one.limit_mm else theme.warn)
            if index == self._largest:
                painter.setPen(QPen(QColor(theme.accent), 3.0))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawEllipse(QPointF(x, y(one.error_mm)), 9.0, 9.0)
            painter.setPen(QPen(colour, 2.0))
            painter.drawLine(
                QPointF(x, y(one.error_mm - one.expanded_mm)),
                QPointF(x, y(one.error_mm + one.expanded_mm)),
            )
            painter.setBrush(colour)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.drawEllipse(QPointF(x, y(one.error_mm)), 4.0, 4.0)
        painter.setFont(digit_font(13, bold=False))
        painter.setPen(QColor(theme.muted))
        limit = max(one.limit_mm for one in checks)
        for value in (limit, 0.0, -limit):
            place = QRectF(0.0, y(value) - 10.0, _SCALE_PX - 6.0, 20.0)
            right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(place, right, f"{1e3 * value:+.0f}" if value else "0")
        self._paint_groups(painter, box, pitch)

    def _paint_groups(self, painter: QPainter, box: QRectF, pitch: float) -> None:
        """Paint where one line or sphere ends and what it is called, as far as there is room."""
        painter.setFont(text_font(13))
        begin = 0
        names = [_group(one.name) for one in self._checks]
        for index in range(1, len(names) + 1):
            if index < len(names) and names[index] == names[begin]:
                continue
            painter.setPen(QPen(QColor(self._theme.border), 1.0))
            x = box.left() + index * pitch
            painter.drawLine(QPointF(x, box.top()), QPointF(x, box.bottom() + 6.0))
            place = QRectF(
                box.left() + begin * pitch, box.bottom() + 2.0, (index - begin) * pitch,
                self._foot - 4.0,
            )  # fmt: skip
            painter.setPen(QColor(self._theme.muted))
            if self._whole_names:
                wrapped = Qt.AlignmentFlag.AlignHCenter | Qt.TextFlag.TextWordWrap
                painter.drawText(place.adjusted(3.0, 0.0, -3.0, 0.0), wrapped, names[begin])
                begin = index
                continue
            # The end of a name says more than its beginning: "space diagonal 2".
            text = names[begin]
            while painter.fontMetrics().horizontalAdvance(text) > place.width() and text:
                text = text.partition(" ")[2]
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, text)
            begin = index


def session_of(record: VerificationRecord) -> tuple[tuple[str, str], ...]:
    """Return facts about corners and repeated seats; none for records of earlier versions."""
    facts: list[tuple[str, str]] = []
    if record.corners:
        missing = [one for one in record.corners if not one.reached]
        said = f"{len(record.corners) - len(missing)} of {len(record.corners)} reached"
        for one in missing:
            said += f"; {one.name}: {one.reason or 'no reason'}"
        facts.append(("Corners", said))
    if record.repeats:
        shifts = (
            f"{one.place} {1e3 * float(np.linalg.norm(one.shift_mm)):.0f} µm"
            f"{'' if one.square <= one.limit else ' ▲'}"
            for one in record.repeats
        )
        facts.append(("Repeats", ", ".join(shifts)))
    forms = [one for one in record.checks if one.name.endswith(", form")]
    if forms:
        worst = max(forms, key=lambda one: one.error_mm)
        facts.append(
            ("Form", f"{1e3 * worst.error_mm:.1f} µm, limit {1e3 * worst.limit_mm:.1f} µm")
        )
    return tuple(facts)


def _count(checks: int, failed: int) -> str:
    return f"{failed} of {checks} failed" if failed else str(checks)


def _error(check: Check) -> str:
    return f"{check.name} {1e3 * check.error_mm:+.1f} µm, limit {1e3 * check.limit_mm:.1f} µm"


class RepeatsLines(Protocol):
    """The procedure that lets a failed line be taken again."""

    def repeat_line(self, line: int, now: datetime) -> None:
        """Take a line anew."""
        ...

    def back(self, now: datetime) -> None:
        """Return to the step before."""
        ...


class VerdictPage(StepPage):
    """Passed or not, by how much, and against what rule."""

    keys = ("back", "repeat", "calculate", "keep", "accept")

    def __init__(self) -> None:
        super().__init__()
        self._theme = THEMES[DEFAULT_THEME]
        self._outcome: VerificationOutcome | None = None
        self._seen: Seen | None = None
        self._word = FitText("Verdict", limit=40)
        self._word.setFixedHeight(54)
        self.sentence = sentence_label("What the verdict means", 17)
        self.facts = Facts("Figures of the verdict")
        self.warnings = sentence_label("What makes the verdict weaker", 14)
        self.chart = ErrorChart()
        # What speaks against a session may be longer than a small window is high.
        told = QVBoxLayout()
        told.setContentsMargins(0, 0, 6, 0)
        told.addWidget(self.sentence)
        told.addWidget(self.facts)
        told.addWidget(self.warnings)
        told.addStretch(1)
        holder = QWidget()
        holder.setLayout(told)
        area = QScrollArea()
        area.setAccessibleName("Figures and reasons")
        area.setWidgetResizable(True)
        area.setFrameShape(QFrame.Shape.NoFrame)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        area.setWidget(holder)
        right = QVBoxLayout()
        right.addWidget(self._word)
        right.addWidget(area, 1)
        side = panel(right)
        side.setFixedWidth(_SIDE_PX)
        left = QVBoxLayout()
        left.addWidget(self.chart)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(panel(left), 1)
        layout.addWidget(side)

    def show_seen(self, seen: Seen) -> None:
        """Show the verdict."""
        view = seen.view
        if not isinstance(view, VerificationView):
            return
        self._seen = seen
        if view.outcome is not None and view.outcome is not self._outcome:
            self._outcome = view.outcome
            record = view.outcome.record
            self.chart.show_checks(record.checks, view.outcome.largest)
            worst = record.checks[view.outcome.largest]
            artefacts = ", ".join(f"{one.name} ({one.serial})" for one in record.artefacts)
            self.facts.show_facts(
                (
                    ("Checks", _count(len(record.checks), len(view.outcome.failed))),
                    ("Worst", worst.name),
                    ("Error", f"{1e3 * worst.error_mm:+.1f} ± {1e3 * worst.expanded_mm:.1f} µm"),
                    ("Limit", f"± {1e3 * worst.limit_mm:.1f} µm"),
                    *session_of(record),
                    ("Artefacts", artefacts),
                    ("Rule", record.rule),
                )
            )
            told = [f"▲ {one.what} {one.remedy}" for one in view.outcome.warnings]
            told += [f"First: {_error(one)}" for one in record.superseded]
            self.warnings.setText("\n".join(told))
        self._show_word()

    def word(self) -> str:
        """Return the large word."""
        return self._word.text()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self._show_word()

    def _show_word(self) -> None:
        seen, theme = self._seen, self._theme
        if seen is None or not isinstance(seen.view, VerificationView):
            return
        error, outcome = seen.view.base.error, seen.view.outcome
        if error is not None:
            self._word.show_text("NO VERDICT", theme.bad, Mark.BAD)
            text = f"{error.what} {error.remedy}"
        elif outcome is None:
            self._word.show_text("NOT CALCULATED", theme.muted, Mark.OPEN)
            text = "Press R to calculate."
        elif outcome.record.passed:
            self._word.show_text("PASSED", theme.good, Mark.GOOD)
            text = "Store the verdict: the calibration may then be used."
        elif outcome.record.objections:
            self._word.show_text("FAILED", theme.bad, Mark.BAD)
            objections = outcome.record.objections
            remedies = dict.fromkeys(one.remedy for one in objections)
            text = "\n".join((*(one.what for one in objections), *remedies))
        elif outcome.record.superseded:
            self._word.show_text("FAILED", theme.bad, Mark.BAD)
            text = "A line was repeated, and the verification failed: store it, and calibrate anew."
        else:
            self._word.show_text("FAILED", theme.bad, Mark.BAD)
            text = (
                "If one line alone failed, take it again, once; if it fails again, store the "
                "verdict and calibrate anew. Jobs since the last good verification are then in "
                "doubt: Recall jobs (F12), on page Calibration, shows which of their verdicts hold."
            )
        if text != self.sentence.text():
            self.sentence.setText(text)


def repeat_worst(procedure: RepeatsLines, view: VerificationView) -> Callable[[datetime], None]:
    """Return the command that takes the line of the worst check again, from the verdict on.

    The procedure refuses where that is not allowed; the sentence then says why.
    """
    names = [line.name for line in view.lines]
    checks = () if view.outcome is None else view.outcome.record.checks
    lengths = [one for one in checks if _group(one.name) in names]
    line = 0
    if lengths:
        worst = max(lengths, key=lambda one: abs(one.error_mm) / one.limit_mm)
        line = names.index(_group(worst.name))

    def command(now: datetime) -> None:
        procedure.repeat_line(line, now)
        for _ in range(_BACK_TO_LINES):
            procedure.back(now)

    return command


def _group(name: str) -> str:
    """Return the line or the sphere that a check belongs to: what stands before the comma."""
    return name.partition(",")[0]
