"""German pages of the manual beside the English ones: which there are, and which are behind.

``python -m docs.translations`` lists them. ``python -m docs.translations NAME.md ...`` says that
these are up to date again: it writes the mark of the English text into their first line, after
somebody has translated what changed. Links between pages lead to the German page where there is
one, so they are set again in all.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from ocmm_core.manual import load_manual, mark_of

DOCS = Path(__file__).resolve().parent
GERMAN = DOCS / "de"
_MARK = re.compile(r"\A<!-- English: [0-9a-f]* -->\n")
_LINK = re.compile(r"(?<=\]\()(?:\.\./)?([\w-]+\.md)(?=[)#])")


def behind() -> list[str]:
    """Return the German pages whose English one has changed since, or whose sections are others."""
    german = {one.name: one for one in load_manual(DOCS, "de").chapters}
    return [
        path.name
        for path in sorted(GERMAN.glob("*.md"))
        if path.name not in german
        or german[path.name].language == "en"
        or german[path.name].is_behind
    ]


def missing() -> list[str]:
    """Return the documents without a German page; those of decisions are English on purpose."""
    return sorted(path.name for path in DOCS.glob("*.md") if not (GERMAN / path.name).is_file())


def linked(text: str) -> str:
    """Return a German page with links to German pages, and to English ones where there is none."""
    return _LINK.sub(
        lambda found: found[1] if (GERMAN / found[1]).is_file() else f"../{found[1]}", text
    )


def mark(names: list[str]) -> None:
    """Write the marks of these pages, and the links of all."""
    for path in sorted(GERMAN.glob("*.md")):
        old = path.read_text(encoding="utf-8")
        new = linked(old)
        if path.name in names:
            english = (DOCS / path.name).read_text(encoding="utf-8")
            new = f"<!-- English: {mark_of(english)} -->\n{_MARK.sub('', new)}"
        if new != old:
            path.write_text(new, encoding="utf-8")


if __name__ == "__main__":
    mark(sys.argv[1:])
    sys.stdout.write(f"Behind: {', '.join(behind()) or 'none'}\n")
    sys.stdout.write(f"In English only: {', '.join(missing()) or 'none'}\n")
