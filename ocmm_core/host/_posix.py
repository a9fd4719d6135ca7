"""Linux, and where it can be had, other systems of its kind."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import fcntl
import os
import pwd
import resource
import select
import signal
import stat
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

from ocmm_core.host._host import Host

_AT_FDCWD = -100
_RENAME_NOREPLACE = 1
_PR_SET_PDEATHSIG = 1
_SHARED_MEMORY = Path("/dev/shm")  # noqa: S108 - rings have names there that nobody guesses


def _process_words(pid: int) -> str:
    """Return what a process is called and whose it is; empty where it is gone."""
    place = Path("/proc") / str(pid)
    try:
        name = "".join(c for c in place.joinpath("comm").read_text("utf-8") if c.isprintable())
        user = place.stat().st_uid
    except (OSError, UnicodeDecodeError):
        return ""
    with contextlib.suppress(KeyError):
        return f"{name}, process {pid}, user {pwd.getpwuid(user).pw_name}"
    return f"{name}, process {pid}"


class PosixHost(Host):
    """See `Host`."""

    is_linux_like: ClassVar[bool] = True
    closes_before_rename: ClassVar[bool] = False

    def lock(self, descriptor: int, *, shared: bool = False, wait: bool = False) -> None:
        how = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        fcntl.flock(descriptor, how if wait else how | fcntl.LOCK_NB)

    def holder_of(self, path: Path) -> str:
        try:
            inode = path.stat().st_ino
            lines = Path("/proc/locks").read_text("ascii").splitlines()
        except (OSError, UnicodeDecodeError):
            return ""
        for line in lines:
            # "1: POSIX  ADVISORY  WRITE 4711 fd:01:131073 0 EOF"; the device has other numbers on
            # some file systems, the inode and whether that process is there must do.
            words = line.split()
            found = [word.rpartition(":")[2] for word in words if word.count(":") == 2]
            pid = words[4] if len(words) > 5 and words[4].isdigit() else ""
            if pid and found == [str(inode)] and int(pid) not in (0, os.getpid()):
                return _process_words(int(pid))
        return ""

    def open_to_lock(self, folder: Path) -> int:
        return os.open(folder, os.O_RDONLY | os.O_DIRECTORY)

    def open_file(self, path: Path, flags: int, mode: int = 0o666) -> int:
        return os.open(path, flags, mode)

    def open_as_it_is(self, path: Path) -> int:
        return os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)

    def is_at(self, descriptor: int, path: Path) -> bool:
        try:
            return os.path.samestat(os.fstat(descriptor), path.lstat())
        except FileNotFoundError:
            return False

    @contextlib.contextmanager
    def sharing_byte(self, descriptor: int, at: int) -> Iterator[None]:
        # struct flock of Linux: type, from the start, offset, length, no process.
        flock = struct.Struct("hhqqi4x")
        command = getattr(fcntl, "F_OFD_SETLK", None) if sys.platform == "linux" else None
        if command is not None:
            try:
                fcntl.fcntl(descriptor, command, flock.pack(fcntl.F_RDLCK, os.SEEK_SET, at, 1, 0))
            except BlockingIOError:
                raise
            except OSError:
                command = None
        try:
            yield
        finally:
            if command is not None:
                fcntl.fcntl(descriptor, command, flock.pack(fcntl.F_UNLCK, os.SEEK_SET, at, 1, 0))

    def hold_name(self, path: Path) -> int:
        # Closing an ordinary descriptor would release the locks of SQLite on the same file.
        only_path = getattr(os, "O_PATH", None)
        return -1 if only_path is None else os.open(path, only_path | os.O_CLOEXEC)

    def place_of(self, descriptor: int) -> Path | None:
        with contextlib.suppress(OSError):
            place = Path(f"/proc/self/fd/{descriptor}").readlink()
            if os.path.samestat(os.fstat(descriptor), place.stat()):
                return place
        return None

    def is_mounted(self, descriptor: int) -> bool:
        try:
            about = Path(f"/proc/self/fdinfo/{descriptor}").read_text("ascii")
            mounts = Path("/proc/self/mountinfo").read_text("utf-8", "surrogateescape")
        except OSError:
            return True
        found = [line.split()[1] for line in about.splitlines() if line.startswith("mnt_id:")]
        return not found or any(line.split()[0] == found[0] for line in mounts.splitlines())

    def is_write_protected(self, path: Path) -> bool:
        try:
            return bool(os.statvfs(path).f_flag & os.ST_RDONLY)
        except OSError:
            return False

    def content_of(self, path: Path, size: int) -> bytes | None:
        with contextlib.suppress(OSError):
            wanted = path.stat()
            for entry in Path("/proc/self/fd").iterdir():
                with contextlib.suppress(OSError):
                    if os.path.samestat(os.fstat(int(entry.name)), wanted):
                        # Refused for those that only hold the name.
                        return os.pread(int(entry.name), size + 1, 0)
        return None

    def reserve(self, descriptor: int, size: int) -> None:
        os.posix_fallocate(descriptor, 0, size)

    def write_at(self, descriptor: int, content: bytes, offset: int) -> int:
        return os.pwrite(descriptor, content, offset)

    def read_at(self, descriptor: int, size: int, offset: int) -> bytes:
        return os.pread(descriptor, size, offset)

    def is_of_group(self, state: os.stat_result) -> bool:
        return state.st_gid == os.getegid()

    def sync_folder(self, folder: Path) -> None:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def rename_new(self, temporary: Path, path: Path) -> None:
        import ctypes

        try:
            rename = ctypes.CDLL(None, use_errno=True).renameat2
        except (AttributeError, OSError, TypeError):
            rename = None
        if rename is not None:
            names = os.fsencode(temporary), os.fsencode(path)
            if rename(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_NOREPLACE) == 0:
                return
            code = ctypes.get_errno()
            if code not in (errno.EINVAL, errno.ENOSYS):
                raise OSError(code, os.strerror(code), str(path))
        if path.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
        temporary.rename(path)

    def remove_same(self, path: Path, device: int, inode: int) -> bool:
        with contextlib.suppress(FileNotFoundError):
            # By descriptor: the folder may be renamed between the check and the removal.
            folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
            try:
                found = os.stat(path.name, dir_fd=folder, follow_symlinks=False)
                if (found.st_dev, found.st_ino) == (device, inode):
                    os.unlink(path.name, dir_fd=folder)
                    return True
            finally:
                os.close(folder)
        return False

    def is_own(self, state: os.stat_result) -> bool:
        return state.st_uid == os.getuid()

    def is_open_to(self, state: os.stat_result, others: int) -> bool:
        return bool(stat.S_IMODE(state.st_mode) & others)

    def shared_memory(self) -> Path | None:
        return _SHARED_MEMORY if _SHARED_MEMORY.is_dir() else None

    def processors(self) -> int:
        can_say = hasattr(os, "sched_getaffinity")
        return len(os.sched_getaffinity(0)) if can_say else os.cpu_count() or 1

    def resident_bytes(self) -> int:
        try:
            pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
        except (OSError, ValueError, IndexError):
            return 0
        return pages * resource.getpagesize()

    def processor_seconds(self, pid: int) -> float | None:
        try:
            # What stands before the last bracket is the name of the program, whatever it holds.
            words = Path(f"/proc/{pid}/stat").read_text("utf-8", "replace").rpartition(")")[2]
            user, system = (int(word) for word in words.split()[11:13])
        except (OSError, ValueError):
            return None
        return (user + system) / float(os.sysconf("SC_CLK_TCK"))

    def limit_memory(self, most_bytes: int) -> None:
        with contextlib.suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_DATA, (most_bytes, most_bytes))

    def stand_back(self, steps: int) -> None:
        os.nice(steps)

    def can_copy_process(self) -> bool:
        # Elsewhere nobody ends the copy of a process that was killed.
        return sys.platform == "linux" and self.processors() > 1

    def copy_process(self) -> int:
        parent = os.getpid()
        pid = os.fork()
        if not pid:
            ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
            if os.getppid() != parent:
                # It ended before it could be watched.
                os._exit(1)
        return pid

    def end_copy(self, pid: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)

    def reader_has_left(self, descriptor: int) -> bool:
        looking = select.poll()
        looking.register(descriptor, 0)
        return any(event & select.POLLERR for _, event in looking.poll(0))
