"""Measuring page of a test: target, progress, and the last errors with their MPE."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Protocol

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout

from ocmm_core.acceptance import GuidedAcceptanceView, JudgedValue, worst_value
from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.typed_numbers import TEMPERATURE
from ocmm_gui.acceptance._checks import checks_of
from ocmm_gui.acceptance._touch_picture import TouchPicture, planned_places, position_contents
from ocmm_gui.charts import ErrorChart
from ocmm_gui.kit import (
    DEFAULT_THEME,
    THEMES,
    OwnKeysField,
    PlainLabel,
    Theme,
    localised,
    panel,
    read_number,
    said,
    sentence_label,
    text_font,
    tr,
)
from ocmm_gui.wizards.parts import CollectPage, Seen, bars

_CHART_PX = 150


class TakesTemperature(Protocol):
    """A procedure that logs the room temperature."""

    def set_temperature(self, celsius: float, now: datetime) -> None: ...


class MeasurePage(CollectPage):
    """Volume, artefact, progress, last errors, temperature; ``away`` (3,): cameras to volume."""

    keys = ("back", "automatic", "take", "next")
    misread = Signal(object)
    """Emits the `InputError` of a typed temperature."""

    def __init__(self, rig: Rig, away: Float, procedure: TakesTemperature) -> None:
        super().__init__(rig, tr("Points taken"))
        self._theme = THEMES[DEFAULT_THEME]
        self._procedure = procedure
        self._shown: object = None
        self._beyond = False
        self.touches = TouchPicture(away)
        self.chart = ErrorChart()
        self.chart.setMinimumHeight(_CHART_PX)
        self.errors = panel(_one(self.chart))
        self.errors.hide()
        self.last = sentence_label(tr("Last error against its limit"), 16)
        self.hint = sentence_label(tr("Why something is measured again"), 15)
        self.place = sentence_label(tr("Position"), 15)
        self.temperature = OwnKeysField()
        self.temperature.setObjectName("room")
        self.temperature.setAccessibleName(tr("Room, °C"))
        self.temperature.setAccessibleDescription(tr("Type it when it changes, then Return"))
        self.temperature.setFont(text_font(15))
        self.temperature.returnPressed.connect(self._note_temperature)
        self.temperature.left.connect(self._give_keys_back)
        self._lay_out()

    def show_seen(self, seen: Seen) -> None:
        super().show_seen(seen)
        view = seen.view_as(GuidedAcceptanceView)
        if not self.temperature.hasFocus():
            text = localised(f"{view.temperature_c:g}")
            if self.temperature.text() != text:
                self.temperature.setText(text)
        state = (view.test.done, view.test.current, len(view.test.positions), view.hint)
        if state == self._shown:
            return
        self._shown = state
        self._show_position(view)
        self._show_errors(view.test.values, view.latest)
        self.hint.setText(f"▲ {said(view.hint)}" if view.hint else "")
        self._paint()

    def set_theme(self, theme: Theme) -> None:
        self._theme = theme
        self._paint()

    def _show_position(self, view: GuidedAcceptanceView) -> None:
        test = view.test
        if test.current < 0:
            self.picture.show_contents(bars(planned_places(test), None), tr("all points taken"))
            self.touches.hide()
            self.place.setText("")
            return
        plan = test.positions[test.current]
        self.picture.show_contents(position_contents(test), plan.name)
        self.touches.setVisible(bool(plan.normals))
        if plan.normals:
            self.touches.show_normals(np.array(plan.normals), test.next_item, plan.name)
        used = view.artefact()
        what = "" if used is None else f"{used.use.name} ({used.use.serial})"
        text = tr("Position {number} of {count}: {name}").format(
            number=test.current + 1, count=len(test.positions), name=plan.name
        )
        held = "" if used is None or not used.supports else f"\n{used.supports}"
        self.place.setText(f"{text}\n{what}{held}")

    def _show_errors(self, values: Sequence[JudgedValue], latest: Sequence[JudgedValue]) -> None:
        self.errors.setVisible(bool(values))
        if not values or not latest:
            self.last.setText(tr("No errors yet: they follow when a position is complete."))
            self._beyond = False
            return
        self.chart.show_checks(checks_of(values), worst_value(values))
        worst = latest[worst_value(latest)]
        self._beyond = abs(worst.error_mm) > worst.limit_mm
        self.last.setText(
            tr("Last: {quantity} {error:+.1f} µm, limit ± {limit:.1f} µm\n{name}").format(
                quantity=worst.quantity, error=1e3 * worst.error_mm, limit=1e3 * worst.limit_mm,
                name=f"{worst.position}, {worst.name}",
            )
        )  # fmt: skip

    def _note_temperature(self) -> None:
        try:
            celsius = read_number(TEMPERATURE, self.temperature.text())
        except InputError as error:
            self.misread.emit(error)
            return
        self.commanded.emit(lambda now: self._procedure.set_temperature(celsius, now))
        self._give_keys_back()

    def _give_keys_back(self) -> None:
        """Return the focus to the page, so that keys take points."""
        parent = self.parentWidget()
        if parent is not None:
            parent.setFocus()

    def _paint(self) -> None:
        theme = self._theme
        self.last.setStyleSheet(f"color: {theme.bad if self._beyond else theme.text};")
        self.hint.setStyleSheet(f"color: {theme.warn};")

    def _lay_out(self) -> None:
        pictures = QHBoxLayout()
        pictures.setSpacing(8)
        pictures.addWidget(self.picture, 1)
        pictures.addWidget(self.touches, 1)
        self.touches.hide()
        left = QVBoxLayout()
        left.setSpacing(8)
        left.addLayout(pictures, 3)
        left.addWidget(self.errors, 2)
        self.beside.insertLayout(0, left, 1)
        for widget in (self.place, self.last, self.hint):
            self.scores.addWidget(widget)
        row = QHBoxLayout()
        label = PlainLabel(tr("Room, °C"))
        label.setFont(text_font(15))
        label.setProperty("role", "muted")
        label.setBuddy(self.temperature)
        row.addWidget(label)
        row.addWidget(self.temperature, 1)
        self.scores.addLayout(row)


def _one(widget: ErrorChart) -> QVBoxLayout:
    layout = QVBoxLayout()
    layout.addWidget(widget)
    return layout
