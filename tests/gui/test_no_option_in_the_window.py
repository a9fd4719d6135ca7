"""No sentence of the window names an option of the command line, or requests a restart."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from tests.gui.window_sentences import marked

_ROOT = Path(__file__).resolve().parents[2]
_SHOWN = ("ocmm_core", "ocmm_sim", "ocmm_cad", "ocmm_shop")
_OPTION = re.compile(r"(?<![\w<!-])--[a-z]")
_AGAIN = re.compile(
    r"\brestart (ocmm|the program|the acquisition|the window|it)\b|\bstart (ocmm|again)\b"
    r"|\bstart(ed)? with --",
    re.IGNORECASE,
)
_ON_A_TERMINAL = (
    "ocmm_core/doctor", "ocmm_core/settings/_specs.py", "ocmm_core/options.py",
    "ocmm_core/acceptance",
    "ocmm_core/export/certificate/_artefact.py",
    "ocmm_core/cluster", "ocmm_shop/cluster", "ocmm_core/fieldbus/described/_esi",
    "ocmm_shop/archive/checks/_rebuild.py", "ocmm_shop/archiving.py",
    "ocmm_cad/sections.py",
    # Commands of an administrator for services and interfaces of the computer, in a shell.
    "ocmm_core/acquisition/bus_process/_client.py",
)  # fmt: skip
"""What these say is never shown in the window."""


def test_no_text_of_the_window_names_an_option_or_a_restart() -> None:
    found = [
        f"{call.file}:{call.line}: {call.sentence}"
        for call in marked()
        if call.sentence is not None
        and (_OPTION.search(call.sentence) or _AGAIN.search(call.sentence))
    ]
    assert not found


def test_no_remedy_of_the_core_that_the_window_shows_does() -> None:
    found = [
        f"{path.relative_to(_ROOT)}:{line}: {text}"
        for path in sorted(one for name in _SHOWN for one in (_ROOT / name).rglob("*.py"))
        if not str(path.relative_to(_ROOT)).startswith(_ON_A_TERMINAL)
        for line, text in _sentences(path)
        if _OPTION.search(text) or _AGAIN.search(text)
    ]
    assert not found


def _sentences(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the literals of a file that are sentences, without its docstrings."""
    tree = ast.parse(path.read_text())
    docs = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if not isinstance(node, ast.Constant) or id(node) in docs:
            continue
        # A command for a process is one word, a sentence is not.
        if isinstance(node.value, str) and " " in node.value:
            yield node.lineno, node.value


def test_the_search_for_options_finds_one() -> None:
    assert _OPTION.search("Give --out a folder.")
    assert _AGAIN.search("Restart OCMM.")
    assert not _OPTION.search("A dash -- or two.")
