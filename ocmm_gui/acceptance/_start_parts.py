"""Parts of the start page: lists, captions, buttons, and terms of the core."""

from __future__ import annotations

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QListWidget, QListWidgetItem

from ocmm_core.acceptance import ProcedureOffer
from ocmm_gui.kit import later, literal, localised, said, said_word, text_font, tr

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
    limits = ", ".join(
        localised(f"{said_word(key)} {limit.describe()}") for key, limit in one.limits.items()
    )
    return tr("{wording}; rule: {rule}; limits: {limits}").format(
        wording=said(one.wording), rule=said_word(one.rule), limits=limits
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
