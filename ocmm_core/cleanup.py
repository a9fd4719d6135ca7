"""Cleanup of temporary files of killed programs.

Each temporary file, work folder and ring of frames is locked while in use, and the system releases
locks with the process: one that can be locked is a leftover, also on a shared folder. Between
making and locking another program may remove it, so its maker compares the name afterwards.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from ocmm_core.host import HOST

_log = logging.getLogger(__name__)

_MARK = r"\.ocmm-[0-9a-f]{6}\.tmp"
_BEING_WRITTEN = re.compile(rf"\..*{_MARK}")
_SCRATCH = "ocmm-scratch-"
_TRIES = 10
"""Other programs clear at their start; more collisions are no accident."""


def hold(descriptor: int, path: Path) -> bool:
    """Lock a new file at ``path``; return False if another program removed it as a leftover."""
    try:
        HOST.lock(descriptor)
    except BlockingIOError:
        return False
    except OSError:
        # A file system without locks: others cannot lock it either, and do not remove it.
        return True
    return HOST.is_at(descriptor, path)


def temporary_file(path: Path) -> tuple[int, Path]:
    """Make a file next to ``path`` for its content; return its descriptor and name; or OSError."""
    while True:
        name = path.with_name(f".{path.name}.ocmm-{secrets.token_hex(3)}.tmp")
        try:
            descriptor = HOST.open_file(name, os.O_WRONLY | os.O_CREAT | os.O_EXCL)
        except FileExistsError:
            continue
        if hold(descriptor, name):
            return descriptor, name
        os.close(descriptor)


@contextlib.contextmanager
def scratch_folder(what: str) -> Iterator[Path]:
    """Give a new folder to work in, removed with its content at the end; or raise OSError."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=f"{_SCRATCH}{what}-"))
        descriptor = _held(folder)
        if descriptor is not None:
            break
    try:
        yield folder
    finally:
        os.close(descriptor)
        shutil.rmtree(folder, ignore_errors=True)


def scratch_path(what: str) -> Path:
    """Return a path at which another process may make a work folder, see `keep_folder`."""
    return Path(tempfile.gettempdir()) / f"{_SCRATCH}{what}-{secrets.token_hex(8)}"


def keep_folder(folder: Path) -> bool:
    """Make and hold the folder of a `scratch_path` until exit; return success, or raise OSError."""
    for _ in range(_TRIES):
        folder.mkdir(mode=0o700)
        # Never closed: the end of the process does that.
        if _held(folder) is not None:
            return True
        if folder.exists():
            return False
    return False


def _held(folder: Path) -> int | None:
    """Return the lock of a new folder; None if it was removed as a leftover."""
    try:
        descriptor = HOST.open_to_lock(folder)
    except FileNotFoundError:
        return None
    if hold(descriptor, folder):
        return descriptor
    os.close(descriptor)
    return None


def clear_leftovers(folders: Iterable[Path]) -> int:
    """Remove files and work folders of killed programs in these folders; return how many.

    Missing folders are left out. Never raises: a leftover that cannot be removed stays.
    """
    count = 0
    for folder in {folder.absolute() for folder in folders}:
        count += clear(path for path in _in(folder) if _BEING_WRITTEN.fullmatch(path.name))
    # Without space or rights there is no such folder.
    with contextlib.suppress(OSError):
        there = Path(tempfile.gettempdir())
        count += clear(path for path in _in(there) if path.name.startswith(_SCRATCH))
    if count:
        _log.info("Temporary files and folders of killed programs removed: %d.", count)
    return count


def clear_beside(path: Path) -> int:
    """Remove what killed programs were writing under the name of ``path``; return how many."""
    name = re.compile(rf"\.{re.escape(path.name)}{_MARK}")
    return clear(one for one in _in(path.parent) if name.fullmatch(one.name))


def clear(paths: Iterable[Path]) -> int:
    """Remove those files and folders of this user that nobody holds; return how many."""
    return sum(_remove(path) for path in paths)


def unheld(paths: Iterable[Path]) -> list[Path]:
    """Return the unlocked files of this user."""
    found = []
    for path in paths:
        with contextlib.suppress(OSError):
            descriptor = HOST.open_as_it_is(path)
            try:
                if HOST.is_own(os.fstat(descriptor)):
                    HOST.lock(descriptor)
                    found.append(path)
            finally:
                os.close(descriptor)
    return found


def _in(folder: Path) -> list[Path]:
    try:
        return [Path(entry.path) for entry in os.scandir(folder)]
    except OSError:
        return []


def _remove(path: Path) -> bool:
    try:
        descriptor = HOST.open_as_it_is(path)
    except OSError:
        return False
    is_open = True
    try:
        state = path.lstat()
        is_folder = stat.S_ISDIR(state.st_mode)
        if not HOST.is_own(state) or not (is_folder or stat.S_ISREG(state.st_mode)):
            return False
        HOST.lock(descriptor)
        if not HOST.is_at(descriptor, path):
            return False
        if HOST.closes_before_rename:
            os.close(descriptor)
            is_open = False
        if is_folder:
            shutil.rmtree(path)
        else:
            return HOST.remove_same(path, state.st_dev, state.st_ino)
    except OSError:
        # In use, or already gone.
        return False
    finally:
        if is_open:
            os.close(descriptor)
    return True
