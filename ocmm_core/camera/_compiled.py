"""One decorator for the compiled loops of this room and of those that call them."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from ocmm_core.instructions import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(*needs: ModuleType, reorder: bool = False) -> Callable[[F], F]:
    """Return a decorator that compiles a function with numba and keeps the result beside its file.

    Numba compiles anew when the file of the function changes. What it calls in other modules is
    built in, constants included, and a change there would go unnoticed: numbers would land in wrong
    columns. Those modules are named here.

    Parameters
    ----------
    needs
        Modules whose compiled functions or constants the function uses.
    reorder
        Sums may be taken in any order, several numbers at once.
    """
    decorate = njit(
        cache=True, nogil=True, error_model="numpy", fastmath={"reassoc"} if reorder else False
    )

    def compile_cached(function: F) -> F:
        dispatcher: F = decorate(function)
        if needs:
            # numba 0.61 to 0.69 offer no other way; if one does not keep its stamp here, this
            # fails at once instead of letting old code run.
            file = dispatcher._cache._cache_file  # type: ignore[attr-defined] # noqa: SLF001
            file._source_stamp = (file._source_stamp, *map(_digest, needs))  # noqa: SLF001
        return dispatcher

    return compile_cached


def _digest(module: ModuleType) -> bytes:
    try:
        return hashlib.sha256(Path(module.__file__ or "").read_bytes()).digest()
    except OSError:
        # A frozen program has no files; numba's own stamp is that of the whole program then.
        return b""
