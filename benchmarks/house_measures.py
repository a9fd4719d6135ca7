"""Measures of the tree: faces, circles, names, comments, sizes."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from benchmarks.house_tree import ROOTS, House, Import, Source, inside, is_single, last_name

_NUMBA = frozenset({"njit", "jit", "vectorize", "guvectorize", "cfunc", "stencil"})
# Comments for tools explain nothing.
_TO_A_TOOL = re.compile(r"#\s*(noqa|type:|fmt:|pragma|ruff:|mypy:)")
_LAYOUT = frozenset(
    {
        tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.COMMENT,
        tokenize.ENCODING, tokenize.ENDMARKER,
    }
)  # fmt: skip

Graph = Mapping[str, frozenset[str]]


@dataclass(frozen=True, slots=True)
class Entry:
    """Import of an inner module from outside its package."""

    source: Source
    taken: Import
    reason: str

    def __str__(self) -> str:
        """Return file, line, and the import."""
        name = f".{self.taken.name}" if self.taken.name else ""
        return f"{self.source.path}:{self.taken.line} {self.taken.target}{name} ({self.reason})"


@dataclass(frozen=True, slots=True)
class Density:
    """Comments of one file: lines with a comment, and lines of code without docstrings."""

    path: str
    comments: int
    code: int

    @property
    def per_100(self) -> float:
        """Comment lines per 100 lines of code."""
        return 100.0 * self.comments / max(1, self.code)


def wrong_entries(house: House, sources: Iterable[Source]) -> list[Entry]:
    """Return the imports of ``sources`` past a public face.

    Imports under TYPE_CHECKING count as well. Tests may import the internals of their package and,
    if a test is for a package of packages, of the packages in it.
    """
    found = []
    for source in sources:
        home = package_of_test(house, source)
        for taken in house.imports[source.module]:
            own = home and inside(house.room(taken.target), home)
            reason = "" if own else house.wrong_entry(home or source.module, taken)
            if reason:
                found.append(Entry(source, taken, reason))
    return found


def package_of_test(house: House, source: Source) -> str:
    """Return the package of a test, by its folder; empty if it has none.

    `tests/core/a/b` is for `ocmm_core.a.b`, or for `ocmm_core.a` if the former does not exist;
    `tests/gui` is for `ocmm_gui`. A file directly in `tests/core` is for no package.
    """
    parts = source.path.parts
    if len(parts) < 3 or parts[0] != "tests" or f"ocmm_{parts[1]}" not in ROOTS:
        return ""
    names = [f"ocmm_{parts[1]}", *parts[2:-1]]
    while names and ".".join(names) not in house.product:
        names.pop()
    found = ".".join(names)
    return "" if found == "ocmm_core" else found


def single_rooms(house: House) -> list[str]:
    """Return the rooms of one file: those directly in a root package."""
    return [
        name for name, source in house.product.items() if is_single(name) and not source.is_package
    ]


def module_graph(house: House, *, typing: bool = False) -> Graph:
    """Return the modules needed by each module: the named file, and the file with the definition.

    A lazy face (`__getattr__`) needs nothing itself; an importer of its name needs the file behind
    it. With ``typing``, imports under TYPE_CHECKING count as well.
    """
    graph = {}
    for name in house.product:
        needs = set()
        for taken in house.imports[name]:
            if typing or not taken.typing:
                needs |= {taken.target, house.home(taken.target, taken.name)[0]}
        graph[name] = frozenset(needs - {name} - set(ROOTS))
    return graph


def room_graph(house: House, *, typing: bool = False) -> Graph:
    """Return which room needs which."""
    graph: defaultdict[str, set[str]] = defaultdict(set)
    for name, needs in module_graph(house, typing=typing).items():
        room = house.room(name)
        graph[room] |= {house.room(one) for one in needs} - {room, *ROOTS}
    return {room: frozenset(needs) for room, needs in graph.items()}


def circles(graph: Graph) -> list[list[str]]:
    """Return the strongly connected parts of a graph that hold more than one node (Tarjan 1972)."""
    found: list[list[str]] = []
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    for start in graph:
        if start in order:
            continue
        work = [(start, iter(sorted(graph[start])))]
        order[start] = low[start] = len(order)
        stack.append(start)
        while work:
            node, following = work[-1]
            for one in following:
                if one not in order:
                    order[one] = low[one] = len(order)
                    stack.append(one)
                    work.append((one, iter(sorted(graph.get(one, ())))))
                    break
                if one in stack:
                    low[node] = min(low[node], order[one])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == order[node]:
                    at = stack.index(node)
                    if len(stack) - at > 1:
                        found.append(sorted(stack[at:]))
                    del stack[at:]
    return sorted(found)


def classes(house: House) -> Mapping[str, list[str]]:
    """Return the files of each public class by its name."""
    found: defaultdict[str, list[str]] = defaultdict(list)
    for source in house.product.values():
        for node in source.tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(f"{source.path}:{node.lineno}")
    return found


def kernels(house: House) -> list[Density]:
    """Return the density of comments in files with functions that numba compiles."""
    compilers = _NUMBA | _wrappers(house)
    found = []
    for source in house.product.values():
        names = compilers | _local_compilers(source, compilers)
        functions = (n for n in ast.walk(source.tree) if isinstance(n, ast.FunctionDef))
        if any(last_name(one) in names for f in functions for one in f.decorator_list):
            found.append(density(source))
    return sorted(found, key=lambda one: one.per_100)


def density(source: Source) -> Density:
    """Return comments and lines of code of a file; docstrings and blank lines are neither."""
    comments: set[int] = set()
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source.text).readline):
        if token.type == tokenize.COMMENT and not _TO_A_TOOL.match(token.string):
            comments.add(token.start[0])
        elif token.type not in _LAYOUT:
            code.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(source.tree):
        # A docstring, of a constant as well.
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            code.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return Density(str(source.path), len(comments), len(code))


def folders(house: House) -> Counter[str]:
    """Return the number of Python files directly in each folder."""
    return Counter(str(source.path.parent) for source in house.product.values())


def lines(sources: Iterable[Source]) -> int:
    """Return the number of lines, blank ones included."""
    return sum(len(source.text.splitlines()) for source in sources)


def longer_than(limit: int, sources: Iterable[Source]) -> list[tuple[str, int]]:
    """Return the files above a number of lines, the longest first."""
    sizes = ((str(source.path), lines([source])) for source in sources)
    return sorted((one for one in sizes if one[1] > limit), key=lambda one: -one[1])


def _wrappers(house: House) -> frozenset[str]:
    """Return the functions of the product that call numba to make a decorator."""
    return frozenset(
        function.name
        for source in house.product.values()
        if "numba" in source.text
        for function in source.tree.body
        if isinstance(function, ast.FunctionDef)
        and not any(last_name(one) in _NUMBA for one in function.decorator_list)
        and any(last_name(one) in _NUMBA for one in _calls(function))
    )


def _local_compilers(source: Source, compilers: frozenset[str]) -> frozenset[str]:
    """Return the decorators that a file makes for itself: ``_quick = njit(cache=True)``."""
    return frozenset(
        target.id
        for node in source.tree.body
        if isinstance(node, ast.Assign) and last_name(node.value) in compilers
        for target in node.targets
        if isinstance(target, ast.Name)
    )


def _calls(node: ast.AST) -> Iterator[ast.Call]:
    return (one for one in ast.walk(node) if isinstance(one, ast.Call))
