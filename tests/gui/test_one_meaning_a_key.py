"""A key that opens a page or works in the whole window means nothing else on any page."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from PySide6.QtGui import QKeySequence

from ocmm_gui.kit import ACTIONS

_GUI = Path(__file__).resolve().parents[2] / "ocmm_gui"
_EVERYWHERE = ("F1", "F2", "F3", "F4", "F5", "F11", "F12")
_SAME = {
    # The Start page opens the same page as the key in a job.
    "New job": "Job", "Open": "Results", "Plans": "Plan", "Calibrate": "Maintain",
}  # fmt: skip


@cache
def _infos() -> list[tuple[str, str, tuple[str, ...]]]:
    """Return file, text and keys of every `ActionInfo` in the sources that names its keys."""
    found = []
    for path in sorted(_GUI.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if not (isinstance(node, ast.Call) and getattr(node.func, "id", "") == "ActionInfo"):
                continue
            if len(node.args) < 4 or not isinstance(node.args[3], ast.Tuple):
                continue
            text = node.args[1]
            if isinstance(text, ast.Call) and isinstance(text.args[0], ast.Constant):
                keys = tuple(str(ast.literal_eval(key)) for key in node.args[3].elts)
                found.append((path.name, str(text.args[0].value), keys))
    return found


def test_no_two_actions_of_the_window_share_a_key() -> None:
    keys = [QKeySequence(key).toString() for info in ACTIONS for key in info.shortcuts]
    assert len(keys) == len(set(keys))


def test_keys_that_open_pages_mean_the_same_on_every_page() -> None:
    owner = {
        key: info.text
        for info in ACTIONS
        for key in info.shortcuts
        if key in _EVERYWHERE or key.startswith("Ctrl+")
    }
    infos = _infos()
    assert len(infos) > 80
    for file, text, keys in infos:
        for key in keys:
            if key in owner:
                assert _SAME.get(text, text) == owner[key], f"{file}: {text} on {key}"


def test_no_page_uses_a_key_twice() -> None:
    for file in {file for file, _, _ in _infos()}:
        keys = [key for name, _, keys in _infos() if name == file for key in keys]
        assert len(keys) == len(set(keys)), file
