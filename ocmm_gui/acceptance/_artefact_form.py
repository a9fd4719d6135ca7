"""Form of an artefact, typed or read from a certificate."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtWidgets import QGridLayout, QWidget

from ocmm_core.acceptance import ARTEFACT_KINDS, ArtefactEntry
from ocmm_gui.acceptance._start_parts import kind_word
from ocmm_gui.kit import ChoiceBox, FormField, caption, form_field, later, tr

_FIELDS = (
    ("id", later("Id"), later("What tests call it, such as BAR-1")),
    ("name", later("Name"), later("Of the artefact")),
    ("maker", later("Maker"), later("May be empty")),
    ("serial", later("Serial no."), later("As engraved")),
    ("laboratory", later("Laboratory"), later("That calibrated it")),
    ("certificate", later("Certificate no."), later("Of the laboratory")),
    ("due_utc", later("Due"), later("Holds until, like 2027-06-30: your own rule")),
    ("sizes", later("Sizes, mm"), later("At 20 °C: diameter; or nests of a bar from 0")),
    ("expanded", later("U, mm"), later("k = 2")),
    ("expanded_per_length", later("U per length"), later("Part that grows with length; or empty")),
    ("form", later("Form, mm"), later("Certified form error; empty if within U")),
    ("expansion", later("Expansion, 1/K"), later("Such as 1.15e-5")),
    ("expansion_sigma", later("its u, 1/K"), later("Standard uncertainty, such as 1e-6")),
    ("supports", later("Held"), later("Where and how it is held; may be empty")),
    ("quantity", later("Quantity"), later("Of a DCC with several lengths: part of its name")),
)  # fmt: skip
_CERTIFIED = ("serial", "laboratory", "certificate", "sizes", "expanded")
_IN_COLUMN = 8


class ArtefactForm(QWidget):
    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Artefact"))
        self.kind = ChoiceBox(
            tr("Kind"), tr("What the artefact is"), [kind_word(one) for one in ARTEFACT_KINDS]
        )
        self.fields: dict[str, FormField] = {}
        self._read: dict[str, str] = {}
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(10)
        grid.setVerticalSpacing(4)
        grid.addWidget(caption(tr("Kind"), self.kind), 0, 0)
        grid.addWidget(self.kind, 0, 1)
        for index, (key, label, tip) in enumerate(_FIELDS, start=1):
            field = form_field(tr(label), tr(tip))
            field.setObjectName(key)
            field.setAccessibleDescription(tr(tip))
            self.fields[key] = field
            column, row = divmod(index, _IN_COLUMN)
            grid.addWidget(caption(tr(label), field), row, 2 * column)
            grid.addWidget(field, row, 2 * column + 1)

    def texts(self) -> dict[str, str]:
        """Return the field texts; changed certificate data counts as typed."""
        found = {key: field.text().strip() for key, field in self.fields.items()}
        found["kind"] = ARTEFACT_KINDS[self.kind.currentIndex()]
        same = bool(self._read) and all(found[key] == self._read.get(key) for key in _CERTIFIED)
        found["source"] = self._read["source"] if same else "typed"
        found["certificate_sha256"] = self._read["certificate_sha256"] if same else ""
        return found

    def show_read(self, fields: Mapping[str, str]) -> None:
        """Fill in the data of a certificate."""
        self._read = dict(fields)
        for key, field in self.fields.items():
            if key in fields:
                field.setText(fields[key])
        if "kind" in fields:
            self.kind.setCurrentIndex(ARTEFACT_KINDS.index(fields["kind"]))
        self.fields["id" if not self.fields["id"].text() else "due_utc"].setFocus()

    def show_entry(self, entry: ArtefactEntry) -> None:
        """Fill in a register entry, for a newer certificate."""
        self._read = {}
        for key, field in self.fields.items():
            value = getattr(entry, key, "")
            if key == "sizes":
                value = " ".join(repr(one) for one in entry.sizes)
            elif key == "due_utc":
                value = entry.due_utc[:10]
            field.setText(value if isinstance(value, str) else repr(value))
        self.kind.setCurrentIndex(ARTEFACT_KINDS.index(entry.kind))

    def clear(self) -> None:
        self._read = {}
        for field in self.fields.values():
            field.clear()
        self.fields["id"].setFocus()
