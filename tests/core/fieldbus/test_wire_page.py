"""The page about the bus says what the program says."""

from __future__ import annotations

import re
from pathlib import Path

from ocmm_core.acquisition.bus_process import RECIPE
from ocmm_core.fieldbus.report import TEXTS, Alarm

_ROOT = Path(__file__).resolve().parents[3]
_PAGE = _ROOT / "docs" / "wire.md"


def alarm_table() -> str:
    """Return the table of alarms as it must stand on the page."""
    rows = [f"| `{code}` | {TEXTS[code].title} | {TEXTS[code].remedy} |" for code in Alarm]
    return "\n".join(["| code | means | what to do |", "|---|---|---|", *rows])


def test_every_alarm_has_its_row_in_the_words_of_the_program() -> None:
    page = _PAGE.read_text(encoding="utf-8")
    found = re.search(r"<!-- alarms:[^\n]*-->\n(.*?)\n?<!-- end of alarms -->", page, re.DOTALL)
    assert found is not None
    assert found[1] == alarm_table(), f"put this between the marks:\n{alarm_table()}"


def test_what_the_page_tells_to_type_exists() -> None:
    page = _PAGE.read_text(encoding="utf-8")
    assert RECIPE in page
    for name in set(re.findall(r"installer/linux/[\w@.-]*\w", page)):
        assert (_ROOT / name).is_file(), name
    for link in re.findall(r"\]\(([^)#]+)\)", page):
        assert (_PAGE.parent / link).exists() or link == "camera_objects.md", link
