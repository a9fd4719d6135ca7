"""No text of the window is HTML, with any content of plan, job or path."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from PySide6 import QtGui
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QLabel, QWidget
from pytestqt.qtbot import QtBot

from ocmm_core.documents import resource
from ocmm_gui.kit import PlainLabel, literal
from tests.gui.conftest import OpenWindow
from tests.host import HANG_MS

GUI = Path(__file__).resolve().parents[2] / "ocmm_gui"
HOSTILE = "<b>x</b>[/12] <img src=file:///etc/passwd> &lt;"
PLAIN = ("", "ø 20 ± 0.1", "R&D", "1 < 2", "<>", "x\n<b>y</b>")


@pytest.mark.parametrize(
    "text", [HOSTILE, "<a href='http://a.b'>c</a>", "&lt;b>", "<p>", "a < b > c", *PLAIN]
)
def test_a_literal_is_never_html_and_looks_the_same(text: str) -> None:
    found = literal(text)
    assert not QtGui.Qt.mightBeRichText(found)
    assert found.replace("\N{WORD JOINER}", "") == text
    assert literal(found) == found


@pytest.mark.parametrize("text", PLAIN)
def test_a_usual_text_is_not_changed(text: str) -> None:
    assert literal(text) == text


def test_a_label_shows_html_as_it_is(qapp: QApplication) -> None:
    label = PlainLabel(HOSTILE)
    label.setToolTip(HOSTILE)
    assert label.textFormat() is Qt.TextFormat.PlainText
    assert not QtGui.Qt.mightBeRichText(label.toolTip())
    # A bold x in the place of the tag would be far narrower.
    assert label.sizeHint().width() > PlainLabel("x[/12]").sizeHint().width() * 3


def _calls(source: str) -> list[tuple[str, ast.Call]]:
    calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
    return [(getattr(one.func, "id", "") or getattr(one.func, "attr", ""), one) for one in calls]


def test_every_tool_tip_and_label_is_made_in_one_way() -> None:
    tips = 0
    for path in sorted(GUI.rglob("*.py")):
        if path == GUI / "kit" / "_texts.py":
            continue
        for name, call in _calls(path.read_text("utf-8")):
            place = f"{path.name}, line {call.lineno}"
            if name == "setToolTip":
                tips += 1
                inner = call.args[0]
                assert isinstance(inner, ast.Call), place
                assert "literal" in (getattr(inner.func, one, "") for one in ("id", "attr")), place
            # The pages of a report are pictures, on labels without a text.
            assert name != "QLabel" or (not call.args and path.name == "_preview.py"), place
            assert name not in ("setHtml", "setWhatsThis", "setStatusTip", "fromHtml"), place
            assert name != "setTextFormat" or "PlainText" in ast.unparse(call), place
    assert tips > 20


def _hostile_plan(folder: Path) -> Path:
    text = resource("plans", "quick.toml").read_text("utf-8")
    lines = []
    for line in text.splitlines():
        lines.append(line)
        if line.strip() == "[[features]]":
            lines.append(f'text = "{HOSTILE}"')
    path = folder / "<b>x<b>[12].toml"
    path.write_text("\n".join(lines), "utf-8")
    return path


def test_a_plan_of_html_is_shown_as_it_is(
    open_window: OpenWindow, tmp_path: Path, qtbot: QtBot
) -> None:
    window = open_window(plan=str(_hostile_plan(tmp_path)), stay=True).window

    def is_shown() -> bool:
        return any("[/12]" in one.toolTip() for one in window.findChildren(QWidget))

    qtbot.waitUntil(is_shown, timeout=HANG_MS)
    shown = [window, *window.findChildren(QWidget)]
    for one in shown:
        assert not QtGui.Qt.mightBeRichText(one.toolTip()), one.toolTip()
        if isinstance(one, QLabel) and one.textFormat() is not Qt.TextFormat.PlainText:
            assert not QtGui.Qt.mightBeRichText(one.text()), one.text()
