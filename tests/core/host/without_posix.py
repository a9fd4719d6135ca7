"""Python as on Windows, as far as this computer can simulate it.

For the sources of OCMM alone, parts specific to Linux and similar systems are missing: modules,
functions, constants. Open files can be neither renamed nor removed. `msvcrt` locks as on Windows.
Everything else, above all the libraries, is that of this computer. Loaded by every process of a
test as ``sitecustomize``.
"""

from __future__ import annotations

import builtins
import errno
import os
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from types import ModuleType
from typing import Any

MODULES = ("fcntl", "grp", "posix", "pysoem", "pty", "pwd", "resource", "syslog", "termios", "tty")
NAMES = {
    "os": (
        "O_DIRECTORY O_NOFOLLOW O_NONBLOCK O_CLOEXEC O_SYNC O_DSYNC O_NOCTTY WNOHANG chown fchmod "
        "fchown fork forkpty geteuid getgid getegid getpgid getuid killpg lchown mkfifo nice "
        "openpty posix_fadvise posix_fallocate posix_spawn pread preadv pwrite pwritev "
        "register_at_fork sched_getaffinity sched_setaffinity sched_setscheduler sched_yield "
        "sendfile setegid seteuid setgid setsid setuid statvfs sync sysconf uname wait wait4 waitid"
    ),
    "socket": "AF_UNIX AF_PACKET SO_PEERCRED SCM_RIGHTS sethostname if_nameindex",
    "signal": (
        "SIGALRM SIGCHLD SIGCONT SIGHUP SIGKILL SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 "
        "alarm pause pidfd_send_signal pthread_kill pthread_sigmask setitimer sigwait sigwaitinfo"
    ),
    "select": "poll epoll",
    "time": "CLOCK_MONOTONIC CLOCK_REALTIME CLOCK_TAI clock_gettime clock_gettime_ns tzset",
}  # fmt: skip


class _Half(ModuleType):
    """A module without some of its names."""

    def __init__(self, whole: ModuleType, hidden: frozenset[str]) -> None:
        super().__init__(whole.__name__)
        self.__dict__["_whole"], self.__dict__["_hidden"] = whole, hidden

    def __getattr__(self, name: str) -> Any:
        if name in self.__dict__["_hidden"]:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        return getattr(self.__dict__["_whole"], name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self.__dict__["_whole"], name, value)


def _hide() -> None:
    halves: dict[str, _Half] = {}
    real = builtins.__import__

    def hiding(
        name: str,
        globals: Mapping[str, object] | None = None,  # noqa: A002 - the name of the language
        locals: Mapping[str, object] | None = None,  # noqa: A002 - as above
        fromlist: Sequence[str] | None = (),
        level: int = 0,
    ) -> ModuleType:
        asking = str((globals or {}).get("__name__", ""))
        if not asking.startswith("ocmm_"):
            return real(name, globals, locals, fromlist or (), level)
        if name == "msvcrt":
            return _MSVCRT
        if name in MODULES:
            raise ImportError(f"No module named {name!r}", name=name)
        whole = real(name, globals, locals, fromlist or (), level)
        if name not in NAMES:
            return whole
        return halves.setdefault(name, _Half(whole, frozenset(NAMES[name].split())))

    builtins.__import__ = hiding


def _refuse(name: str, which: Sequence[int]) -> None:
    real: Callable[..., Any] = getattr(os, name)

    @wraps(real)
    def refusing(*paths: Any, **options: Any) -> Any:
        # With a folder's descriptor, a name refers to another place.
        if all(value is None for value in options.values()):
            for at in which:
                _refuse_open(paths[at])
        return real(*paths, **options)

    setattr(os, name, refusing)


def _refuse_open(path: Any) -> None:
    try:
        there = os.lstat(path)
    except OSError:
        return
    for descriptor in Path("/proc/self/fd").iterdir():
        try:
            held = descriptor.stat()
        except OSError:
            continue
        if os.path.samestat(held, there):
            raise PermissionError(errno.EACCES, "The process cannot access the file", str(path))
    whole = str(Path(path).absolute())
    if any(line.endswith(whole) for line in Path("/proc/self/maps").read_text().splitlines()):
        raise PermissionError(errno.EACCES, "The file is mapped", str(path))


class _Msvcrt(ModuleType):
    """Its locks: of a byte range by descriptor, as far as those of this system go."""

    LK_NBLCK, LK_UNLCK = 2, 0

    @staticmethod
    def locking(descriptor: int, mode: int, nbytes: int) -> None:
        import fcntl

        assert nbytes == 1
        how = fcntl.LOCK_EX | fcntl.LOCK_NB if mode == _Msvcrt.LK_NBLCK else fcntl.LOCK_UN
        try:
            fcntl.flock(descriptor, how)
        except BlockingIOError as error:
            raise OSError(errno.EACCES, "Permission denied") from error


_MSVCRT = _Msvcrt("msvcrt")


def _install() -> None:
    _hide()
    for name, which in {
        "replace": (0, 1), "rename": (0, 1), "unlink": (0,), "remove": (0,),
    }.items():  # fmt: skip
        _refuse(name, which)


if __name__ == "sitecustomize":
    _install()
