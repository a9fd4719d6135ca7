"""The places of a module that can be changed a little, and the text of each change.

A change is one small mistake as it is made in writing: a number that is one off or doubled, a
comparison with or without its limit or the wrong way round, an operator or a sign exchanged, a
condition negated, a result or a field of it missing, two of them exchanged. What nobody computes
with is left alone: docstrings and all other text, annotations, decorators, imports, what only a
type checker reads, the words of a log, errors that are raised, and ``strict=`` of ``zip``, which
checks the code and not the values.
"""

from __future__ import annotations

import ast
import io
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

Place = tuple[int, int]
"""Line from 1, character from 0."""

COMPARISONS: dict[str, tuple[str, ...]] = {
    "<": ("<=", ">="),
    "<=": ("<", ">"),
    ">": (">=", "<="),
    ">=": (">", "<"),
    "==": ("!=",),
    "!=": ("==",),
    "is": ("is not",),
    "is not": ("is",),
    "in": ("not in",),
    "not in": ("in",),
}
ARITHMETIC = {"+": "-", "-": "+", "*": "/", "/": "*", "//": "*", "%": "*", "**": "*"}
LARGE = 100
"""Whole numbers from here on are doubled: a change by one would be no detectable mistake."""
COMPILERS = ("njit", "compiled")
"""Decorators of compiled functions; no test is seen in these."""
LOGS = ("_log", "log", "logger", "logging", "warnings")


@dataclass(frozen=True, slots=True)
class Change:
    """One change of one module.

    Attributes
    ----------
    kind
        number, comparison, arithmetic, sign, condition, connective, truth, or result.
    begin, end
        What is replaced, on one line or over several.
    text
        What stands there instead.
    names
        Where no test can be seen at the place itself, the names it is used by: the compiled
        function, the constant, the class.
    compiled
        Whether it stands in a compiled function.
    """

    kind: str
    begin: Place
    end: Place
    text: str
    names: tuple[str, ...]
    compiled: bool

    def applied(self, source: str) -> str:
        """Return the module with the change."""
        lines = source.splitlines(keepends=True)
        before = [*lines[: self.begin[0] - 1], lines[self.begin[0] - 1][: self.begin[1]]]
        after = [lines[self.end[0] - 1][self.end[1] :], *lines[self.end[0] :]]
        return "".join([*before, self.text, *after])


def changes(source: str) -> list[Change]:
    """Return all changes of a module, in the order of the text."""
    found = _Walk(source)
    found.block(ast.parse(source).body)
    return sorted(set(found.changes), key=lambda one: (one.begin, one.end, one.text))


class _Walk:
    def __init__(self, source: str) -> None:
        self.changes: list[Change] = []
        self._lines = source.splitlines()
        self._tokens = list(tokenize.generate_tokens(io.StringIO(source).readline))
        self._names: tuple[str, ...] = ()
        self._compiled = False
        self._inside = False

    def block(self, body: list[ast.stmt]) -> None:
        for statement in body:
            self._statement(statement)

    def _statement(self, node: ast.stmt) -> None:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            self._definition(node)
        elif isinstance(node, ast.Import | ast.ImportFrom | ast.Raise | ast.Assert):
            return
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            self._assignment(node)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            self.block(node.orelse)
        elif isinstance(node, ast.AugAssign):
            if not isinstance(node.value, ast.JoinedStr):
                self._operator(node.target, node.value, ARITHMETIC, "=")
            self._any(node.value)
        else:
            if isinstance(node, ast.Return) and node.value is not None:
                self._result(node.value)
            if isinstance(node, ast.If | ast.While):
                self._negated(node.test)
            self._children(node)

    def _definition(self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> None:
        before = self._names, self._compiled, self._inside
        if isinstance(node, ast.ClassDef):
            self._names, self._inside = (node.name,), False
        else:
            marks = " ".join(ast.unparse(one) for one in node.decorator_list)
            self._compiled |= any(word in marks for word in COMPILERS)
            # Defaults belong to who calls without them.
            self._names = (node.name,)
            for default in (*node.args.defaults, *node.args.kw_defaults):
                if default is not None:
                    self._any(default)
            if not self._compiled:
                self._names = ()
            self._inside = True
        self.block(node.body)
        self._names, self._compiled, self._inside = before

    def _assignment(self, node: ast.Assign | ast.AnnAssign) -> None:
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = tuple(one.id for one in targets if isinstance(one, ast.Name))
        if "__all__" in names or node.value is None:
            return
        before = self._names
        if not self._inside:
            self._names = (*names, *before)
        self._any(node.value)
        self._names = before

    def _children(self, node: ast.AST) -> None:
        for child in ast.iter_child_nodes(node):
            self._any(child)

    def _any(self, node: ast.AST) -> None:
        """Record the changes of a part of a statement and of its contents."""
        match node:
            case ast.stmt():
                self._statement(node)
                return
            case ast.JoinedStr() | ast.expr_context():
                # Before Python 3.12 parts of an f-string have no place of their own.
                return
            case ast.Call() if _word(node.func) in LOGS or _word(node.func) == "cast":
                return
            case ast.Call() if (_word(node.func) or "").endswith(("Error", "Refusal")):
                return
            case ast.keyword(arg="strict"):
                return
            case ast.Constant():
                self._constant(node)
            case ast.Compare():
                for left, right in pairwise((node.left, *node.comparators)):
                    self._operator(left, right, COMPARISONS)
            case ast.BinOp() if not _text(node.left) and not _text(node.right):
                self._operator(node.left, node.right, ARITHMETIC)
            case ast.BoolOp():
                for left, right in pairwise(node.values):
                    self._operator(left, right, {"and": "or", "or": "and"})
            case ast.UnaryOp(op=ast.USub() | ast.Not()):
                line, begin = self._begin(node)
                sign = 1 if isinstance(node.op, ast.USub) else len("not ")
                self._add("sign", (line, begin), (line, begin + sign), "")
            case ast.IfExp():
                self._negated(node.test)
        self._children(node)

    def _constant(self, node: ast.Constant) -> None:
        begin, end, value = self._begin(node), self._end(node), node.value
        if isinstance(value, bool):
            self._add("truth", begin, end, str(not value))
        elif isinstance(value, int):
            near = [value + 1, value - 1] if value < LARGE else [2 * value]
            for number in near:
                self._add("number", begin, end, str(number))
        elif isinstance(value, float):
            self._add("number", begin, end, repr(value + 1.0))
            if value:
                self._add("number", begin, end, repr(2.0 * value))

    def _result(self, node: ast.expr) -> None:
        if not (isinstance(node, ast.Constant) and node.value is None):
            self._add("result", self._begin(node), self._end(node), "None")
        fields = node.elts if isinstance(node, ast.Tuple) else []
        if isinstance(node, ast.Call):
            fields = [] if any(isinstance(one, ast.Starred) for one in node.args) else node.args
            for named in node.keywords:
                if named.arg not in (None, "strict"):
                    self._add("result", self._begin(named.value), self._end(named.value), "None")
        for left, right in pairwise(fields):
            if _text(left) or _text(right):
                continue
            between = self._part(self._end(left), self._begin(right))
            exchanged = self._of(right) + between + self._of(left)
            self._add("result", self._begin(left), self._end(right), exchanged)

    def _negated(self, node: ast.expr) -> None:
        self._add("condition", self._begin(node), self._end(node), f"(not ({self._of(node)}))")

    def _operator(
        self,
        left: ast.expr,
        right: ast.expr,
        table: dict[str, tuple[str, ...]] | dict[str, str],
        tail: str = "",
    ) -> None:
        if _text(left) or _text(right):
            return
        begin, end = self._end(left), self._begin(right)
        tokens = [
            one
            for one in self._tokens
            if begin <= one.start
            and one.end <= end
            and one.string not in "()\\\n"
            and one.type in (tokenize.OP, tokenize.NAME)
        ]
        written = " ".join(one.string for one in tokens).removesuffix(tail)
        instead = table.get(written, ())
        if not instead:
            return
        kind = {id(COMPARISONS): "comparison", id(ARITHMETIC): "arithmetic"}.get(
            id(table), "connective"
        )
        for text in (instead,) if isinstance(instead, str) else instead:
            self._add(kind, tokens[0].start, tokens[-1].end, text + tail)

    def _add(self, kind: str, begin: Place, end: Place, text: str) -> None:
        self.changes.append(Change(kind, begin, end, text, self._names, self._compiled))

    def _begin(self, node: ast.expr) -> Place:
        return self._place(node.lineno, node.col_offset)

    def _end(self, node: ast.expr) -> Place:
        return self._place(node.end_lineno or 0, node.end_col_offset or 0)

    def _place(self, line: int, byte: int) -> Place:
        return line, len(self._lines[line - 1].encode()[:byte].decode())

    def _of(self, node: ast.expr) -> str:
        return self._part(self._begin(node), self._end(node))

    def _part(self, begin: Place, end: Place) -> str:
        lines = self._lines[begin[0] - 1 : end[0]]
        lines[-1] = lines[-1][: end[1]]
        lines[0] = lines[0][begin[1] :]
        return "\n".join(lines)


def _word(node: ast.expr) -> str | None:
    """Return the first name of ``a.b.c``, or the name itself."""
    while isinstance(node, ast.Attribute):
        node = node.value
    return node.id if isinstance(node, ast.Name) else None


def _text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def places(source: str, names: frozenset[str]) -> Iterator[int]:
    """Yield the lines, inside of functions, that use one of the names."""
    for function in ast.walk(ast.parse(source)):
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            for node in ast.walk(function):
                if isinstance(node, ast.Name | ast.Attribute):
                    word = node.id if isinstance(node, ast.Name) else node.attr
                    if word in names:
                        yield node.lineno
