"""Translation of the core's finished English sentences.

Errors, reasons, steps and warnings are complete English sentences, as logs and files contain them.
They are recognised by the catalogue that `docs/make_core_texts.py` collects from the sources;
values are copied into the translated sentence character by character. An ambiguous sentence stays
English (decision 47).
"""

from __future__ import annotations

import functools
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import msgspec

from ocmm_core.documents import decode_json, read_bytes, resource
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.wording._pattern import KNOWN_WORD, NUMBER, SENTENCE, WORD, Pattern

ENGLISH = "en"
LANGUAGES = (ENGLISH, "de")
"""Languages of the core; the first is that of the sources."""

LANGUAGE_VARIABLE = "OCMM_LANGUAGE"


def language_of(environment: Mapping[str, str], chosen: str = "") -> str:
    """Return the language: OCMM_LANGUAGE, else the setting ``chosen``, else the system's.

    The language of the system is the first of ``LC_ALL``, ``LC_MESSAGES`` and ``LANG`` that is set
    in ``environment`` (POSIX.1-2017, 8.2).
    """
    system = next(
        (found for name in ("LC_ALL", "LC_MESSAGES", "LANG") if (found := environment.get(name))),
        "",
    )
    for wanted in (environment.get(LANGUAGE_VARIABLE, ""), chosen):
        if _short(wanted) in LANGUAGES:
            return _short(wanted)
    return _short(system) if _short(system) in LANGUAGES else ENGLISH


def _short(name: str) -> str:
    """Return the language of a locale: ``de`` of ``de_AT.UTF-8``."""
    return name.replace("-", "_").split("_")[0].split(".")[0].lower()


C = TypeVar("C")

_LETTERS = re.compile(r"[^\W\d_]+")
_LOWER_WORDS = re.compile(r"(?<![\w'\"/.])[a-z]{2,}(?![\w'\"/.])")
_SAYS_SOMETHING = re.compile(r"(?:\b[a-z]{2,} ){4}|\w[.!?] [A-Z][a-z]|[a-z]{2}[.!?] [A-Z]")
_END_OF_SENTENCE = re.compile(r"(?<=[.!?:;)])\s+|\n+")
_BEFORE_A_SENTENCE = frozenset(":;,")
_POINT = re.compile(r"(?<=\d)\.(?=\d)")
_DEEPEST = 2
_MOST_PIECES = 16
_REMEMBERED = 4096


class _English(msgspec.Struct, frozen=True):
    """`core.json`: every sentence with its codes, and the words."""

    sentences: dict[str, list[str]]
    words: list[str]


class _Shown(msgspec.Struct, frozen=True):
    """Catalogue of a language; sentences without a translation are empty."""

    sentences: dict[str, str]
    words: dict[str, str]


@dataclass(frozen=True, slots=True)
class _Known:
    """A sentence and its translation."""

    said: Pattern
    shown: Pattern
    codes: frozenset[str]


class Translation:
    """All sentences of the core in another language.

    ``sentences``: English and translated templates; a template without a translation stays English.
    ``words`` of enumerations and registries; ``codes`` of the errors that use a template;
    ``comma``: numbers formatted by the program, and no others, get a decimal comma.
    """

    def __init__(
        self,
        sentences: Mapping[str, str],
        words: Mapping[str, str],
        codes: Mapping[str, Iterable[str]] | None = None,
        *,
        comma: bool = False,
    ) -> None:
        self._comma = comma
        self._words = dict(words)
        self._plain: dict[str, str] = {}
        self._by_word: dict[str, list[_Known]] = defaultdict(list)
        self._wordless: list[_Known] = []
        self._seen: dict[tuple[str, str], str | None] = {}
        patterns = []
        for english, shown in sentences.items():
            said = Pattern.from_template(english)
            if said.names:
                known = frozenset((codes or {}).get(english, ()))
                patterns.append(_Known(said, Pattern.from_template(shown), known))
            else:
                self._plain[said.literals[0]] = Pattern.from_template(shown).literals[0]
        self._index(patterns)

    def _index(self, patterns: Sequence[_Known]) -> None:
        """File each sentence under the rarest of its whole words."""
        words = {id(known): _whole_words(known.said) for known in patterns}
        often = Counter(word for found in words.values() for word in found)
        for known in patterns:
            found = words[id(known)]
            if found:
                self._by_word[min(found, key=lambda word: (often[word], word))].append(known)
            else:
                self._wordless.append(known)

    def translate(self, text: str, code: str = "") -> str:
        """Return sentences in this language, unchanged if unknown; ``code``: of an error."""
        key = (text, code)
        if key not in self._seen:
            if len(self._seen) >= _REMEMBERED:
                self._seen.clear()
            self._seen[key] = self._translate(text, code, 0)
        found = self._seen[key]
        return text if found is None else found

    def word(self, text: str) -> str:
        """Return a word of an enumeration or a registry in this language."""
        found = (
            self._words.get(text)
            or self._plain.get(text)
            # "cylinder" in a sentence is the shape "Cylinder".
            or self._words.get(text[:1].upper() + text[1:])
        )
        # "face diagonal XY 1, 140 mm" is two words, "Interim_L distance" a symbol and a word.
        symbol, _, rest = text.partition(" ")
        if not found and rest and "_" in symbol:
            return f"{symbol} {self.word(rest)}"
        return found or ", ".join(map(self.word, text.split(", ")) if ", " in text else [text])

    def _translate(self, text: str, code: str, depth: int) -> str | None:
        """Return a text in this language; None if it is not in the catalogue."""
        if not _LETTERS.search(text):
            return text
        whole = self._sentence(text, code, depth)
        return whole if whole is not None or depth else self._pieces(text, code)

    def _sentence(self, text: str, code: str, depth: int) -> str | None:
        """Return one sentence in this language; None if unknown to the catalogue, or ambiguous."""
        if text in self._plain:
            return self._plain[text]
        found = [(known, known.said.fillings(text)) for known in self._candidates(text, depth)]
        found = [(known, ways) for known, ways in found if self._may_be(known.said, ways)]
        found = [(known, ways) for known, ways in found if code in known.codes] or found
        if not found:
            return self._before_another(text, code, depth)
        # One sentence can be a special case of another; its own words decide.
        most = max(known.said.weight for known, _ in found)
        shown = {
            self._filled(known, values, depth)
            for known, ways in found if known.said.weight == most
            for values in ways
        }  # fmt: skip
        return shown.pop() if len(shown) == 1 else None

    def _may_be(self, pattern: Pattern, ways: Sequence[Sequence[str]]) -> bool:
        """Return whether a match has no sentence in place of a name."""
        return any(
            not any(
                mark != SENTENCE and _SAYS_SOMETHING.search(value) and self.word(value) == value
                for mark, value in zip(pattern.marks, values, strict=True)
            )
            for values in ways
        )

    def _before_another(self, text: str, code: str, depth: int) -> str | None:
        """Return the lead-in of another sentence, such as ``PART CONFORMS:``."""
        if text[-1:] not in _BEFORE_A_SENTENCE:
            return None
        before = text[:-1]
        inner = self._words.get(before) if before.isupper() else None
        inner = inner or self._sentence(before, code, depth)
        return None if inner is None else inner + text[-1]

    def _candidates(self, text: str, depth: int) -> Iterable[_Known]:
        for word in dict.fromkeys(_LETTERS.findall(text)):
            yield from self._by_word.get(word, ())
        if not depth:
            yield from self._wordless

    def _filled(self, known: _Known, values: Sequence[str], depth: int) -> str | None:
        filled = {}
        for name, mark, value in zip(known.said.names, known.said.marks, values, strict=True):
            inner: str | None = value
            if mark == NUMBER and self._comma:
                inner = with_comma(value)
            elif mark == WORD:
                inner = self.word(value)
            elif mark == KNOWN_WORD:
                inner = self._words.get(value)
            elif mark == SENTENCE:
                inner = self._inner(value, depth + 1)
            elif _SAYS_SOMETHING.search(value):
                inner = None  # a sentence in place of a value
            if inner is None:
                return None
            filled[name] = inner
        return known.shown.filled(filled)

    def _inner(self, text: str, depth: int) -> str | None:
        """Return a sentence within another; None if it is not in the catalogue."""
        if depth > _DEEPEST:
            return None
        found = self._words.get(text) or self._translate(text, "", depth)
        if found is None and (ended := self._plain.get(f"{text}.")) is not None:
            found = ended.removesuffix(".")
        # Names and numbers alone are not a sentence.
        return found if found is not None or _LOWER_WORDS.search(text) else text

    def _pieces(self, text: str, code: str) -> str | None:
        """Return several sentences in this language; None unless all are in the catalogue."""
        ends = [match.span() for match in _END_OF_SENTENCE.finditer(text)]
        if not ends or len(ends) > _MOST_PIECES:
            return None
        starts = [0, *(stop for _, stop in ends)]
        stops = [*(start for start, _ in ends), len(text)]
        # Backwards, so that the translation of the rest is available at every place.
        rest: list[str | None] = [None] * len(starts) + [""]
        for first in reversed(range(len(starts))):
            for last in reversed(range(first, len(stops))):
                if rest[last + 1] is None or (first == 0 and last == len(stops) - 1):
                    continue
                piece = text[starts[first] : stops[last]]
                told = self._sentence(piece, code, 0) if _LETTERS.search(piece) else piece
                if told is not None:
                    between = text[stops[last] : starts[last + 1]] if last + 1 < len(starts) else ""
                    rest[first] = told + between + (rest[last + 1] or "")
                    break
        return rest[0]


def _whole_words(pattern: Pattern) -> set[str]:
    """Return the whole words of a template, which values cannot extend."""
    found = set()
    for at, literal in enumerate(pattern.literals):
        for match in _LETTERS.finditer(literal):
            open_left = at > 0 and match.start() == 0
            open_right = at < len(pattern.literals) - 1 and match.end() == len(literal)
            if not (open_left or open_right):
                found.add(match.group())
    return found


@functools.cache
def load_translation(language: str, *, comma: bool = False) -> Translation:
    """Return the translation into one of `LANGUAGES`; loaded once, on first use.

    ``comma``: decimals follow a comma. InputError if the catalogue cannot be read.
    """
    if language == ENGLISH:
        return Translation({}, {})
    english = _read("core.json", _English)
    shown = _read(f"core_{language}.json", _Shown)
    sentences = {said: told for said, told in shown.sentences.items() if told}
    return Translation(sentences, shown.words, english.sentences, comma=comma)


def _read(name: str, kind: type[C]) -> C:
    path = resource("i18n", name)
    try:
        return decode_json(read_bytes(path), kind)
    except msgspec.MsgspecError as error:
        raise InputError(
            "wording.catalogue",
            f"{path}: the sentences of another language cannot be read ({error}).",
            "Install the program completely; until then it speaks English.",
        ) from error


def in_language(error: OcmmError, language: str) -> tuple[str, str]:
    """Return fault and remedy of an error in a language; unknown sentences stay English."""
    if language == ENGLISH:
        return error.what, error.remedy
    translation = load_translation(language)
    return translation.translate(error.what, error.code), translation.translate(
        error.remedy, error.code
    )


def with_comma(number: str) -> str:
    """Return a number with a decimal comma and narrow spaces between thousands."""
    return _POINT.sub(",", number.replace(",", "\N{NARROW NO-BREAK SPACE}"))


@dataclass(frozen=True, slots=True)
class Speech:
    """Texts of a report in its language.

    Only texts of the program are translated, not the names of people, parts and features.
    """

    language: str = ENGLISH
    """One of `LANGUAGES`."""

    def text(self, text: str) -> str:
        """Return sentences of the program; lines with an unknown sentence stay English."""
        if self.language == ENGLISH:
            return text
        told = self._translation()
        whole = told.translate(text) if "\n" in text else text
        return whole if whole != text else "\n".join(_line(told, one) for one in text.split("\n"))

    def word(self, text: str) -> str:
        """Return a word of the program: a heading, a verdict, a shape."""
        return text if self.language == ENGLISH else self._translation().word(text)

    def number(self, text: str) -> str:
        """Return formatted numbers with the decimal sign of the language."""
        return text if self.language == ENGLISH else with_comma(text)

    def _translation(self) -> Translation:
        try:
            return load_translation(self.language, comma=True)
        except OcmmError:
            return Translation({}, {})


def _line(told: Translation, text: str) -> str:
    """Return a word and a sentence, or a sentence with or without the full stop of a report."""
    head, _, rest = text.partition(": ")
    if told.word(head) != head and told.translate(rest) != rest:
        return f"{told.word(head)}: {told.translate(rest)}"
    named, mark, identity = text.rpartition(" (")
    if mark and " " not in identity and told.translate(named) != named:
        # A rule with its identity, which is the same in every language.
        return f"{told.translate(named)} ({identity}"
    for without, after in ((text, ""), (text.removesuffix("."), ".")):
        said = told.translate(without)
        if said != without:
            return said if said.endswith(after) else said + after
    return told.word(text)
