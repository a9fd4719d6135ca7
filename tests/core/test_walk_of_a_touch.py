"""docs/developer/walk_of_a_touch.md names the functions that a touch passes through."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "developer" / "walk_of_a_touch.md").read_text("utf-8")
STAYS = re.findall(r"^\| `(\S+\.py)` \| `(\S+)` \|", TEXT, re.MULTILINE)


def _definitions(path: Path) -> set[str]:
    """Return the functions of a file, and its methods with their class."""
    tree = ast.parse(path.read_text("utf-8"))
    names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    for kind in (node for node in tree.body if isinstance(node, ast.ClassDef)):
        methods = (node for node in kind.body if isinstance(node, ast.FunctionDef))
        names |= {f"{kind.name}.{node.name}" for node in methods}
    return names


def test_every_stay_is_where_the_walk_says() -> None:
    assert len(STAYS) > 20
    missing = [(file, who) for file, who in STAYS if who not in _definitions(ROOT / file)]
    assert missing == []


def test_the_walk_counts_its_returns_and_does_not_climb_back_more_often() -> None:
    files = [file for file, _ in STAYS]
    returns = sum(file in files[:place] for place, file in enumerate(files))
    (told,) = re.findall(r"^(\d+) returns\.", TEXT, re.MULTILINE)
    assert returns == int(told) <= 6
