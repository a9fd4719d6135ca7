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
class Entrance:
    """An import that enters a room past its door."""

    importer: str
    line: int
    imported: str

    def __str__(self) -> str:
        """Return the place of the import and its correction."""
        room = room_of(self.imported)
        return f"{self.importer}:{self.line} imports {self.imported}: enter by {room}"


def room_of(module: str) -> str:
    """Return the package of an internal module; empty for a public one."""
    parts = module.split(".")
    inner = next((i for i, part in enumerate(parts) if _is_inner(part)), None)
    return ".".join(parts[:inner]) if inner is not None else ""


def _is_inner(part: str) -> bool:
    return part.startswith("_") and not part.startswith("__")


def may_look_into(test: Path) -> str:
    """Return the package whose rooms a test may enter; ``test`` is relative to the repository."""
    parts = test.parts
    own = f"ocmm_{parts[1]}"
    if parts[0] != "tests" or own not in ROOTS:
        return ""
    if own != "ocmm_core":
        return own
    return f"ocmm_core.{parts[2]}" if len(parts) > 3 else ""


def entrances_from_outside(repository: Path) -> Iterator[Entrance]:
    """Yield what tests, benchmarks and scripts import past a door."""
    for folder in _OUTSIDE:
        for path in sorted((repository / folder).rglob("*.py")):
            relative = path.relative_to(repository)
            own = may_look_into(relative)
            for line, module in _imported(path):
                room = room_of(module)
                if room and not (own and (room + ".").startswith(own + ".")):
                    yield Entrance(relative.as_posix(), line, module)


def _imported(path: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            # `from room import _file` names the file last, `from room._file import x` before.
            names = names if not room_of(node.module) else [node.module]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        for name in names:
            # A private name inside a module of a single file is not a room.
            if name.startswith(ROOTS) and room_of(name) not in ROOTS:
                yield node.lineno, name


def entrances_inside(graph: ImportGraph) -> Iterator[Entrance]:
    """Yield the product's imports past a public face."""
    ours = sorted(module for module in graph.modules if module.startswith(ROOTS))
    packages = {module for module in ours if graph.find_children(module)}
    for module in ours:
        room = room_of(module)
        if not room:
            continue
        for importer in sorted(graph.find_modules_that_directly_import(module)):
            own = importer if importer in packages else importer.rpartition(".")[0]
            if own != room:
                details = graph.get_import_details(importer=importer, imported=module)
                line = details[0]["line_number"] if details else 0
                yield Entrance(importer, line, module)


class DoorsContract(Contract):
    """Nobody enters a room but by its door."""

    type_name = "doors"

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Look at every import of the product, its tests, benchmarks and scripts."""
        found = [*entrances_inside(graph), *entrances_from_outside(_REPOSITORY)]
        return ContractCheck(kept=not found, metadata={"found": found})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print every entrance, one a line."""
        for entrance in check.metadata["found"]:
            output.print_error(str(entrance))
