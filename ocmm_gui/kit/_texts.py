"""The sentences of the window, in the language of whoever reads them.

Every literal that reaches the screen stands in one of two calls, from which Qt's `lupdate` takes
it:

- `tr` translates, where the sentence is used;
- `later` only marks a sentence of a table, which is read when the module is loaded, long before a
  language is chosen. Whoever shows it calls `tr` with it.

A sentence is whole: what changes in it has a name in braces and is filled in afterwards, so that a
translation may put it elsewhere.

What the core says (errors, reasons, steps, verdicts) are finished sentences of its own: `said` and
`said_word` show them in the language that `show_core_in` chose, or as they are.

What is filled in comes from plans, jobs and paths, and Qt reads what looks like HTML as HTML, with
links and pictures. No text of the window is HTML: labels are `PlainLabel`, and every tool tip goes
through `literal`.
"""

from __future__ import annotations

from typing import TypeVar, cast

from PySide6 import QtGui
from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtWidgets import QLabel, QWidget

from ocmm_core.wording import ENGLISH, load_translation

_JOINER = "\N{WORD JOINER}"

_CORE = "ocmm_core_language"
"""Property of the application; without it the core speaks English."""

T = TypeVar("T", bound=tuple[object, ...])


def tr(sentence: str, one: str = "", count: int = -1) -> str:
    """Return a sentence in the language of the window, or as it is where there is no translation.

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
        return one
    return text


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


def show_core_in(language: str) -> None:
    """Show what the core says in a language; only a window that was asked to loads a catalogue.

    Raises
    ------
    InputError
        The catalogue of the language cannot be read; what was chosen before stays.
    """
    application = QCoreApplication.instance()
    if application is not None:
        load_translation(language)
        application.setProperty(_CORE, language)


def core_language() -> str:
    """Return the language in which the window shows what the core says."""
    application = QCoreApplication.instance()
    chosen = None if application is None else application.property(_CORE)
    return chosen if isinstance(chosen, str) else ENGLISH


def said(text: str) -> str:
    """Return sentences of the core as they are shown; English where one of them is not known."""
    language = core_language()
    return text if language == ENGLISH else load_translation(language).of(text)


def said_word(text: str) -> str:
    """Return a word of the core (a verdict, a state, a shape, a heading) as it is shown."""
    language = core_language()
    return text if language == ENGLISH else load_translation(language).word(text)


def literal(text: str) -> str:
    """Return a text that Qt shows as it is, also where it looks like HTML; the same one twice."""
    if not QtGui.Qt.mightBeRichText(text):
        return text
    # A mark without width and without meaning: behind it no tag and no entity begins.
    return text.replace("<", f"<{_JOINER}").replace("&", f"&{_JOINER}")


class PlainLabel(QLabel):
    """A label that shows its text and its tool tip as they are."""

    def __init__(self, text: str = "", parent: QWidget | None = None) -> None:
        super().__init__(text, parent, textFormat=Qt.TextFormat.PlainText)

    def setToolTip(self, text: str) -> None:
        """Set a tool tip that is shown as it is."""
        super().setToolTip(literal(text))
