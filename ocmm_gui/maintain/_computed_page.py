"""Base of pages whose numbers are computed on request, in a separate process."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGridLayout, QWidget

from ocmm_core.errors import OcmmError
from ocmm_gui import kit
from ocmm_gui.kit import later, said, tr
from ocmm_gui.work import SideProcess, Work

_BUSY = later("Computing. Numbers and maps below are from the previous run.")

Field = tuple[str, str, str, str]
"""Key, label, tip and proposal of a field."""


class ComputedPage(QWidget):
    """Fields, a button that starts and cancels, progress, and a sentence on the result."""

    failed = Signal(object)
    """Emits the `OcmmError` of a failed computation."""
    shown = Signal()

    def __init__(
        self, name: str, fields: Sequence[Field], empty: dict[str, str], start: str, ask: str
    ) -> None:
        """``empty``: meaning of fields without a text; ``start``: name of the button."""
        super().__init__()
        self.setAccessibleName(name)
        self._specs, self._empty, self._start, self._ask = fields, empty, start, ask
        self._progress = kit.WorkBar(tr("Progress"))
        self._process = SideProcess(
            self, self._on_finished, self._on_failed, self._progress.advance
        )
        self.fields = {
            key: kit.OwnKeysField(kit.localised(proposal)) for key, _, _, proposal in fields
        }
        self.button = kit.dressed(kit.NarrowButton(), role="primary", high=38)
        self.button.clicked.connect(self.toggle)
        self._sentence = kit.sentence_label(tr("Meaning of the number"), 13)
        self._sentence.setText(ask)
        self._wait(False)

    def toggle(self) -> None:
        if self._process.is_running():
            self.cancel()
            return
        try:
            work = self._work()
        except OcmmError as error:
            self._on_failed(error)
            return
        self._wait(True)
        self._sentence.setText(tr(_BUSY))
        self._process.start(work)

    def cancel(self) -> None:
        if self._process.is_running():
            self._process.cancel()
            self._sentence.setText(self._ask)
        self._wait(False)

    def _work(self) -> Work:
        """Return the work that the fields request; OcmmError if they cannot be read."""
        raise NotImplementedError

    def _show_report(self, report: object) -> None:
        raise NotImplementedError

    def _words(self) -> dict[str, str]:
        return {key: field.text().strip() for key, field in self.fields.items()}

    def _on_finished(self, report: object) -> None:
        self._wait(False)
        self._show_report(report)
        self.shown.emit()

    def _on_failed(self, error: OcmmError) -> None:
        self._wait(False)
        self._sentence.setText(said(f"{error.what} {error.remedy}"))
        self.failed.emit(error)

    def _wait(self, waiting: bool) -> None:
        self.button.setText(tr("Cancel") if waiting else self._start)
        self.button.setAccessibleName(self.button.text())
        if waiting:
            self._progress.start(tr("Starting"))
        else:
            self._progress.hide()
        for field in self.fields.values():
            field.setEnabled(not waiting)

    def _form(self) -> QGridLayout:
        for key, label, tip, _ in self._specs:
            field = kit.dressed(self.fields[key], tr(label), tr(tip), font=kit.text_font(13))
            field.setPlaceholderText(tr(self._empty.get(key, "")))
            field.returnPressed.connect(self.toggle)
        grid = kit.form_grid(self.fields.values(), pixels=13)
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(4)
        grid.addWidget(self.button, len(self._specs), 0, 1, 2)
        grid.addWidget(self._progress, len(self._specs) + 1, 0, 1, 2)
        return grid
