"""Languages of the window, and switching between them.

Sentences of a language are a Qt file, made from `resources/i18n/ocmm_de.ts` by ``python -m
docs.make_texts``. Qt's own texts (dialog buttons, field menus) come from the file that PySide6
ships.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QLibraryInfo, QLocale, QTranslator

from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.wording import load_translation

LANGUAGES = ("en", "de")
"""Available languages; sentences of the first are in the sources."""

_SYSTEM = "system"
_MARK = "ocmm_language"
_FOLDER = "i18n"


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
