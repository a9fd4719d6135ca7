"""Form for report data that are not in the job, next to the preview; stored with the job."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import QFileSystemWatcher, Signal
from PySide6.QtWidgets import QFormLayout, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.export.template import (
    Paper,
    Particulars,
    given_with,
    keep_given,
    keep_template,
    load_paper,
    surroundings,
    template_in_use,
)
from ocmm_gui.kit import caption, form_field, later, said, sentence_label, tr

_FIELDS = (
    ("template", later("Template"), later("TOML")),
    ("customer", later("Customer"), later("optional")),
    ("order", later("Order no."), later("Where the job has none")),
    ("drawing", later("Drawing"), later("Drawing of the part")),
    ("revision", later("Revision"), later("Revision of the drawing")),
    ("place", later("Place"), later("Where it was measured")),
    ("received", later("Received"), later("Date and condition")),
    ("room", later("Room, °C"), later("A number or a range")),
    ("humidity", later("Humidity, %"), later("A number or a range")),
    ("pressure", later("Pressure, hPa"), later("optional")),
    ("deviations", later("Deviations"), later("Parted by semicolons")),
)
_SEPARATOR = ";"


class PaperForm(QWidget):
    """Fields of the report; empty ones are printed as "not stated"."""

    changed = Signal()
    """A field was edited, or the file of the template was changed."""
    left = Signal()
    """Escape in a field."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Head of the report"))
        rows = QFormLayout(self)
        rows.setContentsMargins(0, 0, 0, 0)
        self.fields = {name: form_field(tr(title), tr(tip)) for name, title, tip in _FIELDS}
        for name, title, _tip in _FIELDS:
            field = self.fields[name]
            rows.addRow(caption(tr(title), field), field)
            field.textEdited.connect(lambda _text: self._on_typed())
            field.left.connect(self.left)
        # The sheet places it where there is room for a sentence.
        self.fault = sentence_label(tr("Fault of the template"), 15)
        self.fault.hide()
        self._job: Path | None = None
        self._kept = Particulars()
        self._typed = False
        self._watcher = QFileSystemWatcher(self)
        self._watcher.fileChanged.connect(lambda _path: self.changed.emit())

    def open(self, job: Path) -> None:
        """Show the data stored with a job; InputError if unreadable."""
        if job == self._job:
            return
        self._job, self._typed, self._kept = job, False, Particulars()
        try:
            self._kept = given_with(job)
        finally:
            for name, _title, _tip in _FIELDS[1:-1]:
                self.fields[name].setText(getattr(self._kept, name))
            self.fields["deviations"].setText(f"{_SEPARATOR} ".join(self._kept.deviations))

    def paper(self) -> Paper:
        """Return the report sheet as typed.

        Raises InputError if the template or an ambient reading is invalid.
        """
        path = self._template()
        self._watch(path)
        given = self._given()
        # Invalid readings are reported next to the fields, like faults of a template.
        surroundings(given)
        return load_paper(path, given)

    def keep(self) -> None:
        """Store the typed data with the job; OcmmError if that fails."""
        if self._typed and self._job is not None:
            self._typed = False
            keep_given(self._job, self._given())

    def keep_template(self) -> None:
        """Store the typed template for every report of this station; errors as `keep`."""
        if self.fields["template"].text().strip():
            keep_template(self._template())

    def show_fault(self, error: OcmmError | None) -> None:
        """Show a fault of the template next to its field; None clears it."""
        self.fault.setVisible(error is not None)
        self.fault.setText("" if error is None else said(f"{error.what} {error.remedy}"))

    def _template(self) -> Path:
        typed = self.fields["template"].text().strip()
        return Path(typed).expanduser() if typed else template_in_use()

    def _given(self) -> Particulars:
        typed = {name: field.text().strip() for name, field in self.fields.items()}
        told = (part.strip() for part in typed["deviations"].split(_SEPARATOR))
        # Data without a field here, such as remarks, are kept.
        return replace(
            self._kept,
            customer=typed["customer"],
            order=typed["order"],
            drawing=typed["drawing"],
            revision=typed["revision"],
            place=typed["place"],
            received=typed["received"],
            room=typed["room"],
            humidity=typed["humidity"],
            pressure=typed["pressure"],
            deviations=tuple(part for part in told if part),
        )

    def _on_typed(self) -> None:
        self._typed = True
        self.changed.emit()

    def _watch(self, path: Path) -> None:
        """Watch the file of the template, which its author edits elsewhere."""
        # Programs that replace a file end the watch of the former one.
        old, new = self._watcher.files(), str(path.absolute())
        if old != [new]:
            if old:
                self._watcher.removePaths(old)
            if path.exists():
                self._watcher.addPath(new)
