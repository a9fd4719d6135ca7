"""For which processors loops are compiled: one of two kinds, in a clone as in the package.

Compiled for the very processor that is there, a clone on one with AVX-512 added up in another order
than the package did, and than the computer beside it: the last bit of a number differed.

What was compiled is kept beside its source, and two processes may write there at once.
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
_KEPT = "ocmm.compiled/1"
"""Stands before what is kept of a function; numba's own begins otherwise."""


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
    """Return numba's decorator for the kind of this processor, or that in the environment."""
    _choose()
    import numba

    decorate: Callable[[F], F] = numba.njit(**options)

    def decorate_kept(function: F) -> F:
        dispatcher: Any = decorate(function)
        if options.get("cache") and hasattr(dispatcher._cache._cache_file, "load"):  # noqa: SLF001
            # The package has its loops in a library, and keeps none.
            dispatcher._cache._cache_file = _KeptCode(dispatcher._cache._cache_file)  # noqa: SLF001
        made: F = dispatcher
        return made

    return decorate_kept


class _KeptCode:
    """What numba keeps of a function on the disk, given out only as what it was compiled for.

    Numba writes an index, which says in which file the code for which types is, and then that file,
    by a number that is free. Between both, and where two processes compile the same function for
    different types at once, the index names a file with other code: of other types, or of an older
    source. It would be run all the same: it reads what it was given as something else, so that
    numbers are wrong or the process ends. So each file says here what is in it.

    Parameters
    ----------
    file
        `numba.core.caching.IndexDataCacheFile` of the function.
    """

    def __init__(self, file: Any) -> None:
        self._file = file

    @property
    def _source_stamp(self) -> object:
        """Return by what numba sees that the source changed; `ocmm_core.camera.compiled` adds."""
        return self._file._source_stamp  # noqa: SLF001

    @_source_stamp.setter
    def _source_stamp(self, stamp: object) -> None:
        self._file._source_stamp = stamp  # noqa: SLF001

    def flush(self) -> None:
        """Forget what is kept."""
        self._file.flush()

    def save(self, key: object, data: object) -> None:
        """Keep what was compiled for the types in ``key``."""
        self._file.save(key, (_KEPT, self._source_stamp, key, data))

    def load(self, key: object) -> Any:
        """Return what was compiled for a key; None where it is not kept, so that it is compiled."""
        found = self._file.load(key)
        if found is None or tuple(found[:3]) != (_KEPT, self._source_stamp, key):
            return None
        return found[3]


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
