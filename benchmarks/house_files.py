"""Reads the files of a repository for `benchmarks.house`."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from keyword import iskeyword
from pathlib import Path

from benchmarks.house_tree import ROOTS, House, Source

_BLOCK = re.compile(r"^```python\n(.*?)^```", re.M | re.S)
_NAME = re.compile(r"`([a-z_]+)`")


def read_house(root: Path) -> House:
    """Read every Python file of the repository at ``root``, and the Python in its documents."""
    product = _product(root)
    others = {folder: read_sources(root, folder) for folder in ("benchmarks", "tests", "docs")}
    pages = (*others["docs"], *_pages(root))
    return House(product, others["benchmarks"], others["tests"], pages, tuple(_started(root)))


def read_product(root: Path) -> House:
    """Read the files of the root packages alone: enough for the graph of their imports."""
    return House(_product(root), (), (), (), ())


def read_sources(root: Path, *folders: str) -> tuple[Source, ...]:
    """Read every Python file below the folders."""
    return tuple(
        _read(root, path, path.read_text(encoding="utf-8"))
        for folder in folders
        for path in sorted((root / folder).rglob("*.py"))
    )


def _product(root: Path) -> dict[str, Source]:
    product = {}
    for name in ROOTS:
        for path in sorted((root / name).rglob("*.py")):
            source = _read(root, path, path.read_text(encoding="utf-8"))
            product[source.module] = source
    return product


def _read(root: Path, path: Path, text: str) -> Source:
    relative = path.relative_to(root)
    is_package = path.name == "__init__.py"
    module = ".".join((relative.parent if is_package else relative.with_suffix("")).parts)
    tree = ast.parse(text, str(relative))
    return Source(module, relative, is_package, text, tree, _all_of(tree))


def _all_of(tree: ast.Module) -> frozenset[str] | None:
    for node in tree.body:
        targets: list[ast.expr] = []
        if isinstance(node, ast.Assign):
            targets = node.targets
        elif isinstance(node, ast.AnnAssign | ast.AugAssign):
            targets = [node.target]
        if any(isinstance(one, ast.Name) and one.id == "__all__" for one in targets):
            value = getattr(node, "value", None)
            if isinstance(value, ast.List | ast.Tuple):
                return frozenset(str(ast.literal_eval(one)) for one in value.elts)
            raise ValueError("an __all__ that is not a plain list cannot be read")
    return None


def _pages(root: Path) -> Iterator[Source]:
    """Yield the Python of the documents, and the names that a page for programmers explains."""
    for path in sorted((root / "docs").rglob("*.md")):
        text = path.read_text(encoding="utf-8")
        blocks = _BLOCK.findall(text)
        if any(name in block for name in ROOTS for block in blocks):
            names = dict.fromkeys(_NAME.findall(text))
            blocks.append("\n".join(f"page.{name}" for name in names if not iskeyword(name)))
        for number, block in enumerate(blocks):
            try:
                tree = ast.parse(block)
            except SyntaxError:
                # A fragment that a reader completes.
                continue
            relative = path.relative_to(root)
            yield Source(f"{relative}#{number}", relative, False, block, tree, None)


def _started(root: Path) -> Iterator[tuple[str, str]]:
    file = root / "pyproject.toml"
    project = tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    for target in project.get("project", {}).get("scripts", {}).values():
        module, _, name = target.partition(":")
        yield module, name
