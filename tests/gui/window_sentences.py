"""The sentences in the sources of the window: which are translated, and which are not."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

MARKS = ("tr", "later")

_WORD = re.compile(r"[^\W\d_]{2,}²?")
_UNITS = frozenset(
    (
        "mm", "px", "um", "µm", "chi²", "deg", "rad", "mrad", "ms", "min", "ns", "Hz", "kHz", "ppm",
        "RMS", "dB", "kB", "MB", "GB", "XYZ", "LED", "OCMM", "CSV", "STEP",
    )
)  # fmt: skip
"""Read alike in every language, as names of formats and products."""

_NOT_SHOWN = frozenset(
    (
        # names that only Qt or Python sees
        "setObjectName", "setProperty", "property", "QKeySequence", "findChild", "getattr",
        "hasattr", "TypeVar", "cast", "lazy_exports", "Signal", "setShortcut",
        # style sheets, fonts, files
        "add_argument_group", "setStyleSheet", "setFamilies", "Path", "resource", "strftime",
        # words searched for in data
        "replace", "partition", "removeprefix", "removesuffix", "startswith", "endswith", "split",
        "compile",
        # the boundary for the unexpected, and files for authors of documents: core texts
        "contained", "run_elsewhere", "fail", "given",
        # the command line
        "add", "ArgumentParser",
    )
)  # fmt: skip
"""A literal that is given to one of these is nothing that the window shows."""

_KEY = re.compile(
    r"(Shift\+|Ctrl\+|Alt\+)?(F\d+|[A-Z]|Space|Backspace|Return|Enter|PgUp|PgDown|Home|Del|Ins|Esc|Tab|Backtab|Left|Right|[,+=0-])"
)
"""Keys, as `QKeySequence` reads them."""

_KNOWN = {
    "app.py": {
        "All points taken are saved in the job file.": "part of an error",
        "DISPLAY": "environment", "WAYLAND_DISPLAY": "environment",
        "QT_QPA_PLATFORM": "environment", "Fusion": "style of Qt",
    },
    "_start.py": {"The picture … cannot be written.\n": "on the terminal"},
    "access/_hands_and_eyes.py": {"Scroll": "name of Qt", "ExtensionButton": "name of Qt"},
    "access/_zoom.py": {
        "QT_SCALE_FACTOR": "environment", "Qt6Gui.dll": "file", "Qt": "folder",
    },
    "acceptance/_artefact_sheet.py": {"The artefact register": "part of an error"},
    "acceptance/_desk.py": {
        "INTERIM": "name of a procedure", "Reading the procedures": "part of an error",
        "Reading unfinished tests": "part of an error", "Reading the artefacts": "part of an error",
    },
    "acceptance/_study_sheet.py": {"STUDY-1": "name that is filled in"},
    "window/_acceptance.py": {"INTERIM": "name of a procedure"},
    "window/_running_job.py": {"The window": "part of an error"},
    "window/_main_window.py": {
        "ResultsSheet ReportSheet CompareSheet AlignmentSheet": "names of classes",
        "PlanSheet": "name of a class",
        "MaintainView BusPage CalibrationPage ProbePage FitsPage RecallSheet": "names of classes",
        "WIZARDS Wizard": "names of classes", "DefinitionPage": "name of a class",
    },
    "wizards/_driver.py": {
        "The calibration procedure": "part of an error",
        "All observations so far are saved in the session.": "part of an error",
    },
    "wizards/_sessions.py": {
        "Length bar document": "part of an error", "the document of the sphere": "part of an error",
    },
}  # fmt: skip
"""Sentences that are not translated here, by file, and why."""

_SHOWS = frozenset(
    (
        "setText", "setWindowTitle", "setToolTip", "setAccessibleName", "setAccessibleDescription",
        "setPlaceholderText", "addItem", "addItems", "setTitle", "drawText", "show_text",
        "show_message",
        "inform", "start", "dressed", "QLabel", "QPushButton", "QAction", "FitText",
        "sentence_label",
        "value_label", "caption", "form_field", "ResultVerdict", "BannerMessage", "Row", "Tag",
    )
)  # fmt: skip
"""Arguments of these are visible: even a single short word counts."""


@dataclass(frozen=True, slots=True)
class Literal:
    """A text in the sources.

    Attributes
    ----------
    file
        Below the root.
    line
        Of the file.
    text
        Without inserted values.
    """

    file: str
    line: int
    text: str


@dataclass(frozen=True, slots=True)
class Marked:
    """A call of `tr` or `later`.

    Attributes
    ----------
    file, line
        Its place.
    mark
        Name of the function.
    node
        The call.
    at_import
        It is evaluated when the module is loaded.
    in_braces
        It is inside an f-string, which `lupdate` does not parse.
    filled
        Names of the values in an immediate call of ``format``; None without such a call.
    """

    file: str
    line: int
    mark: str
    node: ast.Call
    at_import: bool
    in_braces: bool
    filled: frozenset[str] | None

    @property
    def sentence(self) -> str | None:
        """Return the literal; None if it is not a plain one."""
        return _plain(self.node.args[0])

    @property
    def comment(self) -> str:
        """Return the English sentence for one."""
        return (_plain(self.node.args[1]) or "") if len(self.node.args) > 1 else ""


def sources() -> list[Path]:
    """Return the files of the window."""
    return sorted((ROOT / "ocmm_gui").rglob("*.py"))


def marked() -> list[Marked]:
    """Return all calls of `tr` and `later`, also those of the table of settings."""
    found = []
    for path in (*sources(), ROOT / "ocmm_core" / "settings" / "_specs.py"):
        tree, parents = _read(path)
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and _callee(node) in MARKS and _is_name(node.func):
                found.append(
                    Marked(
                        path.relative_to(ROOT).as_posix(), node.lineno, _callee(node), node,
                        _at_import(node, parents),
                        any(isinstance(outer, ast.JoinedStr) for _, outer in _above(node, parents)),
                        _filled(node, parents),
                    )
                )  # fmt: skip
    return found


def bare() -> list[Literal]:
    """Return sentences that are neither translated nor exempt as invisible."""
    found = []
    for path in sources():
        # The text of a printed report is for its readers, in any language of the window.
        if path.name == "__init__.py" or "reports" in path.parts:
            continue
        tree, parents = _read(path)
        keys = {
            text
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and _callee(node) == "later"
            for text in [_plain(node.args[0])]
        }
        known = _KNOWN.get(path.relative_to(ROOT / "ocmm_gui").as_posix(), {})
        for node in ast.walk(tree):
            if not isinstance(node, ast.expr) or (text := _text(node, parents)) is None:
                continue
            # A text marked by `later` is often also the key of its row.
            if text in keys or _is_exempt(node, parents):
                continue
            if text in known or _KEY.fullmatch(text):
                continue
            if _is_sentence(text) or (_words(text) and _is_shown(node, parents)):
                found.append(Literal(path.relative_to(ROOT).as_posix(), node.lineno, text))
    return found


@cache
def _read(path: Path) -> tuple[ast.Module, Mapping[ast.AST, ast.AST]]:
    tree = ast.parse(path.read_text())
    parents = {child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)}
    return tree, parents


def _plain(node: ast.expr) -> str | None:
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None


def _is_name(node: ast.expr) -> bool:
    return isinstance(node, ast.Name)


def _callee(node: ast.Call) -> str:
    if isinstance(node.func, ast.Attribute):
        return node.func.attr
    return node.func.id if isinstance(node.func, ast.Name) else ""


def _above(node: ast.AST, parents: Mapping[ast.AST, ast.AST]) -> Iterator[tuple[ast.AST, ast.AST]]:
    """Yield the ancestors of a node, from inside, each with the child that contains the node."""
    while node in parents:
        yield node, parents[node]
        node = parents[node]


def _text(node: ast.expr, parents: Mapping[ast.AST, ast.AST]) -> str | None:
    if isinstance(node, ast.JoinedStr):
        pieces = (_plain(part) for part in node.values)
        return "…".join(piece for piece in pieces if piece)
    return None if isinstance(parents.get(node), ast.JoinedStr) else _plain(node)


def _words(text: str) -> list[str]:
    return [word for word in _WORD.findall(text) if word not in _UNITS]


def _is_sentence(text: str) -> bool:
    words = _words(text)
    if not words or re.search(r"\w: *…?px|px solid", text):
        return False
    return " " in text.strip() or re.match(r"[^\W\d_a-z][^\W\d_]", text.strip()) is not None


def _is_exempt(node: ast.AST, parents: Mapping[ast.AST, ast.AST]) -> bool:
    """Whether a literal is a key, a type, a document string, an error or otherwise never shown."""
    for inner, outer in _above(node, parents):
        match outer:
            case ast.Expr(value=ast.Constant() | ast.JoinedStr()):
                return True
            case ast.arg() | ast.Compare() | ast.MatchValue() | ast.Assert():
                return True
            case ast.FunctionDef() if outer.returns is inner:
                return True
            case ast.AnnAssign() if outer.annotation is inner:
                return True
            case ast.Subscript() if outer.slice is inner:
                return True
            case ast.Dict() if inner in outer.keys:
                return True
            case ast.FormattedValue() if outer.format_spec is inner:
                return True
            case ast.ClassDef(bases=[ast.Name(id="Enum"), *_]):
                return True
            case ast.Call() if inner is not outer.func:
                name = _callee(outer)
                if name in _NOT_SHOWN or name in MARKS or name.endswith("Error"):
                    return True
                if ast.unparse(outer.func).startswith("_log."):
                    return True
                # The key of a row, before its words.
                if name in ("ActionInfo", "Field") and inner is outer.args[0]:
                    return True
            case _:
                pass
    return False


def _is_shown(node: ast.AST, parents: Mapping[ast.AST, ast.AST]) -> bool:
    """Whether a literal goes straight to the screen."""
    for inner, outer in _above(node, parents):
        if isinstance(outer, ast.Call):
            # Behind the text of a line stand its colour and its mark.
            texts = outer.args[:1] if _callee(outer) == "show_text" else [*outer.args, inner]
            return inner is not outer.func and inner in texts and _callee(outer) in _SHOWS
        if not isinstance(outer, ast.IfExp | ast.BoolOp):
            return False
    return False


def _at_import(node: ast.AST, parents: Mapping[ast.AST, ast.AST]) -> bool:
    for inner, outer in _above(node, parents):
        if isinstance(outer, ast.FunctionDef | ast.AsyncFunctionDef) and inner in outer.body:
            return False
        if isinstance(outer, ast.Lambda) and inner is outer.body:
            return False
    return True


def _filled(node: ast.Call, parents: Mapping[ast.AST, ast.AST]) -> frozenset[str] | None:
    above = parents[node]
    call = parents.get(above)
    if isinstance(above, ast.Attribute) and above.attr == "format" and isinstance(call, ast.Call):
        return frozenset(item.arg or "**" for item in call.keywords)
    return None
