"""The walks in docs/developer name the functions that a touch or a calibration passes through."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ("walk_of_a_touch.md", "walk_of_a_calibration.md")


def _text(page: str) -> str:
    return (ROOT / "docs" / "developer" / page).read_text("utf-8")


def _stays(page: str) -> list[tuple[str, str]]:
    return re.findall(r"^\| `(\S+\.py)` \| `(\S+)` \|", _text(page), re.MULTILINE)


def _definitions(path: Path) -> set[str]:
    """Return the functions of a file, and its methods with their class."""
    tree = ast.parse(path.read_text("utf-8"))
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    for kind in (node for node in tree.body if isinstance(node, ast.ClassDef)):
        methods = (node for node in kind.body if isinstance(node, ast.FunctionDef))
        names |= {f"{kind.name}.{node.name}" for node in methods}
    return names


@pytest.mark.parametrize(("page", "least"), list(zip(PAGES, (21, 15), strict=True)))
def test_every_stay_is_where_the_walk_says(page: str, least: int) -> None:
    stays = _stays(page)
    assert len(stays) >= least
    missing = [(file, who) for file, who in stays if who not in _definitions(ROOT / file)]
    assert missing == []


@pytest.mark.parametrize(("page", "most"), list(zip(PAGES, (6, 5), strict=True)))
def test_the_walk_counts_its_returns_and_does_not_climb_back_more_often(
    page: str, most: int
) -> None:
    files = [file for file, _ in _stays(page)]
    returns = sum(file in files[:place] for place, file in enumerate(files))
    (told,) = re.findall(r"^(\d+) returns\.", _text(page), re.MULTILINE)
    assert returns == int(told) <= most
