"""For which processors loops are compiled: one of two kinds, in a clone as in the package.

Compiled for the very processor that is there, a clone on one with AVX-512 added up in another order
than the package did, and than the computer beside it: the last bit of a number differed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

AVX2, GENERIC = "haswell", "generic"
"""As LLVM calls them: with AVX2 and FMA, and any x86-64 one. The suite is run with both."""
KINDS = (AVX2, GENERIC)
_NEEDED = frozenset({"avx", "avx2", "bmi", "bmi2", "f16c", "fma", "movbe", "popcnt", "lzcnt"})
_NAME = "NUMBA_CPU_NAME"


def kind_of(features: Iterable[str]) -> str:
    """Return for which kind to compile, by the features of a processor as LLVM names them."""
    return AVX2 if frozenset(features) >= _NEEDED else GENERIC


def kind_of_this() -> str:
    """Return for which kind to compile on this processor, as LLVM sees it."""
    from llvmlite.binding import get_host_cpu_features

    return kind_of(name for name, has in get_host_cpu_features().items() if has)


def kind_in_use() -> str:
    """Return for which kind loops are compiled in this process, as `njit` decides it."""
    if _NAME in os.environ:
        return os.environ[_NAME]
    if _is_x86():
        return kind_of_this()
    from llvmlite.binding import get_host_cpu_name

    return str(get_host_cpu_name())


def environment(kind: str) -> dict[str, str]:
    """Return what numba must find in its environment to compile for a kind."""
    # Empty: the features of that processor; without it those of this one are in the key.
    return {_NAME: kind, "NUMBA_CPU_FEATURES": ""}


def njit(**options: object) -> Callable[[F], F]:
    """Return numba's decorator, which compiles for the kind of this processor.

    Where the environment names a processor already, that one counts.
    """
    _choose()
    import numba

    decorate: Callable[[F], F] = numba.njit(**options)
    return decorate


@cache
def _choose() -> None:
    if _NAME in os.environ:
        return
    from numba.core import config

    # Of another architecture numba knows more than we do.
    if _is_x86():
        # The processes of this one inherit it.
        os.environ.update(environment(kind_of_this()))
        # Whoever imported numba before us had it read an environment without.
        config.reload_config()


def _is_x86() -> bool:
    from llvmlite.binding import get_process_triple

    return str(get_process_triple()).startswith(("x86_64", "amd64"))
