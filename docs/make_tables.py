"""Write the tables of the documentation that say what a registry says.

``python docs/make_tables.py`` puts each table between its marks; ``tests/core/test_docs_tables.py``
compares them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from ocmm_core.composition import SOURCES
from ocmm_core.documents import write_atomic
from ocmm_core.export import FORMATS
from ocmm_core.fieldbus.report import Alarm, AlarmSpec, Answer

ROOT = Path(__file__).resolve().parents[1]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of Markdown."""
    lines = (head, ["---"] * len(head), *rows)
    return "\n".join(f"| {' | '.join(line)} |".replace("| --- ", "|---") for line in lines)


def alarms() -> str:
    """Return the table of the alarms of the bus."""
    return table(
        ("code", "means", "what to do", "the program"),
        (
            (f"`{one.code}`", one.title, one.remedy, _answer_words(one))
            for one in (alarm.spec for alarm in Alarm)
        ),
    )


_ANSWERS = {
    Answer.NOTE: "measures on",
    Answer.WAIT: "waits, then brings the bus up again",
    Answer.LIFT: "lifts the camera back to OP",
    Answer.REPEAT: "repeats the bring-up",
}


def _answer_words(alarm: AlarmSpec) -> str:
    if alarm.answer is Answer.BRING_UP:
        cycles = "1 cycle" if alarm.confirmed == 1 else f"{alarm.confirmed} cycles"
        return f"brings the bus up again after {cycles}"
    return _ANSWERS[alarm.answer]


def formats() -> str:
    """Return the table of the formats of a report."""
    return table(
        ("format", "in the window", "files", "for", "takes from the profile"),
        (
            (
                f"`{one.name}`",
                _plain(one.title),
                ", ".join(f"`{suffix}`" for suffix in one.suffixes),
                _plain(one.purpose),
                one.profile or "nothing",
            )
            for one in FORMATS.values()
        ),
    )


def sources() -> str:
    """Return the table of the sources of frames."""
    return table(
        ("source", "is"),
        ((f"`{form}`", words) for spec in SOURCES for form, words in spec.forms),
    )


def _plain(text: str) -> str:
    """Return text of a cell: a bar would begin the next one."""
    return text.replace("|", "\\|")


TABLES: dict[str, tuple[str, Callable[[], str]]] = {
    "alarms": ("docs/wire.md", alarms),
    "formats": ("docs/exports.md", formats),
    "sources": ("README.md", sources),
}
"""By the name in its marks: the page, from the root, and what stands between the marks."""


def marked(page: str, name: str) -> re.Match[str]:
    """Return the place of a table in the text of a page, marks included."""
    pattern = rf"(<!-- table {name}: [^\n]*-->\n)(.*?)(\n<!-- end of {name} -->)"
    found = re.search(pattern, page, re.DOTALL)
    if found is None:
        raise LookupError(f"the marks of the table {name!r} are missing")
    return found


def main() -> None:
    """Write all tables."""
    for name, (path, text) in TABLES.items():
        page = (ROOT / path).read_text(encoding="utf-8")
        place = marked(page, name)
        page = f"{page[: place.end(1)]}{text()}{page[place.start(3) :]}"
        write_atomic(ROOT / path, page.encode("utf-8"))


if __name__ == "__main__":
    main()
