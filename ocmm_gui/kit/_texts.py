"""Sentences of the window in the user's language.

Every displayed literal is in one of two calls, which Qt's `lupdate` extracts:

- `tr` translates where the sentence is used;
- `later` marks a sentence of a table, which is loaded before a language is chosen; `tr` translates
  it for display.

Sentences are whole: variable parts are named fields filled in afterwards, so that translations can
reorder them.

Texts of the core (errors, reasons, steps, verdicts) are complete sentences: `said` and `said_word`
translate them if possible.

Filled-in values come from plans, jobs and paths, and Qt interprets HTML-like text, with links and
images. No text of the window is HTML: labels are `PlainLabel`, and every tool tip goes through
`literal`.
"""

from __future__ import annotations

import functools
from typing import TypeVar, cast

from PySide6 import QtGui
from PySide6.QtCore import QCoreApplication, QSize, Qt
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QLabel, QWidget

from ocmm_core.errors import OcmmError
from ocmm_core.wording import ENGLISH, Translation, load_translation
from ocmm_gui.kit._language import language_in_use
from ocmm_gui.kit._narrow import FittedText, fit_words, is_longer, least_width
from ocmm_gui.kit._numbers import Sentence, numbers_in_use, unit_word

_JOINER = "\N{WORD JOINER}"

T = TypeVar("T", bound=tuple[object, ...])


def tr(sentence: str, one: str = "", count: int = -1) -> str:
    """Return a sentence in the language of the window, if translated.

    Its ``format`` writes numbers with the decimal sign in use (`_numbers`). ``sentence`` is
    English, with ``%n`` for a ``count`` (negative: nothing is counted); ``one``: English for a
    count of one; other languages have their own plurals.
    """
    text = QCoreApplication.translate("", sentence, one or None, count)
    if count == 1 and one and text == sentence.replace("%n", "1"):
        text = one
    return Sentence(text) if numbers_in_use().comma else text


def later(sentence: str) -> str:
    """Return a sentence unchanged, marked for translation by `tr`."""
    return sentence


def tr_all(table: T) -> T:
    """Return a table of `later` sentences translated by `tr`."""
    translated = (
        tr(item) if isinstance(item, str) else tr_all(item) if isinstance(item, tuple) else item
        for item in table
    )
    return cast("T", tuple(translated))


def said(text: str) -> str:
    """Return sentences of the core for display; English without translation."""
    language = language_in_use()
    if language == ENGLISH:
        return text
    return _catalogue(language, numbers_in_use().comma).of(text)


def said_word(text: str) -> str:
    """Return a word of the core (verdict, state, shape, heading) for display."""
    language = language_in_use()
    return text if language == ENGLISH else _catalogue(language, False).word(text)


@functools.cache
def _catalogue(language: str, comma: bool) -> Translation:  # used as cache key
    """Return the core's translations; empty if unreadable, as for Qt's."""
    try:
        return load_translation(language, comma=comma)
    except OcmmError:
        return Translation({}, {})


def with_unit(table: T) -> T:
    """Return a table of sentences with ``{unit}`` as the displayed length unit."""
    named = (
        item.replace("{unit}", unit_word())
        if isinstance(item, str)
        else with_unit(item)
        if isinstance(item, tuple)
        else item
        for item in table
    )
    return cast("T", tuple(named))


def literal(text: str) -> str:
    """Return a text that Qt shows literally, even if it looks like HTML; idempotent."""
    if not QtGui.Qt.mightBeRichText(text):
        return text
    # A zero-width joiner: prevents tags and entities.
    return text.replace("<", f"<{_JOINER}").replace("&", f"&{_JOINER}")


class PlainLabel(QLabel):
    """A label with literal text and tool tip, fully visible in every language."""

    def __init__(self, text: str = "", parent: QWidget | None = None) -> None:
        super().__init__(text, parent, textFormat=Qt.TextFormat.PlainText)

    def setToolTip(self, text: str) -> None:
        super().setToolTip(literal(text))

    def minimumSizeHint(self) -> QSize:
        hint = super().minimumSizeHint()
        if not is_longer() or self.wordWrap() or not self.text():
            return hint
        full = max(self.fontMetrics().horizontalAdvance(line) for line in self.text().split("\n"))
        need = least_width(self.text(), self.font(), rows=1)
        return QSize(min(hint.width(), round(hint.width() - full + need) + 1), hint.height())

    def fitted(self) -> FittedText | None:
        """Return the layout of the text; None if it does not fit."""
        room = self.contentsRect()
        return fit_words(
            self.text(), self.font(), room.width(), room.height(), wraps=self.wordWrap()
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        found = self.fitted() if is_longer() and self.text() else None
        if found is None or (found.text == self.text() and found.font == self.font()):
            super().paintEvent(event)
            return
        painter = QPainter(self)
        painter.setFont(found.font)
        flags = self.alignment() | (Qt.TextFlag.TextWordWrap if self.wordWrap() else 0)
        self.style().drawItemText(
            painter, self.contentsRect(), int(flags), self.palette(), self.isEnabled(),
            found.text, self.foregroundRole(),
        )  # fmt: skip
