"""Definition of a probe: numbers and LEDs, checked while typing, and saved."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QTimer, Signal
from PySide6.QtGui import QHideEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import QPushButton, QWidget

from ocmm_core.calibration import probe_design
from ocmm_core.calibration.records import ProbeRecord
from ocmm_core.errors import OcmmError
from ocmm_core.tracking import LedEntry, ProbeDocument
from ocmm_gui import kit
from ocmm_gui.kit import later, tr
from ocmm_gui.wizards.pages._definition_form import DefinitionForm, LedTable
from ocmm_gui.wizards.pages._picture import ProbeDrawing
from ocmm_gui.work import SideProcess

SETTLE_MS = 500
"""Delay of the check after the last key."""

_PURPOSE = later(
    "Enter LED and ball positions. LED ambiguity is checked as you type. Then choose the "
    "new document in Settings (Instrument) and calibrate the probe."
)


class DefinitionPage(kit.Themed, QWidget):
    """Form and LEDs on the left, picture and verdict on the right."""

    left = Signal()
    saved = Signal(object)
    """Emits the `Path` of the new document."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Define a probe"))
        self._mark = kit.Mark.OPEN
        self._measured: ProbeRecord | None = None
        self.form = DefinitionForm()
        self.leds = LedTable()
        self.picture = ProbeDrawing()
        self._word = kit.FitText(tr("Verdict"), limit=34)
        self._word.setFixedHeight(44)
        self.sentence = kit.sentence_label(tr("Meaning of the verdict"), 17)
        question = tr("Read the probe document from the file")
        self.import_panel = kit.PathPanel(question, tr("File of the probe document"), tr("Read"))
        self.import_panel.given.connect(self._import)
        self.buttons = {
            key: self._button(text, tip, keys, call)
            for key, text, tip, keys, call in (
                ("leave", tr("Leave"), tr("Back; unsaved changes are lost"), "Esc", self._leave),
                ("import", tr("Import"), tr("Start from another document"), "F9", self._ask_import),
                ("measured", tr("As measured"), tr("Use the LEDs of the active calibration"), "F7",
                 self._take_measured),
                ("add", tr("Add LED"), tr("Add an LED, copying the last one"), "F10", self._add),
                ("remove", tr("Remove LED"), tr("Remove the selected LED"), "F6", self._remove),
                ("save", tr("Save"), tr("Save as a new document"), "F8", self._save),
            )
        }  # fmt: skip
        self.buttons["save"].setProperty("role", "primary")
        self._examination = SideProcess(self)
        self._examination.finished.connect(self._show_examined)
        self._examination.failed.connect(self._show_refused)
        self._settle = QTimer(self, singleShot=True, interval=SETTLE_MS)
        self._settle.timeout.connect(self._examine)
        self.form.changed.connect(self._on_changed)
        self.leds.itemChanged.connect(lambda _item: self._on_changed())
        self._lay_out()

    def open(self, document: ProbeDocument, path: Path, measured: ProbeRecord | None) -> None:
        """Show a document; ``measured`` is the calibration of that probe in force."""
        self._measured = measured
        self.buttons["measured"].setEnabled(measured is not None)
        self.import_panel.hide()
        self.form.fields["file"].setText(str(path))
        self._fill(document)
        self.form.fields["name"].setFocus()
        self.form.fields["name"].selectAll()

    def word(self) -> str:
        return self._word.text()

    def set_theme(self, theme: kit.Theme) -> None:
        self._theme = theme
        self._show_message(self._word.text(), self._mark, self.sentence.text())

    def close_examination(self) -> None:
        self._settle.stop()
        self._examination.cancel()

    def hideEvent(self, event: QHideEvent) -> None:
        self.close_examination()
        super().hideEvent(event)

    def _fill(self, document: ProbeDocument) -> None:
        self.form.show_document(document)
        self.leds.show_leds(document.leds)
        self._on_changed()

    def _on_changed(self) -> None:
        self._examination.cancel()
        self._show_message(tr("EXAMINING"), kit.Mark.ACTIVE, "")
        self._settle.start()

    def _examine(self) -> None:
        try:
            document, path = self.form.document(self.leds.leds()), self.form.path()
        except OcmmError as error:
            self._show_refused(error)
            return
        self.picture.show_probe(
            np.array([led.position for led in document.leds]).reshape(-1, 3),
            np.array([led.direction for led in document.leds]).reshape(-1, 3),
            np.array(document.tip),
        )
        self._examination.start(partial(probe_design.examine, document, path))

    def _show_examined(self, found: object) -> None:
        if not isinstance(found, probe_design.DefinitionCheck):
            return
        self._show_message(tr("GOOD"), kit.Mark.GOOD, examined_words(found))

    def _show_refused(self, error: OcmmError) -> None:
        self._show_message(
            tr("CANNOT BE USED"), kit.Mark.BAD, kit.said(f"{error.what} {error.remedy}")
        )

    def _show_message(self, word: str, mark: kit.Mark, sentence: str) -> None:
        self._mark = mark
        self._word.show_text(word, kit.mark_colour(self._theme, mark), mark)
        self.sentence.setText(sentence)

    def _save(self) -> None:
        try:
            path = self.form.path()
            probe_design.save_definition(path, self.form.document(self.leds.leds()))
        except OcmmError as error:
            self._show_refused(error)
            return
        self._show_message(
            tr("SAVED"), kit.Mark.GOOD, tr("Probe saved in {path}.").format(path=path)
        )
        self.saved.emit(path)

    def _ask_import(self) -> None:
        self.import_panel.ask(Path(self.form.fields["file"].text()).expanduser().parent)

    def _import(self, path: Path) -> None:
        try:
            self._fill(probe_design.read_definition(path))
        except OcmmError as error:
            self._settle.stop()
            self._show_refused(error)

    def _take_measured(self) -> None:
        record = self._measured
        if record is None:
            return
        old = {index: led.direction for index, led in enumerate(self._known_leds())}
        sigmas = np.sqrt(np.diag(np.array(record.covariance)))
        self.form.fields["tip"].setText(
            " ".join(kit.localised(f"{value:.4f}") for value in record.tip_mm)
        )
        self.form.fields["tip_sigma"].setText(
            " ".join(kit.localised(f"{value:.4f}") for value in sigmas[-3:])
        )
        self.form.fields["led_sigma"].setText(kit.localised(f"{float(sigmas[:-3].max()):.4f}"))
        forward = (0.0, -1.0, 0.0)
        self.leds.show_leds(
            [
                LedEntry(position=place, direction=old.get(index, forward))
                for index, place in enumerate(record.leds_mm)
            ]
        )
        self._on_changed()

    def _known_leds(self) -> tuple[LedEntry, ...]:
        try:
            return self.leds.leds()
        except OcmmError:
            return ()

    def _add(self) -> None:
        self.leds.add()
        self._on_changed()

    def _remove(self) -> None:
        self.leds.remove()
        self._on_changed()

    def _leave(self) -> None:
        if self.import_panel.isVisible():
            self.import_panel.hide()
        else:
            self.left.emit()

    def _button(self, text: str, tip: str, keys: str, call: Callable[[], None]) -> QPushButton:
        button = kit.dressed(
            kit.NarrowButton(f"{text}\n[{keys}]"), text, f"{tip} ({keys})",
            font=kit.text_font(16, bold=True), role="tool", high=60,
        )  # fmt: skip
        button.clicked.connect(call)
        shortcut = QShortcut(QKeySequence(keys), self, autoRepeat=False)
        shortcut.activated.connect(button.click)
        return button

    def _lay_out(self) -> None:
        font = kit.text_font(28, bold=True)
        title = kit.dressed(kit.PlainLabel(tr("Define a probe")), font=font)
        purpose = kit.sentence_label(tr("Purpose"), 16, tr(_PURPOSE))
        form = kit.vbox(self.form)
        form.addStretch(1)
        right = kit.vbox((self.picture, 1), self._word, self.sentence, spacing=8)
        middle = kit.hbox((kit.panel(form), 4), (self.leds, 5), (kit.panel(right), 4), spacing=8)
        row = kit.hbox(spacing=8)
        for key, button in self.buttons.items():
            row.addWidget(button, 2 if key == "save" else 1)
        kit.vbox(
            title, purpose, self.import_panel, (middle, 1), row, parent=self, spacing=8,
            margins=(12, 8, 12, 10),
        )  # fmt: skip


def examined_words(found: probe_design.DefinitionCheck) -> str:
    """Return by what margin the LEDs can be distinguished, in words."""
    if found.body.code is not None:
        return tr("The LEDs cannot be confused: each is dark in a different frame.")
    nearest, hidden = found.labels[0].ambiguity, found.nearest_hidden
    if nearest is None:
        text = tr("The LEDs cannot be confused: the orientation rules exclude every other order.")
    else:
        order = ", ".join(kit.led_name(label) for label in nearest.labels)
        text = tr(
            "The LEDs cannot be confused: the nearest wrong order, {order}, misses by "
            "{residual_mm:.1f} mm; it would put the tip {tip_error_mm:.0f} mm off."
        ).format(order=order, residual_mm=nearest.residual_mm, tip_error_mm=nearest.tip_error_mm)
    if hidden is not None and hidden.ambiguity is not None:
        text += " " + tr(
            "With {hidden} hidden, the nearest wrong order misses by {residual_mm:.1f} mm."
        ).format(hidden=kit.led_name(hidden.hidden - 1), residual_mm=hidden.ambiguity.residual_mm)
    return text
