"""Commands print through `tr` or its siblings, so that German is possible (decision 47)."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs.core_sentences import Reader
from ocmm_cli.terminal import lead

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = ROOT / "ocmm_cli"

_WORD = re.compile(r"[^\W\d_]{2,}")
_SAYING = {"tr", "tr_word", "tr_later", "heads", "lead", "error_text"}
_PRINTING = {
    "print", "echo", "_print", "add_column", "add_row", "add_task", "status", "Table", "Text",
    "TextColumn", "input", "prompt", "confirm",
}  # fmt: skip
_HOW = {"style", "justify", "box", "header_style", "overflow", "title_justify"}
_OF_DEVELOPERS = ("campaign/", "study/_bench.py")
"""Campaigns and benchmarks are for developers of OCMM; their figures go into reports."""
_NO_SENTENCE = {
    # Help, which stays English.
    "To try it: ocmm demo. The rig, probe, part and plan documents in the resources folder are "
    "templates for your own.",
    "Source of frames. {source_help}", "Store the active black image permanently.",
    "Use the stored black image.", "Use no black image and delete the stored one.",
    "List the black images.",
    # Values of options and of documents.
    "polyworks, qif, dfq, xlsx, json, fai, pdf or all", "polyworks, dfq, xlsx",
    "as found", "after adjustment", "gauge block",
    # Parts of errors, which are translated as a whole.
    "All points taken are saved in the job file.", "The command", "The doctor of a station",
    "which is not a camera bus", "whose bus is private", "the drawing program ended",
    "no answer: end of input", "stopped by the operator",
    # What failed, in the log.
    "The reading of {name}", "The measurement with seed {seed}",
    # Why a calibration was accepted: its signed history is read by everybody.
    "calibrated from known points",
    # Files, and the name of a source that goes into one.
    "EtherCAT, recorded in {name}",
    "SIMULATED: Linearity of {name}: {word:w}", "Linearity of {name}: {word:w}",
    "reference, mm", "bias, µm", "Dots: results. Squares: means. Line with its 95 % band.",
}  # fmt: skip
_FILES = {"study/_study.py": "_write", "study/_probe.py": "write_figures"}
"""Functions that write pictures and tables: files stay English."""
_NOT_READ = re.compile(r"bold( \w+)?|dim|red|green|yellow|\{task\..*|ocmm")


def unsaid(source: str) -> list[str]:
    """Return the sentences and words that a command prints without a call that translates them."""
    reader = Reader(source)
    tree = ast.parse(source)
    inside = {id(one) for call in _calls(tree, _SAYING) for one in ast.walk(call)}
    texts = [
        text for call in _calls(tree, _PRINTING) for text in _texts(call) if id(text) not in inside
    ]
    found = [_literal(text) for text in texts]
    said = {sentence for sentence, *_ in reader.sentences(all_of_it=False)}
    said.update(reader.spoken_words())
    found += [
        sentence for sentence, code, _ in reader.sentences(all_of_it=True)
        # Parts of a printed sentence are printed with it.
        if not code and not any(sentence in whole for whole in said)
    ]  # fmt: skip
    return [
        one for one in dict.fromkeys(found)
        if _WORD.search(re.sub(r"\{.*?\}+", "", one))
        and one.strip() not in _NO_SENTENCE
        and not _NOT_READ.fullmatch(one)
    ]  # fmt: skip


def _calls(tree: ast.AST, names: set[str]) -> Iterator[ast.Call]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            if (name or getattr(node.func, "id", "")) in names:
                yield node


def _texts(call: ast.Call) -> Iterator[ast.expr]:
    """Return the texts that a call prints: its arguments, and both sides of a choice."""
    wanted = [*call.args, *(one.value for one in call.keywords if one.arg not in _HOW)]
    while wanted:
        match wanted.pop():
            case ast.IfExp(body=body, orelse=orelse):
                wanted += [body, orelse]
            case ast.BinOp(op=ast.Add(), left=left, right=right):
                wanted += [left, right]
            case ast.BoolOp(values=values) | ast.Tuple(elts=values):
                wanted += values
            case (ast.Constant(value=str()) | ast.JoinedStr()) as text:
                yield text
            case _:
                pass


def _literal(text: ast.expr) -> str:
    if isinstance(text, ast.JoinedStr):
        parts = (one.value for one in text.values if isinstance(one, ast.Constant))
        return "".join(map(str, parts)).strip()
    return str(text.value).strip() if isinstance(text, ast.Constant) else ""


def _sources() -> dict[str, str]:
    found = {}
    for path in sorted(COMMANDS.rglob("*.py")):
        name = path.relative_to(COMMANDS).as_posix()
        if name.startswith((*_OF_DEVELOPERS, "terminal/_svg", "_kernels", "options/")):
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and node.name == _FILES.get(name):
                node.body = [ast.Pass()]
        found[name] = ast.unparse(tree)
    return found


SOURCES = _sources()


@pytest.mark.parametrize("name", SOURCES)
def test_a_command_says_nothing_past_the_catalogue(name: str) -> None:
    assert unsaid(SOURCES[name]) == [], f"{name}: put it into tr(), tr_word(), lead() or heads()"


@pytest.mark.parametrize(
    "line",
    [
        'console.print("The bus is running.")',
        'console.print(f"Record   {path}", highlight=False)',
        'table.add_column("Serial", no_wrap=True)',
        'typer.echo("PASS" if passed else "FAIL")',
        'console.print(tr("Written") + " to the file")',
        'why = "The file has no end."',
    ],
)
def test_what_is_not_said_is_found(line: str) -> None:
    assert unsaid(line)


def test_what_is_said_is_passed() -> None:
    assert unsaid('console.print(tr("The bus is running."), style="bold red")') == []
    assert unsaid("""console.print(f"{lead('Record   ')}{path}")""") == []


def test_a_label_stays_as_wide_where_it_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    from ocmm_cli.terminal import _console
    from ocmm_core.wording import load_translation

    assert lead("Source   ") == "Source   " or lead("Source   ") == "Quelle   "
    monkeypatch.setattr(_console, "_translation", lambda: load_translation("de"))
    assert lead("Source   ") == "Quelle   "
    assert lead("  Kept in     ") == "  Abgelegt in "
    assert _console.tr("  Not done: ") == "  Nicht ausgeführt: "
    assert _console.tr("Nobody ever says this.") == "Nobody ever says this."
