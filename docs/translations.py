"""German pages of the manual beside the English ones: which there are, and which are behind.

``python -m docs.translations`` lists them. After translating changes, ``python -m docs.translations
READER/NAME.md ...`` writes the mark of the English text into the first line of these pages. It also
sets the links of all pages: to the German page if it exists.
"""

from __future__ import annotations

import posixpath
import re
import sys
from pathlib import Path

from ocmm_core.manual import load_manual, mark_of

DOCS = Path(__file__).resolve().parent
GERMAN = DOCS / "de"
_MARK = re.compile(r"\A<!-- English: [0-9a-f]* -->\n")
_LINK = re.compile(r"(?<=\]\()([\w./-]+\.md)(?=[)#])")


def pages(folder: Path) -> list[str]:
    """Return the pages of a folder and its folders, in order."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.md"))


def behind() -> list[str]:
    """Return the German pages whose English one has changed since, or whose sections are others."""
    german = {one.name: one for one in load_manual(DOCS, "de").chapters}
    return [
        name
        for name in pages(GERMAN)
        if name not in german or german[name].language == "en" or german[name].is_behind
    ]


def missing() -> list[str]:
    """Return the pages in English only, without decisions and those for developers."""
    english = (
        one for one in pages(DOCS) if not one.startswith(("de/", "decisions/", "developer/"))
    )
    return sorted(set(english) - set(pages(GERMAN)))


def linked(name: str, text: str) -> str:
    """Return the German page with links to German pages, or to English ones if untranslated."""
    folder = posixpath.join("de", posixpath.dirname(name))

    def target(found: re.Match[str]) -> str:
        english = posixpath.normpath(posixpath.join(folder, found[1])).removeprefix("de/")
        own = posixpath.join("de", english)
        return posixpath.relpath(own if (DOCS / own).is_file() else english, folder)

    return _LINK.sub(target, text)


def mark(names: list[str]) -> None:
    """Write the marks of these pages, and the links of all."""
    for name in pages(GERMAN):
        path = GERMAN / name
        old = path.read_text(encoding="utf-8")
        new = linked(name, old)
        if name in names:
            english = (DOCS / name).read_text(encoding="utf-8")
            new = f"<!-- English: {mark_of(english)} -->\n{_MARK.sub('', new)}"
        if new != old:
            path.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    mark(sys.argv[1:])
    sys.stdout.write(f"Behind: {', '.join(behind()) or 'none'}\n")
    sys.stdout.write(f"In English only: {', '.join(missing()) or 'none'}\n")
