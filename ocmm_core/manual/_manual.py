"""All documents of the manual in order, targets of links, and search.

The search ranks sections by BM25 (Robertson and Zaragoza, 2009, eq. 3.15); headings weigh more.
"""

from __future__ import annotations

import math
import posixpath
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from urllib.parse import unquote

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.manual._document import (
    ENGLISH,
    Chapter,
    ManualPart,
    ManualSection,
    chapter_of,
    translated,
)

_INDEX = "README.md"
"""First document of a folder; its links give the order of the others."""

_LINK = re.compile(r"\]\(([\w-]+\.md)[)#]")
_LARGEST = 4 << 20


@dataclass(frozen=True, slots=True)
class Place:
    """A section of a document; its top if ``anchor`` is empty."""

    document: str
    anchor: str = ""

    @classmethod
    def from_reference(cls, reference: str) -> Place:
        document, _, anchor = reference.partition("#")
        return cls(document, anchor)

    def __str__(self) -> str:
        return f"{self.document}#{self.anchor}" if self.anchor else self.document


class Manual:
    """Documents of a folder."""

    def __init__(self, folder: Path, chapters: tuple[Chapter, ...]) -> None:
        self.folder = folder
        self.chapters = chapters
        self._by_name = {chapter.name: chapter for chapter in chapters}

    def chapter(self, name: str) -> Chapter | None:
        """Return a document by its name; None if missing."""
        return self._by_name.get(name)

    def section(self, place: Place) -> ManualSection | None:
        chapter = self.chapter(place.document)
        if chapter is None:
            return None
        return chapter.section(place.anchor) if place.anchor else chapter.sections[0]

    def resolve(self, base: str, link: str) -> Place | None:
        """Return the target of a link in document ``base``; None if outside the manual."""
        if ":" in link.partition("#")[0]:
            return None
        path, _, anchor = link.partition("#")
        document = self._below(base, path) if path else base
        place = Place(document, unquote(anchor))
        if self.section(place) is not None:
            return place
        # The section was renamed: link to its document.
        return Place(document) if document in self._by_name else None

    def picture(self, base: str, link: str) -> Path | None:
        """Return the file of a picture in document ``base``; None if outside the folder."""
        path = self._below(base, link)
        if ":" in link or path.startswith(("../", "/")):
            return None
        found = self.folder / path
        return found if found.is_file() else None

    def _below(self, base: str, link: str) -> str:
        """Return the target of a link below the folder, for any language."""
        chapter = self._by_name.get(base)
        folder = "" if chapter is None else chapter.folder
        path = posixpath.join(folder, posixpath.dirname(base), unquote(link))
        return posixpath.normpath(path).removeprefix(folder)

    def search(self, text: str, most: int = 40) -> tuple[ManualHit, ...]:
        """Return sections with all words (or prefixes), or else most of them, best first."""
        return self._index.found(text, most)

    @cached_property
    def _index(self) -> Index:
        return Index(self.chapters)


def manual_folder() -> Path:
    """Return the folder of the documents: of the package, or of the checkout."""
    shipped = resource("manual")
    return shipped if shipped.is_dir() else resource().parent / "docs"


def shipped_text(name: str) -> str:
    """Return a document next to the manual, such as a licence."""
    return (manual_folder().parent / name).read_text("utf-8")


def changes_since(version: str = "") -> list[str]:
    """Return the sections of the changelog after ``version``; without one, the newest release.

    InputError if the changelog does not contain that version.
    """
    text = shipped_text("CHANGELOG.md")
    sections = [f"## {one}".rstrip() for one in text.split("\n## ")[1:]]
    names = [section.split("]")[0].removeprefix("## [") for section in sections]
    filled = [at for at, section in enumerate(sections) if "\n" in section]
    released = [at for at, name in enumerate(names) if name[:1].isdigit()]
    if version and version not in names:
        raise InputError(
            "changes.version",
            f"The changelog does not contain version '{version}'.",
            f"Name one of: {', '.join(names[at] for at in released)}.",
        )
    end = names.index(version) if version else released[0] + 1
    return [sections[at] for at in filled if at < end]


def load_manual(folder: Path | None = None, language: str = ENGLISH) -> Manual:
    """Read all documents, English if untranslated, or raise InputError; ``folder`` None: ours."""
    folder = manual_folder() if folder is None else folder
    chapters = tuple(_chapter(folder, part, path, language) for part, path in _documents(folder))
    if not chapters:
        raise InputError(
            "manual.none",
            f"The manual is not in {folder}.",
            "Install OCMM again; its package holds the manual.",
        )
    return Manual(folder, chapters)


def _chapter(folder: Path, part: ManualPart, path: Path, language: str) -> Chapter:
    name, text = path.relative_to(folder).as_posix(), _text(path)
    english = chapter_of(name, part, text)
    other = folder / language / name
    if language == ENGLISH or not other.is_file():
        return english
    return translated(english, text, language, _text(other)) or english


def _documents(folder: Path) -> Iterator[tuple[ManualPart, Path]]:
    for part in ManualPart:
        place = folder if part is ManualPart.OVERVIEW else folder / part.name.lower()
        found = {path.name: path for path in sorted(place.glob("*.md"))}
        listed = _LINK.findall(_text(found[_INDEX])) if _INDEX in found else []
        for name in dict.fromkeys((_INDEX, *listed, *found)):
            if name in found:
                yield part, found[name]


def _text(path: Path) -> str:
    with path.open("rb") as file:
        return file.read(_LARGEST).decode("utf-8", errors="replace")


_WORD = re.compile(r"[^\W_]+(?:[.'-][^\W_]+)*")
_MOST_WORDS = 12
"""Of a query; pasted text is longer."""

_SATURATION, _LENGTH_SHARE = 1.2, 0.5
_IN_TITLE, _IN_CHAPTER = 6.0, 2.0
"""Weight of a word of a heading, and of the document title, in words of the text."""

_WEIGHTS = {
    ManualPart.OVERVIEW: 0.8, ManualPart.INSPECTOR: 1.6, ManualPart.TECHNICIAN: 1.2,
    ManualPart.QUALITY: 1.2, ManualPart.INTEGRATOR: 1.0, ManualPart.DEVELOPER: 0.8,
    ManualPart.DECISIONS: 0.5,
}  # fmt: skip
"""Most searches at the machine are by inspectors."""

_EXCERPT = 150
_PART_OF_WORD = 4


@dataclass(frozen=True, slots=True)
class ManualHit:
    """A matching section."""

    document: str
    anchor: str
    chapter: str
    title: str
    """`chapter`, `title`: Headings of the document and of the section."""
    excerpt: str
    """Text around the best match; empty for a section of headings alone."""
    score: float
    """Higher is better."""


def search_words(text: str) -> tuple[str, ...]:
    """Return the distinct words of a query, case-folded."""
    found = dict.fromkeys(word.casefold() for word in _WORD.findall(text))
    return tuple(found)[:_MOST_WORDS]


class Index:
    def __init__(self, chapters: Sequence[Chapter]) -> None:
        self._entries: list[tuple[Chapter, ManualSection, Counter[str], float]] = []
        for chapter in chapters:
            of_chapter = _words(chapter.title)
            for section in chapter.sections:
                counts: Counter[str] = Counter(_words(section.text))
                length = float(sum(counts.values()))
                weighted: Counter[str] = Counter(counts)
                for word in _words(section.title):
                    weighted[word] += int(_IN_TITLE)
                for word in of_chapter:
                    weighted[word] += int(_IN_CHAPTER)
                self._entries.append((chapter, section, weighted, length))
        lengths = [length for *_rest, length in self._entries]
        self._mean = max(sum(lengths) / max(len(lengths), 1), 1.0)

    def found(self, text: str, most: int) -> tuple[ManualHit, ...]:
        wanted = search_words(text)
        if not wanted:
            return ()
        counts = [
            [_count(words, word, joins=_joins(chapter)) for word in wanted]
            for chapter, _section, words, _length in self._entries
        ]
        holders = [sum(1 for row in counts if row[i]) for i in range(len(wanted))]
        best = max(sum(1 for count in row if count) for row in counts)
        if not best:
            return ()
        hits = []
        for (chapter, section, _words_of, length), row in zip(self._entries, counts, strict=True):
            if sum(1 for count in row if count) < best:
                continue
            score = _WEIGHTS[chapter.part] * sum(
                _weight(count, length / self._mean) * _rarity(len(counts), held)
                for count, held in zip(row, holders, strict=True)
            )
            excerpt = _excerpt(section.text, wanted, joins=_joins(chapter))
            hits.append(
                ManualHit(
                    chapter.name, section.anchor, chapter.title, section.title, excerpt, score,
                )
            )  # fmt: skip
        # Equal ranks stay in reading order.
        return tuple(sorted(hits, key=lambda hit: -hit.score)[:most])


def _words(text: str) -> list[str]:
    return [word.casefold() for word in _WORD.findall(text)]


def word_fits(word: str, wanted: str, *, joins: bool) -> bool:
    """Return whether a word starts with the wanted one or, in German, contains it.

    So "Unsicherheit" also finds "Messunsicherheit". Words shorter than `_PART_OF_WORD` would match
    too many words by chance.
    """
    return word.startswith(wanted) or (joins and len(wanted) >= _PART_OF_WORD and wanted in word)


def _joins(chapter: Chapter) -> bool:
    """Return whether the language of a document has compound words."""
    return chapter.language != ENGLISH


def _count(words: Counter[str], wanted: str, *, joins: bool) -> float:
    """Return the count of a word in a section; prefix matches count half."""
    exact = float(words.get(wanted, 0))
    return exact + 0.5 * sum(
        n for word, n in words.items() if word != wanted and word_fits(word, wanted, joins=joins)
    )


def _weight(count: float, length: float) -> float:
    longer = 1.0 - _LENGTH_SHARE + _LENGTH_SHARE * length
    return count * (_SATURATION + 1.0) / (count + _SATURATION * longer)


def _rarity(sections: int, holders: int) -> float:
    return math.log(1.0 + (sections - holders + 0.5) / (holders + 0.5))


def _excerpt(text: str, wanted: Sequence[str], *, joins: bool) -> str:
    """Return the line with most matches, cut around the first."""
    lines = text.split("\n")
    found = [_places(line, wanted, joins=joins) for line in lines]
    # Most distinct words first, then adjacent ones; ties: first line.
    phrase = " ".join(wanted)
    best = max(
        range(len(lines)),
        key=lambda i: (
            len({word for word, _b, _e in found[i]}), phrase in lines[i].casefold(), -i
        ),
    )  # fmt: skip
    line, places = lines[best], found[best]
    begin = 0
    if places and places[0][1] > _EXCERPT // 3 and len(line) > _EXCERPT:
        begin = line.rfind(" ", 0, places[0][1] - _EXCERPT // 4) + 1
    end = len(line)
    if end - begin > _EXCERPT:
        end = max(line.rfind(" ", begin, begin + _EXCERPT), begin + _EXCERPT // 2)
    front, back = "… " if begin else "", " …" if end < len(line) else ""
    return f"{front}{line[begin:end]}{back}"


def _places(line: str, wanted: Sequence[str], *, joins: bool) -> list[tuple[str, int, int]]:
    return [
        (word, one.start(), one.end())
        for one in _WORD.finditer(line)
        for word in wanted
        if word_fits(one.group().casefold(), word, joins=joins)
    ]
