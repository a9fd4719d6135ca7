"""One decorator for the compiled loops of this package and its callers."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from ocmm_core.instructions import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(*needs: ModuleType, reorder: bool = False) -> Callable[[F], F]:
    """Return a decorator that compiles with numba and caches the result beside the file.

    Numba recompiles when the file of the function changes, but inlines what it calls in other
    modules, constants included, without noticing changes there. Those modules are therefore named
    here. `needs`: modules whose compiled functions or constants the function uses. `reorder`: allow
    sums in any order, several numbers at once.
    """
    decorate = njit(
        cache=True, nogil=True, error_model="numpy", fastmath={"reassoc"} if reorder else False
    )

    def compile_cached(function: F) -> F:
        dispatcher: F = decorate(function)
        if needs:
            # numba 0.61 to 0.69 have no other way; if one keeps its stamp elsewhere, this fails at
            # once instead of running stale code.
            file = dispatcher._cache._cache_file  # type: ignore[attr-defined] # noqa: SLF001
            file._source_stamp = (file._source_stamp, *map(_digest, needs))  # noqa: SLF001
        return dispatcher

    return compile_cached


def _digest(module: ModuleType) -> bytes:
    try:
        return hashlib.sha256(Path(module.__file__ or "").read_bytes()).digest()
    except OSError:
        # A frozen program has no files; numba then uses the stamp of the whole program.
        return b""
