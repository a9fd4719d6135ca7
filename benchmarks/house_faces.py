"""Write the lists of names in the `__init__` of every package.

    python -m benchmarks.house_faces

The imports under ``if TYPE_CHECKING`` are the list: add a name there, in any place, and run this.
Both lists come out sorted, in full lines. Reads files as text and imports nothing of the product.
"""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Iterable, Iterator
from pathlib import Path

from benchmarks.house_tree import ROOTS

ROOT = Path(__file__).resolve().parents[1]
WIDTH = 100

Name = tuple[str, str]
"""As its file calls it, and as the package exports it."""


def faces(root: Path = ROOT) -> Iterator[Path]:
    """Yield the `__init__` of every package."""
    for name in ROOTS:
        yield from sorted((root / name).rglob("__init__.py"))


def written(text: str) -> str:
    """Return the text of an `__init__` with sorted lists; the same if it exports nothing lazily."""
    tree = ast.parse(text)
    lazy = [node for node in tree.body if isinstance(node, ast.If) and node.orelse]
    if not lazy:
        return text
    modules: dict[str, set[Name]] = {}
    for node in lazy[0].body:
        if not isinstance(node, ast.ImportFrom) or node.module is None:
            raise ValueError(f"line {node.lineno} is no import of names")
        for one in node.names:
            modules.setdefault(node.module, set()).add((one.name, one.asname or one.name))
    exported = [name for names in modules.values() for _, name in names]
    lines = text.splitlines()
    first, last = lazy[0].body[0].lineno, lazy[0].body[-1].end_lineno or 0
    kept = [*lines[: first - 1], *_imports(modules), *lines[last : lazy[0].end_lineno], ""]
    return "\n".join([*kept, *_packed("__all__ = [", _quoted(exported), "]", "")]) + "\n"


def _imports(modules: dict[str, set[Name]]) -> Iterator[str]:
    for module, names in sorted(modules.items()):
        start = f"    from {module} import "
        yield from (f"{start}{name} as {other}" for name, other in sorted(names) if name != other)
        plain = sorted((name for name, other in names if name == other), key=_rank)
        if plain:
            one = start + ", ".join(plain)
            yield from [one] if len(one) <= WIDTH else _packed(f"{start}(", plain, ")", "    ")


def _packed(start: str, names: Iterable[str], end: str, indent: str) -> list[str]:
    """Return a list on one line, or in full lines that the formatter leaves alone."""
    content = ", ".join(names)
    if len(start) + len(content) + len(end) <= WIDTH:
        return [f"{start}{content}{end}"]
    inner = f"{indent}    "
    body = textwrap.wrap(
        f"{content},", WIDTH, initial_indent=inner, subsequent_indent=inner, break_on_hyphens=False
    )
    return [start, *body, f"{indent}{end}  # fmt: skip"]


def _quoted(names: Iterable[str]) -> list[str]:
    return [f'"{name}"' for name in sorted(names, key=_rank)]


def _rank(name: str) -> tuple[int, str]:
    """Constants, classes, functions: the order of import sorters."""
    return (0 if name.isupper() and len(name) > 1 else 1 if name[0].isupper() else 2, name)


def main() -> None:
    """Write the files that differ."""
    for path in faces():
        text = path.read_text(encoding="utf-8")
        new = written(text)
        if new != text:
            path.write_text(new, encoding="utf-8")
            print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
