"""Files that only the user of the station may read, from their first moment on."""

from __future__ import annotations

import os
from pathlib import Path

from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.leftovers import temporary_file
from ocmm_core.side_files import open_guarded


def private_content(path: Path) -> bytes | None:
    """Return what a private file holds, 4096 bytes at most; None where there is none.

    Raises
    ------
    StorageError
        It cannot be read, or others than its user can read it, too.
    """
    try:
        descriptor = open_guarded(path)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StorageError(
            "key.unreadable",
            f"{path}: the key of this station cannot be read ({error.strerror}).",
            "Start the program as the user of this station.",
        ) from error
    with open(descriptor, "rb") as stream:  # noqa: PTH123 - looked at and read by one descriptor
        state = os.fstat(descriptor)
        content = stream.read(4096)
    if HOST.is_open_to(state, 0o077):
        raise StorageError(
            "key.open",
            f"{path}: other users can read the key of this station.",
            f"Type chmod 600 {path}, then replace the key: ocmm key replace.",
        )
    return content


def private_temporary(path: Path, content: bytes) -> Path:
    """Write a private file beside ``path``, under a temporary name and to the disk; return it.

    Raises
    ------
    StorageError
        The folder cannot be written.
    """
    folder = path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        folder.chmod(0o700)
        descriptor, temporary = temporary_file(path)
    except OSError as error:
        raise unwritable(folder, error) from error
    with open(descriptor, "wb") as stream:  # noqa: PTH123 - made beside the key
        try:
            # Nobody else may read it, not even before there is anything in it.
            temporary.chmod(0o600)
            stream.write(content)
            stream.flush()
            os.fsync(descriptor)
        except OSError as error:
            temporary.unlink(missing_ok=True)
            raise unwritable(folder, error) from error
    return temporary


def unwritable(folder: Path, error: OSError) -> StorageError:
    """Return what is to be said where nothing can be written to the folder of keys."""
    return StorageError(
        "key.unwritable",
        f"{folder}: the key of this station cannot be stored ({error.strerror}).",
        "Free disk space, or give the user of this station a folder that can be written.",
    )
