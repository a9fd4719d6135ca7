"""Several files written as one: all of them or none."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Callable, Mapping
from pathlib import Path

from ocmm_core.documents import write_atomic
from ocmm_core.errors import StorageError


def write_together(
    contents: Mapping[Path, bytes],
    check: Callable[[Mapping[Path, bytes]], None] | None = None,
) -> None:
    """Write files of one folder, which is made where it is missing.

    Everything is first written and synced under temporary names. Should a rename fail after
    another one went well, the files that were replaced already get back what they held.

    Parameters
    ----------
    check
        Gets what was read back before any file is replaced; when it raises, nothing is.

    Raises
    ------
    StorageError
        Something cannot be written; the folder then holds the files that it held before.
    """
    staged = {path: path.with_name(f".{path.name}.{os.getpid()}.new") for path in contents}
    replaced: list[tuple[Path, bytes | None]] = []
    path = next(iter(contents))
    try:
        for path in contents:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomic(staged[path], contents[path])
        if check is not None:
            check({path: staged[path].read_bytes() for path in contents})
        for path in contents:
            before = path.read_bytes() if path.exists() else None
            staged[path].replace(path)
            replaced.append((path, before))
    except OSError as error:
        for done, before in replaced:
            with contextlib.suppress(OSError):
                if before is None:
                    done.unlink()
                else:
                    write_atomic(done, before)
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        raise StorageError(
            "export.not_writable",
            f"{path}: the file cannot be written ({error.strerror}).",
            "Free space on that disk, or choose a folder on another one."
            if full
            else "Choose a writable folder, and close programs that use the file.",
        ) from error
    finally:
        for temporary in staged.values():
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
