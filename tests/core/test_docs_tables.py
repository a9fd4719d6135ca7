"""The tables of the documentation agree with the registries."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

_ROOT = Path(__file__).resolve().parents[2]


def _script() -> ModuleType:
    place = importlib.util.spec_from_file_location("make_tables", _ROOT / "docs" / "make_tables.py")
    assert place is not None
    assert place.loader is not None
    module = importlib.util.module_from_spec(place)
    place.loader.exec_module(module)
    return module


SCRIPT = _script()


@pytest.mark.parametrize("name", list(SCRIPT.TABLES))
def test_a_table_says_what_its_registry_says(name: str) -> None:
    path, text = SCRIPT.TABLES[name]
    page = (_ROOT / path).read_text(encoding="utf-8")
    assert SCRIPT.marked(page, name)[2] == text(), "run: python docs/make_tables.py"
