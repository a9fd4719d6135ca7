"""Tables of all commands at 40 to 300 columns, in both languages, with names of any length."""

from __future__ import annotations

import ast
import functools
import io
import itertools
from pathlib import Path
from random import Random

import pytest

from ocmm_cli.terminal import PlainConsole, print_grid
from ocmm_core.inspection.recall import COLUMNS
from ocmm_core.tolerances.decisions import U_LABEL, PartWord, Verdict
from ocmm_core.wording import load_translation
from tests.host import amount

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted(
    path for room in ("ocmm_cli", "ocmm_bench") for path in (ROOT / room).rglob("*.py")
)
LANGUAGES = ("en", "de")
WIDTHS = (40, 47, 60, 72, 80, 100, 118, 132, 160, 200, 300)
NAMES = ("BORE", "Bohrung unten links, Abstand zur Bezugsebene A", "HOUSING_LEFT_UPPER_" * 4)
VERDICTS = (*(one.value for one in Verdict), PartWord.NOT_PROVEN.value, "FAILED", "PASSED")
# Heads that are known at run time only: columns of answers, names of cameras, fields of sets.
AT_RUN_TIME = {
    "_print_answer": ("job", "part", "characteristic", "measured", "expanded", "verdict", "note"),
    "print_account": ("Answers and frames", "A" * 12, "B" * 12, "Left", "Right"),
}


def _strings(node: ast.expr, function: ast.FunctionDef) -> list[str]:
    """Return the heads in an expression, or in the assignment of the name that it is."""
    names = {"COLUMNS": COLUMNS, "U_LABEL": (U_LABEL,)}
    found: list[str] = []
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and isinstance(part.value, str):
            found.append(part.value)
        elif isinstance(part, ast.Name) and part.id in names:
            found += names[part.id]
        elif isinstance(part, ast.Name):
            for line in ast.walk(function):
                if isinstance(line, ast.Assign) and part.id in ast.unparse(line.targets[0]):
                    found += _strings(line.value, function)
    return list(dict.fromkeys(found))


@functools.cache
def tables() -> dict[str, tuple[str, ...]]:
    """Return the heads of the tables of all commands, in English."""
    found = {}
    for path in SOURCES:
        functions = [
            node for node in ast.walk(ast.parse(path.read_text("utf-8")))
            if isinstance(node, ast.FunctionDef)
        ]  # fmt: skip
        for function in functions:
            calls = [
                node for node in ast.walk(function)
                if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "print_grid"
            ]  # fmt: skip
            for number, call in enumerate(calls):
                own = AT_RUN_TIME.get(function.name, ())
                read = tuple(_strings(call.args[1], function))
                key = f"{path.relative_to(ROOT)}:{function.name}:{number}"
                found[key] = own if len(read) < 2 and own else read
    return found


def test_every_table_is_printed_by_one_function() -> None:
    makers = [path for path in SOURCES if "rich.table import" in path.read_text("utf-8")]
    assert [path.name for path in makers] == ["_console.py"]
    assert len(tables()) >= 31
    headless = {key.split(":")[1] for key, heads in tables().items() if len(heads) < 2}
    assert headless == {"print_report"}


@pytest.mark.parametrize("language", LANGUAGES)
def test_heads_of_a_table_are_distinct(language: str) -> None:
    translation = load_translation(language)
    for key, heads in tables().items():
        shown = [translation.word(head) for head in heads]
        assert len(set(shown)) == len(shown), (key, shown)


def printed(
    heads: list[str], name: str, verdicts: list[str], width: int, chance: Random
) -> tuple[str, list[str]]:
    """Return a generated table as printed, and the numbers and verdicts in it."""
    values: list[str] = []
    rows = []
    kinds = ["name", *chance.choices(("number", "verdict", "prose"), (6, 1, 1), k=len(heads) - 1)]
    for row in range(3):
        cells = []
        for kind in kinds:
            number = f"{chance.uniform(-999, 999):.4f}"
            unit = chance.choice(("", "", " mm", " µm"))
            cell = {
                "name": f"{name} {row}",
                "number": f"{number}{unit}",
                "verdict": chance.choice(verdicts),
                "prose": f"noise of the cameras over {number} s, from the calibration",
            }[kind]
            cells.append(cell)
            if kind != "name":
                values.append(number if kind == "prose" else cell)
        rows.append(cells)
    stream = io.StringIO()
    print_grid(PlainConsole(file=stream, width=width, no_color=True), heads, rows, "title")
    return stream.getvalue(), values


def test_shortens_and_wraps_no_number_and_no_verdict() -> None:
    combinations = list(itertools.product(tables().items(), WIDTHS, LANGUAGES, NAMES))
    assert len(combinations) >= 2_000
    tried = Random(40).sample(combinations, amount(200, len(combinations)))  # noqa: S311 - seeded
    words = {language: load_translation(language) for language in LANGUAGES}
    blocks = 0
    for (key, heads), width, language, name in tried:
        shown = [words[language].word(head) for head in heads]
        verdicts = [words[language].word(verdict) for verdict in VERDICTS]
        chance = Random(f"{key} {width} {language} {name}")  # noqa: S311 - seeded
        text, values = printed(shown, name, verdicts, width, chance)
        case = (key, width, language, name)
        assert "…" not in text, case
        assert all(text.count(value) >= values.count(value) for value in set(values)), case
        assert max(map(len, text.splitlines())) <= width, case
        blocks += "─" not in text
    # Both forms were tried.
    assert len(tried) // 20 < blocks < len(tried)
