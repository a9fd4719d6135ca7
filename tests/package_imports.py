"""Permitted imports of inner files: the contract of import-linter, for the product and its tests.

The ``__init__`` of a package is its public face. A file whose name begins with an underscore is
internal: only files of the same package import it. The tests of a package may import its internals
- those in ``tests/core/NAME`` from ``ocmm_core.NAME`` and its packages, those in ``tests/gui`` from
``ocmm_gui`` - and all others use the public face like the product.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, output

from benchmarks.house_tree import ROOTS

_REPOSITORY = Path(__file__).resolve().parents[1]
_OUTSIDE = ("tests", "benchmarks", "docs", "installer")


@dataclass(frozen=True, slots=True)
class InnerImport:
    """Import of an inner module from outside its package."""

    importer: str
    line: int
    imported: str

    def __str__(self) -> str:
        """Return the place of the import and its correction."""
        package = package_of(self.imported)
        return f"{self.importer}:{self.line} imports {self.imported}: import from {package}"


def package_of(module: str) -> str:
    """Return the package of an internal module; empty for a public one."""
    parts = module.split(".")
    inner = next((i for i, part in enumerate(parts) if _is_inner(part)), None)
    return ".".join(parts[:inner]) if inner is not None else ""


def _is_inner(part: str) -> bool:
    return part.startswith("_") and not part.startswith("__")


def tested_package(test: Path) -> str:
    """Return the package whose inner modules a test may import; ``test``: its relative path."""
    parts = test.parts
    own = f"ocmm_{parts[1]}"
    if parts[0] != "tests" or own not in ROOTS:
        return ""
    if own != "ocmm_core":
        return own
    return f"ocmm_core.{parts[2]}" if len(parts) > 3 else ""


def inner_imports_from_outside(repository: Path) -> Iterator[InnerImport]:
    """Yield inner imports of tests, benchmarks and scripts."""
    for folder in _OUTSIDE:
        for path in sorted((repository / folder).rglob("*.py")):
            relative = path.relative_to(repository)
            own = tested_package(relative)
            for line, module in _imported(path):
                package = package_of(module)
                if package and not (own and (package + ".").startswith(own + ".")):
                    yield InnerImport(relative.as_posix(), line, module)


def _imported(path: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            # `from package import _file` names the file last, `from package._file import x` before.
            names = names if not package_of(node.module) else [node.module]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        for name in names:
            # A private name in a module of a single file is not a package.
            if name.startswith(ROOTS) and package_of(name) not in ROOTS:
                yield node.lineno, name


def inner_imports_inside(graph: ImportGraph) -> Iterator[InnerImport]:
    """Yield inner imports of the product."""
    ours = sorted(module for module in graph.modules if module.startswith(ROOTS))
    packages = {module for module in ours if graph.find_children(module)}
    for module in ours:
        package = package_of(module)
        if not package:
            continue
        for importer in sorted(graph.find_modules_that_directly_import(module)):
            own = importer if importer in packages else importer.rpartition(".")[0]
            if own != package:
                details = graph.get_import_details(importer=importer, imported=module)
                line = details[0]["line_number"] if details else 0
                yield InnerImport(importer, line, module)


class PackageImportsContract(Contract):
    """Packages are imported by their public API alone."""

    type_name = "public_api"

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Check every import of the product, its tests, benchmarks and scripts."""
        found = [*inner_imports_inside(graph), *inner_imports_from_outside(_REPOSITORY)]
        return ContractCheck(kept=not found, metadata={"found": found})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print every finding, one a line."""
        for one in check.metadata["found"]:
            output.print_error(str(one))
