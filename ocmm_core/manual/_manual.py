"""All documents of the manual in order, and targets of links."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
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
from ocmm_core.manual._search import Index, ManualHit

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
    def of(cls, reference: str) -> Place:
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
