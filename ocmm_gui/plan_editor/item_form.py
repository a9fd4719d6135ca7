"""A form for one item of a plan: its fields as the document has them, one line each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Generic, TypeVar

import msgspec
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QGridLayout, QLabel, QLineEdit, QScrollArea, QWidget

from ocmm_core.errors import InputError
from ocmm_core.inspection.plan_csv import number
from ocmm_gui.sheet import ChoiceBox, caption, form_field
from ocmm_gui.theme import DEFAULT_THEME, THEMES, Theme, text_font

Item = TypeVar("Item", bound=msgspec.Struct)


class Kind(Enum):
    """What a field holds."""

    TEXT = "text"
    COUNT = "whole number"
    NUMBER = "number"
    VECTOR = "three numbers"
    NAMES = "names"
    CHOICE = "one of a list"


@dataclass(frozen=True, slots=True)
class FormLine:
    """One field of an item.

    Attributes
    ----------
    key
        As in the document.
    label, tip
        For people.
    kind
        What it holds.
    choices
        Where only these are possible.
    """

    key: str
    label: str
    tip: str
    kind: Kind = Kind.TEXT
    choices: tuple[str, ...] = ()


class ItemForm(QScrollArea, Generic[Item]):
    """Fill in an item; what cannot be read is said for the field.

    Parameters
    ----------
    name
        Accessible name.
    make
        Type of the item.
    lines
        Its fields.
    """

    edited = Signal()
    """A field was left, or another choice was made."""
    left = Signal()
    """Esc was pressed."""

    def __init__(self, name: str, make: type[Item], lines: Sequence[FormLine]) -> None:
        super().__init__()
        self._make, self._lines = make, tuple(lines)
        self._theme = THEMES[DEFAULT_THEME]
        self._faulty = ""
        self._kept: dict[str, Any] = {}
        self.setAccessibleName(name)
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        inside = QWidget()
        grid = QGridLayout(inside)
        grid.setContentsMargins(0, 0, 6, 0)
        grid.setVerticalSpacing(5)
        self.fields: dict[str, QLineEdit | QComboBox] = {}
        self._captions: dict[str, QLabel] = {}
        for row, line in enumerate(self._lines):
            field = self._field(line)
            words = caption(line.label, field)
            words.setToolTip(line.tip)
            grid.addWidget(words, row, 0)
            grid.addWidget(field, row, 1)
            self.fields[line.key], self._captions[line.key] = field, words
        grid.setRowStretch(len(self._lines), 1)
        self.setWidget(inside)
        # The panel behind shows through.
        for widget in (self.viewport(), inside):
            widget.setAutoFillBackground(False)

    def show_item(self, item: Item) -> None:
        """Fill the fields in; what has no field is kept as it is."""
        self._kept = msgspec.to_builtins(item)
        for line in self._lines:
            field, text = self.fields[line.key], _text(self._kept.get(line.key))
            field.blockSignals(True)
            if isinstance(field, QComboBox):
                field.setCurrentText(text)
            elif field.text() != text:
                field.setText(text)
            field.blockSignals(False)

    def item(self) -> Item:
        """Return what is filled in.

        Raises
        ------
        InputError
            A field cannot be read; the sentence names it.
        """
        data = dict(self._kept)
        for line in self._lines:
            data[line.key] = _value(line, self._read(line.key))
        try:
            return msgspec.convert(data, self._make)
        except msgspec.ValidationError as error:
            raise InputError(
                "plan.form", f"What is filled in cannot be used: {error}.", "Correct that field."
            ) from error

    def mark(self, key: str) -> None:
        """Mark the field that is at fault; an empty key marks none."""
        self._faulty = key
        for name, words in self._captions.items():
            colour = self._theme.bad if name == key else self._theme.muted
            weight = "bold" if name == key else "normal"
            words.setStyleSheet(f"color: {colour}; font-weight: {weight};")

    def faulty(self) -> str:
        """Return the key of the field that is marked; empty for none."""
        return self._faulty

    def focus_first(self) -> None:
        """Put the keyboard into the first field."""
        field = self.fields[self._lines[0].key]
        field.setFocus()
        if isinstance(field, QLineEdit):
            field.selectAll()

    def set_theme(self, theme: Theme) -> None:
        """Paint with ``theme`` from now on."""
        self._theme = theme
        self.mark(self._faulty)

    def _read(self, key: str) -> str:
        field = self.fields[key]
        text = field.currentText() if isinstance(field, QComboBox) else field.text()
        return text.strip()

    def _field(self, line: FormLine) -> QLineEdit | QComboBox:
        if line.kind is Kind.CHOICE:
            choice = ChoiceBox(line.label, line.tip, line.choices)
            choice.setFont(text_font(14))
            choice.currentTextChanged.connect(lambda _text: self.edited.emit())
            return choice
        field = form_field(line.label, line.tip)
        field.setFont(text_font(14))
        field.editingFinished.connect(self.edited)
        field.left.connect(self.left)
        return field


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        parts = [_text(item) for item in value]
        return ", ".join(parts) if value and isinstance(value[0], str) else "  ".join(parts)
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(
        "" if value is None else value
    )


def _value(line: FormLine, text: str) -> Any:
    if line.kind is Kind.NAMES:
        return [part.strip() for part in text.split(",") if part.strip()]
    if line.kind in (Kind.TEXT, Kind.CHOICE):
        return text
    words = text.split() if line.kind is Kind.VECTOR else [text]
    values = [number(word) for word in words]
    wanted = 3 if line.kind is Kind.VECTOR else 1
    whole = line.kind is Kind.COUNT
    if len(values) != wanted or any(
        value is None or (whole and value != int(value)) for value in values
    ):
        raise InputError(
            f"plan.form.{line.key}",
            f"{line.label} is {text!r}, which is not {_WANTED[line.kind]}.",
            f"{line.tip}.",
        )
    numbers = [value for value in values if value is not None]
    if line.kind is Kind.VECTOR:
        return numbers
    return int(numbers[0]) if whole else numbers[0]


_WANTED: Mapping[Kind, str] = {
    Kind.COUNT: "a whole number",
    Kind.NUMBER: "a number",
    Kind.VECTOR: "three numbers with spaces between them",
}
