"""Files of the station that other users must not read or must not write."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from ocmm_core.cleanup import temporary_file
from ocmm_core.errors import StorageError
from ocmm_core.host import HOST
from ocmm_core.side_files import open_guarded

_LARGEST = 1 << 20


def guarded_content(
    path: Path, what: str, *, secret: bool = False, most: int = _LARGEST
) -> bytes | None:
    """Return the content of a file that other users cannot have written; None if missing.

    `what`: Noun for the file in messages. `secret`: Other users must not read it; may be a link.
    Raises StorageError if it cannot be read, is no regular file, or other users have more rights.
    """
    try:
        descriptor = open_guarded(path, follow=secret, most=most)
        with open(descriptor, "rb") as stream:  # noqa: PTH123 - checked and read by one descriptor
            state, content = os.fstat(descriptor), stream.read(most)
    except OSError as error:
        # A link to nothing is not missing.
        if isinstance(error, FileNotFoundError) and not path.is_symlink():
            return None
        raise StorageError(
            "key.unreadable" if secret else "station.unreadable",
            f"{path}: the {what} cannot be read ({error.strerror}).",
            "Start the program as the user of this station."
            if secret
            else "Restore it from a backup as a regular file of this user, with read permission.",
        ) from error
    if not secret:
        _refuse_foreign(path, state, what)
    elif HOST.is_open_to(state, 0o077):
        raise StorageError(
            "key.open",
            f"{path}: other users can read the {what}.",
            f"Type chmod 600 {path}, then replace the key: ocmm key replace.",
        )
    refuse_open_folder(path.parent, what)
    return content


def refuse_open_folder(folder: Path, what: str) -> None:
    """Raise StorageError if others can exchange its files or the folder; sticky parents pass."""
    for one in (folder, *folder.parents):
        try:
            state = one.stat()
        except OSError:
            continue
        sticky = one != folder and state.st_mode & stat.S_ISVTX
        if _others_write(state) and not sticky:
            raise StorageError(
                "station.open_folder",
                f"{one}: other users can write this folder, so the {what} in it is not trusted.",
                f"Check the files in it, then type chmod go-w {one}.",
            )


def _refuse_foreign(path: Path, state: os.stat_result, what: str) -> None:
    if not HOST.is_own(state) and state.st_uid != 0:
        raise StorageError(
            "station.owner",
            f"{path}: the {what} belongs to another user, so it is not trusted.",
            f"Start the program as the user of this station. If you are, restore {path} from a "
            "backup.",
        )
    if _others_write(state):
        raise StorageError(
            "station.open",
            f"{path}: other users can write the {what}, so it is not trusted.",
            f"Check it, then type chmod 600 {path}.",
        )


def _others_write(state: os.stat_result) -> bool:
    """Return whether others can write; the primary group of the user does not count as others."""
    return HOST.is_open_to(state, 0o002 if HOST.is_of_group(state) else 0o022)


def private_temporary(path: Path, content: bytes) -> Path:
    """Flush a private file next to ``path``, return its temporary name, or raise StorageError."""
    folder = path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        folder.chmod(0o700)
        descriptor, temporary = temporary_file(path)
    except OSError as error:
        raise unwritable(folder, error) from error
    try:
        # On a full disk, closing fails again.
        with open(descriptor, "wb") as stream:  # noqa: PTH123 - made next to the key
            # Other users must not read it, not even while it is empty.
            temporary.chmod(0o600)
            stream.write(content)
            stream.flush()
            os.fsync(descriptor)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise unwritable(folder, error) from error
    return temporary


def unwritable(folder: Path, error: OSError) -> StorageError:
    return StorageError(
        "key.unwritable",
        f"{folder}: the key of this station cannot be stored ({error.strerror}).",
        "Free disk space, or give the user of this station a folder that can be written.",
    )
