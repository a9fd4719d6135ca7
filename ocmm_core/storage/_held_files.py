"""Descriptors of the database files that this process has open.

POSIX drops all locks on a file with any descriptor: read it through the holder's descriptor.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ocmm_core.side_files import LARGEST_JOB, open_guarded


@dataclass(slots=True)
class _Holding:
    descriptors: list[int] = field(default_factory=list)
    users: int = 0


class HeldFiles:
    """Descriptors of the files held by this process, by device and inode."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._held: dict[tuple[int, int], _Holding] = {}

    def hold(self, path: Path, most: int) -> tuple[tuple[int, int], int]:
        """Keep a descriptor until `let_go`; return its key and it. Raises as `open_guarded`."""
        with self._lock:
            descriptor = open_guarded(path, follow=False, most=most)
            key = _key(descriptor)
            holding = self._held.setdefault(key, _Holding())
            holding.descriptors.append(descriptor)
            holding.users += 1
            return key, descriptor

    def let_go(self, key: tuple[int, int]) -> None:
        """End a `hold`, after the connection is closed."""
        with self._lock:
            holding = self._held[key]
            holding.users -= 1
            if not holding.users:
                del self._held[key]
                for descriptor in holding.descriptors:
                    os.close(descriptor)

    @contextlib.contextmanager
    def reading(self, path: Path) -> Iterator[int]:
        """Yield a descriptor for reading a job file; OSError of `open_guarded`."""
        with self._lock:
            looked = path.stat()
            holding = self._held.get((looked.st_dev, looked.st_ino))
            if holding is not None:
                yield holding.descriptors[0]
                return
            descriptor = open_guarded(path, most=LARGEST_JOB)
            try:
                yield descriptor
            finally:
                replaced = self._held.get(_key(descriptor))
                if replaced is None:
                    os.close(descriptor)
                else:
                    # The name was given to a held job meanwhile: closing would drop its locks.
                    replaced.descriptors.append(descriptor)


HELD = HeldFiles()
"""Per process, like POSIX locks."""


def _key(descriptor: int) -> tuple[int, int]:
    state = os.fstat(descriptor)
    return state.st_dev, state.st_ino
