"""Sentences and numbers of the window in the user's language, and switching between languages.

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

Numbers, lengths and dates are formatted here only. Internally and in files numbers have a point,
lengths are in mm and dates are ISO 8601. The display follows language and settings: `style_of`
makes a `NumberStyle`, and `use_numbers` activates it before windows are created. Sentences from
`tr` format numbers in this style automatically. Other texts use `localised`, lengths
`length_number` with `unit_word`, days and times `day_words` and `time_words`.
"""

from __future__ import annotations

import functools
import re
import string
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime
from numbers import Real
from pathlib import Path
from typing import Any, ClassVar, TypeVar, cast

from PySide6 import QtGui
from PySide6.QtCore import QCoreApplication, QLibraryInfo, QLocale, QTranslator

from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from ocmm_core.tables import typed_number
from ocmm_core.typed_numbers import NumberField
from ocmm_core.units import find_unit, named_unit, scaled
from ocmm_core.wording import ENGLISH, Translation, load_translation

LANGUAGES = ("en", "de")
"""Available languages; sentences of the first are in the sources."""

_MARK = "ocmm_language"
_FOLDER = "i18n"
_JOINER = "\N{WORD JOINER}"

T = TypeVar("T", bound=tuple[object, ...])


def tr(sentence: str, one: str = "", count: int = -1) -> str:
    """Return a sentence in the language of the window, if translated.

    Its ``format`` writes numbers with the decimal sign in use (`NumberStyle`). ``sentence`` is
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


INCH_MM = named_unit("inch", "length").factor

_INCH_DECIMALS = 2
"""Additional decimals: 0.001 mm is 0.00004 in."""
_POINT = re.compile(r"(?<=\d)\.(?=\d)")
_BOTH = re.compile(r"[.,]")


@dataclass(frozen=True, slots=True)
class NumberStyle:
    comma: bool = False
    """Comma as decimal sign, point as thousands separator."""
    inch: bool = False
    """Lengths of the part are shown and typed in inch."""
    day: str = "%Y-%m-%d"


_DAYS = {"de": "%d.%m.%Y"}
_COMMAS = ("de",)


def style_of(language: str, decimal: str = "locale", units: str = "mm") -> NumberStyle:
    """Return the number style of a language; `decimal`: ``locale``, ``point`` or ``comma``."""
    comma = language in _COMMAS if decimal == "locale" else decimal == "comma"
    return NumberStyle(comma, units == "inch", _DAYS.get(language, NumberStyle().day))


class _InUse:
    style: ClassVar[NumberStyle] = NumberStyle()


def use_numbers(style: NumberStyle) -> None:
    """Use a style from now on, in this process; existing displays do not change."""
    _InUse.style = style


def numbers_in_use() -> NumberStyle:
    return _InUse.style


def localised(text: str) -> str:
    """Return a text with the decimal sign in use for points between digits."""
    return _POINT.sub(",", text) if _InUse.style.comma else text


def is_ambiguous(text: str) -> bool:
    """Return whether a typed number could mean two values."""
    digits = any(sign.isdigit() for sign in text)
    return digits and bool(_BOTH.search(text)) and typed_value(text) is None


def typed_value(text: str) -> float | None:
    """Return a typed number; None if invalid or ambiguous."""
    return typed_number(text, comma=_InUse.style.comma)


def read_number(field: NumberField, text: str) -> float:
    """Return a number typed in the style in use; InputError as `NumberField.read`."""
    return field.read(text, comma=_InUse.style.comma)


def unit_word() -> str:
    return "in" if _InUse.style.inch else "mm"


def length_number(value_mm: float, *, signed: bool = False, decimals: int = 3) -> str:
    """Return a length without unit; `decimals` are for mm, two more in inch."""
    value = value_mm
    if _InUse.style.inch:
        value, decimals = value_mm / INCH_MM, decimals + _INCH_DECIMALS
    rounded = round(value, decimals) + 0.0  # adding zero turns -0.0 into 0.0
    return localised(f"{rounded:+.{decimals}f}" if signed else f"{rounded:.{decimals}f}")


def length_words(value_mm: float, *, signed: bool = False, decimals: int = 3) -> str:
    return f"{length_number(value_mm, signed=signed, decimals=decimals)} {unit_word()}"


_TYPED_DECIMALS = 8
"""Of an inch in a field: half a step is a tenth of the nanometre to which it is read."""

_READ_DECIMALS = 6
_WITH_UNIT = re.compile(r"(?P<number>.*?[\d.,])?\s*(?P<unit>[^\d\s.,+-]\D*)")


def field_length(value_mm: float) -> str:
    """Return a length for a field, with the unit only in inch."""
    if not _InUse.style.inch:
        short = f"{value_mm:g}"
        return localised(short if float(short) == value_mm else str(value_mm))
    text = f"{value_mm / INCH_MM:.{_TYPED_DECIMALS}f}".rstrip("0").rstrip(".")
    return f"{localised('0' if text == '-0' else text)} {unit_word()}"


def split_unit(text: str) -> tuple[str, str]:
    """Return a number as it was typed, and the unit of length behind it or an empty text."""
    found = _WITH_UNIT.fullmatch(text.strip())
    if found is None or find_unit(found["unit"], "length") is None:
        return text.strip(), ""
    return (found["number"] or "").strip(), found["unit"]


def to_mm(value: float, unit: str) -> float:
    """Return a length in mm; without a unit it is in the one that is shown."""
    factor = named_unit(unit or unit_word(), "length").factor
    return value if factor == 1.0 else round(scaled(value, factor), _READ_DECIMALS)


def day_words(when: date | str) -> str:
    """Return a day; of an ISO 8601 time the local one, of other text the text."""
    if isinstance(when, str):
        try:
            if len(when) > len("2026-01-31"):
                return day_words(datetime.fromisoformat(when).astimezone())
            return day_words(date.fromisoformat(when))
        except ValueError:
            return when
    return f"{when:{_InUse.style.day}}"


def time_words(when: datetime) -> str:
    """Return day, hour and minute."""
    return f"{when:{_InUse.style.day} %H:%M}"


class _Commas(string.Formatter):
    def format_field(self, value: Any, format_spec: str) -> Any:
        text = super().format_field(value, format_spec)
        if not isinstance(value, Real) or isinstance(value, bool):
            return text
        return _BOTH.sub(lambda sign: "," if sign.group() == "." else ".", text)


_COMMAS_FORMATTER = _Commas()


class Sentence(str):
    """A sentence whose `format` writes decimal commas; otherwise a plain string."""

    __slots__ = ()

    def format(self, *args: object, **names: object) -> str:
        """Format; numbers get a comma, texts are unchanged."""
        return _COMMAS_FORMATTER.vformat(self, args, names)
