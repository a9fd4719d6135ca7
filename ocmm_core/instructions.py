"""Processor kinds for which loops are compiled: two, so that sums have the same last bit.

Code compiled for AVX-512 adds in another order. The compiled cache is next to the source; two
processes may write it at once.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

AVX2, GENERIC = "haswell", "generic"
"""LLVM names: with AVX2 and FMA, and any x86-64. The tests run with both."""
KINDS = (AVX2, GENERIC)
_NEEDED = frozenset({"avx", "avx2", "bmi", "bmi2", "f16c", "fma", "movbe", "popcnt", "lzcnt"})
_NAME = "NUMBA_CPU_NAME"
_KEPT = "ocmm.compiled/1"
"""Start of a stored function; differs from numba's."""


def kind_of(features: Iterable[str]) -> str:
    """Return the kind of a processor by its LLVM features."""
    return AVX2 if frozenset(features) >= _NEEDED else GENERIC


def kind_of_this() -> str:
    """Return the kind of this processor."""
    from llvmlite.binding import get_host_cpu_features

    return kind_of(name for name, has in get_host_cpu_features().items() if has)


def kind_in_use() -> str:
    """Return the kind that `njit` uses in this process."""
    if _NAME in os.environ:
        return os.environ[_NAME]
    if _is_x86():
        return kind_of_this()
    from llvmlite.binding import get_host_cpu_name

    return str(get_host_cpu_name())


def environment(kind: str) -> dict[str, str]:
    """Return numba's environment for a kind."""
    # Empty: the features of that kind; if missing, the key contains those of this processor.
    return {_NAME: kind, "NUMBA_CPU_FEATURES": ""}


def njit(**options: object) -> Callable[[F], F]:
    """Return numba's decorator for the kind of this processor, or that in the environment."""
    _choose()
    import numba

    decorate: Callable[[F], F] = numba.njit(**options)

    def decorate_kept(function: F) -> F:
        dispatcher: Any = decorate(function)
        if options.get("cache") and hasattr(dispatcher._cache._cache_file, "load"):  # noqa: SLF001
            # The package has its loops in a library.
            dispatcher._cache._cache_file = _KeptCode(dispatcher._cache._cache_file)  # noqa: SLF001
        made: F = dispatcher
        return made

    return decorate_kept


class _KeptCode:
    """Compiled cache of a function that returns code only for the key it was compiled for.

    Numba writes an index, then the numbered file with the code. If two processes compile at once,
    the index may name code for other types or of an older source, which would misread its input:
    each file therefore contains its key. `file`: `numba.core.caching.IndexDataCacheFile`.
    """

    def __init__(self, file: Any) -> None:
        self._file = file

    @property
    def _source_stamp(self) -> object:
        """Return numba's stamp of the source; `ocmm_core.camera.compiled` adds to it."""
        return self._file._source_stamp  # noqa: SLF001

    @_source_stamp.setter
    def _source_stamp(self, stamp: object) -> None:
        self._file._source_stamp = stamp  # noqa: SLF001

    def flush(self) -> None:
        self._file.flush()

    def save(self, key: object, data: object) -> None:
        self._file.save(key, (_KEPT, self._source_stamp, key, data))

    def load(self, key: object) -> Any:
        """Return the code for a key; None if it must be compiled."""
        found = self._file.load(key)
        if found is None or tuple(found[:3]) != (_KEPT, self._source_stamp, key):
            return None
        return found[3]


@cache
def _choose() -> None:
    if _NAME in os.environ:
        return
    from numba.core import config

    if _is_x86():
        # The processes of this one inherit it.
        os.environ.update(environment(kind_of_this()))
        # Numba may have been imported before, without this environment.
        config.reload_config()


def _is_x86() -> bool:
    from llvmlite.binding import get_process_triple

    return str(get_process_triple()).startswith(("x86_64", "amd64"))
