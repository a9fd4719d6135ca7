"""Definitions that nothing in the product uses.

A function or class is used where its file names it outside of itself, or another file imports it,
directly or through faces. That a face names it is no use. A method is used where any attribute of
its name is read or set, and the texts of a file that asks for attributes by name (`getattr`) count
as such: whose it is cannot be told, so that this finds too few rather than too many. What only
unused definitions use is unused itself. docs/integrator/python.md lists names for other programs.
A definition whose docstring says "for tests" is a hook that tests need: it is left out, with what
only such hooks use.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass

from benchmarks.house_tree import House, Source, last_name

_BY_NAME = frozenset({"getattr", "hasattr", "setattr", "delattr", "attrgetter", "methodcaller"})
# These change a definition without registering it.
_PLAIN = frozenset(
    {
        "abstractmethod", "cache", "cached_property", "classmethod", "compiled", "contextmanager",
        "dataclass", "dataclass_transform", "final", "lru_cache", "njit", "overload", "override",
        "property", "runtime_checkable", "setter", "staticmethod", "total_ordering", "wraps",
    }
)  # fmt: skip
# A subclass of a foreign class may have methods that only the latter calls.
_CALLED_BY_NOBODY = frozenset(
    {
        "ABC", "Enum", "Exception", "Flag", "Generic", "IntEnum", "IntFlag", "NamedTuple",
        "Protocol", "StrEnum", "Struct", "TypedDict", "ValueError", "object",
    }
)  # fmt: skip
_OF_FRAMEWORKS = frozenset(
    {
        "connection_lost",
        "connection_made",
        "data_received",
        "eof_received",
        "emit",
        "event",
        "filter",
        "format",
        "on_end",
        "on_start",
        "paint",
        "render_str",
        "resolve_command",
        "run",
        "write",
    }
)

Use = tuple[str, int]
"""Module and line."""


@dataclass(frozen=True, slots=True)
class Definition:
    """A function, class or method.

    Attributes
    ----------
    module, name
        Its module and name.
    owner
        Class of a method; empty for others.
    path
        Its file.
    first, last
        Its lines, decorators included.
    """

    module: str
    name: str
    owner: str
    path: str
    first: int
    last: int

    @property
    def lines(self) -> int:
        """Number of its lines."""
        return self.last - self.first + 1

    def holds(self, use: Use) -> bool:
        """Whether a use is within it."""
        return use[0] == self.module and self.first <= use[1] <= self.last

    def __str__(self) -> str:
        """Return file, line, name and size."""
        name = f"{self.owner}.{self.name}" if self.owner else self.name
        return f"{self.path}:{self.first} {name} ({self.lines} lines)"


@dataclass(frozen=True, slots=True)
class Unused:
    """Definitions unused by the product.

    Attributes
    ----------
    by_anything
        Without any user.
    by_tests_only
        Used by tests.
    """

    by_anything: tuple[Definition, ...]
    by_tests_only: tuple[Definition, ...]


@dataclass(frozen=True, slots=True)
class _Uses:
    defined: defaultdict[tuple[str, str], set[Use]]
    attributes: defaultdict[str, set[Use]]

    def of(self, one: Definition) -> Collection[Use]:
        if one.owner:
            return self.attributes.get(one.name, ())
        return self.defined.get((one.module, one.name), ())


def unused(house: House) -> Unused:
    """Return what neither the product nor benchmarks nor the Python of the documents use."""
    uses = _Uses(defaultdict(set), defaultdict(set))
    for hook in _hooks(house):
        found = uses.attributes[hook.name] if hook.owner else uses.defined[hook.module, hook.name]
        found.add(("tests", 0))
    for module, name in house.started:
        uses.defined[house.home(module, name)].add(("pyproject.toml", 0))
    _add_uses(uses, house, [*house.product.values(), *house.benchmarks, *house.pages])
    without = _unused(_definitions(house), uses)
    _add_uses(uses, house, house.tests)
    at_all = set(_unused(without, uses))
    return Unused(
        tuple(one for one in without if one in at_all),
        tuple(one for one in without if one not in at_all),
    )


def _hooks(house: House) -> Iterator[Definition]:
    """Yield the definitions marked as hooks for tests."""
    for source in house.product.values():
        for node in ast.walk(source.tree):
            if not isinstance(node, ast.ClassDef | ast.Module):
                continue
            for inner in node.body:
                if not isinstance(inner, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                    continue
                if "for tests" in (ast.get_docstring(inner) or "").lower():
                    owner = node.name if isinstance(node, ast.ClassDef) else ""
                    yield _definition(source, inner, owner)


def _unused(found: Iterable[Definition], uses: _Uses) -> list[Definition]:
    found = list(found)
    dead: dict[str, list[Definition]] = defaultdict(list)
    names: list[Definition] = []
    while True:
        more = [
            one
            for one in found
            if one not in names
            and all(
                one.holds(use) or any(other.holds(use) for other in dead[use[0]])
                for use in uses.of(one)
            )
        ]
        if not more:
            break
        names += more
        for one in more:
            dead[one.module].append(one)
    # The methods of an unused class go with it.
    whole = {(one.module, one.name) for one in names if not one.owner}
    return [one for one in found if one in names and (one.module, one.owner) not in whole]


def _definitions(house: House) -> Iterator[Definition]:
    for source in house.product.values():
        for node in source.tree.body:
            if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                continue
            if not _is_known(node):
                yield _definition(source, node, "")
            if isinstance(node, ast.ClassDef):
                foreign = _is_foreign(house, source, node, set())
                for inner in node.body:
                    if (
                        isinstance(inner, ast.FunctionDef | ast.AsyncFunctionDef)
                        and not _is_known(inner)
                        and not (foreign and _may_be_called(inner.name))
                    ):
                        yield _definition(source, inner, node.name)


def _definition(
    source: Source, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef, owner: str
) -> Definition:
    first = min([node.lineno, *(one.lineno for one in node.decorator_list)])
    last = node.end_lineno or node.lineno
    return Definition(source.module, node.name, owner, str(source.path), first, last)


def _is_known(node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> bool:
    """Whether Python or a registering decorator uses a definition."""
    special = node.name.startswith("_") and node.name.endswith("_")
    return special or any(last_name(one) not in _PLAIN for one in node.decorator_list)


def _is_foreign(house: House, source: Source, node: ast.ClassDef, seen: set[str]) -> bool:
    """Whether a class builds, however far down, on one that is not of the product."""
    for base in node.bases:
        inner = base.value if isinstance(base, ast.Subscript) else base
        name = last_name(inner)
        module, name = _home_of(house, source, name)
        found = _class_of(house, module, name)
        if found is None:
            # asyncio's protocol is not a mere interface for type checkers: the event loop calls it.
            if name not in _CALLED_BY_NOBODY or ast.unparse(inner) == "asyncio.Protocol":
                return True
        elif name not in seen and _is_foreign(house, house.product[module], found, seen | {name}):
            return True
    return False


def _home_of(house: House, source: Source, name: str) -> tuple[str, str]:
    for taken in house.imports[source.module]:
        if taken.bound == name:
            return house.home(taken.target, taken.name)
    return source.module, name


def _class_of(house: House, module: str, name: str) -> ast.ClassDef | None:
    body = house.product[module].tree.body if module in house.product else []
    return next((n for n in body if isinstance(n, ast.ClassDef) and n.name == name), None)


def _may_be_called(name: str) -> bool:
    """Whether a method may be one that a framework calls; Qt's are in camelCase."""
    return name != name.lower() or name in _OF_FRAMEWORKS or name.startswith(("visit_", "do_"))


def _add_uses(uses: _Uses, house: House, sources: Iterable[Source]) -> None:
    for source in sources:
        modules = _modules_by_name(house, source)
        loaded: set[str] = set()
        texts: list[tuple[str, int]] = []
        by_name = False
        late = []
        for node in ast.walk(source.tree):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                loaded.add(node.id)
                uses.defined[source.module, node.id].add((source.module, node.lineno))
            elif isinstance(node, ast.Attribute):
                use = (source.module, node.lineno)
                uses.attributes[node.attr].add(use)
                module = modules.get(_dotted(node.value))
                if module:
                    uses.defined[house.home(module, node.attr)].add(use)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                texts.append((node.value, node.lineno))
            elif isinstance(node, ast.Call) and last_name(node) in _BY_NAME:
                by_name = True
                texts_of_call = (one for one in ast.walk(node) if isinstance(one, ast.Constant))
                late += [str(one.value) for one in texts_of_call if one.value in house.product]
            elif isinstance(node, ast.ClassDef):
                for name, line in _in_body(node):
                    uses.attributes[name].add((source.module, line))
        # A table of names for `getattr`, unless it is that of a lazy face.
        if by_name and not source.is_package:
            for text, line in texts:
                uses.attributes[text].add((source.module, line))
                # And of the lazily imported modules.
                for imported in late:
                    uses.defined[imported, text].add((source.module, line))
        for taken in house.imports[source.module]:
            # A face that only passes a name on does not use it.
            if taken.name and not (source.is_package and taken.bound not in loaded):
                home = house.home(taken.target, taken.name)
                uses.defined[home].add((source.module, taken.line))


def _modules_by_name(house: House, source: Source) -> dict[str, str]:
    """Return the modules of the product that a file can name, also through faces, by their name."""
    homes = ((one.bound, house.home(one.target, one.name)) for one in house.imports[source.module])
    return {bound: module for bound, (module, name) in homes if not name}


def _in_body(node: ast.ClassDef) -> Iterator[tuple[str, int]]:
    """Yield the names used in a class outside its methods: ``area = property(_area)``."""
    for statement in node.body:
        if isinstance(statement, ast.Assign | ast.AnnAssign | ast.Expr):
            for one in ast.walk(statement):
                if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Load):
                    yield one.id, one.lineno


def _dotted(node: ast.expr) -> str:
    """Return ``a.b.c`` as it is written; empty for anything else."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute):
        before = _dotted(node.value)
        return f"{before}.{node.attr}" if before else ""
    return ""
