"""Verdicts: on a tip (diameter, form, stability, changes), and of a verification by its errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Protocol

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from ocmm_core.calibration.guided import VerificationOutcome, VerificationView
from ocmm_core.calibration.records import Check, TipCheckRecord, TipRecord
from ocmm_core.calibration.tip import TipCheckOutcome, TipOutcome
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Points3
from ocmm_gui import kit
from ocmm_gui.charts import ErrorChart, Plot, check_words, group_of, is_amount, session_of
from ocmm_gui.kit import later, tr
from ocmm_gui.wizards.pages._result_frame import Filled, ResultFrame, ResultVerdict, failed, passed
from ocmm_gui.wizards.pages._touch_pages import TipScatter

_BACK_TO_LINES = 3


def _count(checks: int, failed: int) -> str:
    return (
        tr("{failed} of {checks} failed").format(failed=failed, checks=checks)
        if failed
        else str(checks)
    )


def _error(check: Check) -> str:
    return f"{kit.said_word(check.name)} {check_words(check)}"


class RepeatsLines(Protocol):
    """A procedure with repeatable lines."""

    def repeat_line(self, line: int, now: datetime) -> None: ...

    def back(self, now: datetime) -> None: ...


class VerdictPage(ResultFrame[VerificationOutcome]):
    """Pass or fail, the margin, and the decision rule."""

    shows = VerificationOutcome
    keys = ("back", "repeat", "calculate", "keep", "accept")

    def __init__(self) -> None:
        self.chart = ErrorChart()
        super().__init__(((tr("Errors and limits"), self.chart),))

    def judge(self, outcome: VerificationOutcome) -> ResultVerdict:
        record = outcome.record
        if record.passed:
            text = tr(
                "Store the verdict; the calibration can then be used. Certificate: Ctrl+P in "
                "Maintain, page Calibration."
            )
            return passed(text)
        if record.objections:
            remedies = dict.fromkeys(kit.said(one.remedy) for one in record.objections)
            text = "\n".join((*(kit.said(one.what) for one in record.objections), *remedies))
        elif record.superseded:
            text = tr(
                "A line was repeated and the verification failed: store it and calibrate again."
            )
        else:
            text = tr(
                "If only one line failed, repeat it once. If it fails again, store the verdict "
                "and calibrate again. Jobs since the last good verification are then suspect: "
                "Recall jobs (F12), on page Calibration, shows which of their verdicts hold."
            )
        return failed(text)

    def fill(self, outcome: VerificationOutcome) -> Filled:
        record = outcome.record
        self.chart.show_checks(record.checks, outcome.largest)
        worst = record.checks[outcome.largest]
        artefacts = ", ".join(f"{one.name} ({one.serial})" for one in record.artefacts)
        facts = [
            (tr("Checks"), _count(len(record.checks), len(outcome.failed))),
            (tr("Worst"), kit.said_word(worst.name)),
            (tr("Error"), check_words(worst)),
            *session_of(record),
            (tr("Artefacts"), artefacts),
            (tr("Rule"), kit.said(record.rule)),
        ]
        if record.passed and outcome.due_utc:
            facts.insert(3, (tr("Valid until"), kit.day_words(outcome.due_utc)))
        if record.arose is not None:
            facts.insert(1, (tr("Since"), kit.said(record.arose.sentence)))
        if record.superseded:
            facts.append((tr("First"), "\n".join(map(_error, record.superseded))))
        return facts, outcome.warnings


def repeat_worst(procedure: RepeatsLines, view: VerificationView) -> Callable[[datetime], None]:
    """Return the command that repeats the line of the worst check; may be refused."""
    names = [line.name for line in view.lines]
    checks = () if view.outcome is None else view.outcome.record.checks
    lengths = [one for one in checks if group_of(one.name) in names]
    line = 0
    if lengths:
        worst = max(lengths, key=lambda one: abs(one.error_mm) / one.limit_mm)
        line = names.index(group_of(worst.name))

    def command(now: datetime) -> None:
        procedure.repeat_line(line, now)
        for _ in range(_BACK_TO_LINES):
            procedure.back(now)

    return command


_SCALE_PX = 58.0
_CHECKED = (
    (later("Check"), later("quantity checked")),
    (later("Error, µm"), later("value found")),
    ("U, µm", later("expanded uncertainty (k = 2)")),
    (later("Limit, µm"), later("of the error")),
)
_COMPARED = (
    ("", later("quantity compared")),
    (later("Now"), later("this qualification")),
    (later("Before"), later("previous qualification")),
    (later("Change"), later("now minus before")),
)


class ChecksView(QWidget):
    """Errors between their limits, as a chart and as numbers."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Errors and limits"))
        self.chart = ErrorChart(whole_names=True)
        self.table = kit.NumberTable(tr("Errors in numbers"), kit.tr_all(_CHECKED))
        kit.vbox((self.chart, 1), self.table, parent=self, spacing=8, margins=0)

    def show_checks(self, checks: Sequence[Check], largest: int) -> None:
        self.chart.show_checks(checks, largest)
        self.table.show_rows(
            [
                (
                    kit.said_word(one.name),
                    kit.localised(f"{1e3 * one.error_mm:+.1f}"),
                    kit.localised(f"{1e3 * one.expanded_mm:.1f}") if one.expanded_mm else "–",
                    kit.localised(f"{'' if is_amount(one) else '± '}{1e3 * one.limit_mm:.1f}"),
                )
                for one in checks
            ]
        )


class FormPlot(Plot):
    """Radius residuals of all points, from the pole to the equator."""

    def __init__(self) -> None:
        super().__init__(tr("Form, µm"))
        self._below: Float = np.empty(0)
        self._residuals_um: Float = np.empty(0)

    def show_form(self, residuals_mm: Float, directions_world: Points3) -> None:
        """Show residuals (n,) in directions (n, 3) over their angle from the middle."""
        self._residuals_um = 1e3 * residuals_mm
        middle = directions_world.mean(axis=0)
        cosines = directions_world @ (middle / max(float(np.linalg.norm(middle)), 1e-9))
        self._below = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
        form = float(np.ptp(self._residuals_um)) if len(residuals_mm) else 0.0
        self._show_message(
            tr(
                "%n points, form {form:.1f} µm", "1 point, form {form:.1f} µm", len(residuals_mm)
            ).format(form=form)
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = self._painter()
        box = self._paint_head(painter).adjusted(_SCALE_PX, 6.0, -6.0, -44.0)
        if not len(self._residuals_um):
            return
        theme = self._theme
        reach = 1.2 * max(float(np.abs(self._residuals_um).max()), 1.0)
        widest = max(90.0, float(self._below.max()))
        kit.ink(
            painter, QPen(QColor(theme.border), max(theme.border_px, 1)), QColor(theme.background)
        )
        painter.drawRect(box)
        painter.drawLine(
            QPointF(box.left(), box.center().y()), QPointF(box.right(), box.center().y())
        )
        kit.ink(painter, QColor(theme.muted), font=kit.digit_font(13, bold=False))
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        for value in (reach, 0.0, -reach):
            y = box.center().y() - 0.5 * box.height() * value / reach
            place = QRectF(0.0, y - 10.0, _SCALE_PX - 6.0, 20.0)
            painter.drawText(place, right, f"{value:+.0f}" if value else "0")
        for angle in range(0, int(widest) + 1, 30):
            x = box.left() + box.width() * angle / widest
            place = QRectF(x - 30.0, box.bottom() + 3.0, 60.0, 18.0)
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, f"{angle}°")
        painter.setFont(kit.text_font(13))
        foot = QRectF(box.left(), box.bottom() + 22.0, box.width(), 20.0)
        painter.drawText(foot, Qt.AlignmentFlag.AlignCenter, tr("angle from the pole"))
        kit.ink(painter, QPen(QColor(theme.panel), 1.0), QColor(theme.accent))
        for angle, value in zip(self._below.tolist(), self._residuals_um.tolist(), strict=True):
            x = box.left() + box.width() * angle / widest
            y = box.center().y() - 0.5 * box.height() * value / reach
            painter.drawEllipse(QPointF(x, y), 5.5, 5.5)


class TipResultPage(ResultFrame[TipOutcome]):
    shows = TipOutcome
    plots = (later("Limits"), later("Form"), later("Cone"), later("Before/after"))

    def __init__(self, rig: Rig) -> None:
        views = (
            ChecksView(), FormPlot(), TipScatter(rig),
            kit.NumberTable(tr("Now and before"), kit.tr_all(_COMPARED), whole=False),
        )  # fmt: skip
        super().__init__(tuple(zip(kit.tr_all(self.plots), views, strict=True)))
        self.chart, self.form, self.cone, self.compared = views

    def judge(self, outcome: TipOutcome) -> ResultVerdict:
        if outcome.record.passed:
            return passed(
                tr(
                    "Store the verdict; points can then be taken with this tip. Certificate: "
                    "Ctrl+P in Maintain, page Probe."
                )
            )
        return failed(
            tr(
                "Clean ball, sphere and cone, tighten the stylus and qualify again. If it fails "
                "again, calibrate the probe or change the stylus."
            )
        )

    def fill(self, outcome: TipOutcome) -> Filled:
        record = outcome.record
        self.chart.show_checks(record.checks, outcome.largest)
        self.form.show_form(outcome.residuals_mm, outcome.directions_world)
        self.cone.show_off(outcome.cone_off_world, float("nan"))
        self.compared.show_rows(_compared(record, outcome.previous))
        facts = [
            (tr("Diameter"), kit.localised(f"{record.diameter_mm:.4f} mm")),
            ("", kit.localised(f"U {2e3 * record.diameter_sigma_mm:.1f} µm (k = 2)")),
            (tr("Largest error"), check_words(record.checks[outcome.largest])),
            (
                tr("Form"),
                tr(
                    "{form_mm:.1f} µm, %n points", "{form_mm:.1f} µm, 1 point", record.points
                ).format(form_mm=1e3 * record.form_mm),
            ),
            (tr("In the cone"), kit.localised(f"2s {1e3 * record.articulation_2s_mm:.1f} µm")),
            (tr("Largest"), kit.localised(f"{1e3 * record.articulation_max_mm:.1f} µm")),
            (tr("Valid until"), kit.day_words(record.valid_until_utc)),
            (tr("Artefacts"), _artefacts(record)),
        ]
        return facts, outcome.warnings


class TipCheckResultPage(ResultFrame[TipCheckOutcome]):
    """The verdict of a quick check."""

    shows = TipCheckOutcome
    keys = ("back", "calculate", "keep", "accept")

    def __init__(self) -> None:
        chart = ChecksView()
        super().__init__(((tr("Limits"), chart),))
        self.chart = chart

    def judge(self, outcome: TipCheckOutcome) -> ResultVerdict:
        if outcome.record.passed:
            return passed(
                tr(
                    "The tip is still as qualified. Store the verdict and continue. A check does "
                    "not extend the term of the qualification, whose certificate is at Ctrl+P in "
                    "Maintain, page Probe."
                )
            )
        return failed(
            tr(
                "The tip is no longer as qualified. Store the verdict: no points are taken until "
                "the tip is qualified or the probe calibrated."
            )
        )

    def fill(self, outcome: TipCheckOutcome) -> Filled:
        """Show a check; return its figures and what speaks against the tip."""
        record = outcome.record
        self.chart.show_checks(record.checks, outcome.largest)
        worst = record.checks[outcome.largest]
        facts = [
            (tr("Largest error"), f"{check_words(worst)} ({kit.said_word(worst.name)})"),
            (tr("Tip"), record.tip),
            (tr("Artefacts"), _artefacts(record)),
        ]
        if record.passed:
            facts.insert(1, (tr("Valid until"), kit.day_words(outcome.due_utc)))
        return facts, (*outcome.findings, *outcome.warnings)


def _compared(now: TipRecord, before: TipRecord | None) -> list[tuple[str, ...]]:
    rows = []
    for name, attribute, factor, form in (
        (tr("Diameter, mm"), "diameter_mm", 1.0, ".4f"),
        (tr("Form, µm"), "form_mm", 1e3, ".1f"),
        (tr("2s in the cone, µm"), "articulation_2s_mm", 1e3, ".1f"),
        (tr("Largest in the cone, µm"), "articulation_max_mm", 1e3, ".1f"),
        (tr("Point, µm"), "point_sigma_mm", 1e3, ".2f"),
        (tr("Temperature, °C"), "temperature_c", 1.0, ".1f"),
    ):
        new = getattr(now, attribute)
        old = None if before is None else getattr(before, attribute)
        words = ["–" if value is None else format(factor * value, form) for value in (new, old)]
        both = new is not None and old is not None
        change = format(factor * (new - old), f"+{form}") if both else "–"
        rows.append((name, *words, change))
    rows.append(
        (
            tr("Made"),
            kit.day_words(now.made_utc),
            "–" if before is None else kit.day_words(before.made_utc),
            "",
        )
    )
    return rows


def _artefacts(record: TipRecord | TipCheckRecord) -> str:
    return ", ".join(f"{one.name} {one.serial}".strip() for one in record.artefacts) or tr("none")
