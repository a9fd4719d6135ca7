"""Lock of a folder with a history, between processes."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.host import HOST

_READING_S, _WRITING_S = 5.0, 20.0
"""Longest waits. A write takes milliseconds; many processes may want to write at once."""
_BETWEEN_S = 0.002


@contextmanager
def locked_folder(folder: Path, *, shared: bool = False) -> Iterator[None]:
    """Keep other processes from writing meanwhile; StorageError if one writes for too long."""
    try:
        if not shared:
            folder.mkdir(parents=True, exist_ok=True)
        descriptor = HOST.open_to_lock(folder)
    except OSError as error:
        raise StorageError(
            "events.folder",
            f"{folder}: the folder cannot be opened ({error.strerror}).",
            "Restore it, or give one with read and write permission, then repeat.",
        ) from error
    try:
        _lock(folder, descriptor, shared=shared)
        yield
    finally:
        os.close(descriptor)


def _lock(folder: Path, descriptor: int, *, shared: bool) -> None:
    patience_s = _READING_S if shared else _WRITING_S
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        try:
            HOST.lock(descriptor, shared=shared)
        except BlockingIOError:
            time.sleep(_BETWEEN_S)
            continue
        except OSError:
            # A file system without locks.
            return
        return
    raise StorageError(
        "events.busy",
        f"{folder}: another program has been writing the history for {patience_s:g} s.",
        "Wait until it has ended, or close it, then repeat.",
    )
