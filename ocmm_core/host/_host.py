"""What a system must do for the other rooms."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from contextlib import AbstractContextManager
from pathlib import Path
from typing import ClassVar


class Host(ABC):
    """A kind of operating system."""

    is_linux_like: ClassVar[bool]
    """It has what the camera bus needs: raw frames, process rights, real-time priority."""
    closes_before_rename: ClassVar[bool]
    """A file that is open cannot be renamed or removed; so what is written is, for a moment before
    it has its name, held by nobody."""

    @abstractmethod
    def holder_of(self, path: Path) -> str:
        """Return which other process has locked a file, in words; empty where nobody can say."""

    @abstractmethod
    def lock(self, descriptor: int, *, shared: bool = False, wait: bool = False) -> None:
        """Lock a file against other descriptors until this one is closed.

        ``shared``: others may share it; Windows locks for one alone instead. ``wait`` until it is
        free; else BlockingIOError if another one has it. OSError if the file system knows no locks.
        """

    @abstractmethod
    def open_to_lock(self, folder: Path) -> int:
        """Return a descriptor that stands for a folder in `lock`; OSError where there is none."""

    @abstractmethod
    def open_file(self, path: Path, flags: int, mode: int = 0o666) -> int:
        """Return a descriptor as `os.open`, for bytes that stay as they are."""

    @abstractmethod
    def open_as_it_is(self, path: Path) -> int:
        """Return a descriptor of a file or folder, not waiting nor following links; OSError."""

    @abstractmethod
    def is_at(self, descriptor: int, path: Path) -> bool:
        """Return whether a path still means what was opened by `open_as_it_is` or made there."""

    @abstractmethod
    def sharing_byte(self, descriptor: int, at: int) -> AbstractContextManager[None]:
        """Return what keeps a shared lock on a byte, which libraries of this process respect.

        Nothing without locks of descriptors; BlockingIOError if another program has it alone.
        """

    @abstractmethod
    def hold_name(self, path: Path) -> int:
        """Return a descriptor that only identifies the file at a path; -1 if the system has none.

        Closing it releases no locks of other descriptors. OSError if there is no file.
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
        """Return the first ``size + 1`` bytes of a file by a descriptor that is open already.

        None if there is none: opening and closing another one would release the locks of SQLite.
        """

    @abstractmethod
    def reserve(self, descriptor: int, size: int) -> None:
        """Give a file this size, with room for all of it; OSError if there is not enough room."""

    @abstractmethod
    def write_at(self, descriptor: int, content: bytes, offset: int) -> int:
        """Write bytes from an offset on; return how many were written."""

    @abstractmethod
    def read_at(self, descriptor: int, size: int, offset: int) -> bytes:
        """Read at most ``size`` bytes from an offset on; threads may share the descriptor."""

    @abstractmethod
    def is_of_group(self, state: os.stat_result) -> bool:
        """Return whether a file belongs to the primary group of this user."""

    @abstractmethod
    def sync_folder(self, folder: Path) -> None:
        """Return when the names in a folder are on the disk; OSError where they may not be.

        Windows keeps names in a journal and has no such call: there it does nothing.
        """

    @abstractmethod
    def rename_new(self, temporary: Path, path: Path) -> None:
        """Rename without replacing a file; FileExistsError where there is one."""

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
        """Return the folder for files that are in memory only; None where there is none."""

    @abstractmethod
    def processors(self) -> int:
        """Return how many processors this process may use."""

    @abstractmethod
    def resident_bytes(self) -> int:
        """Return how much memory this process holds; 0 where nobody can say."""

    @abstractmethod
    def processor_seconds(self, pid: int) -> float | None:
        """Return how much time of processors another process took; None where nobody can say."""

    @abstractmethod
    def limit_memory(self, most_bytes: int) -> None:
        """Let this process hold no more than this; nothing where that cannot be had."""

    @abstractmethod
    def stand_back(self, steps: int) -> None:
        """Give way to other processes, by steps of `os.nice`."""

    @abstractmethod
    def can_copy_process(self) -> bool:
        """Return whether this process can go on as two, with all that it holds."""

    @abstractmethod
    def copy_process(self) -> int:
        """Go on as two processes: return 0 in the copy, its number in the other.

        The system ends the copy when the other ends. OSError if there is no copy.
        """

    @abstractmethod
    def end_copy(self, pid: int) -> None:
        """End a copy of this process, whatever it does."""

    @abstractmethod
    def reader_has_left(self, descriptor: int) -> bool:
        """Return whether nobody can read what is written to a pipe any more."""
