"""Write several files, all or none."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Callable, Mapping
from pathlib import Path

from ocmm_core.documents import write_atomic, written_beside
from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.leftovers import clear_beside
from ocmm_core.side_files import LARGEST_JOB, read_guarded


def write_together(
    contents: Mapping[Path, bytes], check: Callable[[Mapping[Path, bytes]], None] | None = None
) -> None:
    """Write files of one folder, created if missing.

    Everything is first written and synced under temporary names. If a rename fails after others
    succeeded, the replaced files are restored. Temporary files of a killed program are removed here
    and at the next start (`leftovers`). `check`: receives the read-back content before any file is
    replaced; may raise. StorageError: something cannot be written; the folder then holds its former
    files, or the error names those that could not be restored.
    """
    staged: dict[Path, Path] = {}
    replaced: list[tuple[Path, bytes | None]] = []
    path = next(iter(contents))
    try:
        with contextlib.ExitStack() as held:
            for path in contents:
                path.parent.mkdir(parents=True, exist_ok=True)
                clear_beside(path)
                staged[path] = held.enter_context(written_beside(path, contents[path]))
            if check is not None:
                check({path: staged[path].read_bytes() for path in contents})
            for path in contents:
                before = read_guarded(path, LARGEST_JOB) if path.exists() else None
                staged[path].replace(path)
                replaced.append((path, before))
            for folder in {path.parent for path in contents}:
                HOST.sync_folder(folder)
    except OSError as error:
        mixed = [done.name for done, before in replaced if not _put_back(done, before)]
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        raise StorageError(
            "export.not_writable",
            f"{path}: the file cannot be written ({error.strerror})."
            + (f" Already replaced: {', '.join(mixed)}." if mixed else ""),
            "Free space on that disk, or choose a folder on another one."
            if full
            else "Choose a writable folder, and close programs that use the file.",
        ) from error


def _put_back(path: Path, before: bytes | None) -> bool:
    """Restore or remove a file; return whether that succeeded."""
    try:
        if before is None:
            path.unlink()
            return True
        write_atomic(path, before)
    except OSError:
        # A disk that fails to rename may still write.
        if before is None:
            return False
        try:
            path.write_bytes(before)
        except OSError:
            return False
    return True
