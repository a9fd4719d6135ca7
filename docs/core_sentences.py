"""Find the sentences in the sources of the core; `docs/make_core_texts.py` lists them.

What is read of a source is its text alone: nothing is imported or run.
"""

from __future__ import annotations

import ast
import itertools
import math
import re
import string
from collections.abc import Iterator, Sequence

_CODE = re.compile(r"[a-z][a-z0-9_]*(\.[a-z0-9_]+)+")
_WORD = re.compile(r"[^\W\d_]{2,}")
_MACHINE = re.compile(
    r"</?\w|\b(SELECT|PRAGMA|CREATE|INSERT|DELETE|UPDATE|VALUES|CHECK|DOCTYPE|TRIGGER|BEGIN|LOCK)\b"
    r"|\b(ALTER TABLE|DROP|LIMIT :page|UNIQUE|NOT NULL|PRIMARY KEY|CASE WHEN)\b|\boperator, plan"
    r"|^part, characteristic,"
    r"|\b\w+ [=<>]+ :\w+"  # a condition of SQL
    r"|^[A-Z_]{8,}\("  # an entity of a STEP file
    r"|://|strftime|search_path|\\d|^[\w.,/ ]*_[\w.,/ ]*$"
)
_SINGLE = re.compile(r"[A-Z]([a-z]+|[A-Z]+)( \(UTC\))?")
_FILLED_LATER = re.compile(r"^[^{}]*(\{([a-z_]*|\d(:\.\df)?)\}[^{}]*)+$")
_MOST_FORMS = 6
"""More alternatives of one sentence stay a name that is filled in."""


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


_SILENT_CALLS = _set(
    "lazy_exports compile findall getLogger debug info warning exception ValueError TypeError "
    "KeyError IndexError AttributeError NotImplementedError AssertionError RuntimeError OSError "
    "execute executescript executemany NamedTemporaryFile Thread match search sub fullmatch dtype "
    "field_names setdefault startswith endswith removeprefix removesuffix replace rstrip lstrip "
    "strip encode join_names TypeVar namedtuple strftime einsum query command_words command "
    "quoted call_text"
)
_SILENT_KEYWORDS = _set("help metavar dtype pattern encoding mode homes order")
_SENTENCE_PARTS = _set(
    "what remedy reason why sentence blocker hint caution fault how problem trouble told complaint "
    "doubt doubts doing next_words reference_reason broken warning judgement gap absent"
)
_WORD_PARTS = _set(
    "value word words summary status state kind shape strerror quantity verdict when lower hold "
    "depth_part wanted_part side"
)
_FAILING = _set(
    "contained described fail note draw run_errand run_elsewhere exit_with _do _tell_failure"
)
_WORD_KEYWORDS = _set("words title point_word direction_word name_words label")


class _Qualified(ast.NodeTransformer):
    """Replaces names of imported modules of ours, `package.name`, by the name alone."""

    def __init__(self, modules: frozenset[str]) -> None:
        self._modules = modules

    @classmethod
    def removed(cls, tree: ast.Module) -> ast.Module:
        """Return a tree as if every name were imported."""
        imports = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
        ours = (node for node in imports if (node.module or "").startswith("ocmm_"))
        modules = frozenset(one.asname or one.name for node in ours for one in node.names)
        cls(modules).visit(tree)
        return tree

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Replace it if it is of a module, whose name has no capitals."""
        self.generic_visit(node)
        match node.value:
            case ast.Name(id=name) if name in self._modules and name.islower():
                return ast.copy_location(ast.Name(node.attr, node.ctx), node)
        return node


class Reader:
    """Finds the sentences of one source."""

    def __init__(self, text: str, *, of_command: bool = True) -> None:
        # `tr` of the window is collected by Qt.
        self._of_command = of_command
        self._tree = _Qualified.removed(ast.parse(text))
        self._parents = {
            child: node for node in ast.walk(self._tree) for child in ast.iter_child_nodes(node)
        }

        self._asked: list[str] = []  # names whose values are being resolved

    def sentences(self, *, all_of_it: bool) -> Iterator[tuple[str, str, bool]]:
        """Return sentences with the code that stands beside them, or nothing for it.

        The last says whether it is a remedy: what stands behind code and sentence.
        """
        for node in ast.walk(self._tree):
            if not isinstance(node, ast.expr) or not _is_text(node) or self._is_inner(node):
                continue
            code, is_remedy = self._code(node)
            spoken = self._is_spoken(node)
            if not (code or all_of_it or spoken) or (not code and self._is_silent(node)):
                continue
            for form in self._forms(node):
                sentence = named(form).strip()
                if not sentence:
                    continue
                if (
                    _WORD.search(_literal(sentence))
                    if spoken
                    else _is_said(sentence, coded=bool(code))
                ):
                    yield sentence, code, is_remedy

    def words(self, *, single: bool, names: bool = False) -> Iterator[str]:
        """Return members of enumerations, words of registries, and what else is asked for.

        ``single``: single words; ``names``: names of entries, which stand in sentences.
        """
        for node in ast.walk(self._tree):
            match node:
                case ast.ClassDef(bases=bases) if any(
                    "Enum" in ast.unparse(base) for base in bases
                ):
                    values = [one.value for one in node.body if isinstance(one, ast.Assign)]
                case ast.keyword(arg=str() as name, value=value) if name in _WORD_KEYWORDS:
                    values = [value]
                case ast.keyword(arg="name", value=value) if names:
                    values = [value]
                case ast.Constant(value=str() as word) if single and _SINGLE.fullmatch(word):
                    values = [] if self._is_silent(node) or self._is_inner(node) else [node]
                case _:
                    continue
            for value in values:
                match value:
                    case ast.Constant(value=str() as word) if _WORD.search(word):
                        yield word
                    case _:
                        pass

    def spoken_words(self) -> Iterator[str]:
        """Return the words that a command prints in the language: heads, labels, verdicts."""
        for node in ast.walk(self._tree):
            if not isinstance(node, ast.Call) or _name_of(node) not in ("tr_word", "heads", "lead"):
                continue
            for value in node.args:
                sides = [value.body, value.orelse] if isinstance(value, ast.IfExp) else [value]
                for side in sides:
                    if isinstance(side, ast.Constant) and _WORD.search(str(side.value)):
                        yield str(side.value).strip()

    def failures(self) -> Iterator[str]:
        """Return the sentences of `failure.contained`: what failed, and what is not lost."""
        for node in ast.walk(self._tree):
            if not isinstance(node, ast.Call) or _called(node) not in _FAILING:
                continue
            for value in node.args:
                for form in self._alternatives(value) or self._constants(value):
                    text = named(form)
                    if re.match(r"[A-Z]\w+ .", text):
                        yield text if text.endswith(".") else f"{text} failed: {{text}}."

    def _constants(self, value: ast.expr) -> list[list[str | ast.FormattedValue]]:
        """Return the texts of a constant of the module."""
        return [
            [node.value.value]
            for node in self._tree.body
            if isinstance(value, ast.Name)
            and isinstance(node, ast.Assign)
            and ast.unparse(node.targets[0]) == value.id
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ]

    def _is_inner(self, node: ast.AST) -> bool:
        parent = self._parents.get(node)
        if isinstance(parent, ast.JoinedStr | ast.FormattedValue):
            return True
        if isinstance(parent, ast.IfExp) and self._is_inner(parent):
            return True
        return isinstance(parent, ast.BinOp) and isinstance(parent.op, ast.Add) and _is_text(parent)

    def _code(self, node: ast.AST) -> tuple[str, bool]:
        """Return the code of the error whose sentence this is, and whether it is its remedy."""
        while (parent := self._parents.get(node)) is not None:
            if isinstance(parent, ast.Call) and node is not parent.func:
                for place, value in enumerate(parent.args[:3]):
                    if (
                        value is not node
                        and isinstance(value, ast.Constant)
                        and isinstance(value.value, str)
                        and _CODE.fullmatch(value.value)
                    ):
                        return value.value, node in parent.args[place + 2 :]
                if not isinstance(node, ast.expr):
                    return "", False
            if isinstance(parent, ast.stmt):
                return "", False
            node = parent
        return "", False

    def _is_spoken(self, node: ast.AST) -> bool:
        """Return whether a command prints it in the language of the terminal."""
        parent = self._parents.get(node)
        return (
            self._of_command
            and isinstance(parent, ast.Call)
            and (
                _name_of(parent) in ("tr", "tr_later")
                or ast.unparse(parent.func).endswith(("console.show", "console.show_line"))
            )
        )

    def _is_silent(self, node: ast.AST) -> bool:
        """Return whether a text is a docstring, a key, a pattern, or for a log."""
        child = node
        while (parent := self._parents.get(child)) is not None:
            match parent:
                case ast.Expr() if child is node:
                    return True
                case ast.Call():
                    if child is not parent.func and _called(parent) in _SILENT_CALLS:
                        return True
                case ast.keyword() if parent.arg in _SILENT_KEYWORDS:
                    return True
                case ast.Compare() | ast.arg():
                    return True
                case ast.AnnAssign() if child is parent.annotation:
                    return True
                case ast.Subscript() if child is parent.slice:
                    return True
                case ast.Dict() if child in parent.keys:
                    return True
                case ast.Assign(targets=[ast.Name(id="__all__")]):
                    return True
                case ast.FunctionDef() | ast.ClassDef() if child in parent.decorator_list:
                    return True
                case ast.stmt():
                    return False
            child = parent
        return False

    def _forms(self, node: ast.expr) -> list[list[str | ast.FormattedValue]]:
        """Return all forms that a text can have, by its alternatives, as parts."""
        match node:
            case ast.Constant(value=str() as text):
                return [[text]]
            case ast.BinOp(left=left, right=right):
                return self._product([left, right])
            case ast.IfExp(body=body, orelse=other):
                return [*self._forms(body), *self._forms(other)]
            case ast.JoinedStr(values=values):
                return [form for tied in _tied(values) for form in self._product(tied)]
            case ast.FormattedValue(value=value, format_spec=None, conversion=-1):
                chosen = self._alternatives(value)
                return chosen if chosen else [[node]]
            case ast.FormattedValue():
                return [[node]]
            case _:
                return [[ast.FormattedValue(node, -1, None)]]

    def _product(self, values: Sequence[ast.expr]) -> list[list[str | ast.FormattedValue]]:
        forms = [self._forms(value) for value in values]
        # The longest lists of alternatives are given up first.
        while (count := math.prod(len(form) for form in forms)) > _MOST_FORMS and count > 1:
            worst = max(range(len(forms)), key=lambda at: len(forms[at]))
            value = values[worst]
            forms[worst] = [
                [
                    value
                    if isinstance(value, ast.FormattedValue)
                    else ast.FormattedValue(value, -1, None)
                ]
            ]
        return [list(itertools.chain(*parts)) for parts in itertools.product(*forms)]

    def _alternatives(self, value: ast.expr) -> list[list[str | ast.FormattedValue]]:
        """Return the source texts of a filled-in value, if all of them are literal."""
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            return [[value.value]]
        if isinstance(value, ast.IfExp):
            sides = [self._alternatives(side) for side in (value.body, value.orelse)]
            return sides[0] + sides[1] if all(sides) else []
        if isinstance(value, ast.JoinedStr):
            return [form for tied in _tied(value.values) for form in self._product(tied)]
        if isinstance(value, ast.Name):
            assigned = [] if value.id in self._asked else self._assigned(value)
            if assigned:
                self._asked.append(value.id)
                sides = [self._alternatives(one) for one in assigned]
                self._asked.pop()
                if all(sides):
                    return [form for side in sides for form in side]
        return []

    def _assigned(self, name: ast.Name) -> list[ast.expr]:
        """Return all that is assigned to a name in the function around it; nothing if unclear."""
        scope: ast.AST = name
        while not isinstance(scope, ast.FunctionDef | ast.Module):
            scope = self._parents[scope]
        found: list[ast.expr] = []
        if isinstance(scope, ast.FunctionDef):
            arguments = scope.args
            if any(one.arg == name.id for one in (*arguments.args, *arguments.kwonlyargs)):
                return []
        for node in ast.walk(scope):
            if (
                isinstance(node, ast.Name)
                and node.id == name.id
                and isinstance(node.ctx, ast.Store)
            ):
                parent = self._parents[node]
                if not isinstance(parent, ast.Assign) or isinstance(parent.value, ast.Name):
                    return []
                if isinstance(parent.targets[0], ast.Tuple):
                    return []
                found.append(parent.value)
        return found


def _tied(values: Sequence[ast.expr]) -> list[list[ast.expr]]:
    """Return parts for each side of the conditions that stand in several of them.

    "Point{'s' if n > 1 else ''} {'were' if n > 1 else 'was'}" has two forms, not four.
    """
    asked = [
        ast.unparse(part.value.test)
        for part in values
        if isinstance(part, ast.FormattedValue) and isinstance(part.value, ast.IfExp)
    ]
    twice = next((test for test in asked if asked.count(test) > 1), None)
    if twice is None:
        return [list(values)]
    sides: list[list[ast.expr]] = [[], []]
    for part in values:
        for side, chosen in zip(sides, ("body", "orelse"), strict=True):
            if (
                isinstance(part, ast.FormattedValue)
                and isinstance(part.value, ast.IfExp)
                and ast.unparse(part.value.test) == twice
            ):
                value = getattr(part.value, chosen)
                side.append(ast.FormattedValue(value, part.conversion, part.format_spec))
            else:
                side.append(part)
    return [tied for side in sides for tied in _tied(side)]


def _name_of(node: ast.Call) -> str:
    """Return the name of a called function; empty for a method."""
    return str(getattr(node.func, "id", ""))


def _called(node: ast.Call) -> str:
    """Return the name of a called function or method."""
    return str(getattr(node.func, "attr", getattr(node.func, "id", "")))


def _is_text(node: ast.AST) -> bool:
    match node:
        case ast.Constant(value=str()) | ast.JoinedStr():
            return True
        case ast.BinOp(op=ast.Add(), left=left, right=right):
            return _is_text(left) or _is_text(right)
        case _:
            return False


def _is_said(sentence: str, *, coded: bool) -> bool:
    literal = _literal(sentence)
    words = _WORD.findall(literal)
    if ":s}" in sentence and not words:
        return bool(re.search(r"[:;(.]", literal))
    if not words or _MACHINE.search(literal) or _CODE.fullmatch(sentence):
        return False
    if coded:
        return " " in sentence or sentence.endswith(".")
    if len(words) == 1 and len(words[0]) > 3 and words[0][0].isupper():
        return bool(re.fullmatch(r"(.*[^.\w])?[A-Z]\w+\.|[A-Z]\w+:? \{.*", sentence))
    if ":w}" in sentence and words:
        return " " in literal.strip()
    return len(words) >= 2 and " " in literal.strip()


def _literal(sentence: str) -> str:
    return " ".join(text for text, *_ in string.Formatter().parse(sentence))


def named(parts: Sequence[str | ast.FormattedValue]) -> str:
    """Return a sentence with a name in braces for each value that is filled in.

    ``{count:n}`` is a number, ``{status:w}`` a word of the program, ``{reason:s}`` a sentence
    of the program; all else is filled in as it is.
    """
    used: dict[str, int] = {}
    text = ""
    if len(parts) == 1 and isinstance(parts[0], str) and _FILLED_LATER.search(parts[0]):
        # `str.format` fills it in; a field with a place or a format is a number.
        return re.sub(r"\{(\d?)(:.*?)?\}", r"{number\1:n}", parts[0])
    for part in parts:
        if isinstance(part, str):
            text += part.replace("{", "{{").replace("}", "}}")
            continue
        name, mark = _name(part.value)
        spec = "" if part.format_spec is None else ast.unparse(part.format_spec)
        if not mark and re.search(r"[\dfdeg%}][fdeg%}]?'?$", spec.rstrip("'")):
            mark = "n" if re.search(r"[fdeg%,]'$", spec) else mark
        used[name] = used.get(name, 0) + 1
        if used[name] > 1:
            name = f"{name}_{used[name]}"
        if text.endswith("}") and not text.endswith("}}"):
            # Nothing parts two of them: they are one.
            text = text[: text.rindex("{")]
            mark = ""
        text += f"{{{name}:{mark}}}" if mark else f"{{{name}}}"
    return text


def _name(value: ast.AST) -> tuple[str, str]:
    match value:
        case ast.Name(id=name):
            name = name.strip("_").lower()
            return name, "s" if name in _SENTENCE_PARTS else "w" if name in _WORD_PARTS else ""
        case ast.Attribute(value=of, attr="value"):
            return _name(of)[0], "w"
        case ast.Attribute(attr=name):
            name = name.strip("_").lower()
            return name, "s" if name in _SENTENCE_PARTS else "w" if name in _WORD_PARTS else ""
        case ast.Call(func=ast.Name(id="len"), args=[one]):
            return _name(one)[0], "n"
        case ast.Call(func=ast.Name(id="shape_word"), args=[one]):
            return "shape", "w"
        case ast.Call(func=ast.Name(), args=[one, *_]):
            return _name(one)[0], ""
        case ast.Call(func=ast.Attribute(value=of, attr=name), args=args):
            if name in {"degrees", "join", "get"} and args:
                return _name(args[0])[0], ""
            name = name.strip("_").lower()
            return name, "w" if name in _WORD_PARTS else ""
        case ast.Call(func=func):
            return _name(func)[0], ""
        case ast.BinOp(left=left, right=right):
            inner = left if not isinstance(left, ast.Constant) else right
            return _name(inner)[0], ""
        case ast.UnaryOp(operand=inner) | ast.Subscript(value=inner) | ast.Starred(value=inner):
            return _name(inner)[0], ""
        case ast.GeneratorExp(elt=inner) | ast.ListComp(elt=inner) | ast.BoolOp(values=[inner, *_]):
            return _name(inner)[0], ""
        case ast.IfExp(body=inner):
            return _name(inner)[0], ""
        case _:
            return "text", ""
