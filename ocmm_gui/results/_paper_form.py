"""What a report says that no job knows: typed beside its preview, which follows."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFormLayout, QWidget

from ocmm_core.export.report import Paper, Particulars, load_paper, standard_template
from ocmm_gui.kit import caption, form_field, later, tr

_FIELDS = (
    ("template", later("Template"), later("TOML file; empty for plain")),
    ("customer", later("Customer"), later("For whom it was measured")),
    ("order", later("Order"), later("Order, where the job has none")),
    ("drawing", later("Drawing"), later("Drawing of the part")),
    ("revision", later("Revision"), later("Revision of the drawing")),
    ("place", later("Place"), later("Where it was measured")),
    ("received", later("Received"), later("Date and condition")),
    ("deviations", later("Deviations"), later("Parted by semicolons")),
)
_SEPARATOR = ";"


class PaperForm(QWidget):
    """Fields of the paper; what stays empty is "not stated" there."""

    changed = Signal()
    """Something was typed."""
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
            field.textEdited.connect(lambda _text: self.changed.emit())
            field.left.connect(self.left)

    def paper(self) -> Paper:
        """Return the paper as it is typed.

        Raises
        ------
        InputError
            The template cannot be used.
        """
        typed = {name: field.text().strip() for name, field in self.fields.items()}
        told = (part.strip() for part in typed["deviations"].split(_SEPARATOR))
        given = Particulars(
            customer=typed["customer"],
            order=typed["order"],
            drawing=typed["drawing"],
            revision=typed["revision"],
            place=typed["place"],
            received=typed["received"],
            deviations=tuple(part for part in told if part),
        )
        template = typed["template"]
        path = Path(template).expanduser() if template else standard_template()
        return load_paper(path, given)
