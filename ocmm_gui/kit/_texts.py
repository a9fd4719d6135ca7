"""Sentences of the window in the user's language, and switching between languages.

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

Sentences of a language are a Qt file, made from `resources/i18n/ocmm_de.ts` by ``python -m
docs.make_texts``. Qt's own texts (dialog buttons, field menus) come from the file that PySide6
ships.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar, cast

from PySide6 import QtGui
from PySide6.QtCore import QCoreApplication, QLibraryInfo, QLocale, QTranslator

from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.wording import ENGLISH, Translation, load_translation
from ocmm_gui.kit._numbers import Sentence, numbers_in_use, unit_word

LANGUAGES = ("en", "de")
"""Available languages; sentences of the first are in the sources."""

_MARK = "ocmm_language"
_FOLDER = "i18n"
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
    return _catalogue(language, numbers_in_use().comma).translate(text)


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


def chosen_language(setting: str, wanted: Sequence[str] | None = None) -> str:
    """Return the language of a setting, or for ``system`` of ``wanted``, None: the system's."""
    if setting in LANGUAGES:
        return setting
    if wanted is None:
        wanted = QLocale.system().uiLanguages()
    for name in wanted:
        language = name.replace("_", "-").partition("-")[0].lower()
        if language in LANGUAGES:
            return language
    return LANGUAGES[0]


def language_file(language: str) -> Path:
    """Return the compiled sentences of a language; English has no such file."""
    return resource(_FOLDER, f"ocmm_{language}.qm")


def use_language(app: QCoreApplication, language: str) -> bool:
    """Use a language from now on; return whether its files were complete.

    Call it before creating windows. Without a file, sentences are English; nothing is raised.
    """
    for translator in app.findChildren(QTranslator):
        if translator.objectName() == _MARK:
            app.removeTranslator(translator)
            translator.setParent(None)
            translator.deleteLater()
    app.setProperty(_MARK, language)
    if language == LANGUAGES[0]:
        return True
    of_qt = Path(QLibraryInfo.path(QLibraryInfo.LibraryPath.TranslationsPath))
    # The later one has priority: our texts override Qt's.
    found = [
        _install(app, path) for path in (of_qt / f"qtbase_{language}.qm", language_file(language))
    ]
    return all(found) and _core_speaks(language)


def language_in_use(app: QCoreApplication | None = None) -> str:
    """Return the language in use; English by default."""
    app = app or QCoreApplication.instance()
    name = None if app is None else app.property(_MARK)
    return name if isinstance(name, str) else LANGUAGES[0]


def _install(app: QCoreApplication, path: Path) -> bool:
    translator = QTranslator(app)
    translator.setObjectName(_MARK)
    return translator.load(str(path)) and app.installTranslator(translator)


def _core_speaks(language: str) -> bool:
    try:
        load_translation(language)
    except OcmmError:
        return False
    return True
