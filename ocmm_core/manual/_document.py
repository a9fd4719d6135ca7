"""A document of the manual: its sections and their anchors."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum

_HEADING = re.compile(r"(#{1,6})\s+(.*?)\s*#*\s*")
_FENCE = re.compile(r"\s*(```+|~~~+)")
_COMMENT = re.compile(r"<!--.*?-->[ \t]*\n?", re.DOTALL)
_OF_ENGLISH = re.compile(r"<!-- English: ([0-9a-f]{16}) -->\n")
_LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
_NO_ANCHOR = re.compile(r"[^\w\- ]")
_RULE = re.compile(r"[-:| ]+")


class ManualPart(Enum):
    """Readers of a document, in the order of the manual; each has the folder of its name."""

    OVERVIEW = 0
    INSPECTOR = 1
    TECHNICIAN = 2
    QUALITY = 3
    INTEGRATOR = 4
    DEVELOPER = 5
    DECISIONS = 6


ENGLISH = "en"
"""Language of every original; translations are optional."""


@dataclass(frozen=True, slots=True)
class ManualSection:
    """A heading and the text up to the next heading."""

    anchor: str
    """Link target after ``#``; for the first section, that of its title. Translated sections have
    the anchors of the English ones, so that links hold in every language."""
    level: int
    """1 for the title of the document."""
    title: str
    text: str
    """Plain words for the search; one line per paragraph or table row."""


@dataclass(frozen=True, slots=True)
class Chapter:
    name: str
    """Path below the folder of the manual, such as ``inspector/start.md``."""
    part: ManualPart
    markdown: str
    sections: tuple[ManualSection, ...]
    """In order; the first one has the title."""
    language: str = ENGLISH
    folder: str = ""
    """Base of its links below the folder of the manual: ``de/`` for a German document."""
    is_behind: bool = False
    """The English document was changed after it was translated."""

    @property
    def title(self) -> str:
        return self.sections[0].title

    def section(self, anchor: str) -> ManualSection | None:
        return next((one for one in self.sections if one.anchor == anchor), None)

    def anchors_by_heading(self) -> dict[str, str]:
        """Return the anchors by those that the translated headings themselves would have."""
        made = anchors_of(one.title for one in self.sections)
        return dict(zip(made, (one.anchor for one in self.sections), strict=True))


def chapter_of(name: str, part: ManualPart, text: str) -> Chapter:
    """Return a document in sections; text before the first heading gets its own section."""
    markdown = _COMMENT.sub("", text.replace("\r\n", "\n"))
    heads: list[tuple[int, str]] = []
    bodies: list[list[str]] = []
    fence = ""
    for line in markdown.split("\n"):
        mark = _FENCE.match(line)
        if mark is not None and (not fence or mark[1].startswith(fence)):
            # Fenced text contains no headings.
            fence = "" if fence else mark[1]
            continue
        head = None if fence else _HEADING.fullmatch(line)
        if head is not None:
            heads.append((len(head[1]), plain_words(head[2])))
            bodies.append([])
        elif line.strip():
            if not heads:
                heads.append((1, name))
                bodies.append([])
            bodies[-1].append(line)
    heads, bodies = heads or [(1, name)], bodies or [[]]
    names = anchors_of(title for _level, title in heads)
    return Chapter(
        name, part, markdown,
        tuple(
            ManualSection(anchor, level, title, _joined(body))
            for anchor, (level, title), body in zip(names, heads, bodies, strict=True)
        ),
    )  # fmt: skip


def translated(english: Chapter, original: str, language: str, text: str) -> Chapter | None:
    """Return a translated document with the anchors of the English ``original``, both Markdown.

    The first line of ``text`` is `mark_of` the English. None if heading levels differ: bad links.
    """
    found = chapter_of(english.name, english.part, text)
    if [one.level for one in found.sections] != [one.level for one in english.sections]:
        return None
    mark = _OF_ENGLISH.match(text.replace("\r\n", "\n"))
    return replace(
        found,
        sections=tuple(
            replace(own, anchor=other.anchor)
            for own, other in zip(found.sections, english.sections, strict=True)
        ),
        language=language,
        folder=f"{language}/",
        is_behind=mark is None or mark[1] != mark_of(original),
    )


def mark_of(text: str) -> str:
    """Return the short hash of the English text for the first line of a translation."""
    return hashlib.sha256(text.replace("\r\n", "\n").encode()).hexdigest()[:16]


def anchors_of(titles: Iterable[str]) -> tuple[str, ...]:
    """Return the anchors of the headings of one document, as GitHub makes them.

    Lower case, blanks as hyphens, no other signs; repeated names end with ``-1``, ``-2``.
    """
    seen: dict[str, int] = {}
    anchors = []
    for title in titles:
        anchor = _NO_ANCHOR.sub("", title.strip().lower()).replace(" ", "-")
        count = seen.get(anchor, 0)
        seen[anchor] = count + 1
        anchors.append(f"{anchor}-{count}" if count else anchor)
    return tuple(anchors)


def plain_words(markdown: str) -> str:
    """Return a line without Markdown marks: code, links, bold."""
    return _LINK.sub(r"\1", markdown).replace("`", "").replace("**", "").replace("\\|", "|").strip()


def _joined(lines: Iterable[str]) -> str:
    """Return the lines of a section joined, one line per paragraph or table row."""
    told: list[str] = []
    ended = True
    for line in lines:
        bare = line.strip()
        if bare.startswith("|"):
            if not _RULE.fullmatch(bare):
                cells = [plain_words(cell) for cell in bare.strip("|").split(" | ")]
                told.append(" · ".join(cell for cell in cells if cell))
            ended = True
            continue
        if bare.startswith("!["):
            ended = True
            continue
        begins = bare.startswith(("- ", "* ")) or (bare[:1].isdigit() and ". " in bare[:4])
        words = plain_words(bare.removeprefix("- ").removeprefix("* "))
        if ended or begins or not told:
            told.append(words)
        else:
            told[-1] = f"{told[-1]} {words}"
        ended = False
    return "\n".join(told)
