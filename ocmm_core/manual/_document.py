"""A document of the manual: its sections, with the names by which links find them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum

_HEADING = re.compile(r"(#{1,6})\s+(.*?)\s*#*\s*")
_FENCE = re.compile(r"\s*(```+|~~~+)")
_COMMENT = re.compile(r"<!--.*?-->[ \t]*\n?", re.DOTALL)
_LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
_NO_ANCHOR = re.compile(r"[^\w\- ]")
_RULE = re.compile(r"[-:| ]+")


class Part(Enum):
    """Whom a document is for, in the order in which the manual shows them."""

    INSPECTOR = 1
    METROLOGIST = 2
    STATION = 3
    DEVELOPER = 4
    DECISIONS = 5


@dataclass(frozen=True, slots=True)
class ManualSection:
    """A heading and what stands below it, up to the next heading.

    Attributes
    ----------
    anchor
        The part of a link behind ``#``; that of the first section of a document is its title's.
    level
        1 for the title of the document.
    title
        The heading without marks.
    text
        What is below it as plain words, for a search; one line a paragraph or row of a table.
    """

    anchor: str
    level: int
    title: str
    text: str


@dataclass(frozen=True, slots=True)
class Chapter:
    """A document.

    Attributes
    ----------
    name
        Path below the folder of the manual, such as ``inspecting.md``.
    part
        Whom it is for.
    markdown
        As it is shown, without comments.
    sections
        In their order; the first one has the title.
    """

    name: str
    part: Part
    markdown: str
    sections: tuple[ManualSection, ...]

    @property
    def title(self) -> str:
        """Return its title."""
        return self.sections[0].title

    def section(self, anchor: str) -> ManualSection | None:
        """Return a section by its anchor; None where there is none."""
        return next((one for one in self.sections if one.anchor == anchor), None)


def chapter_of(name: str, part: Part, text: str) -> Chapter:
    """Return a document in sections; text before the first heading belongs to a section of it."""
    markdown = _COMMENT.sub("", text.replace("\r\n", "\n"))
    heads: list[tuple[int, str]] = []
    bodies: list[list[str]] = []
    fence = ""
    for line in markdown.split("\n"):
        mark = _FENCE.match(line)
        if mark is not None and (not fence or mark[1].startswith(fence)):
            # What a fence encloses begins no section, whatever it looks like.
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


def anchors_of(titles: Iterable[str]) -> tuple[str, ...]:
    """Return the anchors of the headings of one document, as GitHub and its like make them.

    Small letters, blanks as hyphens, no other signs; the second of the same name ends with ``-1``.
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
    """Return a line without the marks of its type: code, links, bold letters."""
    return _LINK.sub(r"\1", markdown).replace("`", "").replace("**", "").replace("\\|", "|").strip()


def _joined(lines: Iterable[str]) -> str:
    """Return the lines of a section as paragraphs and rows, one a line."""
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
