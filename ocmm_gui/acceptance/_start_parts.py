"""Parts of the start page: lists, captions, buttons, and terms of the core."""

from __future__ import annotations

from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QPushButton, QWidget

from ocmm_core.acceptance import ProcedureOffer
from ocmm_gui.kit import NarrowButton, PlainLabel, later, literal, text_font, tr

ROW_PX = 34
KIND_WORDS = {
    "sphere": later("sphere"), "bar": later("bar"), "gauge block": later("gauge block"),
    "part": later("part"), "plate": later("plate"), "dumbbell": later("dumbbell"),
    "cone": later("cone"),
}  # fmt: skip
"""Displayed kinds of artefacts and roles in a test."""


def kind_word(kind: str) -> str:
    return tr(KIND_WORDS[kind]) if kind in KIND_WORDS else kind


def limits_text(offer: ProcedureOffer) -> str:
    one = offer.procedure
    limits = ", ".join(f"{key} {limit.describe()}" for key, limit in one.limits.items())
    return tr("{wording}; rule: {rule}; limits: {limits}").format(
        wording=one.wording, rule=one.rule, limits=limits
    )


def choice_list(name: str) -> QListWidget:
    """Return an empty list with its name."""
    found = QListWidget()
    found.setAccessibleName(name)
    found.setFont(text_font(15))
    found.setWordWrap(True)
    return found


def add_line(where: QListWidget, text: str) -> None:
    """Add a line, with a tool tip in case it is cut."""
    item = QListWidgetItem(text, where)
    item.setToolTip(literal(text))
    item.setSizeHint(QSize(100, ROW_PX))


def caption_of(text: str, buddy: QWidget) -> PlainLabel:
    """Return the muted name of a control."""
    label = PlainLabel(text)
    label.setFont(text_font(15))
    label.setProperty("role", "muted")
    label.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
    label.setBuddy(buddy)
    return label


def large_button(text: str, name: str, key: str) -> QPushButton:
    """Return a button of the foot with its key; that of Return is the primary one."""
    button = NarrowButton(text)
    button.setAccessibleName(name)
    button.setFont(text_font(17, bold=True))
    button.setMinimumHeight(50)
    button.setShortcut(key)
    button.setProperty("role", "primary" if key == "Return" else "plain")
    return button
