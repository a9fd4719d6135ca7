"""Where numba finds the kernels of the package; it loads this by its name.

Their folders are root's and are only read. What is not in them is compiled in memory, by the
process that needs it: slower, and right.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import config
from numba.core.caching import Cache, InTreeCacheLocator

from installer.bundle.kernels import kernels_beside


class ShippedLocator(InTreeCacheLocator):  # type: ignore[misc] # numba ships no annotations
    """Beside the file of the function, whether or not that can be written to.

    Each kind of processor has its own folder, so that both can be compiled at the same time: numba
    keeps one list of results for each function of a folder.
    """

    def __init__(self, py_func: Any, py_file: str) -> None:
        super().__init__(py_func, py_file)
        self._kept = str(kernels_beside(Path(py_file), str(config.CPU_NAME)))

    def get_cache_path(self) -> str:
        """Return the folder of the results."""
        return self._kept

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> ShippedLocator | None:
        """Return the place of a function's results; None where there is no file of it."""
        return cls(py_func, py_file) if Path(py_file).is_file() else None

    def ensure_cache_path(self) -> None:
        """Do nothing: whether it can be written to shows when it is."""

    def get_source_stamp(self) -> bytes:
        """Return what tells one state of the file from another."""
        # numba's own is that of the program where a program is frozen.
        return _digest(self._py_file)


@cache
def _digest(file: str) -> bytes:
    return hashlib.sha256(Path(file).read_bytes()).digest()


@contextmanager
def _going_on(_: Any) -> Iterator[None]:
    """Let numba go on where it cannot store or read a result."""
    try:
        yield
    except OSError:
        return


Cache._guard_against_spurious_io_errors = _going_on  # noqa: SLF001 - numba has the place for it, for Windows alone
