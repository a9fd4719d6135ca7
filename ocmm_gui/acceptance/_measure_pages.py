"""Pages of a running test: target, progress and errors against the MPE, then the verdict."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Protocol

import numpy as np
from PySide6.QtCore import Signal

from ocmm_core import acceptance
from ocmm_core.calibration.records import Check
from ocmm_core.camera import Rig
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.typed_numbers import TEMPERATURE
from ocmm_gui import kit
from ocmm_gui.acceptance._touch_picture import TouchPicture, planned_places, position_contents
from ocmm_gui.charts import ErrorChart, InterimPlot, check_words
from ocmm_gui.kit import later, tr
from ocmm_gui.wizards.pages import (
    CollectPage,
    Filled,
    ResultFrame,
    ResultVerdict,
    StepSnapshot,
    bars,
)


def checks_of(values: Sequence[acceptance.JudgedValue]) -> tuple[Check, ...]:
    """Return values as checks; a chart groups them by the text before the comma."""
    return tuple(
        Check(
            name=f"{kit.said(one.position)}, {kit.said_word(one.quantity)} {kit.said(one.name)}",
            measured_mm=one.certified_mm + one.error_mm,
            certified_mm=one.certified_mm, expanded_mm=one.expanded_mm, limit_mm=one.limit_mm,
        )
        for one in values
    )  # fmt: skip


_CHART_PX = 150


class TemperatureLog(Protocol):
    """A procedure that logs the room temperature."""

    def set_temperature(self, celsius: float, now: datetime) -> None: ...


class MeasurePage(CollectPage):
    """Volume, artefact, progress, last errors, temperature; ``away`` (3,): cameras to volume."""

    keys = ("back", "automatic", "take", "next")
    misread = Signal(object)
    """Emits the `InputError` of a typed temperature."""

    def __init__(self, rig: Rig, away: Float, procedure: TemperatureLog) -> None:
        super().__init__(rig, tr("Points taken"))
        self._procedure = procedure
        self._shown: object = None
        self.touches = TouchPicture(away)
        self.chart = kit.dressed(ErrorChart(), high=_CHART_PX)
        self.errors = kit.panel(kit.vbox(self.chart))
        self.errors.hide()
        self.last = kit.sentence_label(tr("Last error against its limit"), 16)
        self.hint = kit.sentence_label(tr("Why something is measured again"), 15, role="warn")
        self.place = kit.sentence_label(tr("Position"), 15)
        tip = tr("Type it when it changes, then Return")
        self.temperature = kit.dressed(
            kit.OwnKeysField(), tr("Room, °C"), tip, font=kit.text_font(15)
        )
        self.temperature.setObjectName("room")
        self.temperature.returnPressed.connect(self._note_temperature)
        self.temperature.left.connect(self._give_keys_back)
        self._lay_out()

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        view = seen.view_as(acceptance.GuidedAcceptanceView)
        if not self.temperature.hasFocus():
            text = kit.localised(f"{view.temperature_c:g}")
            if self.temperature.text() != text:
                self.temperature.setText(text)
        state = (view.test.done, view.test.current, len(view.test.positions), view.hint)
        if state == self._shown:
            return
        self._shown = state
        self._show_position(view)
        self._show_errors(view.test.values, view.latest)
        self.hint.setText(f"▲ {kit.said(view.hint)}" if view.hint else "")

    def _show_position(self, view: acceptance.GuidedAcceptanceView) -> None:
        test = view.test
        if test.current < 0:
            self.picture.show_contents(bars(planned_places(test), None), tr("all points taken"))
            self.touches.hide()
            self.place.setText("")
            return
        plan = test.positions[test.current]
        name = kit.said(plan.name)
        self.picture.show_contents(position_contents(test), name)
        self.touches.setVisible(bool(plan.normals))
        if plan.normals:
            self.touches.show_normals(np.array(plan.normals), test.next_item, name)
        used = view.artefact()
        what = "" if used is None else f"{used.use.name} ({used.use.serial})"
        text = tr("Position {number} of {count}: {name}").format(
            number=test.current + 1, count=len(test.positions), name=name
        )
        held = "" if used is None or not used.supports else f"\n{used.supports}"
        self.place.setText(f"{text}\n{what}{held}")

    def _show_errors(
        self, values: Sequence[acceptance.JudgedValue], latest: Sequence[acceptance.JudgedValue]
    ) -> None:
        self.errors.setVisible(bool(values))
        if not values or not latest:
            self.last.setText(tr("No errors yet: they follow when a position is complete."))
            kit.use_role(self.last, "")
            return
        self.chart.show_checks(checks_of(values), acceptance.worst_value(values))
        worst = checks_of(latest)[acceptance.worst_value(latest)]
        kit.use_role(self.last, "bad" if abs(worst.error_mm) > worst.limit_mm else "")
        last = tr("Last: {errors}\n{name}")
        self.last.setText(last.format(errors=check_words(worst), name=worst.name))

    def _note_temperature(self) -> None:
        try:
            celsius = kit.read_number(TEMPERATURE, self.temperature.text())
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

    def _lay_out(self) -> None:
        pictures = kit.hbox((self.picture, 1), (self.touches, 1), spacing=8)
        self.touches.hide()
        self.beside.insertLayout(0, kit.vbox((pictures, 3), (self.errors, 2), spacing=8), 1)
        for widget in (self.place, self.last, self.hint):
            self.scores.addWidget(widget)
        label = kit.caption(tr("Room, °C"), self.temperature, 15)
        self.scores.addLayout(kit.hbox(label, (self.temperature, 1)))


_MARKS = {
    acceptance.AcceptanceVerdict.PASS: kit.Mark.GOOD,
    acceptance.AcceptanceVerdict.FAIL: kit.Mark.BAD,
    acceptance.AcceptanceVerdict.LEANING_IN: kit.Mark.DOUBT,
    acceptance.AcceptanceVerdict.LEANING_OUT: kit.Mark.DOUBT,
    acceptance.AcceptanceVerdict.VOID: kit.Mark.DOUBT,
}
_COLUMNS = (
    (later("Quantity"), later("What is tested")),
    (later("Where"), later("Position and length")),
    (later("Error, µm"), later("Test value")),
    (later("U, µm"), later("Of the test value, k = 2")),
    (later("MPE, µm"), later("Limit")),
    (later("Verdict"), later("By the decision rule")),
)


class AcceptanceVerdictPage(ResultFrame[acceptance.AcceptanceOutcome]):
    """Pass or fail, margin, decision rule; then certificate and record."""

    shows = acceptance.AcceptanceOutcome
    keys = ("back", "repeat", "calculate", "keep", "accept", "plot1", "plot2", "plot3")
    paper_wanted = Signal(object)
    """Emits the `Path` of the record for a certificate."""

    def __init__(self) -> None:
        self.chart = ErrorChart()
        self.interim = InterimPlot()
        self.values = kit.NumberTable(tr("Every value"), kit.tr_all(_COLUMNS), whole=False)
        self.values.fit_columns(1)
        self.values.right_heads((2, 3, 4))
        self.values.setWordWrap(True)
        super().__init__(
            (
                (tr("Errors and limits"), self.chart),
                (tr("Record"), self.values),
                (tr("Interim checks"), self.interim),
            )
        )
        self._simulated = kit.FitText(tr("Source"), limit=20, high=28)
        self.right.insertWidget(1, self._simulated)
        self.record = kit.dressed(
            kit.NarrowButton(tr("Record  [2]")), tr("Show every value of the record")
        )
        self.record.clicked.connect(lambda: self.show_plot(1))
        tip = tr("Write the certificate, PDF and DCC")
        self.paper = kit.dressed(kit.NarrowButton(tr("Certificate (PDF and DCC)  [P]")), tip)
        self.paper.setShortcut("P")
        self.paper.clicked.connect(self._want_paper)
        for button in (self.record, self.paper):
            kit.dressed(button, font=kit.text_font(15, bold=True), high=44)
            self.right.addWidget(button)

    def allows(self, key: str) -> bool:
        """Return whether the procedure permits another retest."""
        outcome = self._shown
        left = outcome.retests_left if isinstance(outcome, acceptance.AcceptanceOutcome) else 0
        return key != "repeat" or left > 0

    def show_seen(self, seen: StepSnapshot) -> None:
        super().show_seen(seen)
        self.paper.setEnabled(self._file() is not None)
        self._show_source(seen)

    def judge(self, outcome: acceptance.AcceptanceOutcome) -> ResultVerdict:
        return ResultVerdict(
            kit.said_word(outcome.word), _MARKS[outcome.verdict], kit.said(outcome.sentence)
        )

    def fill(self, outcome: acceptance.AcceptanceOutcome) -> Filled:
        if self._seen is None:
            return (), ()
        values, stage = outcome.values, self._seen.view_as(acceptance.GuidedAcceptanceView).stage
        if values:
            self.chart.show_checks(checks_of(values), acceptance.worst_value(values))
        self.values.show_rows([_row(one) for one in values])
        if outcome.chart is not None:
            self.interim.show_chart(outcome.chart)
            self.show_plot(2)
        facts = [
            (
                kit.said_word(one.quantity),
                tr("{error:+.1f} µm, U {u:.1f} µm (k = 2), limit {limit:.1f} µm").format(
                    error=1e3 * one.error_mm, u=1e3 * one.expanded_mm, limit=1e3 * one.limit_mm
                ),
            )
            for one in outcome.quantities
        ]  # fmt: skip
        used = ", ".join(f"{one.use.name} ({one.use.serial})" for one in stage.artefacts)
        facts += [
            (tr("Values"), str(len([one for one in values if not one.superseded]))),
            (tr("Retests left"), str(outcome.retests_left)),
            (tr("Method"), kit.said(stage.procedure.wording)),
            (tr("Rule"), kit.said_word(stage.procedure.rule)),
            (tr("Artefact"), used or tr("none")),
        ]
        if outcome.file is not None:
            facts.append((tr("Record"), outcome.file.name[:16]))
        return facts, ()

    def _file(self) -> Path | None:
        return self._shown.file if isinstance(self._shown, acceptance.AcceptanceOutcome) else None

    def _want_paper(self) -> None:
        if self._file() is not None:
            self.paper_wanted.emit(self._file())

    def _show_source(self, seen: StepSnapshot) -> None:
        instrument = seen.view_as(acceptance.GuidedAcceptanceView).stage.instrument
        known = ", ".join(map(kit.said, instrument.states))
        if instrument.simulated and not instrument.unproven:
            known = tr("SIMULATED: virtual rig and artefact")
        self._simulated.show_text(known, "warn", kit.Mark.DOUBT if known else None)
        self._simulated.setToolTip(kit.literal(" ".join(map(kit.said, instrument.unproven))))
        self._simulated.setVisible(bool(known))


def _row(one: acceptance.JudgedValue) -> tuple[str, ...]:
    superseded = tr(" (repeated)") if one.superseded else ""
    return (
        kit.said_word(one.quantity), f"{kit.said(one.position)}, {kit.said(one.name)}{superseded}",
        kit.localised(f"{1e3 * one.error_mm:+.1f}"),
        kit.localised(f"{1e3 * one.expanded_mm:.1f}") if one.expanded_mm else "–",
        kit.localised(f"{1e3 * one.limit_mm:.1f}"), kit.said_word(one.verdict.value),
    )  # fmt: skip
