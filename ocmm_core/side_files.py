"""Guard for files next to trusted files, and for the working folder: all of them are input.

They can be pipes, devices, links or endless files. The guard opens without waiting, checks the
descriptor and limits the size. The hostile lane of `ocmm selftest reliability` uses `SIDE_FILES`.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from types import MappingProxyType

from ocmm_core.errors import InputError
from ocmm_core.host import HOST

_MB = 1 << 20
_HOLES = 64 * _MB
"""Bytes from which on a file must be on the disk for the most part; none of ours has holes."""
_WITHOUT_WAITING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)


class Trusted(Enum):
    """Kinds of files that this program trusts after a check of their content."""

    JOB = auto()
    DATABASE = auto()
    """Archives and outboxes."""
    CHAIN = auto()
    """Histories."""
    RECORDING = auto()
    SETTINGS = auto()
    KEYS = auto()
    MEMORY = auto()
    """How far this computer has seen each history."""


@dataclass(frozen=True, slots=True)
class SideFile:
    """A name next to a trusted file."""

    name: str
    """``{}`` is the name of the trusted file."""
    most: int = 0
    """Bytes at most; 0: this program never makes such a file, and it is refused."""


SIDE_FILES: Mapping[Trusted, tuple[SideFile, ...]] = MappingProxyType(
    {
        Trusted.JOB: (
            SideFile("{}", 1024 * _MB),
            SideFile("{}-journal"),
            SideFile("{}-wal", 512 * _MB),
            SideFile("{}-shm", 16 * _MB),
            SideFile(".{}.ocmm-0a1b2c.tmp", 1024 * _MB),
        ),
        Trusted.DATABASE: (
            SideFile("{}", 1 << 40),
            SideFile("{}-journal"),
            SideFile("{}-wal", 1 << 36),
            SideFile("{}-shm", 512 * _MB),
        ),
        Trusted.CHAIN: (
            SideFile("{}", 64 * _MB),
            SideFile("events.seal.json", 64 * _MB),
            SideFile(".{}.ocmm-0a1b2c.tmp", 64 * _MB),
        ),
        Trusted.RECORDING: (SideFile("{}", 1 << 40),),
        Trusted.SETTINGS: (SideFile("{}", _MB),),
        Trusted.KEYS: (
            SideFile("{}", _MB),
            SideFile("station.key", 4096),
            SideFile(".changing", 4096),
        ),
        Trusted.MEMORY: (SideFile("{}", 64 << 10),),
    }
)
"""The first of each kind is the trusted file itself."""


LARGEST_JOB = SIDE_FILES[Trusted.JOB][0].most
"""Bytes of the largest job file."""


class OversizeError(OSError):
    """A file is larger than any of its kind; ``size`` says how large."""

    def __init__(self, size: int, most: int) -> None:
        super().__init__(errno.EFBIG, f"it has {size:,} bytes, and at most {most:,} are read")
        self.size = size


def open_guarded(
    path: Path,
    *,
    follow: bool = True,
    most: int | None = None,
    flags: int = os.O_RDONLY,
    mode: int = 0o600,
) -> int:
    """Return the descriptor of a regular file, without waiting.

    ``follow``: accept a link, never for a side file; ``most`` bytes; ``flags``, ``mode``: of
    `os.open`; no file is made through a link. OSError with a ``strerror`` if it is missing or
    refused.
    """
    follow = follow and not flags & os.O_CREAT
    try:
        looked = path.stat() if follow else path.lstat()
    except FileNotFoundError:
        if not flags & os.O_CREAT:
            raise
    else:
        if stat.S_ISLNK(looked.st_mode):
            raise OSError(errno.ELOOP, "it is a link", str(path))
        # Opening a device may have effects. The opened descriptor is checked again.
        _require_regular(looked)
    opened = flags | _WITHOUT_WAITING | (0 if follow else _NO_LINK)
    descriptor = HOST.open_file(path, opened, mode)
    try:
        state = os.fstat(descriptor)
        _require_regular(state)
        if most is not None and state.st_size > most:
            raise OversizeError(state.st_size, most)
        if state.st_size > _HOLES and getattr(state, "st_blocks", _HOLES) * 512 < state.st_size / 8:
            raise OSError(errno.EFBIG, "most of it are holes")
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def read_guarded(path: Path, most: int, *, follow: bool = True) -> bytes:
    """Return the content of a regular file as of `open_guarded`; OSError as there."""
    descriptor = open_guarded(path, follow=follow, most=most)
    with open(descriptor, "rb") as stream:  # noqa: PTH123 - looked at and read by one descriptor
        content = stream.read(most + 1)
    if len(content) > most:
        raise OversizeError(len(content), most)
    return content


def distrust_working_folder() -> None:
    """Keep modules of the working folder out of the processes of a program; call it first.

    InputError: the folder has a file of options by which numba would compute and store code.
    """
    # Python would search modules there first, e.g. in a folder of jobs that others can write.
    os.environ["PYTHONSAFEPATH"] = "1"
    path = Path(".numba_config.yaml")
    if os.path.lexists(path):
        raise InputError(
            "start.options",
            f"{path.absolute()}: a file of this name changes how numbers are computed.",
            "Remove it, or start the program in another folder.",
        )


def has_content(path: Path, content: bytes) -> bool:
    """Return whether a regular file has exactly this content; False if it cannot be read."""
    try:
        return read_guarded(path, len(content)) == content
    except OSError:
        return False


def refuse_side_files(path: Path, kind: Trusted) -> None:
    """Check the names next to a trusted file before a library opens them.

    OSError, with ``filename``, if one is not a regular file, is a second name of another file,
    belongs to a third user, is too large, or is never made by this program.
    """
    owner = path.stat().st_uid
    for side in SIDE_FILES[kind][1:]:
        if not side.name.startswith("{}-"):
            continue
        there = path.with_name(side.name.format(path.name))
        try:
            state = there.lstat()
        except FileNotFoundError:
            continue
        why = _fault(side, state, owner)
        if why:
            raise OSError(errno.EPERM, why, str(there))


def _fault(side: SideFile, state: os.stat_result, owner: int) -> str:
    if not side.most:
        return "this program never makes such a file"
    if stat.S_ISLNK(state.st_mode):
        return "it is a link"
    if not stat.S_ISREG(state.st_mode):
        return "it is a folder, a pipe or a device"
    if state.st_nlink > 1:
        return "it is a second name of another file"
    if not HOST.is_own(state) and state.st_uid not in (0, owner):
        return "it belongs to another user"
    return "it is larger than any of its kind" if state.st_size > side.most else ""


def _require_regular(state: os.stat_result) -> None:
    if stat.S_ISDIR(state.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(state.st_mode):
        raise OSError(errno.EINVAL, "it is a pipe or a device")
