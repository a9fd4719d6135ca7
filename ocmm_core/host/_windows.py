"""Windows implementation, from the documentation of Python and Win32: untested on Windows.

Weaker than on Linux: folder entries are not flushed to disk, all locks are exclusive, and a file
has no lock while it is being renamed.
"""

from __future__ import annotations

import contextlib
import errno
import os
import time
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, ClassVar

from ocmm_core.host._host import Host

# A Windows lock prevents others from reading the locked bytes, so lock a byte beyond the end of
# every file. The C library locks at the current file position, which is restored afterwards.
_BEYOND = 0x7FFF_0000
_FOLDER_LOCK = ".ocmm-lock"
_BETWEEN_S = 0.02


class WindowsHost(Host):
    """See `Host`."""

    is_linux_like: ClassVar[bool] = False
    closes_before_rename: ClassVar[bool] = True

    def lock(self, descriptor: int, *, shared: bool = False, wait: bool = False) -> None:
        del shared
        import msvcrt

        # Its names are there for type checkers on Windows only.
        native: Any = msvcrt
        while True:
            stood = os.lseek(descriptor, 0, os.SEEK_CUR)
            os.lseek(descriptor, _BEYOND, os.SEEK_SET)
            try:
                native.locking(descriptor, native.LK_NBLCK, 1)
            except OSError as error:
                # EACCES and EDEADLK mean that the lock is held.
                if error.errno not in (errno.EACCES, errno.EDEADLK):
                    raise
                if not wait:
                    raise BlockingIOError(errno.EAGAIN, "another program has it") from error
            else:
                return
            finally:
                os.lseek(descriptor, stood, os.SEEK_SET)
            time.sleep(_BETWEEN_S)

    def holder_of(self, path: Path) -> str:
        # Only the Restart Manager service of Windows can tell.
        del path
        return ""

    def open_to_lock(self, folder: Path) -> int:
        # Folders cannot be opened for locking: lock a file inside instead.
        return self.open_file(folder / _FOLDER_LOCK, os.O_RDWR | os.O_CREAT)

    def open_file(self, path: Path, flags: int, mode: int = 0o666) -> int:
        # Without it line feeds would become two characters, and sealed lines others.
        return os.open(path, flags | getattr(os, "O_BINARY", 0), mode)

    def open_as_it_is(self, path: Path) -> int:
        if path.is_symlink():
            raise OSError(errno.ELOOP, "it is a link", str(path))
        return self.open_to_lock(path) if path.is_dir() else self.open_file(path, os.O_RDWR)

    def is_at(self, descriptor: int, path: Path) -> bool:
        there = path / _FOLDER_LOCK if path.is_dir() else path
        try:
            return os.path.samestat(os.fstat(descriptor), there.lstat())
        except FileNotFoundError:
            return False

    def sharing_byte(self, descriptor: int, at: int) -> AbstractContextManager[None]:
        del descriptor, at
        return contextlib.nullcontext()

    def hold_name(self, path: Path) -> int:
        # A file that is open can be neither renamed nor removed.
        path.stat()
        return -1

    def place_of(self, descriptor: int) -> Path | None:
        del descriptor
        return None

    def is_mounted(self, descriptor: int) -> bool:
        del descriptor
        return True

    def is_write_protected(self, path: Path) -> bool:
        del path
        return False

    def content_of(self, path: Path, size: int) -> bytes | None:
        del path, size
        return None

    def reserve(self, descriptor: int, size: int) -> None:
        os.truncate(descriptor, size)

    def write_at(self, descriptor: int, content: bytes, offset: int) -> int:
        os.lseek(descriptor, offset, os.SEEK_SET)
        return os.write(descriptor, content)

    def read_at(self, descriptor: int, size: int, offset: int) -> bytes:
        os.lseek(descriptor, offset, os.SEEK_SET)
        return os.read(descriptor, size)

    def is_of_group(self, state: os.stat_result) -> bool:
        del state
        return True

    def sync_folder(self, folder: Path) -> None:
        del folder

    def rename_new(self, temporary: Path, path: Path) -> None:
        # Windows refuses to rename to a name that there is.
        temporary.rename(path)

    def remove_same(self, path: Path, device: int, inode: int) -> bool:
        with contextlib.suppress(FileNotFoundError):
            found = path.lstat()
            if (found.st_dev, found.st_ino) == (device, inode):
                path.unlink()
                return True
        return False

    def is_own(self, state: os.stat_result) -> bool:
        del state
        return True

    def is_open_to(self, state: os.stat_result, others: int) -> bool:
        # Rights are those of the folder: that of a user is his alone.
        del state, others
        return False

    def shared_memory(self) -> Path | None:
        return None

    def processors(self) -> int:
        return os.cpu_count() or 1

    def resident_bytes(self) -> int:
        return 0

    def processor_seconds(self, pid: int) -> float | None:
        del pid
        return None

    def limit_memory(self, most_bytes: int) -> None:
        del most_bytes

    def stand_back(self, steps: int) -> None:
        del steps

    def can_copy_process(self) -> bool:
        return False

    def copy_process(self) -> int:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))

    def end_copy(self, pid: int) -> None:
        del pid

    def reader_has_left(self, descriptor: int) -> bool:
        # A closed reader is only detected by writing to the pipe.
        del descriptor
        return False
