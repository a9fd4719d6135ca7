"""The computer under check: files and tools below a root folder, and system calls.

All input comes from drivers, tools and administrators. Whatever is unreadable, empty, endless or
not text raises `NotAskedError`, shown as NOT CHECKED, never guessed.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import stat
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import platformdirs

from ocmm_core.acquisition.bus_process import granted_by
from ocmm_core.errors import InputError, OcmmError

_TIME_ERROR = 5
_TIMEX_BYTES = 512
"""struct timex has 208 bytes; the rest is reserve."""


def _clock_is_synchronised() -> bool | None:
    """Return whether the kernel clock is synchronised (adjtimex(2)); None if unknown.

    Needs neither ``timedatectl`` nor ``chronyc``, which report the same.
    """
    if sys.platform != "linux":
        return None
    state = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES))
    return None if state < 0 else bool(state != _TIME_ERROR)


@dataclass(frozen=True, slots=True)
class HostCalls:
    now: Callable[[], datetime] = lambda: datetime.now(UTC)
    # Resolved when called: not every system has it, and this module is imported on all.
    statvfs: Callable[[Path], os.statvfs_result] = lambda path: os.statvfs(path)
    fsync: Callable[[int], None] = os.fsync
    owner: Callable[[Path], int] = lambda path: path.stat().st_uid
    """User id of a file's owner."""
    granted: Callable[[Path], frozenset[int]] = granted_by
    """Capabilities by number that a program file grants."""
    synchronised: Callable[[], bool | None] = _clock_is_synchronised


_MOST_BYTES = 1 << 16
_MOST_OUTPUT = 1 << 20
_TOOL_S = 10.0
_TOOL_FOLDERS = ("/usr/sbin", "/sbin", "/usr/bin", "/bin")
_RANGES = re.compile(r"\d{1,4}(?:-\d{1,4})?(?:,\d{1,4}(?:-\d{1,4})?)*")


class NotAskedError(OcmmError):
    """A property of this computer could not be determined."""

    def __init__(self, what: str, remedy: str = "") -> None:
        super().__init__("doctor.not_asked", what, remedy)

    def __reduce__(self) -> tuple[type[OcmmError], tuple[str, ...]]:  # type: ignore[override]
        return (NotAskedError, (self.what, self.remedy))


@dataclass(frozen=True, slots=True)
class Computer:
    """A computer below a root folder; see `this_computer`."""

    root: Path
    """``/``, or a substitute folder."""
    user: str
    uid: int
    """`user`, `uid`: user of the station; with sudo, the caller."""
    by_sudo: bool
    """Rights and limits of this process are not those of ``user``."""
    home: Path
    data: Path
    state: Path
    jobs: Path
    """`home`, `data`, `state`, `jobs`: folders of that user and of jobs, on the computer."""
    program: Path
    """Running interpreter or program, as a path of the computer."""
    interface: str = ""
    """Camera network adapter; empty if not given."""
    environment: Mapping[str, str] = field(default_factory=dict)
    calls: HostCalls = field(default_factory=HostCalls)

    def place(self, path: Path | str) -> Path:
        """Return the real location of a path of the computer."""
        return self.root / str(path).lstrip("/")

    def has(self, path: Path | str) -> bool:
        """Return whether a path exists, or may exist but is not accessible."""
        with contextlib.suppress(OSError, ValueError):
            return self.place(path).exists()
        return True

    def text(self, path: Path | str) -> str:
        """Return the stripped text of a small file; NotAskedError if unreadable."""
        try:
            # Do not wait for the writer of a pipe.
            descriptor = os.open(self.place(path), os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except FileNotFoundError as error:
            raise NotAskedError(f"This computer has no {path}.") from error
        except (OSError, ValueError) as error:
            raise NotAskedError(f"{path} cannot be read ({_reason(error)}).") from error
        try:
            if not stat.S_ISREG(os.fstat(descriptor).st_mode):
                raise NotAskedError(f"{path} is no file.")
            content = _read(descriptor, _MOST_BYTES + 1)
        except OSError as error:
            raise NotAskedError(f"{path} cannot be read ({_reason(error)}).") from error
        finally:
            os.close(descriptor)
        return _text(content, str(path))

    def number(self, path: Path | str) -> int:
        """Return the integer in a file; raise NotAskedError if there is no such number."""
        text = self.text(path)
        if not re.fullmatch(r"-?\d{1,18}", text):
            raise NotAskedError(f"{path} holds no whole number.")
        return int(text)

    def cpus(self, path: Path | str) -> tuple[int, ...]:
        """Return the processors of a list as ``0-2,5``; raise NotAskedError if invalid."""
        text = self.text(path)
        # No processor: the kernel writes an empty line, or this word.
        if text in ("", "(null)"):
            return ()
        if not _RANGES.fullmatch(text):
            raise NotAskedError(f"{path} holds no list of processors.")
        found: list[int] = []
        for part in text.split(","):
            first, _, last = part.partition("-")
            # Ascending, as the kernel writes it; bounds the time spent on invalid input.
            if int(last or first) < int(first) or (found and int(first) <= found[-1]):
                raise NotAskedError(f"{path} holds no list of processors.")
            found += range(int(first), int(last or first) + 1)
        return tuple(found)

    def names(self, folder: Path | str) -> tuple[str, ...]:
        """Return the sorted names in a folder; raise NotAskedError if absent."""
        try:
            found = sorted(os.listdir(self.place(folder)))  # noqa: PTH208 - names, not paths
        except (OSError, ValueError) as error:
            raise NotAskedError(f"{folder} cannot be listed ({_reason(error)}).") from error
        return tuple(found)

    def link(self, path: Path | str) -> str:
        """Return the target of a link, or an empty text."""
        with contextlib.suppress(OSError, ValueError):
            return str(self.place(path).readlink())
        return ""

    def tool(self, name: str) -> Path | None:
        """Return the path of a system tool; None if not installed."""
        for folder in _TOOL_FOLDERS:
            found = self.place(folder) / name
            if os.access(found, os.X_OK):
                return found
        return None

    def run(self, name: str, *arguments: str, package: str) -> str:
        """Return a tool's output; NotAskedError naming `package` if missing or failing."""
        program = self.tool(name)
        if program is None:
            raise NotAskedError(f"'{name}' is not installed.", f"Install it: apt install {package}")
        try:
            process = subprocess.Popen(  # noqa: S603 - fixed tools, checked names, no shell
                [program, *arguments],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                env={"PATH": ":".join(_TOOL_FOLDERS), "LC_ALL": "C"},
            )  # fmt: skip
        except OSError as error:
            raise NotAskedError(f"'{name}' cannot be started ({_reason(error)}).") from error
        late = threading.Timer(_TOOL_S, process.kill)
        late.start()
        with process:
            assert process.stdout is not None  # noqa: S101 - a pipe was asked for
            content = process.stdout.read(_MOST_OUTPUT)
            if len(content) == _MOST_OUTPUT:
                process.kill()
        late.cancel()
        late.join()
        said = content.decode("utf-8", errors="replace").strip()
        if process.returncode != 0:
            lines = said.splitlines()
            last = lines[-1][:200] if lines else f"exit {process.returncode}"
            legible = "".join(sign if sign.isprintable() else "?" for sign in last)
            raise NotAskedError(f"'{name}' answers: {legible}.")
        return said


def this_computer(*, interface: str = "", jobs: Path | None = None) -> Computer:
    """Return this computer and its user; raise InputError unless on Linux.

    ``interface`` defaults to that of ``/etc/ocmm/bus.env``, ``jobs`` to the current folder.
    """
    if sys.platform != "linux":
        raise InputError(
            "doctor.platform",
            "Only computers with Linux can be checked.",
            "Check the computer that the cameras are connected to.",
        )
    sudo = os.environ.get("SUDO_USER", "") if os.geteuid() == 0 else ""
    user, uid, home = _user(sudo)
    by_sudo = bool(sudo) and uid != 0
    ours = (platformdirs.user_data_path("ocmm"), platformdirs.user_state_path("ocmm"))
    theirs = (home / ".local/share/ocmm", home / ".local/state/ocmm")
    data, state = theirs if by_sudo else ours
    return Computer(
        root=Path("/"), user=user, uid=uid, by_sudo=by_sudo, home=home, data=data, state=state,
        jobs=Path.cwd() if jobs is None else jobs.absolute(), program=Path(sys.executable),
        interface=interface, environment=dict(os.environ),
    )  # fmt: skip


def _user(sudo: str) -> tuple[str, int, Path]:
    import pwd

    try:
        entry = pwd.getpwnam(sudo) if sudo else pwd.getpwuid(os.geteuid())
    except KeyError:
        return os.environ.get("USER", ""), os.geteuid(), Path.home()
    return entry.pw_name, entry.pw_uid, Path(entry.pw_dir)


def _read(descriptor: int, most: int) -> bytes:
    parts = []
    while most > 0 and (part := os.read(descriptor, most)):
        parts.append(part)
        most -= len(part)
    return b"".join(parts)


def _text(content: bytes, path: str) -> str:
    if not content:
        raise NotAskedError(f"{path} is empty.")
    if len(content) > _MOST_BYTES:
        raise NotAskedError(f"{path} is longer than {_MOST_BYTES:,} bytes.")
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise NotAskedError(f"{path} holds no text.") from error
    if any(not (sign.isprintable() or sign in "\n\t") for sign in text):
        raise NotAskedError(f"{path} holds no text.")
    return text.strip()


def _reason(error: Exception) -> str:
    return (isinstance(error, OSError) and error.strerror) or type(error).__name__
