"""Processor kinds for which loops are compiled: two, so that sums have the same last bit.

Code compiled for AVX-512 adds in another order. The compiled cache is next to the source; two
processes may write it at once.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable
from functools import cache, update_wrapper
from pathlib import Path
from threading import RLock
from types import ModuleType
from typing import Any, TypeVar, cast

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


def njit(*needs: ModuleType, **options: object) -> Callable[[F], F]:
    """Return numba's decorator for the kind of this processor, or that in the environment.

    The function is made on its first use, which imports numba. `needs`: modules that it inlines
    compiled functions or constants of. Numba does not notice changes there.
    """

    def defer(function: F) -> F:
        return cast("F", Deferred(function, needs, options))

    return defer


class Deferred:
    """Function to be compiled: replaced by numba's dispatcher in its module on the first use."""

    _lock = RLock()
    _made: Any = None

    def __init__(
        self, function: Callable[..., Any], needs: tuple[ModuleType, ...], options: dict[str, Any]
    ) -> None:
        update_wrapper(self, function)
        self._function, self._needs, self._options = function, needs, options

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call the compiled function."""
        return (self._made or self._dispatcher())(*args, **named)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._made or self._dispatcher(), name)

    def __reduce__(self) -> str:
        return self._function.__qualname__

    def is_made(self) -> bool:
        """Return whether it was used."""
        return self._made is not None

    def _dispatcher(self) -> Any:
        with self._lock:
            if self._made is None:
                self._made = self._make()
                # Numba compiles calls of dispatchers only.
                names = self._function.__globals__
                for name, value in list(names.items()):
                    if isinstance(value, Deferred):
                        names[name] = value._dispatcher()  # noqa: SLF001 - of this class
            return self._made

    def _make(self) -> Any:
        _choose()
        import numba

        dispatcher: Any = numba.njit(**self._options)(self._function)
        if self._options.get("cache"):
            # numba 0.61 to 0.69 have no other way; if one keeps its stamp elsewhere, this fails at
            # once instead of running stale code.
            file = dispatcher._cache._cache_file  # noqa: SLF001
            if self._needs:
                file._source_stamp = (file._source_stamp, *map(_digest, self._needs))  # noqa: SLF001
            if hasattr(file, "load"):
                # The package has its loops in a library.
                dispatcher._cache._cache_file = _KeptCode(file)  # noqa: SLF001
        return dispatcher


def _digest(module: ModuleType) -> bytes:
    try:
        return hashlib.sha256(Path(module.__file__ or "").read_bytes()).digest()
    except OSError:
        # A frozen program has no files; numba then uses the stamp of the whole program.
        return b""


class _KeptCode:
    """Compiled cache of a function that returns code only for the key it was compiled for.

    Numba writes an index, then the numbered file with the code. If two processes compile at once,
    the index may name code for other types or of an older source, which would misread its input:
    each file therefore contains its key. `file`: `numba.core.caching.IndexDataCacheFile`.
    """

    def __init__(self, file: Any) -> None:
        self._file = file

    def flush(self) -> None:
        self._file.flush()

    def save(self, key: object, data: object) -> None:
        self._file.save(key, (*self._named(key), data))

    def load(self, key: object) -> Any:
        """Return the code for a key; None if it must be compiled."""
        try:
            found = self._file.load(key)
        except (AttributeError, ImportError):
            # The index names a class of arguments that an older source had.
            self.flush()
            return None
        if found is None or tuple(found[:3]) != self._named(key):
            return None
        return found[3]

    def _named(self, key: object) -> tuple[object, ...]:
        return (_KEPT, self._file._source_stamp, key)  # noqa: SLF001


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
