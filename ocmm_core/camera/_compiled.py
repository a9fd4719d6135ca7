"""One decorator for the compiled loops of this package and its callers."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any, TypeVar

from ocmm_core.cpu_features import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(*needs: ModuleType, reorder: bool = False) -> Callable[[F], F]:
    """Return a decorator that compiles with numba and caches the result beside the file.

    `needs`: see `njit`. `reorder`: allow sums in any order, several numbers at once.
    """
    return njit(
        *needs, cache=True, nogil=True, error_model="numpy",
        fastmath={"reassoc"} if reorder else False,
    )  # fmt: skip
