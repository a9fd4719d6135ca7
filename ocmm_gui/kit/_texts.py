"""The sentences of the window, in the language of whoever reads them.

Every literal that reaches the screen stands in one of two calls, from which Qt's `lupdate` takes
it:

- `tr` translates, where the sentence is used;
- `later` only marks a sentence of a table, which is read when the module is loaded, long before a
  language is chosen. Whoever shows it calls `tr` with it.

A sentence is whole: what changes in it has a name in braces and is filled in afterwards, so that a
translation may put it elsewhere.

What the core says (errors, reasons, steps, verdicts) are finished sentences of its own: `said` and
`said_word` show them in the language of the window, or as they are.

What is filled in comes from plans, jobs and paths, and Qt reads what looks like HTML as HTML, with
links and pictures. No text of the window is HTML: labels are `PlainLabel`, and every tool tip goes
through `literal`.
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
from ocmm_gui.kit._narrow import Fitted, fit_words, is_longer, least_width
from ocmm_gui.kit._numbers import Sentence, numbers_in_use, unit_word

_JOINER = "\N{WORD JOINER}"

T = TypeVar("T", bound=tuple[object, ...])


def tr(sentence: str, one: str = "", count: int = -1) -> str:
    """Return a sentence in the language of the window, or as it is where there is no translation.

    Its ``format`` writes numbers with the decimal sign in use (`_numbers`).

    Parameters
    ----------
    sentence
        In English. With a ``count``, ``%n`` stands for it.
    one
        The English sentence for a count of one; languages with other plurals translate by
        ``count``.
    count
        How many there are; negative where nothing is counted.
    """
    text = QCoreApplication.translate("", sentence, one or None, count)
    if count == 1 and one and text == sentence.replace("%n", "1"):
        text = one
    return Sentence(text) if numbers_in_use().comma else text


def later(sentence: str) -> str:
    """Return a sentence as it is, marked for translation; `tr` translates it when it is shown."""
    return sentence


def tr_all(table: T) -> T:
    """Return a table of sentences that were marked with `later`, as `tr` translates them."""
    translated = (
        tr(item) if isinstance(item, str) else tr_all(item) if isinstance(item, tuple) else item
        for item in table
    )
    return cast("T", tuple(translated))


def said(text: str) -> str:
    """Return sentences of the core as they are shown; English where one of them is not known."""
    language = language_in_use()
    if language == ENGLISH:
        return text
    return _catalogue(language, numbers_in_use().comma).of(text)


def said_word(text: str) -> str:
    """Return a word of the core (a verdict, a state, a shape, a heading) as it is shown."""
    language = language_in_use()
    return text if language == ENGLISH else _catalogue(language, False).word(text)


@functools.cache
def _catalogue(language: str, comma: bool) -> Translation:  # a key of a cache
    """Return the sentences of the core; none where they cannot be read, as for those of Qt."""
    try:
        return load_translation(language, comma=comma)
    except OcmmError:
        return Translation({}, {})


def with_unit(table: T) -> T:
    """Return a table of sentences in which ``{unit}`` is the unit in which lengths are shown."""
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
    """Return a text that Qt shows as it is, also where it looks like HTML; the same one twice."""
    if not QtGui.Qt.mightBeRichText(text):
        return text
    # A mark without width and without meaning: behind it no tag and no entity begins.
    return text.replace("<", f"<{_JOINER}").replace("&", f"&{_JOINER}")


class PlainLabel(QLabel):
    """A label that shows its text and its tool tip as they are, and whole in every language."""

    def __init__(self, text: str = "", parent: QWidget | None = None) -> None:
        super().__init__(text, parent, textFormat=Qt.TextFormat.PlainText)

    def setToolTip(self, text: str) -> None:
        """Set a tool tip that is shown as it is."""
        super().setToolTip(literal(text))

    def minimumSizeHint(self) -> QSize:
        """Return what the words need at their least size."""
        hint = super().minimumSizeHint()
        if not is_longer() or self.wordWrap() or not self.text():
            return hint
        full = max(self.fontMetrics().horizontalAdvance(line) for line in self.text().split("\n"))
        need = least_width(self.text(), self.font(), rows=1)
        return QSize(min(hint.width(), round(hint.width() - full + need) + 1), hint.height())

    def fitted(self) -> Fitted | None:
        """Return how the words are painted; None where they do not fit."""
        room = self.contentsRect()
        return fit_words(
            self.text(), self.font(), room.width(), room.height(), wraps=self.wordWrap()
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the words in the type that fits."""
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
