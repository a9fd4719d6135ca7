"""What others wrote is printed as it is: no markup, no emoji, nothing that steers the terminal."""

from __future__ import annotations

import ast
import io
from pathlib import Path

import pytest
from rich.progress import Progress, TextColumn
from rich.table import Table
from rich.text import Text

from ocmm_cli.terminal import PlainConsole, shown

CLI = Path(__file__).resolve().parents[2] / "ocmm_cli"
HOSTILE = ("/x/[/12]", "[bold red]PASSED[/]", "[link=http://a.b]c[/link]", ":warning:", "a[b")


def printed(*objects: object) -> str:
    stream = io.StringIO()
    console = PlainConsole(file=stream, width=200, force_terminal=False)
    console.print(*objects)
    return stream.getvalue()


@pytest.mark.parametrize("text", HOSTILE)
def test_markup_is_printed_as_it_is(text: str) -> None:
    assert printed(text).strip() == text
    table = Table(title=text)
    table.add_column(text)
    table.add_row(text)
    assert printed(table).count(text) == 3


def test_a_style_is_given_by_a_text_only() -> None:
    assert printed(Text.assemble("Verdict ", ("FAILED", "red"))).strip() == "Verdict FAILED"


def test_nothing_steers_the_terminal() -> None:
    text = "PART \x1b[2K\x1b]0;title\x07\r\x9b1m\u202eSMROFNOC\ud800"
    for given in (printed(text), shown(text)):
        assert given.isprintable() or given.strip().isprintable()
        assert "\\x1b[2K" in given
    assert shown("µ ± 20 °C Zoë\n\t中文") == "µ ± 20 °C Zoë\n\t中文"


def _calls(name: str) -> list[tuple[Path, ast.Call]]:
    found = []
    for path in CLI.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.Call) and name in (
                getattr(node.func, "id", ""), getattr(node.func, "attr", "")
            ):  # fmt: skip
                found.append((path, node))
    return found


def test_no_command_makes_a_console_of_its_own() -> None:
    assert {path.name for path, _ in _calls("Console")} <= set()
    assert {path.name for path, _ in _calls("PlainConsole")} == {"_console.py"}


def test_no_column_of_a_progress_reads_markup() -> None:
    columns = _calls("TextColumn")
    assert len(columns) > 4
    for path, call in columns:
        fixed = isinstance(call.args[0], ast.Constant) and "{" not in str(call.args[0].value)
        plain = any(
            word.arg == "markup" and isinstance(word.value, ast.Constant) and not word.value.value
            for word in call.keywords
        )
        assert fixed or plain, f"{path.name}, line {call.lineno}"


def test_no_text_of_a_command_is_markup() -> None:
    for path in CLI.rglob("*.py"):
        source = path.read_text("utf-8")
        assert "[/]" not in source, path
        assert "rich.markup" not in source, path
        assert "markup=True" not in source, path


def test_a_progress_shows_a_name_as_it_is() -> None:
    stream = io.StringIO()
    console = PlainConsole(file=stream, width=80, force_terminal=True)
    with Progress(TextColumn("{task.description}", markup=False), console=console) as progress:
        progress.add_task("[/12]")
    assert "[/12]" in stream.getvalue()
