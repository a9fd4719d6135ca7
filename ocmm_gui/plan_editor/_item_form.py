"""Form for one item of a plan: its fields as in the document, one line each."""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection, Mapping
from typing import Any

import msgspec
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFocusEvent
from PySide6.QtWidgets import QGridLayout, QLabel, QLineEdit, QPlainTextEdit, QScrollArea, QWidget

from ocmm_core.errors import InputError
from ocmm_core.tolerances.kinds import KINDS, spec_of
from ocmm_gui.kit import ChoiceBox, Themed, caption, form_field, literal, text_font
from ocmm_gui.plan_editor._field_labels import choice_word
from ocmm_gui.plan_editor._form_lines import (
    FLAGS,
    FieldKind,
    FormLine,
    closed,
    form_lines,
    opened,
    text_of,
    value_of,
)

_FONT = 14
_ROWS_PX = 132
_FIXED_PX = 84


class RowsField(QPlainTextEdit):
    """Multi-line text; Tab moves to the next field."""

    editingFinished = Signal()

    def __init__(self, name: str, tip: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setToolTip(literal(tip))
        self.setPlaceholderText(tip)
        self.setTabChangesFocus(True)
        self.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.setFont(text_font(_FONT))

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.editingFinished.emit()


Field = QLineEdit | ChoiceBox | RowsField


class ItemForm(Themed, QScrollArea):
    """Edit an item; errors name the field.

    If a choice decides which fields exist, the lines follow it and keep compatible values.

    `name`: Accessible name.
    `make`: Type of the item, as for `form_lines`.
    `without`: Fields without a line; they stay unchanged.
    `decider`: Field whose choice leaves others without a meaning; these lose line and value.
    `unused`: Returns these fields for a choice.
    """

    edited = Signal()
    """Focus left a field, or a choice was changed."""
    left = Signal()

    def __init__(
        self,
        name: str,
        make: Any,
        without: tuple[str, ...] = (),
        decider: str = "",
        unused: Callable[[str], Collection[str]] = lambda _choice: (),
    ) -> None:
        super().__init__()
        self._make, self._without = make, without
        self._decider, self._unused = decider, unused
        self._defaults: dict[str, Any] = {}
        if decider:
            fields = msgspec.structs.fields(make)
            self._defaults = {one.name: msgspec.to_builtins(_start(one)) for one in fields}
        self._faulty = ""
        self._data: dict[str, Any] = opened(make, None)
        self._lines: tuple[FormLine, ...] = ()
        self.fields: dict[str, Field] = {}
        self._captions: dict[str, QLabel] = {}
        self.setAccessibleName(name)
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.viewport().setAutoFillBackground(False)
        self._lay_out()

    def show_item(self, item: msgspec.Struct | None) -> None:
        """Fill in the fields; values without a field are kept."""
        self._show(opened(self._make, msgspec.to_builtins(item)))

    def item(self) -> Any:
        """Return the edited item; InputError names a field that cannot be read."""
        data = self._filled_in(strict=True)
        try:
            return msgspec.convert(closed(self._make, data), self._make)
        except msgspec.ValidationError as error:
            raise InputError(
                "plan.form", f"Invalid entry: {error}.", "Correct that field."
            ) from error

    def lines(self) -> tuple[FormLine, ...]:
        return self._lines

    def choice(self) -> str:
        """Return the selected kind of item; empty for none, or a single kind."""
        first = self._lines[0]
        return self._text(first.key) if first.decides else ""

    def mark(self, key: str) -> None:
        """Mark the faulty field; an empty key marks none."""
        inner = (name for name in self.fields if key and name.startswith(f"{key}."))
        self._faulty = key if key in self.fields else next(inner, "")
        for name, words in self._captions.items():
            colour = self._theme.bad if name == self._faulty else self._theme.muted
            weight = "bold" if name == self._faulty else "normal"
            words.setStyleSheet(f"color: {colour}; font-weight: {weight};")

    def faulty(self) -> str:
        """Return the key of the marked field; empty for none; for tests."""
        return self._faulty

    def focus_first(self) -> None:
        if self._lines:
            field = self.fields[self._lines[0].key]
            field.setFocus()
            if isinstance(field, QLineEdit):
                field.selectAll()

    def _paint(self) -> None:
        self.mark(self._faulty)

    def _show(self, data: dict[str, Any]) -> None:
        self._data = data
        if self._lines_of(data) != self._lines:
            self._lay_out()
        for line in self._lines:
            field = self.fields[line.key]
            text = text_of(line, _at(data, line.key, line.neutral), angle=_is_angle(data, line.key))
            if self._text(line.key) == text:
                continue
            field.blockSignals(True)
            if isinstance(field, ChoiceBox):
                field.choose(text)
            elif isinstance(field, RowsField):
                field.setPlainText(text)
            else:
                field.setText(text)
            field.blockSignals(False)

    def _filled_in(self, *, strict: bool) -> dict[str, Any]:
        """Return the data with the fields' content; unless ``strict``, as far as readable."""
        data = copy.deepcopy(self._data)
        for line in self._lines:
            if line.kind is FieldKind.FIXED:
                value = _at(data, line.key, "")
                if strict and line.key.rpartition(".")[2] == "digest" and not value:
                    raise InputError(
                        f"plan.form.{line.key}",
                        "A frame comes from its document and carries its hash.",
                        "Press Shift+F9 and choose the frame file; ocmm align creates one.",
                    )
                continue
            try:
                text, before = self._text(line.key), _at(self._data, line.key, line.neutral)
                if text == text_of(line, before, angle=_is_angle(self._data, line.key)) and (
                    _is_angle(data, line.key) == _is_angle(self._data, line.key)
                ):
                    # Untouched fields keep every digit of the document.
                    _put(data, line.key, before)
                    continue
                value = value_of(line, text, angle=_is_angle(data, line.key))
            except InputError:
                if strict:
                    raise
                value = line.neutral
            _put(data, line.key, value)
        return data

    def _text(self, key: str) -> str:
        field = self.fields[key]
        if isinstance(field, ChoiceBox):
            return field.choice()
        return (field.toPlainText() if isinstance(field, RowsField) else field.text()).strip()

    def _decided(self, key: str) -> None:
        """Show the lines of another choice."""
        outer, _, name = key.rpartition(".")
        data = self._filled_in(strict=False)
        if outer:
            # Equal names in another kind have another meaning.
            data[outer] = {name: _at(data, key, "")}
        elif key == self._decider:
            data |= {name: self._defaults[name] for name in self._unused(data[key])}
        self._show(data)
        self.fields[key].setFocus()
        self.edited.emit()

    def _lines_of(self, data: Mapping[str, Any]) -> tuple[FormLine, ...]:
        """Return the lines; an unused field has one if the document has a value for it."""
        lines = form_lines(self._make, data, self._without)
        unused = self._unused(data[self._decider]) if data.get(self._decider) else ()
        without = {name for name in unused if data.get(name) in (None, self._defaults[name])}
        return tuple(line for line in lines if line.key not in without)

    def _lay_out(self) -> None:
        self._lines = self._lines_of(self._data)
        inside = QWidget()
        # The panel behind shows through.
        inside.setAutoFillBackground(False)
        grid = QGridLayout(inside)
        grid.setContentsMargins(0, 0, 6, 0)
        grid.setVerticalSpacing(5)
        self.fields, self._captions = {}, {}
        for row, line in enumerate(self._lines):
            field = self._field(line)
            words = caption(line.label, field)
            words.setToolTip(literal(line.tip))
            several = isinstance(field, RowsField)
            top = Qt.AlignmentFlag.AlignTop if several else Qt.AlignmentFlag.AlignVCenter
            grid.addWidget(words, row, 0, top)
            grid.addWidget(field, row, 1)
            self.fields[line.key], self._captions[line.key] = field, words
        grid.setRowStretch(len(self._lines), 1)
        before = self.takeWidget()
        if before is not None:
            # One of its fields may be emitting a signal now.
            before.hide()
            before.deleteLater()
        self.setWidget(inside)
        self.mark(self._faulty)

    def _field(self, line: FormLine) -> Field:
        if line.kind in (FieldKind.CHOICE, FieldKind.FLAG):
            choice = ChoiceBox(line.label, line.tip, line.choices or FLAGS, choice_word)
            choice.setFont(text_font(_FONT))
            choice.set_theme(self._theme)
            if line.decides or line.key == self._decider:
                choice.currentTextChanged.connect(lambda _text, key=line.key: self._decided(key))
            else:
                choice.currentTextChanged.connect(lambda _text: self.edited.emit())
            return choice
        if line.kind in (FieldKind.PLACES, FieldKind.FIXED):
            rows = RowsField(line.label, line.tip)
            rows.setFixedHeight(_ROWS_PX if line.kind is FieldKind.PLACES else _FIXED_PX)
            if line.kind is FieldKind.FIXED:
                rows.setReadOnly(True)
            else:
                rows.editingFinished.connect(self.edited)
            return rows
        field = form_field(line.label, line.tip)
        field.setFont(text_font(_FONT))
        field.editingFinished.connect(self.edited)
        field.left.connect(self.left)
        return field


def _start(field: msgspec.structs.FieldInfo) -> Any:
    made = field.default_factory
    return made() if callable(made) else None if field.required else field.default


def _is_angle(data: Mapping[str, Any], key: str) -> bool:
    """Return whether the item of a line is an angle, by its kind."""
    outer = key.rpartition(".")[0]
    kind = _at(data, f"{outer}.kind" if outer else "kind", "")
    return kind in KINDS and spec_of(kind).unit == "deg"


def _at(data: Mapping[str, Any], key: str, otherwise: Any) -> Any:
    found: Any = data
    for part in key.split("."):
        if not isinstance(found, Mapping) or part not in found:
            return otherwise
        found = found[part]
    return found


def _put(data: dict[str, Any], key: str, value: Any) -> None:
    *outer, name = key.split(".")
    for part in outer:
        data = data.setdefault(part, {})
    data[name] = value
