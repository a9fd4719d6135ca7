"""Figures of the sources that may only fall, compared with the committed record.

    python -m benchmarks.house_record [--write]

Reads files as text and imports nothing of the product. `--write` lowers the record
(`benchmarks/house.json`) where a figure fell, and never raises it. Exit code 1 if a figure is above
its record.
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from benchmarks.house_files import read_product, read_sources
from benchmarks.house_measures import circles, classes, longer_than, module_graph
from benchmarks.house_tree import House, Source

ROOT = Path(__file__).resolve().parents[1]
RECORD = ROOT / "benchmarks" / "house.json"
LONGEST_FILE = 400
MOST_PARAMETERS = 12
LONGEST_SUBJECT = 72
COMMITS_SINCE = "2026-11-29T00:00:00+00:00"

# Turns of phrase that read as translated.
_TURNS = re.compile(
    "|".join(
        (
            r"\b(whoever|whatever|whichever|wherever|whomever|nobody|somebody|anybody)\b",
            r"\b(says|said|told|tells|tell|asked|asks|stands|stand|stood|standing)\b",
            r"\b(besides?|anew|knows|known|any more|no more)\b",
            r"\b(looked|looks|look) (at|for|whether)\b",
            r"\b(by itself|by themselves|of its own|of their own)\b",
            r"\b(so many|as many|so much|so far as|how (far|large|much|well|sure|many))\b",
            r"\b[Ww]hat (is|was|are|were|it|they|the|a|an|this|has|had|can|may|must|nobody|of|such|"
            r"stands|comes|follows)\b",
            r"\b[Ww]here (it|there|they|none|no|nothing|one|that|this|he|somebody|nobody|a|an|"
            r"the)\b",
            r"(?:(?<=\n)|(?<=\. )|^)\s*Of (the|a|an|its|all|each|this|that|one|those|whom|which)\b",
            r", too[,;.]",
            r"\b(books|papers|deeds?|blows?|doubts?)\b",
            r"\bis (none|one|no)\b",
        )
    ),
    re.MULTILINE,
)

# Strings, which may contain "#", or a comment: eight times as fast as `tokenize`.
_COMMENT = re.compile(
    r""""{3}(?:[^\\"]|\\.|"(?!""))*"{3}|'{3}(?:[^\\']|\\.|'(?!''))*'{3}"""
    r"""|"(?:[^\\"\n]|\\.)*"|'(?:[^\\'\n]|\\.)*'|(#[^\n]*)""",
    re.DOTALL,
)


def figures(root: Path = ROOT) -> dict[str, float]:
    """Return all figures by name; lower is better for each."""
    house = read_product(root)
    product = tuple(house.product.values())
    named = {name: len(places) for name, places in classes(house).items()}
    users = _users(house)
    single = [one for one in product if len(users[one.module]) == 1 and not _is_special(one)]
    pages = [root / name for name in ("README.md", "CONTRIBUTING.md")]
    decisions = sorted((root / "docs" / "decisions").glob("*.md"))
    manual = [
        path
        for path in sorted((root / "docs").rglob("*.md"))
        if path not in decisions and "de" not in path.relative_to(root).parts
    ]
    manual += [root / name for name in ("SECURITY.md", "CHANGELOG.md") if (root / name).is_file()]
    found: dict[str, float] = {
        "lines": sum(one.text.count("\n") for one in product),
        "files": len(product),
        "packages with __all__": sum(one.exported is not None for one in house.packages),
        "class names used twice": sum(count > 1 for count in named.values()),
        "import cycles": len(circles(module_graph(house))),
        f"files above {LONGEST_FILE} lines": len(longer_than(LONGEST_FILE, product)),
        "modules with one user": len(single),
        f"functions with more than {MOST_PARAMETERS} parameters": sum(map(_wide, product)),
        "decisions": sum(path.name[:1].isdigit() for path in decisions),
        "words per 1,000, code": _rate(_python_texts(product)),
        "words per 1,000, tests": _rate(_python_texts(read_sources(root, "tests", "benchmarks"))),
        "words per 1,000, docs": _rate(map(_prose, (*pages, *manual))),
        "words per 1,000, decisions": _rate(map(_prose, decisions)),
        **{f"bytes of {path.name}": path.stat().st_size for path in pages},
    }
    subjects = _subjects(root)
    if subjects is not None:
        found["commit subjects too long"] = sum(len(one) > LONGEST_SUBJECT for one in subjects)
    return found


def worse(now: Mapping[str, float], record: Mapping[str, float]) -> list[str]:
    """Return a sentence for each figure above its record."""
    return [
        f"{name}: {now[name]:g}, and the record is {most:g}."
        for name, most in record.items()
        if name in now and now[name] > most
    ]


def _users(house: House) -> dict[str, set[str]]:
    users: defaultdict[str, set[str]] = defaultdict(set)
    for source in house.product.values():
        for taken in house.imports[source.module]:
            for name in (taken.target, f"{taken.target}.{taken.name}"):
                if name in house.product:
                    users[name].add(source.module)
    # A package that publishes a module is not its user.
    return defaultdict(set, {
        name: those for name, those in users.items()
        if not (len(those) == 1 and house.product[next(iter(those))].is_package)
    })  # fmt: skip


def _is_special(source: Source) -> bool:
    return source.path.name.startswith("__")


def _wide(source: Source) -> int:
    return sum(
        len(node.args.posonlyargs + node.args.args + node.args.kwonlyargs) > MOST_PARAMETERS
        for node in _statements(source.tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    )


def _statements(tree: ast.Module) -> Iterator[ast.stmt]:
    """Yield all statements; several times faster than a walk over all nodes."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        for name in ("body", "orelse", "finalbody", "handlers", "cases"):
            below = getattr(node, name, None)
            if isinstance(below, list):
                waiting += below
        if isinstance(node, ast.stmt):
            yield node


def _python_texts(sources: Iterable[Source]) -> Iterator[str]:
    """Yield docstrings, of fields as well, and comments."""
    for source in sources:
        for one in _statements(source.tree):
            text = one.value if isinstance(one, ast.Expr) else None
            if isinstance(text, ast.Constant) and isinstance(text.value, str):
                yield text.value
        for found in _COMMENT.finditer(source.text):
            if found[1]:
                yield found[1].lstrip("# ")


def _prose(path: Path) -> str:
    return re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)


def _rate(texts: Iterable[str]) -> float:
    """Return turns of phrase per 1,000 words, to a tenth."""
    words = turns = 0
    for text in texts:
        words += len(text.split())
        turns += sum(1 for _ in _TURNS.finditer(text))
    return round(1000.0 * turns / max(1, words), 1)


def _subjects(root: Path) -> list[str] | None:
    """Return subjects of recent commits; None outside a repository with a history."""
    command = ["git", "log", f"--since={COMMITS_SINCE}", "--no-merges", "--format=%s"]
    try:
        done = subprocess.run(  # noqa: S603 - fixed arguments, no shell
            command, cwd=root, capture_output=True, text=True, check=False
        )
    except OSError:
        return None
    return done.stdout.splitlines() if done.returncode == 0 else None


def main() -> int:
    """Print each figure next to its record; return 1 if one is worse."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", action="store_true", help="lower the record")
    options = parser.parse_args()
    record: dict[str, float] = json.loads(RECORD.read_text()) if RECORD.is_file() else {}
    now = figures()
    for name, figure in now.items():
        print(f"{name:42} {figure:>9g}   record {record.get(name, figure):>9g}")
    found = worse(now, record)
    print("\n".join(found))
    if options.write:
        lowered = {name: min(figure, record.get(name, figure)) for name, figure in now.items()}
        RECORD.write_text(json.dumps(lowered, indent=1) + "\n")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
