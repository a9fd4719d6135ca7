"""Search: sections by BM25 (Robertson and Zaragoza, 2009, eq. 3.15); headings weigh more."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from ocmm_core.manual._document import ENGLISH, Chapter, ManualPart, ManualSection

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
    marked: tuple[tuple[int, int], ...]
    """Start and end of each match in the excerpt, characters."""
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
            excerpt, marked = _excerpt(section.text, wanted, joins=_joins(chapter))
            hits.append(
                ManualHit(
                    chapter.name, section.anchor, chapter.title, section.title, excerpt, marked,
                    score,
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


def _excerpt(
    text: str, wanted: Sequence[str], *, joins: bool
) -> tuple[str, tuple[tuple[int, int], ...]]:
    """Return the line with most matches, cut around the first, and their positions."""
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
    marked = tuple(
        (first - begin + len(front), last - begin + len(front))
        for _word, first, last in places
        if first >= begin and last <= end
    )
    return f"{front}{line[begin:end]}{back}", marked


def _places(line: str, wanted: Sequence[str], *, joins: bool) -> list[tuple[str, int, int]]:
    return [
        (word, one.start(), one.end())
        for one in _WORD.finditer(line)
        for word in wanted
        if word_fits(one.group().casefold(), word, joins=joins)
    ]
