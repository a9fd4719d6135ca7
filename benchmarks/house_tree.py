"""The sources of the product as text: what each file imports and from which package.

Nothing of the product is imported; all is read with `ast`. A room is a package, its face is the
`__init__` with an `__all__`. The face may be lazy: what it imports under TYPE_CHECKING says where a
name comes from as well as a plain import. A file directly in a root package, without a leading
underscore, is a room of one file and its own face (`ocmm_core.errors`).
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOTS = (
    "ocmm_core", "ocmm_genicam", "ocmm_trackers", "ocmm_sim", "ocmm_cad", "ocmm_shop", "ocmm_cli",
    "ocmm_gui", "ocmm_serve", "ocmm_bench", "ocmm_boards", "ocmm_machine", "ocmm_planner",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Import:
    """One thing that a file takes from the product.

    Attributes
    ----------
    target
        Module or package that is named.
    name
        What is taken from it; empty where it is the module itself.
    bound
        Name that it has in the file afterwards.
    line
        Line of the statement, from 1.
    typing
        Whether the statement is read by type checkers alone.
    """

    target: str
    name: str
    bound: str
    line: int
    typing: bool


@dataclass(frozen=True, slots=True)
class Source:
    """One file.

    Attributes
    ----------
    module
        Dotted name; for tests, benchmarks and documents their path.
    path
        The file, relative to the repository.
    is_package
        Whether it is an `__init__`.
    exported
        Content of `__all__`; None where there is none.
    """

    module: str
    path: Path
    is_package: bool
    text: str
    tree: ast.Module
    exported: frozenset[str] | None


@dataclass(frozen=True)
class House:
    """All sources of a repository.

    Attributes
    ----------
    product
        Files of the root packages by dotted name.
    benchmarks, tests, pages
        Other files that use the product; of the documents their scripts and blocks of Python.
    started
        Modules and names that pyproject.toml starts as programs.
    """

    product: Mapping[str, Source]
    benchmarks: tuple[Source, ...]
    tests: tuple[Source, ...]
    pages: tuple[Source, ...]
    started: tuple[tuple[str, str], ...]

    @cached_property
    def imports(self) -> Mapping[str, tuple[Import, ...]]:
        """What each file takes from the product, by its module."""
        everyone = [*self.product.values(), *self.benchmarks, *self.tests, *self.pages]
        return {source.module: tuple(self._imports(source)) for source in everyone}

    @cached_property
    def packages(self) -> tuple[Source, ...]:
        """Packages below the roots."""
        found = (source for source in self.product.values() if source.is_package)
        return tuple(source for source in found if source.module not in ROOTS)

    def home(self, target: str, name: str) -> tuple[str, str]:
        """Return module and name of a definition, behind any number of faces."""
        seen = set()
        while (target, name) not in seen and name:
            seen.add((target, name))
            for one in self.imports.get(target, ()):
                if one.bound == name:
                    target, name = one.target, one.name
                    break
        return target, name

    def room(self, module: str) -> str:
        """Return the package of a module, or the module itself if it is public."""
        if self.product[module].is_package or is_single(module):
            return module
        return parent(module)

    def wrong_entry(self, importer: str, taken: Import) -> str:
        """Return the fault of an import past a public face; empty if there is none.

        Parameters
        ----------
        importer
            Dotted name of the importing module, or of the package of a test.
        taken
            Its import.
        """
        target = taken.target
        if target in ROOTS:
            return ""
        if not self.product[target].is_package:
            within = parent(target)
            open_to_all = inside(importer, within) or is_single(target)
            return "" if open_to_all else "past the face"
        if inside(importer, target):
            return ""
        hidden = next((one for one in upwards(target) if is_private(one)), "")
        if hidden and not inside(importer, parent(hidden)):
            return "a private room"
        exported = self.product[target].exported
        if exported is None:
            return "no face there"
        if not taken.name:
            return "the room as a module"
        return "" if taken.name in exported else "not in __all__"

    def _imports(self, source: Source) -> Iterator[Import]:
        for node, typing in _walk(source.tree, deep="import_module" in source.text):
            if isinstance(node, ast.Import):
                for alias in node.names:
                    if alias.name in self.product:
                        bound = alias.asname or alias.name
                        yield Import(alias.name, "", bound, node.lineno, typing)
            elif isinstance(node, ast.ImportFrom):
                base = _base(source, node)
                for alias in node.names:
                    bound = alias.asname or alias.name
                    whole = f"{base}.{alias.name}"
                    # A face may name a function like the file that holds it.
                    if whole in self.product and not self._exports(base, alias.name):
                        yield Import(whole, "", bound, node.lineno, typing)
                    elif base in self.product:
                        yield Import(base, alias.name, bound, node.lineno, typing)
            elif isinstance(node, ast.Call) and last_name(node) == "import_module":
                named = node.args[0] if node.args else None
                if isinstance(named, ast.Constant) and named.value in self.product:
                    yield Import(str(named.value), "", "", node.lineno, typing)

    def _exports(self, package: str, name: str) -> bool:
        exported = self.product[package].exported if package in self.product else None
        return exported is not None and name in exported


def parent(module: str) -> str:
    """Return the package that a module is in; empty for a root."""
    return module.rpartition(".")[0]


def inside(module: str, package: str) -> bool:
    """Whether a module is a package or anywhere in it."""
    return module == package or module.startswith(f"{package}.")


def is_private(module: str) -> bool:
    """Whether the last part of a dotted name begins with an underscore, `__main__` included."""
    return module.rpartition(".")[2].startswith("_")


def is_single(module: str) -> bool:
    """Whether a module would be a package of one file: directly in a root."""
    return parent(module) in ROOTS and not is_private(module)


def upwards(module: str) -> Iterator[str]:
    """Yield a dotted name and those of the packages around it, without the root."""
    while parent(module):
        yield module
        module = parent(module)


def last_name(node: ast.AST) -> str:
    """Return the last part of a name or call: ``njit`` of ``numba.njit(...)``."""
    if isinstance(node, ast.Call):
        node = node.func
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


_STATEMENTS = (ast.stmt, ast.excepthandler, ast.match_case)


def _walk(node: ast.AST, *, deep: bool) -> Iterator[tuple[ast.AST, bool]]:
    """Yield all nodes, and whether only type checkers come there; only statements unless `deep`."""
    # Not by recursion: each node would pass through a generator for every level above it.
    left = [(child, False) for child in ast.iter_child_nodes(node)][::-1]
    below: list[tuple[ast.AST, bool]]
    while left:
        child, only_typing = left.pop()
        yield child, only_typing
        if isinstance(child, ast.Name | ast.Constant):
            continue
        if isinstance(child, ast.If) and _is_type_checking(child.test):
            below = [
                *((one, True) for one in child.body),
                *((one, only_typing) for one in child.orelse),
            ]
        else:
            below = [
                (one, only_typing)
                for one in ast.iter_child_nodes(child)
                if deep or isinstance(one, _STATEMENTS)
            ]
        left += reversed(below)


def _is_type_checking(test: ast.expr) -> bool:
    return (isinstance(test, ast.Name) and test.id == "TYPE_CHECKING") or (
        isinstance(test, ast.Attribute) and test.attr == "TYPE_CHECKING"
    )


def _base(source: Source, node: ast.ImportFrom) -> str:
    if not node.level:
        return node.module or ""
    around = source.module.split(".")
    kept = around[: len(around) - node.level + source.is_package]
    return ".".join([*kept, *([node.module] if node.module else [])])
