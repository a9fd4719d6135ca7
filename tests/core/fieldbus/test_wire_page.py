"""The page about the bus agrees with the program."""

from __future__ import annotations

import re
from pathlib import Path

from ocmm_core.acquisition.bus_process import RECIPE

_ROOT = Path(__file__).resolve().parents[3]
_PAGE = _ROOT / "docs" / "technician" / "wire.md"


def test_what_the_page_tells_to_type_exists() -> None:
    page = _PAGE.read_text(encoding="utf-8")
    assert RECIPE in page
    for name in set(re.findall(r"installer/linux/[\w@.-]*\w", page)):
        assert (_ROOT / name).is_file(), name
    for link in re.findall(r"\]\(([^)#]+)\)", page):
        assert (_PAGE.parent / link).exists() or link == "camera_objects.md", link
