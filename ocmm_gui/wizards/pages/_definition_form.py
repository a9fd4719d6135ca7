from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QAbstractItemDelegate, QGridLayout, QLineEdit, QTableWidget, QWidget

from ocmm_core.camera import MAX_LEDS, Vector3
from ocmm_core.errors import InputError
from ocmm_core.tracking import SCHEMA, LedEntry, OrientationRule, ProbeDocument, StrobeEntry
from ocmm_core.typed_numbers import COORDINATE
from ocmm_gui import kit
from ocmm_gui.kit import later, tr

_FIELDS = (
    ("name", later("Name"), later("Name of the probe, used in its records")),
    ("tip", later("Tip, mm"), later("Centre of the ball in the probe frame: x y z")),
    ("tip_diameter", later("Ball, mm"), later("Diameter from the maker's certificate")),
    ("tip_diameter_sigma", later("Ball ±, mm"), later("Standard uncertainty of the diameter")),
    ("tip_sigma", later("Tip ±, mm"), later("Standard uncertainties of its position: x y z")),
    ("led_sigma", later("LEDs ±, mm"), later("Standard uncertainty of each coordinate of an LED")),
    ("emission_half_angle_deg", later("Light, °"),
    later("Largest viewing angle off its direction")),
    (
        "rules", later("Rules"),
        later("Orientation rules: probe axis > direction; x y z > x y z; …; empty: none"),
    ),
    ("strobe", later("Strobe"),
    later("Period in frames: dark frame of each LED; empty: always on")),
    ("file", later("File"), later("New name; a used document is never changed")),
)  # fmt: skip
_EMPTY = {"rules": later("none"), "strobe": later("always on")}
"""Meaning of empty fields."""
_COLUMNS = (
    (later("LED"), later("its number")),
    ("X, mm", later("probe frame")),
    ("Y, mm", later("probe frame")),
    ("Z, mm", later("probe frame")),
    ("dX", later("emission direction; length is ignored")),
    ("dY", later("emission direction")),
    ("dZ", later("emission direction")),
)


class LedTable(kit.NumberTable):
    """Editable table of LED positions and directions."""

    def __init__(self) -> None:
        super().__init__(
            tr("LEDs"), kit.tr_all(_COLUMNS), whole=False, font=kit.digit_font(14, bold=False)
        )
        self.setEditTriggers(QTableWidget.EditTrigger.AllEditTriggers)
        self.setSelectionBehavior(QTableWidget.SelectionBehavior.SelectItems)
        self.setTabKeyNavigation(False)
        self.verticalHeader().setDefaultSectionSize(40)

    def closeEditor(self, editor: QWidget, hint: QAbstractItemDelegate.EndEditHint) -> None:
        """Move to the next cell with Tab, and from the last one out of the table."""
        hints = QAbstractItemDelegate.EndEditHint
        here = (self.currentRow(), self.currentColumn())
        last = (self.rowCount() - 1, self.columnCount() - 1)
        if hint == hints.EditNextItem and here == last:
            super().closeEditor(editor, hints.NoHint)
            self.focusNextChild()
        elif hint == hints.EditPreviousItem and here <= (0, 1):
            super().closeEditor(editor, hints.NoHint)
            self.focusPreviousChild()
        else:
            super().closeEditor(editor, hint)

    def show_leds(self, leds: Sequence[LedEntry]) -> None:
        rows = []
        for row, led in enumerate(leds):
            place = (kit.localised(f"{value:.7g}") for value in led.position)
            # A hundredth is half a degree, better than any LED direction is known.
            light = (kit.localised(f"{round(value, 2):g}") for value in led.direction)
            rows.append((kit.led_name(row), *place, *light))
        self.blockSignals(True)
        self.show_rows(rows)
        self.blockSignals(False)

    def leds(self) -> tuple[LedEntry, ...]:
        """Return the LEDs; raise InputError if a cell is not a number."""
        found = []
        for row in range(self.rowCount()):
            values = [
                number(word, f"{kit.led_name(row)} {title.partition(',')[0]}")
                for word, (title, _) in zip(
                    self.cells(row)[1:], kit.tr_all(_COLUMNS)[1:], strict=True
                )
            ]
            position: Vector3 = (values[0], values[1], values[2])
            found.append(LedEntry(position=position, direction=(values[3], values[4], values[5])))
        return tuple(found)

    def add(self) -> None:
        """Add an LED like the last one."""
        if self.rowCount() < MAX_LEDS:
            last = self.cells(self.rowCount() - 1)[1:] if self.rowCount() else ("0",) * 6
            self.insertRow(self.rowCount())
            for column, word in enumerate((kit.led_name(self.rowCount() - 1), *last)):
                self._write(self.rowCount() - 1, column, word)
            self.setCurrentCell(self.rowCount() - 1, 1)
            self.scrollToBottom()

    def remove(self) -> None:
        """Remove the selected LED; those after it move up."""
        if self.currentRow() >= 0:
            self.removeRow(self.currentRow())
            for row in range(self.rowCount()):
                self._write(row, 0, kit.led_name(row))


class DefinitionForm(QWidget):
    """Numbers of a probe other than its LEDs."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("The probe"))
        self.fields: dict[str, QLineEdit] = {}
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(6)
        for row, (key, label, tip) in enumerate(_FIELDS):
            caption = kit.dressed(kit.PlainLabel(tr(label)), font=kit.text_font(15), role="muted")
            field, font = kit.HintField(), kit.text_font(16)
            kit.dressed(field, tr(label), tr(tip), font=font, high=34, key=key)
            field.setPlaceholderText(tr(_EMPTY.get(key, "")))
            field.textEdited.connect(lambda _text: self.changed.emit())
            caption.setBuddy(field)
            grid.addWidget(caption, row, 0)
            grid.addWidget(field, row, 1)
            self.fields[key] = field

    def show_document(self, document: ProbeDocument) -> None:
        """Show the numbers of a document; keep the file name."""
        rules = "; ".join(
            f"{_text(rule.probe_axis)} > {_text(rule.world_direction)}"
            for rule in document.orientation_rules
        )
        code = document.strobe
        strobe = "" if code is None else f"{code.period}: {' '.join(map(str, code.dark))}"
        for key, text in (
            ("name", document.name),
            ("tip", _text(document.tip)),
            ("tip_diameter", kit.localised(f"{document.tip_diameter:g}")),
            ("tip_diameter_sigma", kit.localised(f"{document.tip_diameter_sigma:g}")),
            ("tip_sigma", _text(document.tip_sigma)),
            ("led_sigma", kit.localised(f"{document.led_sigma:g}")),
            ("emission_half_angle_deg", kit.localised(f"{document.emission_half_angle_deg:g}")),
            ("rules", rules),
            ("strobe", strobe),
        ):
            self.fields[key].setText(text)

    def document(self, leds: Sequence[LedEntry]) -> ProbeDocument:
        """Return the document with these LEDs; raise InputError for invalid numbers."""
        text = {key: field.text().strip() for key, field in self.fields.items()}
        if not text["name"]:
            raise InputError("definition.name", "The probe has no name.", "Enter one.")
        return ProbeDocument(
            schema=SCHEMA,
            unit="mm",
            name=text["name"],
            tip=_vector(text["tip"], tr("Tip")),
            tip_diameter=number(text["tip_diameter"], tr("Ball")),
            tip_diameter_sigma=number(text["tip_diameter_sigma"], tr("Ball ±")),
            tip_sigma=_vector(text["tip_sigma"], tr("Tip ±")),
            led_sigma=number(text["led_sigma"], tr("LEDs ±")),
            emission_half_angle_deg=number(text["emission_half_angle_deg"], tr("Light")),
            leds=list(leds),
            orientation_rules=_rules(text["rules"]),
            strobe=_strobe(text["strobe"]),
        )

    def path(self) -> Path:
        """Return the file; raise InputError if empty."""
        text = self.fields["file"].text().strip()
        if not text:
            raise InputError("definition.file", "No file name.", "Enter a new one.")
        return Path(text).expanduser()


def number(text: str, what: str) -> float:
    """Return a number, with point or comma; raise InputError if invalid."""
    return kit.read_number(replace(COORDINATE, words=what), text)


def _vector(text: str, what: str) -> Vector3:
    values = [number(word, what) for word in text.replace(";", " ").split()]
    if len(values) != 3:
        raise InputError(
            "definition.vector",
            f"{what} has {len(values)} numbers.",
            "Enter x y z, separated by spaces.",
        )
    return values[0], values[1], values[2]


def _rules(text: str) -> tuple[OrientationRule, ...]:
    rules = []
    for part in filter(None, (part.strip() for part in text.split(";"))):
        axis, _, world = part.partition(">")
        rules.append(
            OrientationRule(
                probe_axis=_vector(axis, tr("The axis of an orientation rule")),
                world_direction=_vector(world, tr("The direction of an orientation rule")),
            )
        )
    return tuple(rules)


def _strobe(text: str) -> StrobeEntry | None:
    if not text:
        return None
    period, _, dark = text.partition(":")
    return StrobeEntry(period=_frame(period), dark=[_frame(word) for word in dark.split()])


def _frame(text: str) -> int:
    value = number(text, tr("Frame of the strobe code"))
    if value != round(value):
        raise InputError(
            "definition.strobe", f"Frame of the strobe code is {text.strip()!r}.",
            "Enter whole numbers, e.g. 8: 0 1 2 3 4 5.",
        )  # fmt: skip
    return round(value)


def _text(vector: Vector3) -> str:
    return " ".join(kit.localised(f"{value:g}") for value in vector)
