"""Parsed sources of the product, for tests of their content."""

from __future__ import annotations

import ast
import gc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def parsed_with(*texts: str) -> Iterator[tuple[str, ast.Module]]:
    """Yield name and tree of each file that contains one of the texts; no other is parsed.

    Sources are formatted: a call is ``name(``, an argument ``name=``.
    """
    for path in sorted(ROOT.glob("ocmm_*/**/*.py")):
        text = path.read_text("utf-8")
        if any(one in text for one in texts):
            yield path.relative_to(ROOT).as_posix(), ast.parse(text)


@contextmanager
def uncollected() -> Iterator[None]:
    """Pause garbage collections: visits of a million parsed nodes take as long as parsing."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
