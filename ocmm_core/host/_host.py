"""Operating-system services that the other packages depend on."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from contextlib import AbstractContextManager
from pathlib import Path
from typing import ClassVar


class Host(ABC):
    """A kind of operating system."""

    is_linux_like: ClassVar[bool]
    """Whether it has raw sockets, capabilities and real-time scheduling for the camera bus."""
    closes_before_rename: ClassVar[bool]
    """Whether an open file cannot be renamed or removed. A temporary file must then be closed
    before its rename, and for that moment it has no lock."""

    @abstractmethod
    def holder_of(self, path: Path) -> str:
        """Describe the other process that holds a lock on a file; empty if unknown."""

    @abstractmethod
    def lock(self, descriptor: int, *, shared: bool = False, wait: bool = False) -> None:
        """Lock a file until this descriptor is closed.

        ``shared`` locks are exclusive on Windows. Unless it may ``wait``: BlockingIOError if
        another process holds the lock. OSError if the file system does not support locks.
        """

    @abstractmethod
    def open_to_lock(self, folder: Path) -> int:
        """Return a descriptor to `lock` in place of a folder; OSError if it is missing."""

    @abstractmethod
    def open_file(self, path: Path, flags: int, mode: int = 0o666) -> int:
        """Return a descriptor as `os.open`, for bytes that stay as they are."""

    @abstractmethod
    def open_as_it_is(self, path: Path) -> int:
        """Return a descriptor of a file or folder, not waiting nor following links; OSError."""

    @abstractmethod
    def is_at(self, descriptor: int, path: Path) -> bool:
        """Return whether a path still refers to the file or folder of this descriptor."""

    @abstractmethod
    def sharing_byte(self, descriptor: int, at: int) -> AbstractContextManager[None]:
        """Return what keeps a shared lock on a byte, which libraries of this process respect.

        Nothing without locks of descriptors; BlockingIOError if another program has it alone.
        """

    @abstractmethod
    def hold_name(self, path: Path) -> int:
        """Return a descriptor that only identifies the file at a path; -1 if not supported.

        Closing it does not release the locks of other descriptors. OSError if the file is missing.
        """

    @abstractmethod
    def place_of(self, descriptor: int) -> Path | None:
        """Return the present path of an open file; None if it has none or the path is unknown."""

    @abstractmethod
    def is_mounted(self, descriptor: int) -> bool:
        """Return whether the file system of an open file is mounted; True if unknown."""

    @abstractmethod
    def is_write_protected(self, path: Path) -> bool:
        """Return whether the file system of a path is mounted read-only; False if unknown."""

    @abstractmethod
    def content_of(self, path: Path, size: int) -> bytes | None:
        """Read the first ``size + 1`` bytes of a file through a descriptor that is already open.

        None if it is not open: opening and closing a second descriptor releases SQLite's locks.
        """

    @abstractmethod
    def reserve(self, descriptor: int, size: int) -> None:
        """Give a file this size, with room for all of it; OSError if there is not enough room."""

    @abstractmethod
    def write_at(self, descriptor: int, content: bytes, offset: int) -> int:
        """Write bytes at an offset; return the number written."""

    @abstractmethod
    def read_at(self, descriptor: int, size: int, offset: int) -> bytes:
        """Read at most ``size`` bytes from an offset on; threads may share the descriptor."""

    @abstractmethod
    def is_of_group(self, state: os.stat_result) -> bool:
        """Return whether a file belongs to the primary group of this user."""

    @abstractmethod
    def sync_folder(self, folder: Path) -> None:
        """Flush the entries of a folder to disk; OSError if this may have failed.

        No operation on Windows, where the file system journals names.
        """

    @abstractmethod
    def rename_new(self, temporary: Path, path: Path) -> None:
        """Rename without replacing a file; FileExistsError if the target exists."""

    @abstractmethod
    def remove_same(self, path: Path, device: int, inode: int) -> bool:
        """Remove a name if it still means a file; return whether it did. OSError as `os.unlink`.

        A file that another program put there meanwhile stays.
        """

    @abstractmethod
    def is_own(self, state: os.stat_result) -> bool:
        """Return whether a file belongs to the user of this process; without owners it does."""

    @abstractmethod
    def is_open_to(self, state: os.stat_result, others: int) -> bool:
        """Return whether the mode of a file has one of these bits; without modes it has none."""

    @abstractmethod
    def shared_memory(self) -> Path | None:
        """Return the folder of a memory file system; None if the system has none."""

    @abstractmethod
    def processors(self) -> int:
        """Return the number of processors available to this process."""

    @abstractmethod
    def resident_bytes(self) -> int:
        """Return the resident memory of this process in bytes; 0 if unknown."""

    @abstractmethod
    def processor_seconds(self, pid: int) -> float | None:
        """Return the processor time of another process in seconds; None if unknown."""

    @abstractmethod
    def limit_memory(self, most_bytes: int) -> None:
        """Limit the memory of this process, in bytes; ignored if not supported."""

    @abstractmethod
    def stand_back(self, steps: int) -> None:
        """Give way to other processes, by steps of `os.nice`."""

    @abstractmethod
    def can_copy_process(self) -> bool:
        """Return whether this process can go on as two, with all that it holds."""

    @abstractmethod
    def copy_process(self) -> int:
        """Fork this process: return 0 in the child and the child's process number in the parent.

        The system kills the child when the parent ends. OSError if forking failed.
        """

    @abstractmethod
    def end_copy(self, pid: int) -> None:
        """Kill a forked copy of this process."""

    @abstractmethod
    def reader_has_left(self, descriptor: int) -> bool:
        """Return whether the read end of a pipe is closed."""
